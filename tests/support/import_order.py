"""The order in which workers of pytest-xdist import the tests: every second worker begins with the last file.

In a fresh checkout, pytest compiles each test file and rewrites its assertions; later imports read the stored bytecode.
Workers that begin at the same end compile all files at the same time. Two that begin at both ends compile half each.
"""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from _pytest.reports import CollectReport


def begins_last(config: pytest.Config) -> bool:
    """Return whether this process is a worker that imports the last test file first."""
    worker: dict[str, str] = getattr(config, "workerinput", {})
    return int(worker.get("workerid", "gw0").removeprefix("gw")) % 2 == 1


def reverse_files(collector: pytest.Collector, report: CollectReport) -> None:
    """Reverse the files and folders that a folder contains; the tests of a file keep their order."""
    if isinstance(collector, pytest.Session | pytest.Directory):
        report.result.reverse()


def restore_order(items: list[pytest.Item]) -> None:
    """Put the tests of reversed files into the order of all other workers, as pytest-xdist requires."""
    files = [list(tests) for _, tests in groupby(items, lambda item: item.getparent(pytest.File))]
    items[:] = [test for tests in reversed(files) for test in tests]
