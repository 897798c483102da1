"""Writes the published problems as model files: `python benchmarks/write_models.py DIRECTORY [NAME…]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from published import PROBLEMS

from scbm.files import write_model


def main() -> None:
    """Writes each problem, or those that are named, to `NAME.yaml`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", type=Path)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(PROBLEMS)}")
    options = parser.parse_args()
    if unknown := [name for name in options.names if name not in PROBLEMS]:
        parser.error(f"no such problem: {', '.join(unknown)}")
    options.directory.mkdir(parents=True, exist_ok=True)
    for name in options.names or PROBLEMS:
        file = options.directory / f"{name}.yaml"
        file.write_text(write_model(PROBLEMS[name]()), encoding="utf-8")
        print(file)


if __name__ == "__main__":
    main()
