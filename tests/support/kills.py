"""Kills writers of stores, by SIGKILL at moments that are drawn, and looks at what they leave.

`kills.py DIRECTORY COUNT` prints how many writers were killed, how many cases they had added by then, and the sum of
how many each was to have added before it was killed. It is a process of its own, as it forks.
"""

from __future__ import annotations

import os
import random
import signal
import sqlite3
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from scbm.model import InputError, Slug
from scbm.store import digest_of, key_of, read_history, write_store
from support.adding import add
from support.stores import a_run, cell, results

SEED, COUNT = 1, 60


def killed_writer(store: Path, after: int, moment_s: float) -> tuple[int, bool]:
    """How many added cases a writer reported, and whether it was killed before it was done.

    Args:
        store: what it writes to.
        after: it is killed only after it has added so many.
        moment_s: and then so much later.
    """
    read, write = os.pipe()
    child = os.fork()
    if not child:
        os.close(read)
        os.dup2(write, 1)
        sys.stdout = os.fdopen(1, "w")
        add(store, 1, SEED, COUNT)
        signal.pause()  # one that is done waits to be killed as well
    os.close(write)
    with os.fdopen(read) as reports:
        added = sum(1 for _ in zip(range(after), reports, strict=False))
        time.sleep(moment_s)  # what is drawn is the moment of death, and none of them may matter
        os.kill(child, signal.SIGKILL)
        added += sum(line.endswith("\n") for line in reports)
    _, status = os.waitpid(child, 0)
    return added, os.WIFSIGNALED(status)


def look(store: Path, added: int) -> None:
    """Raise `AssertionError` if an added case is missing, or if two or more are there that no writer reported."""
    digest = digest_of(cell())
    expected = [(key_of(recipe, digest), result) for recipe, result in results(SEED, COUNT)]
    try:
        history = read_history(store)
    except InputError as error:
        if added or error.diagnostics[0].slug not in (Slug.STORE_EMPTY, Slug.FILE_MISSING):
            raise
        return
    found = [(case.key, case.visited, case.ended_ns, case.verdict) for case in history.cases]
    assert found == [(k, r.visited, r.ended_ns, r.verdict) for k, r in expected[: len(found)]], (
        "another case, or half of one"
    )
    assert added <= len(found) <= added + 1, f"{len(found)} cases, {added} were added"
    assert [(run.cases, run.visited) for run in history.runs] == [(len(found), history.coverage.visited)]
    with sqlite3.connect(store) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    connection.close()


def main(directory: Path, count: int) -> None:
    """Kills so many writers, each with a store of its own, which then goes on to be used."""
    model = cell()
    moments = random.Random(1)
    results(SEED, COUNT)
    kills = cases = waited = 0
    for attempt in range(2 * count):
        store = directory / f"{attempt}.db"
        after = max(0, moments.randrange(-COUNT // 3, COUNT - 5))  # a third of them while the store is being made
        added, was_killed = killed_writer(store, after, moments.uniform(0, 0.01 if after else 0.03))
        look(store, added)
        kills += was_killed
        cases += added
        waited += after
        with write_store(store, model, a_run(2, model)) as writer:
            for position, (recipe, result) in enumerate(results(SEED, COUNT), start=1):
                if position > COUNT - 3:
                    writer.add(position, recipe, result)
        assert read_history(store).runs[-1].cases == 3
        if kills == count:
            break
    sys.stdout.write(f"{kills} {cases} {waited}\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
