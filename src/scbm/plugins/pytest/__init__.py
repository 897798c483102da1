"""Case files as pytest items, a fixture that runs cases in Python tests, and the coverability report at the end.

This module is loaded into every pytest session in an environment with `scbm`. So it imports nothing but pytest, and
all else only where there is a case; where there is none, it does nothing.
"""

from __future__ import annotations

import argparse
import re
from typing import TYPE_CHECKING

import pytest

from scbm.plugins.pytest.session_stash import MODELS, models_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from typing import Any

    from scbm.cases.coverage import Threshold
    from scbm.plugins.pytest.fixture import ModelUnderTest


_STORED = pytest.StashKey[list[str]]()
_SUFFIXES = (".yaml", ".yml")
_SNIFFED_BYTES = 65_536

_MAY_BE_CASE = re.compile(rb"^[^\w\r\n]*(case|goal)\b", re.MULTILINE | re.IGNORECASE)
"""Matches every case file. Only matching files are read, because loading the reader takes long."""

_OUTPUT = "scbm"
"""The key under which a worker of pytest-xdist sends its results."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options and the configuration of the plugin."""
    group = parser.getgroup("scbm", "behavior models")
    group.addoption("--scbm-model", metavar="PATH", help="The model of all case files, whichever they name.")
    group.addoption(
        "--scbm-report",
        choices=("full", "short", "none"),
        help="The coverability report: full, a line for each model, or none. [full if one model was run, else short]",
    )
    group.addoption(
        "--scbm-fail-under",
        action="append",
        type=_threshold,
        metavar="P",
        help="Fail if the visited percentage of a model is lower: `90`, `executing=100`, `coverable=100`.",
    )
    group.addoption(
        "--scbm-certificates",
        action="append",
        metavar="DIRECTORY",
        help="Check these certificates, and count the obligations that they exclude.",
    )
    group.addoption("--scbm-store", metavar="FILE", help="Add the cases that were run to this coverage store.")
    group.addoption(
        "--scbm-record", action="store_true", help="Record results in case files that have none, of cases that pass."
    )
    group.addoption(
        "--scbm-update", action="store_true", help="Replace recorded results from which the runs of case files differ."
    )
    group.addoption("--scbm-planner", metavar="NAME", help="The planner of all cases. [that of the model]")
    group.addoption(
        "--scbm-max-length", type=int, metavar="N", help="Maximum number of operations in a plan. [that of the model]"
    )
    group.addoption(
        "--scbm-max-expanded", type=int, metavar="N", help="Maximum number of expanded states. [that of the model]"
    )
    parser.addini("scbm_model", "The model of case files that name none; seen from the directory of this file.")
    parser.addini("scbm_cases", "Whether case files are collected.", type="bool", default=True)


def _threshold(text: str) -> Threshold:
    from scbm.plugins.pytest.session_statuses import read_threshold

    try:
        return read_threshold(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def pytest_configure(config: pytest.Config) -> None:
    """Raise `UsageError` for unreadable certificates, limits that are too small, and a planner that does not exist."""
    if config.getoption("--scbm-certificates") is not None:
        from scbm.plugins.pytest.session_statuses import certificates_of

        tuple(certificates_of(config))
    for option, least in (("--scbm-max-length", 0), ("--scbm-max-expanded", 1)):
        limit: int | None = config.getoption(option)
        if limit is not None and limit < least:
            raise pytest.UsageError(f"{option}: {limit} is less than {least}")
    if config.getoption("--scbm-planner") is None:
        return
    from scbm.plugins.pytest.session_models import refuse_unknown

    refuse_unknown(config)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect a YAML file that is a case."""
    if file_path.suffix not in _SUFFIXES or not file_path.is_file() or not parent.config.getini("scbm_cases"):
        return None
    try:
        with file_path.open("rb") as stream:
            head = stream.read(_SNIFFED_BYTES)
    except OSError:
        return None
    if not _MAY_BE_CASE.search(head):
        return None
    from scbm.plugins.pytest.items import collect_case

    return collect_case(file_path, head.decode("utf-8", errors="replace"), parent)


@pytest.fixture(scope="module")  # not for each function, as Hypothesis calls a test many times in one of these
def scbm_model(request: pytest.FixtureRequest) -> Callable[..., ModelUnderTest]:
    """Return `scbm_model(path)`, which loads a model; the path is relative to the directory of the test file.

    Without a path it is the model of the configuration.
    """
    from scbm.plugins.pytest.fixture import factory

    return factory(models_of(request.config), request.path.parent)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:  # noqa: ANN401 - pytest-xdist has no types, and may not be there
    """Add the results of a worker of pytest-xdist."""
    packed = getattr(node, "workeroutput", {}).get(_OUTPUT)
    if packed is not None:
        models_of(node.config).results.unpack(packed)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Send the results to the main process, or judge their coverage."""
    config = session.config
    models = config.stash.get(MODELS, None)
    if models is not None:
        models.results.place(session)
    output = getattr(config, "workeroutput", None)
    if output is not None:
        if models is not None:
            output[_OUTPUT] = models.results.pack()
        return
    _keep(session)
    if _judges(config) and session.exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        from scbm.plugins.pytest.summary import find_shortfalls

        if find_shortfalls(models_of(config)):
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Write the coverability report, and the models that miss their threshold."""
    if config.stash.get(MODELS, None) is None and not _judges(config):
        return
    if hasattr(config, "workeroutput"):
        return
    from scbm.plugins.pytest.summary import summarize

    summarize(models_of(config), terminalreporter, judged=_judges(config))
    for line in config.stash.get(_STORED, []):
        is_wrong = line.startswith("FAIL ")
        terminalreporter.write_line(line, bold=is_wrong, red=is_wrong)


def _keep(session: pytest.Session) -> None:
    """Add the results to the store; the session fails if that is not possible."""
    config = session.config
    file: str | None = config.getoption("--scbm-store")
    if file is None or config.getoption("collectonly"):
        return
    from scbm.plugins.pytest.summary import keep

    lines, is_well = keep(config, list(models_of(config).results.parts()), file)
    config.stash[_STORED] = lines
    if not is_well and session.exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _judges(config: pytest.Config) -> bool:
    return config.getoption("--scbm-fail-under") is not None and not config.getoption("collectonly")
