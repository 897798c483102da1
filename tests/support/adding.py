"""A process that adds a run of the scanning cell to a store: `adding.py STORE NUMBER SEED COUNT`.

It says of each case that it was added, as soon as it was.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from scbm.store import write_store
from support.stores import a_run, cell, results


def add(store: Path, number: int, seed: int, count: int) -> None:
    """Adds the run, and says so case by case."""
    model = cell()
    pairs = results(seed, count)
    with write_store(store, model, a_run(number, model)) as writer:
        for position, (recipe, result) in enumerate(pairs, start=1):
            writer.add(position, recipe, result)
            sys.stdout.write(f"{position}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    add(Path(sys.argv[1]), *map(int, sys.argv[2:5]))
