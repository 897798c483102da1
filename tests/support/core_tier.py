"""The core tier: tests that `pytest` runs if its command line names none. A list chooses them.

`tests/core_tier/choose_core_tier.py` writes the list: tests that run many lines of the source in little time.
Other tests are not collected, as that takes time, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import pytest

from support.tiers import tier_of

ROOT = Path(__file__).parents[2]
LIST = ROOT / "tests/core_tier/core_tests.txt"

MISSING = pytest.StashKey[tuple[str, ...]]()
"""Lines of the list for which a run of the core tier has found no test."""

_CHOOSING = ("full", "update_golden", "keyword", "markexpr", "lf")
"""Options that choose tests; with one of them, `pytest` collects all tests."""

SUMMARY = """\
This was the core tier: properties, contracts, tests of the checker, and tests that run nearly all lines of the source.
`pytest tests` runs all usual tests, `pytest FILE_OR_FOLDER` those of a file or a folder, `pytest --full` everything
(see CONTRIBUTING.md, Tiers of tests)."""


class CoreList:
    """The tests of the core tier.

    Attributes:
        lines: the lines of the list. Each is a folder, a test for all of its parameters, or a test with one of them.
    """

    def __init__(self, lines: Iterable[str]) -> None:
        self.lines = tuple(lines)
        tests = [line for line in self.lines if "::" in line]
        self._folders = tuple(f"{line}/" for line in self.lines if "::" not in line)
        self._tests = frozenset(tests)
        self._functions = frozenset(function_of(line) for line in tests)
        self._files = frozenset(line.partition("::")[0] for line in tests)
        self._parents = frozenset(
            str(parent) for file in (*self._files, *self._folders) for parent in Path(file).parents
        )

    def may_hold(self, path: str) -> bool:
        """Return whether a file or a folder, as a path from the root, may have tests of the tier."""
        return f"{path}/".startswith(self._folders) or path in self._files or path in self._parents

    def has_function(self, function: str) -> bool:
        """Return whether a test is in the tier with some of its parameters."""
        return function.startswith(self._folders) or function in self._functions

    def has(self, test: str) -> bool:
        """Return whether the list has the id of a test."""
        return test.startswith(self._folders) or test in self._tests or function_of(test) in self._tests

    def missing(self, tests: Sequence[str]) -> tuple[str, ...]:
        """Return the lines that stand for none of these ids of tests."""
        found = frozenset([*tests, *map(function_of, tests)])
        return tuple(line for line in self.lines if "::" in line and line not in found)

    def of_tier(self, items: Iterable[pytest.Item]) -> tuple[list[pytest.Item], list[pytest.Item]]:
        """Return the tests of the tier, and the others, among them those with the mark of another tier."""
        sides: tuple[list[pytest.Item], list[pytest.Item]] = [], []
        for item in items:
            sides[tier_of(item) is not None or not self.has(item.nodeid)].append(item)
        return sides


class CoreCollection:
    """A plugin that collects only tests of the core tier."""

    def __init__(self, core: CoreList) -> None:
        self._core = core

    def pytest_ignore_collect(self, collection_path: Path) -> bool | None:
        """Ignore a file or a folder without tests of the tier."""
        if not collection_path.is_relative_to(ROOT / "tests"):
            return None
        return None if self._core.may_hold(collection_path.relative_to(ROOT).as_posix()) else True

    @pytest.hookimpl(tryfirst=True)
    def pytest_pycollect_makeitem(self, collector: pytest.Collector, name: str) -> Sequence[pytest.Item] | None:
        """Leave out a test of which no parameter is in the tier, before pytest makes one item for each of them."""
        is_left_out = name.startswith("test") and not self._core.has_function(f"{collector.nodeid}::{name}")
        return [] if is_left_out else None

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Leave out the other tests."""
        if config.args_source is pytest.Config.ArgsSource.TESTPATHS:
            config.stash[MISSING] = self._core.missing([item.nodeid for item in items])
        items[:], others = self._core.of_tier(items)
        config.hook.pytest_deselected(items=others)


def read_core_list() -> CoreList:
    """Return the core tier of the repository."""
    return CoreList(line for line in LIST.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))


def mark(items: Iterable[pytest.Item]) -> None:
    """Give the tests of the core tier the mark `core`."""
    for item in read_core_list().of_tier(items)[0]:
        item.add_marker("core")


def function_of(name: str) -> str:
    """Return the id of a test without its parameters."""
    return name.partition("[")[0]


def is_core_run(config: pytest.Config) -> bool:
    """Return whether a run has only tests of the core tier: the command line says so, or chooses no tests."""
    names_nothing = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    is_core: bool = config.getoption("core")
    return is_core or (names_nothing and not any(map(config.getoption, _CHOOSING)))
