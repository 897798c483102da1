"""CPU time of whole processes of the command line, as a multiple of that of `python -c pass`.

The modules are compiled before, also where Python writes no bytecode: a user starts a command more than once.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parent.parent
BEFORE = "examples/robot_in_the_air/before.yaml"
ROUNDS = 7
COMMANDS = (
    ("python -c pass", ("-c", "pass")),
    ("scbm --version", ("-m", "scbm", "--version")),
    ("scbm --help", ("-m", "scbm", "--help")),
    ("scbm check before.yaml", ("-m", "scbm", "check", BEFORE)),
    ("scbm plan before.yaml", ("-m", "scbm", "plan", BEFORE, "--goal", "item_a_delivered")),
    ("scbm test before.yaml --cases 20", ("-m", "scbm", "test", BEFORE, "--cases", "20")),
)


def seconds(arguments: tuple[str, ...], environment: dict[str, str]) -> float:
    """Return the least CPU time, user and system, of some runs after a first one: other work adds to it."""
    times = []
    for _ in range(1 + ROUNDS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *arguments], cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(times[1:])


def main() -> None:
    """Prints a line for each command."""
    with TemporaryDirectory() as compiled:
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": compiled, "PYTHONDONTWRITEBYTECODE": ""}
        nothing = seconds(COMMANDS[0][1], environment)
        for name, arguments in COMMANDS:
            took = seconds(arguments, environment)
            print(f"{name:<34} {took:.3f} s ({took / nothing:.0f}x)")


if __name__ == "__main__":
    main()
