"""Cases that ran over nodes in coverage stores, on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Self

import pytest
from msgspec.structs import replace

from scbm.cases import Case
from scbm.files import digest_of, load_model, read_model
from scbm.nodes import NodeRun
from scbm.running import Program
from scbm.store import Replays, read_history, write_store
from scbm.testing import RandomCases
from scbm.testing.event_logs.event_log import open_event_log, rerun
from support.models import SCAN_CELL
from support.real_runs import log_of, real_run
from support.stores import a_run, cell, results
from support.stores import store as store_of_runs
from support.wording import Wording

Scbm = Callable[..., Any]


@pytest.fixture
def scbm(scbm: Scbm) -> Scbm:
    """Runs a command line in a thread of its own: the main thread may have an event loop already, of the browser's."""

    def run(*arguments: object) -> Any:  # noqa: ANN401 - what the fixture of all tests gives
        with ThreadPoolExecutor(1) as thread:
            return thread.submit(scbm, *arguments).result()

    return run


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "model.yaml"
    path.write_text(SCAN_CELL, encoding="utf-8")
    return path


@pytest.fixture
def store(scbm: Scbm, model: Path, tmp_path: Path) -> Path:
    """Two cases in simulation, and the same over loopback."""
    path = tmp_path / "cov.db"
    assert scbm("test", model, "--cases", 2, "--store", path).code == 0
    over_loopback = ("--transport", "loopback", "--time-scale", 20, "--logs", tmp_path / "logs")
    assert scbm("test", model, "--cases", 2, *over_loopback, "--store", path).code == 0
    return path


SCANS = read_model(SCAN_CELL)
BINDINGS = "bindings_of: scan_cell\nresources: {scan: {topics: {request: /scan/request, reply: /scan/reply}}}\n"
WHERE = "over loopback, 20 times faster than the wall clock"


def test_a_store_shows_the_very_runs_that_the_saved_logs_are_of(store: Path, model: Path, tmp_path: Path) -> None:
    history = read_history(store)
    loaded = load_model(model)
    assert [history.where(case) for case in history.cases] == [None, None, WHERE, WHERE]
    replays = Replays(history)
    for case in history.cases[2:]:
        execution = replays.execute(case)
        saved = open_event_log(tmp_path / f"logs/{case.name}.log").read(loaded, digest_of(loaded))
        assert execution is not None
        assert execution.digest == saved.trace
        assert (execution.ended_ns, execution.visited) == (case.ended_ns, case.visited)


def test_the_report_says_which_cases_ran_over_nodes(scbm: Scbm, store: Path, wording: Wording) -> None:
    report = json.loads(scbm("report", store, "--json").out)
    assert [case["nodes"] for case in report["cases"]] == [
        None,
        None,
        *[{"where": WHERE, "real": [], "excluded_values": 0}] * 2,
    ]
    assert report["cases"][3]["again"] == report["runs"][1]["command"]
    wording(line for line in scbm("report", store).out.splitlines() if WHERE in line)


class RealScanner:
    """Stands for a session of nodes, of which the scanner is real."""

    real: tuple[str, ...] = ("scan",)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing was begun."""

    def run(self, case: Case, *_: object) -> NodeRun:
        """A run in which resources react otherwise than in simulation."""
        log = replace(log_of(real_run(SCANS, case)), real=self.real)
        return NodeRun(rerun(log, Program(SCANS)), log)


def test_the_store_says_which_resources_were_real(
    scbm: Scbm, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("scbm.nodes.verbs.over_nodes.Session", lambda *_: RealScanner())
    bindings = tmp_path / "bindings.yaml"
    bindings.write_text(BINDINGS, encoding="utf-8")
    path = tmp_path / "cov.db"
    over_dds = ("--transport", "dds", "--domain", 7, "--bindings", bindings, "--real", "scan")
    scbm("test", model, "--cases", 2, *over_dds, "--store", path)
    report = json.loads(scbm("report", path, "--json").out)
    assert [case["nodes"] for case in report["cases"]] == [
        {"where": "over DDS domain 7", "real": ["scan"], "excluded_values": 0}
    ] * 2
    wording(line for line in scbm("report", path).out.splitlines() if report["cases"][0]["nodes"]["where"] in line)
    history = read_history(path)
    replays = Replays(history)
    for stored, number in zip(history.cases, (1, 2), strict=True):
        execution = replays.execute(stored)
        assert execution is not None
        assert execution.trace == real_run(SCANS, RandomCases(SCANS, goals=3).case(0, number)).trace


class AnotherController(RealScanner):
    """Behind the first run another controller comes, which has nothing real."""

    def run(self, case: Case, *rest: object) -> NodeRun:
        """A run with what was real in it."""
        done = super().run(case, *rest)
        self.real = ()
        return done


def test_each_case_is_stored_with_what_was_real_in_its_own_run(
    scbm: Scbm, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = AnotherController()
    monkeypatch.setattr("scbm.nodes.verbs.over_nodes.Session", lambda *_: session)
    path = tmp_path / "cov.db"
    scbm("test", model, "--cases", 2, "--transport", "dds", "--domain", 7, "--store", path)
    report = json.loads(scbm("report", path, "--json").out)
    assert [case["nodes"]["real"] for case in report["cases"]] == [["scan"], []]


def test_of_cases_that_visit_the_same_the_simulated_one_is_in_the_smallest_suite(scbm: Scbm, tmp_path: Path) -> None:
    """Also if it was run later: a file gives it again."""
    path = tmp_path / "cov.db"
    (recipe, result), *_ = results(1, 1)
    over_nodes = replace(a_run(1, cell()), nodes=WHERE)
    with write_store(path, cell(), over_nodes) as writer:
        writer.add(1, replace(recipe, real=()), result, "a log")
    store_of_runs(path, 2, [(recipe, result)])
    report = json.loads(scbm("report", path, "--minimize", "--json").out)
    first, second = report["cases"]
    assert (first["nodes"], second["nodes"]) == ({"where": WHERE, "real": [], "excluded_values": 0}, None)
    assert report["smallest"]["cases"] == [second["label"]]


def test_a_case_over_nodes_is_not_saved_as_a_file_and_that_is_reported(
    scbm: Scbm, model: Path, tmp_path: Path, wording: Wording
) -> None:
    path, saved = tmp_path / "nodes.db", tmp_path / "saved"
    scbm("test", model, "--cases", 1, "--transport", "loopback", "--time-scale", 20, "--store", path)
    ran = scbm("report", path, "--minimize", "--save", saved)
    assert ran.code == 1
    wording(ran.err)
    assert not saved.exists()
