"""Campaigns over nodes: what is told of real resources, and what is left when one is ended early."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import pytest

from scbm.cases import Case, Forced
from scbm.model import Outcome
from scbm.notation import read_model
from scbm.realtime import BusError, Lack, NodeRun, NotReadyError, Reason
from scbm.simulating import Simulated
from scbm.storing import read_history
from scbm.trace import PlanReceived
from support.capturing import captured
from support.models import SCAN_CELL

MODEL = read_model(SCAN_CELL)
Scbm = Callable[..., Any]


@dataclass
class Simulations:
    """Stands for a session of nodes: the runs are simulated ones.

    Attributes:
        outcome: what becomes of every request; what is drawn, if it is `None`.
        ends: raised in place of the third run.
        plans_late_ns: so long a plan takes in the records.
    """

    outcome: Outcome | None = None
    ends: BaseException | None = None
    plans_late_ns: int = 0
    real: tuple[str, ...] = ("scan",)
    closed: int = 0
    _ran: int = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.closed += 1

    def run(self, case: Case, *_: object) -> NodeRun:
        self._ran += 1
        if self._ran == 3 and self.ends is not None:
            raise self.ends
        forced = () if self.outcome is None else (Forced("scan", 1, None, self.outcome),)
        log, records = captured(MODEL, replace(case, outcomes=forced))
        late = tuple(
            replace(record, at_ns=record.at_ns + self.plans_late_ns) if isinstance(record, PlanReceived) else record
            for record in records
        )
        return NodeRun(Simulated(log.end, records[-1].at_ns, late), log)


@pytest.fixture
def nodes(monkeypatch: pytest.MonkeyPatch) -> Simulations:
    session = Simulations()
    monkeypatch.setattr("scbm.cli.over_nodes.Session", lambda *_: session)
    return session


@pytest.fixture
def real(tmp_path: Path) -> tuple[object, ...]:
    """A command line that tests five cases with the only resource of the model real."""
    model, bindings = tmp_path / "model.yaml", tmp_path / "bindings.yaml"
    model.write_text(SCAN_CELL, encoding="utf-8")
    bindings.write_text(
        "bindings_of: scan_cell\nresources: {scan: {topics: {request: /scan/request, reply: /scan/reply}}}\n",
        encoding="utf-8",
    )
    cases = ("--cases", 5, "--time-limit", "30 s", "--failures", tmp_path / "failures")
    return ("test", model, *cases, "--transport", "dds", "--domain", 0, "--bindings", bindings, "--real", "scan")


@pytest.mark.usefixtures("nodes")
def test_the_report_counts_what_real_resources_did(scbm: Scbm, real: tuple[object, ...]) -> None:
    ran = scbm(*real)
    assert ran.code == 0
    (counted,) = json.loads(scbm(*real, "--json").out)["real_resources"]
    assert counted["sent"] == counted["succeeded"] + counted["failed"] + counted["unanswered"]
    assert (counted["resource"], counted["succeeded"] > 0) == ("scan", True)
    numbers = f"{counted['sent']:>10}{counted['succeeded']:>11}{counted['failed']:>8}{counted['unanswered']:>12}"
    assert f"\nReal resources      sent  succeeded  failed  unanswered\n  scan        {numbers}\n" in ran.out
    assert f"\n  scan        {numbers}\n" in scbm(*real, "--missing").out
    assert "did nothing" not in ran.err


def test_simulated_resources_are_not_counted(scbm: Scbm, nodes: Simulations, real: tuple[object, ...]) -> None:
    nodes.real = ()
    nodes.outcome = Outcome.TIMEOUT
    command = real[: real.index("--bindings")]
    ran = scbm(*command)
    assert (ran.code, "Real resources" in ran.out, ran.err) == (0, False, "")
    assert "real_resources" not in json.loads(scbm(*command, "--json").out)


@pytest.mark.parametrize(
    ("outcome", "why"),
    [
        (
            Outcome.TIMEOUT,
            "nothing came back in time; look at what its driver says, at the binding of `scan`",
        ),
        (Outcome.FAIL, "its driver refused or failed each; see what it says itself"),
    ],
)
def test_a_real_resource_that_did_nothing_fails_the_campaign_though_all_cases_pass(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], outcome: Outcome, why: str
) -> None:
    nodes.outcome = outcome
    ran = scbm(*real, "--json")
    told = json.loads(ran.out)
    assert (ran.code, told["passed"]) == (1, True)
    (counted,) = told["real_resources"]
    column = "failed" if outcome is Outcome.FAIL else "unanswered"
    assert counted["sent"] == counted[column] > 0
    assert f"scbm: `scan` is real, and did nothing of {counted['sent']} requests: {why}" in ran.err


@pytest.mark.usefixtures("nodes")
def test_a_real_resource_that_nobody_asked_is_no_failure(scbm: Scbm, real: tuple[object, ...]) -> None:
    place = real.index("--cases") + 1
    ran = scbm(*real[:place], 0, *real[place + 1 :])
    assert (ran.code, ran.err) == (0, "")
    assert "  scan                 0          0       0           0\n" in ran.out


def test_an_interrupted_campaign_reports_the_cases_that_were_done(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], tmp_path: Path
) -> None:
    nodes.ends = KeyboardInterrupt()
    store = tmp_path / "cov.db"
    ran = scbm(*real, "--store", store)
    assert ran.code == 130
    assert "2 random cases of seed 0: " in ran.out
    assert "\n  Interrupted after 2 of 5 cases\n" in ran.out
    assert ran.err == f"scbm: interrupted after 2 of 5 cases; their run in {store} is not finished\n"
    assert nodes.closed == 1
    history = read_history(store)
    assert (len(history.cases), [run.is_finished for run in history.runs]) == (2, [False])


def test_an_interruption_is_told_to_machines(scbm: Scbm, nodes: Simulations, real: tuple[object, ...]) -> None:
    nodes.ends = KeyboardInterrupt()
    told = json.loads(scbm(*real, "--json").out)
    assert (told["ended_early"], len(told["cases"])) == ("Interrupted after 2 of 5 cases", 2)
    nodes.ends = None
    assert "ended_early" not in json.loads(scbm(*real, "--json").out)


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (
            NotReadyError([Reason(Lack.CHILD, "the controller ended with 2")]),
            "DDS domain 0: error[cell-incomplete]: the controller ended with 2\n    = see above what it says\n",
        ),
        (BusError("it is gone", "come back"), "DDS: error[bus-unusable]: it is gone\n    = come back\n"),
    ],
)
def test_a_cell_that_breaks_in_the_middle_leaves_the_report_of_what_was_done(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], error: Exception, told: str
) -> None:
    nodes.ends = error
    ran = scbm(*real)
    assert ran.code == 2
    assert "2 random cases of seed 0: " in ran.out
    assert "\n  Ended by an error after 2 of 5 cases\n" in ran.out
    assert ran.err == f"scbm: ended by an error after 2 of 5 cases\n{told}"
    assert nodes.closed == 1


def test_what_ends_a_campaign_before_its_first_case_leaves_no_report(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...]
) -> None:
    nodes._ran = 2
    nodes.ends = NotReadyError([Reason(Lack.CHILD, "the controller ended with 2")])
    ran = scbm(*real)
    assert (ran.code, ran.out) == (2, "")
    nodes._ran = 2
    nodes.ends = KeyboardInterrupt()
    ran = scbm(*real)
    assert (ran.code, ran.out, ran.err) == (130, "", "")


def test_a_scale_that_the_machine_does_not_keep_up_with_is_told_once(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...]
) -> None:
    nodes.real = ()
    nodes.outcome = Outcome.TIMEOUT
    command = (*real[: real.index("--bindings")], "--time-scale", 500)
    assert scbm(*command).err == ""
    nodes.plans_late_ns = 6_000_000_000
    hint = "a plan took 6 s of a run, and the shortest deadline is 10 s; try a smaller one"
    assert scbm(*command).err == f"scbm: the machine did not keep up with --time-scale 500: {hint}\n"
    assert scbm(*command[:-2]).err == ""  # time that is not scaled cannot be scaled less
    nodes.outcome = Outcome.SUCCEED
    assert scbm(*command).err == ""  # all goals are reached: nothing is to be explained
