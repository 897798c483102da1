"""Measure how long models take to load: lifted ones of 846 and 3,102 operations, and the same written out.

`--source FOLDER` measures another version too, in turns with this one, and prints the ratio of the least CPU times.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src"
FACTORY = Path(__file__).parent / "published" / "factory.yaml"
OBJECTS = "[robot1, robot2, robot3]"
_ROBOTS = 11
"""Robots of the factory that has 3,102 operations."""

_TIMED = """
import sys
from time import process_time
sys.path.insert(0, sys.argv[1])
from scbm.files import read_model, read_file
from pathlib import Path
text = read_file(Path(sys.argv[2]))
read_model("behavior_model: a\\ntypes: {t: [b]}\\nvariables: {'c[t]': {domain: bool, initial: true}}\\n"
           "operations: {}\\ngoals: {d: c.b == true}\\n")
begin = process_time()
model = read_model(text)
print(process_time() - begin, len(model.operations))
"""
"""Loads one model in a process of its own, once the modules are imported and the tables of the parser are read."""


def written_models(folder: Path) -> dict[str, Path]:
    """Write the models, and return their files by what they are called in the output."""
    from scbm.files import read_model, write_model  # noqa: PLC0415 - from the source that is measured

    lifted = FACTORY.read_text("utf-8")
    larger = lifted.replace(OBJECTS, f"[{', '.join(f'robot{each}' for each in range(1, _ROBOTS + 1))}]")
    texts = {"lifted": lifted, "larger": larger}
    texts |= {f"{name}-ground": write_model(read_model(text)) for name, text in texts.items()}
    files = {name: folder / f"{name}.yaml" for name in texts}
    for name, text in texts.items():
        files[name].write_text(text, "utf-8")
    return files


def timed(source: Path, model: Path) -> tuple[float, int]:
    """Return the CPU time in seconds of one load, and the number of operations."""
    command = [sys.executable, "-c", _TIMED, str(source), str(model)]
    seconds, count = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    return float(seconds), int(count)


def main() -> None:
    """Print a line for each model."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", type=Path, help="the folder with the package of another version")
    parser.add_argument("--rounds", type=int, default=7, help="loads of each model by each version")
    options = parser.parse_args()
    sources = [SOURCE, *([options.source] if options.source is not None else [])]
    sys.path.insert(0, str(SOURCE))
    with tempfile.TemporaryDirectory() as folder:
        for name, file in written_models(Path(folder)).items():
            rounds = [[timed(source, file) for source in sources] for _ in range(options.rounds)]
            least = [min(each[index][0] for each in rounds) for index in range(len(sources))]
            shown = ", ".join(f"{seconds:.3f} s" for seconds in least)
            ratio = f", ratio {least[0] / least[1]:.2f}" if len(least) > 1 else ""
            print(f"{name}: {rounds[0][0][1]:,} operations, {shown}{ratio}")


if __name__ == "__main__":
    main()
