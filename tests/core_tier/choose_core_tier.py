"""Chooses the core tier: tests that run many lines of the source in little CPU time.

`choose_core_tier.py [--write] [--seconds S]` runs all usual tests twice: once to measure their CPU time, once under
coverage.py to see which lines each of them runs. Then it takes the test with the most new lines for each second, again
and again, until the tests need S seconds. Properties, contracts and the tests of the checker are always in it.

It prints which tests come and go, and what the tier covers. With `--write` it writes the list, `core_tests.txt`.
"""

from __future__ import annotations

import argparse
import heapq
import json
import os
import re
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parents[1]))

from core_tier.measuring_plugin import COUNTS_LINES, FOLDER
from support.core_tier import LIST, ROOT, function_of, read_core_list

ALWAYS = ("tests/contract", "tests/core_tier", "tests/property", "tests/unit/proofcheck")
"""Folders whose usual tests are all in the tier. Those of the checker take little time, and each kills mutants."""

SECONDS = 40.0
"""The CPU time of the tests. To start two workers, and to collect the tests, takes some ten seconds more."""

WORTHS = (1.0, 0.25, 0.06)
"""The worth of a line that no test of the tier runs, that one runs, and that two run. Others are worth nothing."""

LISTED_SHARE = 0.5
"""The share of its time that a listed test counts with: as times vary, only a clearly better test replaces it."""

SPLIT_S = 0.1
"""Maximum CPU time of a test with all of its parameters to be taken as a whole, which keeps the list short."""

_HAS_LINE_NUMBER = re.compile(r"\.md:\d+\]$")
"""Matches tests with the number of a line of a page, which each edit of the page changes; they are not taken."""

_IN_ALWAYS = tuple(f"{folder}/" for folder in ALWAYS)
"""The beginnings of the names of tests that are always in the tier."""

OVERHEAD_S = 0.001
"""The time of a test that is not measured: to send and to report it."""

_HEAD = "# Chosen by choose_core_tier.py: folders, tests with all of their parameters, tests with one of them."

Lines = frozenset[tuple[str, int]]
"""Lines of the source: files and numbers."""


@dataclass(frozen=True)
class Candidate:
    """A test with one or all of its parameters.

    Attributes:
        name: the line in the list.
        seconds: the CPU time that it needs.
        lines: those that it runs.
    """

    name: str
    seconds: float
    lines: Lines


class Tier:
    """The candidates that are taken.

    Attributes:
        names: those that were taken, in order.
        seconds: the CPU time that they need.
    """

    def __init__(self, listed: Iterable[str]) -> None:
        self.names: list[str] = []
        self.seconds = 0.0
        self._listed = frozenset(listed)
        self._runs: Counter[tuple[str, int]] = Counter()

    def take(self, candidate: Candidate) -> None:
        """Add a candidate."""
        self.names.append(candidate.name)
        self.seconds += candidate.seconds
        self._runs.update(candidate.lines)

    def worth(self, candidate: Candidate) -> float:
        """Return what a candidate adds for each second."""
        worth = sum(WORTHS[self._runs[line]] for line in candidate.lines if self._runs[line] < len(WORTHS))
        return worth / (candidate.seconds * (LISTED_SHARE if candidate.name in self._listed else 1.0))

    def lines(self, least: int) -> int:
        """Return how many lines at least so many tests run."""
        return sum(runs >= least for runs in self._runs.values())


def choose(candidates: Sequence[Candidate], tier: Tier, max_seconds: float) -> None:
    """Fill the tier: first with what is always in it, then with the best candidates. Worths only ever shrink."""
    heap = []
    for candidate in candidates:
        if candidate.name.startswith(_IN_ALWAYS):
            tier.take(candidate)
        else:
            heap.append((-float("inf"), candidate.name, candidate))
    heapq.heapify(heap)
    while heap and tier.seconds < max_seconds:
        _, name, best = heapq.heappop(heap)
        worth = tier.worth(best)
        if worth and heap and -worth > heap[0][0]:
            heapq.heappush(heap, (-worth, name, best))
        elif worth:
            tier.take(best)


def candidates_of(seconds: Mapping[str, float], lines: Mapping[str, Lines]) -> list[Candidate]:
    """Return the candidates, sorted: `seconds` and `lines` are those of each test."""
    of_function: dict[str, list[str]] = defaultdict(list)
    for test in sorted(seconds):
        if not _HAS_LINE_NUMBER.search(test):
            of_function[function_of(test)].append(test)
    wholes = {name: tests for name, tests in of_function.items() if sum(map(seconds.__getitem__, tests)) <= SPLIT_S}
    parts = {test: [test] for name, tests in of_function.items() if name not in wholes for test in tests}
    return [
        Candidate(
            name,
            sum(seconds[test] + OVERHEAD_S for test in tests),
            frozenset().union(*(lines.get(test, frozenset()) for test in tests)),
        )
        for name, tests in sorted((wholes | parts).items())
    ]


def measured_seconds() -> dict[str, float]:
    """Return the CPU time of each usual test."""
    with TemporaryDirectory() as folder:
        _run_tests({FOLDER: folder})
        results = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(Path(folder).iterdir())]
    return {name: seconds for result in results for name, seconds in result.items()}


def measured_lines() -> dict[str, Lines]:
    """Return the lines that each usual test runs. Lines that importing runs belong to no test."""
    from coverage import CoverageData  # noqa: PLC0415 - the tests of choosing need none

    found: dict[str, list[tuple[str, int]]] = defaultdict(list)
    with TemporaryDirectory() as folder:
        _run_tests({FOLDER: folder, COUNTS_LINES: "1"})
        for path in sorted(Path(folder).iterdir()):
            data = CoverageData(str(path))
            data.read()
            for file in sorted(data.measured_files()):
                for line, tests in data.contexts_by_lineno(file).items():
                    for test in filter(None, tests):
                        found[test].append((file, line))
    return {test: frozenset(lines) for test, lines in found.items()}


def _run_tests(environment: Mapping[str, str]) -> None:
    command = [sys.executable, "-m", "pytest", "tests", "-q", "-p", "core_tier.measuring_plugin"]
    all_ = {**os.environ, "PYTHONPATH": str(ROOT / "tests"), **environment}
    ended = subprocess.run(command, cwd=ROOT, env=all_, check=False)
    if ended.returncode not in (0, 1):  # 1: some tests failed, which other runs report
        raise SystemExit(f"the tests could not be measured: pytest ended with {ended.returncode}")


def print_changes(before: Sequence[str], after: Sequence[str]) -> None:
    """Print the lines that leave the list, and those that are new."""
    changes = [
        *((name, "-") for name in before if name not in after),
        *((name, "+") for name in after if name not in before),
    ]
    for name, sign in sorted(changes):
        print(sign, name)


def main(arguments: Sequence[str] | None = None) -> None:
    """Choose the tier, and print the changes and figures."""
    parser = argparse.ArgumentParser(description="Chooses the tests of the core tier.")
    parser.add_argument("--write", action="store_true", help="write the list")
    parser.add_argument("--seconds", type=float, default=SECONDS, metavar="S", help=f"their CPU time [{SECONDS:g}]")
    options = parser.parse_args(arguments)
    listed = read_core_list().lines
    seconds, lines = measured_seconds(), measured_lines()
    tier = Tier(listed)
    choose(candidates_of(seconds, lines), tier, options.seconds)
    after = sorted([*ALWAYS, *(name for name in tier.names if not name.startswith(_IN_ALWAYS))])
    print_changes(listed, after)
    count = len(frozenset().union(*lines.values()))
    shares = ", ".join(f"{100 * tier.lines(least) / count:.2f} % in {least} or more tests" for least in (1, 2, 3))
    print(f"of {len(seconds)} tests with {sum(seconds.values()):.0f} s, and {count} lines that they run")
    print(f"the core tier has {len(after)} rows with {tier.seconds:.0f} s: {shares}")
    if options.write:
        LIST.write_text("".join(f"{line}\n" for line in (_HEAD, *after)), encoding="utf-8")


if __name__ == "__main__":
    main()
