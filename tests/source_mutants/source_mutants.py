"""Runs tests against mutants of the source. Each mutant is a change by hand that a test must notice.

`source_mutants.py [--only WORD] [--one-in N] [--core] [--workers N]` applies one mutant of `mutants.toml` at a time
to a copy of `src/scbm`, and runs its tests with the copy until one fails. It prints which test noticed each mutant, and
exits with 1 if a mutant survives. `test_source_mutants.py` checks the table in each usual run of the tests.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from compileall import compile_dir
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.util import cache_from_source
from pathlib import Path
from queue import SimpleQueue
from shutil import copytree
from tempfile import TemporaryDirectory

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "scbm"
TABLE = Path(__file__).with_name("mutants.toml")

MAX_CPU_S = 30
"""The tests of one mutant need a few seconds of CPU. A mutant that makes them go on without end is noticed, too."""

_FAILED = re.compile(r"^FAILED (.+?)(?: - .*)?$", re.MULTILINE)
_LIMITED_PYTEST = """
import resource, sys
resource.setrlimit(resource.RLIMIT_CPU, (int(sys.argv[1]), resource.RLIM_INFINITY))
import pytest
sys.exit(pytest.main(sys.argv[2:]))
"""
"""Runs pytest, and is ended by the system after so many seconds of CPU."""


@dataclass(frozen=True)
class SourceMutant:
    """A change of one file.

    Attributes:
        file: the path from `src/scbm`.
        old: a text that occurs once in the file.
        new: the text in its place.
        why: what the source does then; of an equivalent mutant why no test can notice it.
        tests: the paths of the tests that are run, in order.
    """

    file: str
    old: str
    new: str
    why: str
    tests: tuple[str, ...]

    @property
    def words(self) -> str:
        """Where the change is, and what it does."""
        before, _, _ = (SOURCE / self.file).read_text(encoding="utf-8").partition(self.old)
        return f"{self.file}:{before.count(chr(10)) + 1}: {self.why}"


def read_mutants(section: str = "mutant") -> list[SourceMutant]:
    """Return the mutants of a section of each file: `mutant`, or `equivalent` for those that no test can notice."""
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    return [
        SourceMutant(file, row["old"], row["new"], row["why"], tuple(row.get("tests", entry["tests"])))
        for file, entry in table.items()
        for row in entry.get(section, ())
    ]


class PackageCopy:
    """A copy of `src/scbm` that tests import instead of it.

    Attributes:
        package: the copied folder.
    """

    def __init__(self, directory: Path, *, is_core: bool = False) -> None:
        """Copy the package; `is_core` says that of the tests only those of the core tier run."""
        self._is_core = is_core
        self.package = Path(copytree(SOURCE, directory / "scbm"))
        compile_dir(self.package, quiet=1)

    def failed(self, mutant: SourceMutant) -> str | None:
        """Return the first test that fails with a mutant; `None` if none does."""
        file = self.package / mutant.file
        source = file.read_text(encoding="utf-8")
        file.write_text(source.replace(mutant.old, mutant.new), encoding="utf-8")
        Path(cache_from_source(str(file))).unlink(missing_ok=True)
        try:
            return self.first_failed(mutant.tests, MAX_CPU_S)
        finally:
            file.write_text(source, encoding="utf-8")

    def first_failed(self, tests: Sequence[str], max_cpu_s: int) -> str | None:
        """Return the first test that fails; `None` if none does. Raises `RuntimeError` if tests cannot be run."""
        core = ("--core",) * self._is_core
        options = (*core, "-q", "-x", "-n", "0", "--tb=no", "-rf", "--no-header", "-p", "no:cacheprovider")
        run = self._python("-c", _LIMITED_PYTEST, str(max_cpu_s), *options, *tests)
        if run.returncode == -signal.SIGXCPU:
            return f"tests go on for more than {max_cpu_s} s of CPU"
        failed = _FAILED.search(run.stdout)
        if run.returncode == pytest.ExitCode.NO_TESTS_COLLECTED and self._is_core:
            return None
        if run.returncode != (failed is not None):
            raise RuntimeError(f"tests could not be run: {run.stdout}{run.stderr}")
        return failed and failed[1]

    def check(self, tests: Sequence[str]) -> None:
        """Raise `RuntimeError` if the tests import another package, or one fails without a mutant."""
        imported = Path(self._python("-c", "import scbm; print(scbm.__file__)").stdout).parent
        failed = self.first_failed(tests, MAX_CPU_S * 10)
        if imported != self.package or failed is not None:
            raise RuntimeError(f"without a mutant {failed} fails, and tests import {imported}")

    def _python(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": str(self.package.parent)}
        command = [sys.executable, "-B", *arguments]
        return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the mutants, and return the exit code."""
    parser = argparse.ArgumentParser(description="Runs tests against mutants of the source.")
    parser.add_argument("--only", default="", metavar="WORD", help="only mutants with this word in file or reason")
    parser.add_argument("--one-in", type=int, default=1, metavar="N", help="a fixed sample: one of N mutants")
    parser.add_argument("--core", action="store_true", help="run only tests of the core tier")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="mutants at a time")
    options = parser.parse_args(arguments)
    mutants = [each for each in read_mutants() if options.only in f"{each.file}: {each.why}"][:: options.one_in]
    survivors: list[str] = []
    with TemporaryDirectory() as directory, ThreadPoolExecutor(options.workers) as workers:
        copies: SimpleQueue[PackageCopy] = SimpleQueue()
        for number in range(options.workers):
            copies.put(PackageCopy(Path(directory, str(number)), is_core=options.core))

        def failed(mutant: SourceMutant) -> str | None:
            copy = copies.get()
            try:
                return copy.failed(mutant)
            finally:
                copies.put(copy)

        first = copies.get()
        first.check(tuple(dict.fromkeys(test for each in mutants for test in each.tests)))
        copies.put(first)
        for mutant, test in zip(mutants, workers.map(failed, mutants), strict=True):
            survivors += [mutant.words] if test is None else []
            print(f"{mutant.words}: {'SURVIVES' if test is None else test}", flush=True)
    print(f"{len(mutants)} mutants, {len(survivors)} survive", *survivors, sep="\n  ")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
