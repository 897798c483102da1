"""The order in which workers of pytest-xdist import the tests: every second worker begins with the last file.

In a fresh checkout, pytest compiles each test file and rewrites its assertions; later imports read the stored bytecode.
Workers that begin at the same end compile all files at the same time. Two that begin at both ends compile half each.
"""

from __future__ import annotations

from collections.abc import Generator
from itertools import groupby
from pathlib import Path

import pytest
from _pytest.reports import CollectReport


def begins_last(config: pytest.Config) -> bool:
    """Return whether this process is a worker that imports the last test file of one folder first."""
    worker: dict[str, str] = getattr(config, "workerinput", {})
    number = int(worker.get("workerid", "gw0").removeprefix("gw"))
    return number % 2 == 1 and len(config.args) == 1 and Path(config.args[0]).is_dir()


class BackwardImports:
    """A plugin that imports files and folders in the reverse order, and then restores the order of the tests.

    It is for a run of one folder: several arguments may name a file, or a test, more than once.
    """

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Generator[None, CollectReport, CollectReport]:
        report = yield
        if isinstance(collector, pytest.Directory):
            report.result.reverse()
        return report

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Put the tests into the order of all other workers, as pytest-xdist requires."""
        files = [list(tests) for _, tests in groupby(items, lambda item: item.getparent(pytest.File))]
        items[:] = [test for tests in reversed(files) for test in tests]
