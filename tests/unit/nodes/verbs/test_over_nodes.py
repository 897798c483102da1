"""Campaigns over nodes: messages about real resources, and the results of a campaign that ends early."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import pytest
from msgspec import structs
from msgspec.structs import replace

from scbm.cases import Case, OutcomeRule
from scbm.cases.trace import SENT, InjectionApplied, PlanReceived
from scbm.files import read_model
from scbm.model import Outcome
from scbm.nodes import BusError, Lack, LostError, NodeRun, NotReadyError, Reason
from scbm.running.simulation import Simulated
from scbm.store import read_history
from scbm.testing.real_drivers import GoalFate
from support.capturing import captured
from support.models import SCAN_CELL
from support.wording import Wording, diagnostic_heads

MODEL = read_model(SCAN_CELL)
Scbm = Callable[..., Any]


@dataclass
class Simulations:
    """Stands for a session of nodes: the runs are simulated ones.

    Attributes:
        outcome: what becomes of every request; what is drawn, if it is `None`.
        ends: raised in place of the third run.
        loses: whether the runs before that are lost.
        plans_late_ns: so long a plan takes in the records.
        real: what is real when the session begins.
        real_in: what was real in a run, by its number, where that is another resource.
        sends: what a driver sends in each run although nothing in the model could.
        goals: the counts of goals at the end.
    """

    outcome: Outcome | None = None
    ends: BaseException | None = None
    loses: bool = False
    plans_late_ns: int = 0
    real: tuple[str, ...] = ("scan",)
    real_in: dict[int, tuple[str, ...]] = field(default_factory=dict)
    sends: tuple[tuple[str, int], ...] = ()
    goals: Counter[tuple[str, str]] = field(default_factory=Counter)
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
        if self.loses:
            raise LostError("the controller was lost")
        forced = () if self.outcome is None else (OutcomeRule("scan", 1, None, self.outcome),)
        log, records = captured(MODEL, replace(case, outcomes=forced))
        late = tuple(
            structs.replace(each, at_ns=each.at_ns + self.plans_late_ns) if isinstance(each, PlanReceived) else each
            for each in records
        )
        late = (late[0], *(InjectionApplied(0, SENT, None, (pair,), forced=True) for pair in self.sends), *late[1:])
        log = replace(log, real=self.real_in.get(self._ran, self.real))
        return NodeRun(Simulated(log.end, records[-1].at_ns, late), log)


@pytest.fixture
def nodes(monkeypatch: pytest.MonkeyPatch) -> Simulations:
    session = Simulations()
    monkeypatch.setattr("scbm.nodes.verbs.over_nodes.Session", lambda *_: session)
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
    came = [counted[name] for name in ("succeeded", "failed", "timed_out", "given_up")]
    assert counted["sent"] == sum(came)
    assert (counted["resource"], counted["succeeded"] > 0, counted["silent"]) == ("scan", True, False)
    numbers = "".join(f"{count:>{width}}" for count, width in zip((sum(came), *came), (10, 11, 8, 11, 10), strict=True))
    title = "Real resources      sent  succeeded  failed  timed out  given up"
    assert f"\n{title}\n  scan        {numbers}\n" in ran.out
    assert f"\n  scan        {numbers}\n" in scbm(*real, "--missing").out
    assert ran.err == ""


def test_the_report_counts_goals_that_end_after_the_last_run(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...]
) -> None:
    nodes.goals.update({("scan", "cancel_refused"): 1, ("scan", "accepted"): 5, ("other", "accepted"): 7})
    (counted,) = json.loads(scbm(*real, "--json").out)["real_resources"]
    assert counted["goals"] == {fate.value: nodes.goals["scan", fate] for fate in GoalFate}
    assert "\n    goals: 5 accepted, 1 cancel refused\n" in scbm(*real).out


def test_each_run_counts_for_what_was_real_in_it(scbm: Scbm, nodes: Simulations, real: tuple[object, ...]) -> None:
    nodes.real = ()
    nodes.real_in = {2: ("scan",), 3: ("scan",)}
    command = real[: real.index("--bindings")]
    report = json.loads(scbm(*command, "--json").out)
    (counted,) = report["real_resources"]
    assert counted["sent"] == sum(case["requests"] for case in report["cases"][1:3]) > 0


def test_what_a_lost_run_was_answered_is_not_counted(scbm: Scbm, nodes: Simulations, real: tuple[object, ...]) -> None:
    nodes.loses = True
    (counted,) = json.loads(scbm(*real, "--json").out)["real_resources"]
    assert (counted["sent"], counted["silent"]) == (0, False)


def test_simulated_resources_are_not_counted(scbm: Scbm, nodes: Simulations, real: tuple[object, ...]) -> None:
    nodes.real = ()
    nodes.outcome = Outcome.TIMEOUT
    command = real[: real.index("--bindings")]
    ran = scbm(*command)
    assert (ran.code, "Real resources" in ran.out, ran.err) == (0, False, "")
    assert "real_resources" not in json.loads(scbm(*command, "--json").out)


@pytest.fixture
def gives_up(real: tuple[object, ...], tmp_path: Path) -> tuple[object, ...]:
    """The same with a case that passes when the second plan has failed, and no random ones."""
    case = tmp_path / "gives_up.yaml"
    text = "case: gives_up\ngoal: scanned\nlimits: {plans: 2}\nexpect: {verdict: replan_limit}\n"
    case.write_text(text, encoding="utf-8")
    place = real.index("--cases")
    return (*real[:place], case, *real[place + 2 :])


@pytest.mark.parametrize("outcome", [Outcome.TIMEOUT, Outcome.FAIL])
def test_a_real_resource_that_did_nothing_fails_the_campaign_though_all_cases_pass(
    scbm: Scbm, nodes: Simulations, gives_up: tuple[object, ...], outcome: Outcome, wording: Wording
) -> None:
    nodes.outcome = outcome
    ran = scbm(*gives_up, "--json")
    report = json.loads(ran.out)
    assert (ran.code, report["passed"]) == (1, True)
    (counted,) = report["real_resources"]
    column = "failed" if outcome is Outcome.FAIL else "timed_out"
    assert (counted["sent"], counted[column], counted["silent"]) == (2, 2, True)
    wording(ran.err)


def test_what_a_silent_resource_left_is_reported_by_its_kind(
    scbm: Scbm, nodes: Simulations, gives_up: tuple[object, ...], tmp_path: Path, wording: Wording
) -> None:
    nodes.outcome = Outcome.TIMEOUT
    ends_before = "case: hurries\ngoal: scanned\nlimits: {time: 3 s}\nexpect: {verdict: time_limit}\n"
    (tmp_path / "hurries.yaml").write_text(ends_before, encoding="utf-8")
    command = (*gives_up, tmp_path / "hurries.yaml")
    ran = scbm(*command)
    assert ran.code == 1
    wording(ran.err)


def test_a_real_resource_whose_requests_were_all_given_up_is_not_silent(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...]
) -> None:
    nodes.outcome = Outcome.TIMEOUT
    place = real.index("--time-limit") + 1
    ran = scbm(*real[:place], "3 s", *real[place + 1 :], "--json")
    (counted,) = json.loads(ran.out)["real_resources"]
    assert (counted["sent"] > 0, counted["given_up"], counted["silent"]) == (True, counted["sent"], False)
    assert ran.err == ""


def test_an_interruption_is_reported_by_the_code_also_where_a_resource_was_silent(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], wording: Wording
) -> None:
    nodes.outcome, nodes.ends = Outcome.TIMEOUT, KeyboardInterrupt()
    ran = scbm(*real)
    assert ran.code == 130
    wording(ran.err)


def test_what_the_model_excludes_is_counted_in_the_report_in_json_and_in_the_store(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], tmp_path: Path, wording: Wording
) -> None:
    nodes.sends = (("temperature", 3), ("count", 1), ("temperature", 9))
    store = tmp_path / "cov.db"
    ran = scbm(*real, "--store", store)
    (title,) = [n for n, line in enumerate(ran.out.splitlines()) if "the model excludes" in line]
    wording(ran.out.splitlines()[title : title + 6])
    assert ran.out.splitlines()[title] in scbm(*real, "--missing").out.splitlines()
    report = json.loads(scbm(*real, "--json").out)
    first = {"variable": "temperature", "value": 3, "at_ns": 0}
    counted, other = report["excluded_values"]
    assert first.items() <= counted["first"].items()
    assert (counted["variable"], counted["count"], counted["cases"]) == ("temperature", 10, 5)
    assert (other["variable"], other["count"], other["first_case"]) == ("count", 5, report["cases"][0]["name"])
    assert [case.excluded for case in read_history(store).cases] == [3] * 5
    stored = json.loads(scbm("report", store, "--json").out)
    assert [case["nodes"]["excluded_values"] for case in stored["cases"]] == [3] * 5
    wording([line for line in scbm("report", store).out.splitlines() if "Over nodes" in line])


@pytest.mark.usefixtures("nodes")
def test_drivers_that_the_model_allows_for_are_not_reported(scbm: Scbm, real: tuple[object, ...]) -> None:
    assert json.loads(scbm(*real, "--json").out)["excluded_values"] == []
    assert "excludes" not in scbm(*real).out


@pytest.mark.usefixtures("nodes")
def test_a_real_resource_that_nobody_asked_is_no_failure(scbm: Scbm, real: tuple[object, ...]) -> None:
    place = real.index("--cases") + 1
    ran = scbm(*real[:place], 0, *real[place + 1 :])
    assert (ran.code, ran.err) == (0, "")
    assert "  scan                 0          0       0          0         0\n" in ran.out


def test_an_interrupted_campaign_reports_the_cases_that_were_done(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], tmp_path: Path, wording: Wording
) -> None:
    nodes.ends = KeyboardInterrupt()
    store = tmp_path / "cov.db"
    ran = scbm(*real, "--store", store)
    assert ran.code == 130
    wording(ran.out.splitlines()[4])
    wording(ran.err)
    assert nodes.closed == 1
    history = read_history(store)
    assert (len(history.cases), [run.is_finished for run in history.runs]) == (2, [False])


def test_nothing_is_reported_of_a_store_that_got_nothing(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], tmp_path: Path, wording: Wording
) -> None:
    nodes.loses, nodes.ends = True, KeyboardInterrupt()
    ran = scbm(*real, "--store", tmp_path / "cov.db")
    assert ran.code == 130
    wording(ran.err)


def test_an_interruption_is_reported_in_json(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], wording: Wording
) -> None:
    nodes.ends = KeyboardInterrupt()
    report = json.loads(scbm(*real, "--json").out)
    assert len(report["cases"]) == 2
    wording(report["ended_early"])
    nodes.ends = None
    assert "ended_early" not in json.loads(scbm(*real, "--json").out)


@pytest.mark.parametrize(
    "error",
    [
        NotReadyError([Reason(Lack.CHILD, "why")]),
        NotReadyError([Reason(Lack.CHILD, "why\n\x1b[2J")]),
        BusError("why\n\x1b[2J", "remedy"),
        NotReadyError([Reason(Lack.GOAL, "`scan` is not reached: `/scan` is busy with goal 7 of another program")]),
    ],
    ids=["child", "child-with-controls", "bus", "busy"],
)
def test_a_cell_that_breaks_in_the_middle_leaves_the_report_of_what_was_done(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], error: Exception, wording: Wording
) -> None:
    nodes.ends = error
    ran = scbm(*real)
    place = "DDS: error[bus-unusable]" if isinstance(error, BusError) else "DDS domain 0: error[cell-incomplete]"
    assert (ran.code, diagnostic_heads(ran.err), "\x1b" in ran.err) == (2, [place], False)
    wording(ran.out.splitlines()[4])
    wording(ran.err)
    assert nodes.closed == 1


def test_what_ends_a_campaign_before_its_first_case_leaves_no_report(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], wording: Wording
) -> None:
    nodes._ran = 2
    nodes.ends = NotReadyError([Reason(Lack.CHILD, "the controller ended with 2")])
    ran = scbm(*real)
    assert (ran.code, ran.out) == (2, "")
    nodes._ran = 2
    nodes.ends = KeyboardInterrupt()
    ran = scbm(*real)
    assert (ran.code, ran.out) == (130, "")
    wording(ran.err)


def test_a_case_that_the_machine_did_not_keep_up_with_is_lost(
    scbm: Scbm, nodes: Simulations, real: tuple[object, ...], wording: Wording
) -> None:
    nodes.real = ()
    nodes.outcome = Outcome.TIMEOUT
    command = (*real[: real.index("--bindings")], "--time-scale", 500)
    kept_up = json.loads(scbm(*command, "--json").out)
    assert "lost" not in {case["verdict"] for case in kept_up["cases"]}
    nodes.plans_late_ns = 6_000_000_000
    ran = scbm(*command, "--json")
    report = json.loads(ran.out)
    assert (ran.code, {case["verdict"] for case in report["cases"]}) == (1, {"lost"})
    wording(report["cases"][0]["failures"])
