"""Whole processes of the command line, beside a Python that does nothing."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
BEFORE = "examples/robot_in_the_air/before.yaml"
ROUNDS = 7
COMMANDS = (
    ("python -c pass", ("-c", "pass")),
    ("scbm --version", ("-m", "scbm", "--version")),
    ("scbm check before.yaml", ("-m", "scbm", "check", BEFORE)),
    ("scbm plan before.yaml", ("-m", "scbm", "plan", BEFORE, "--goal", "item_a_delivered")),
    ("scbm test before.yaml --cases 20", ("-m", "scbm", "test", BEFORE, "--cases", "20")),
)


def seconds(arguments: tuple[str, ...]) -> float:
    """The median of some runs."""
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        subprocess.run([sys.executable, *arguments], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - begin)
    return sorted(times)[ROUNDS // 2]


def main() -> None:
    """Prints a line for each command."""
    nothing = seconds(COMMANDS[0][1])
    for name, arguments in COMMANDS:
        took = seconds(arguments)
        print(f"{name:<34} {took:.3f} s ({took / nothing:.0f}x)")


if __name__ == "__main__":
    main()
