"""A plugin of pytest that measures the CPU time of each test, or the lines of the source that it runs.

`choose_core_tier.py` runs tests with it. Each process writes its own files into the folder that `SCBM_MEASURED` names.
"""

from __future__ import annotations

import json
import os
import resource
import time
from collections.abc import Generator
from pathlib import Path

import pytest

FOLDER, COUNTS_LINES = "SCBM_MEASURED", "SCBM_MEASURED_LINES"
"""Environment variables: the folder of the results, and whether lines are counted, which takes longer."""


def pytest_configure(config: pytest.Config) -> None:
    """Measure in the processes that run tests."""
    worker: dict[str, str] = getattr(config, "workerinput", {})
    if worker or not config.getoption("numprocesses"):
        path = Path(os.environ[FOLDER], worker.get("workerid", "main"))
        config.pluginmanager.register(LineCounter(path) if os.environ.get(COUNTS_LINES) else CpuTimer(path))


class CpuTimer:
    """Measures the CPU seconds of each test."""

    def __init__(self, path: Path) -> None:
        self._path = path.with_suffix(".json")
        self._seconds: dict[str, float] = {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Measure a test with its fixtures."""
        before_s = _cpu_s()
        result = yield
        self._seconds[item.nodeid] = _cpu_s() - before_s
        return result

    def pytest_unconfigure(self) -> None:
        """Write the results."""
        self._path.write_text(json.dumps(self._seconds), encoding="utf-8")


class LineCounter:
    """Records which lines of the source each test runs: its id is the context of the lines."""

    def __init__(self, path: Path) -> None:
        from coverage import Coverage  # noqa: PLC0415 - only measuring needs it

        self._coverage = Coverage(path.with_suffix(".coverage"), source_pkgs=["scbm"], config_file=False)
        self._coverage.start()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Record a test with its fixtures."""
        self._coverage.switch_context(item.nodeid)
        try:
            return (yield)
        finally:
            self._coverage.switch_context("")

    def pytest_unconfigure(self) -> None:
        """Write the results."""
        self._coverage.stop()
        self._coverage.save()


def _cpu_s() -> float:
    """Return the CPU time of this process, and of the processes that it started and that have ended."""
    started = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + started.ru_utime + started.ru_stime
