"""Closing prefers what a cell could do; what it forces is marked, and blames no model."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.cases import EnvironmentChange
from scbm.cases.coverage import Decision, Obligations
from scbm.closing import CloseLimits, Closer, Closing
from scbm.closing.decisions import consequences_of_force, failed_cases
from scbm.closing.scripts.closing_injections import MAX_INJECTIONS
from scbm.closing.symbolic import decision_diagrams
from scbm.files import read_case, read_model
from scbm.testing import Campaign, Tester
from support.shared_closings import shared_closing
from support.wording import Wording

CELL = """
behavior_model: cell
variables:
  done: {domain: bool, initial: false}
  estop: {domain: [released, pressed], initial: released}
resources:
  arm: {simulation: {latency: 2 s}}
operations:
  work:
    deadline: 10 s
    pre:
      g: arm_req_state == initial && arm_req_trigger == false && done == false
      a: [arm_req_trigger <- true]
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [arm_req_state <- initial, arm_req_trigger <- false, done <- true]
    timedout: [arm_req_trigger <- false]
automatic_transitions:
  emergency_stop:
    g: estop == pressed
    a: [plan.state <- aborted]
  arm_failed:
    g: arm_req_state == failed && current.state == executing
    a: [current.state <- failed, arm_req_state <- initial, arm_req_trigger <- false]
goals:
  done: done == true
"""

NOT_IN_USE = "requirements:\n  free: never arm_req_state == executing && current.state == disabled\n"
NEVER = "requirements:\n  enabled: never work.state == disabled\n"


def close(text: str) -> Closing:
    return shared_closing(read_model(text))


def decisions(closing: Closing) -> dict[str, Decision]:
    return {str(decided.obligation): decided.decision for decided in closing.decided}


def changes(closing: Closing) -> list[EnvironmentChange]:
    return [change for made in closing.cases for change in made.case.environment or ()]


def test_an_emergency_stop_comes_in_mid_motion_and_forces_nothing() -> None:
    closing = close(CELL)
    (stop,) = [each for each in changes(closing) if each.assign == (("estop", "pressed"),)]
    assert stop.at_ns == 1_000_000_000
    assert decisions(closing)["automatic/emergency_stop"] is Decision.COVERED


def test_what_is_disabled_by_force_alone_is_proved_and_marked(wording: Wording) -> None:
    closing = close(CELL)
    assert decisions(closing)["work/disabled"] is Decision.UNCOVERABLE
    (made,) = [made for made in closing.cases if made.forcing is not None]
    wording(made.forcing)
    assert [str(each) for each in made.adds_by_force] == ["work/disabled"]
    assert closing.forced == 1
    assert closing.after.figure.percent == 100


def test_an_input_that_disables_an_operation_is_changed_at_a_settled_moment() -> None:
    text = CELL.replace("&& done == false", "&& done == false && estop == released").replace(
        "    g: estop == pressed\n    a: [plan.state <- aborted]", "    g: lamp == false\n    a: [lamp <- true]"
    )
    closing = close(text.replace("  done: {", "  lamp: {domain: bool, initial: true, random: any}\n  done: {", 1))
    assert decisions(closing)["work/disabled"] is Decision.COVERED
    assert all(made.forcing is None for made in closing.cases)
    (change,) = [each for each in changes(closing) if each.assign == (("estop", "pressed"),)]
    (made,) = [made for made in closing.cases if change in (made.case.environment or ())]
    assert change.at_ns is not None
    assert change.at_ns < made.case.planning_ns  # while the plan is awaited


def test_a_state_is_forced_so_that_no_requirement_breaks() -> None:
    closing = close(CELL + NOT_IN_USE)
    (made,) = [made for made in closing.cases if made.forcing is not None]
    assert made.execution.verdict.passed
    assert made.case.injections[0].assign != (("arm_req_state", "executing"),)


def test_a_requirement_that_any_force_breaks_is_a_consequence_and_no_failure() -> None:
    closing = close(CELL + NEVER)
    assert failed_cases(Campaign.of(closing.model, ()), closing, str) == ()
    (consequence,) = consequences_of_force(closing, lambda name: f"again {name}")
    assert "enabled is violated" in consequence.message
    assert consequence.again == f"again {consequence.name}"


def test_the_command_reports_consequences_and_exits_with_0(
    scbm: Callable[..., Any], tmp_path: Path, wording: Wording
) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(CELL + NEVER, encoding="utf-8")
    ran = scbm("close", file)
    assert ran.code == 0
    wording(line for line in ran.out.splitlines() if line.startswith("Consequences"))
    report = json.loads(scbm("close", file, "--json").out)
    assert report["failed"] == []
    (made,) = [case for case in report["cases"] if case["forced_by"] is not None]
    assert made["adds_by_force"] == ["work/disabled"]
    assert len(made["consequences"]) == 1


def test_a_case_of_the_suite_that_forces_a_state_covers_nothing_by_that() -> None:
    model = read_model(CELL)
    force = "{name: one, when: current.name == work, set: {arm_req_state: failed}}"
    case = read_case(f"case: mine\ngoal: done\ninjections: [{force}]\n", model)
    suite = Campaign.of(model, Tester(model).results([case]))
    assert Obligations.of(model).names(suite.forced)[0] == "work/disabled"
    closing = Closer(model).close(suite)
    assert decisions(closing)["work/disabled"] is Decision.UNCOVERABLE
    assert not any(made.forcing for made in closing.cases)


def test_what_is_not_proved_is_undecided_though_a_forced_state_visits_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decision_diagrams, "ENGINES", {})
    closing = Closer(read_model(CELL), CloseLimits(situations=2)).close()
    found = {str(d.obligation): d for d in closing.decided}
    assert (found["work/disabled"].decision, found["work/disabled"].is_forced) == (Decision.UNDECIDED, True)
    assert found["work/disabled"].case is not None


@pytest.fixture
def twelve() -> str:
    """Twelve operations with one robot, and twelve that complete at once."""
    moves = "".join(
        f"  move_{n}:\n    pre: {{g: robot_req_state == initial && robot_req_trigger == false && step == {n},"
        f" a: [robot_req_trigger <- true]}}\n    post: {{g: true, gr: robot_req_state == succeeded,"
        f" a: [robot_req_state <- initial, robot_req_trigger <- false, step <- {n + 1}]}}\n"
        for n in range(12)
    )
    counts = "".join(
        f"  count_{n}:\n    pre: {{g: counted == {n} && step == 12}}\n    post: {{g: true, a: [counted <- {n + 1}]}}\n"
        for n in range(12)
    )
    return (
        "behavior_model: twelve\nvariables:\n  step: {domain: 0..12, initial: 0}\n"
        f"  counted: {{domain: 0..12, initial: 0}}\nresources:\n  robot: {{}}\noperations:\n{moves}{counts}"
        "automatic_transitions:\n  robot_failed:\n    g: robot_req_state == failed && current.state == executing\n"
        "    a: [current.state <- failed, robot_req_state <- initial, robot_req_trigger <- false]\n"
        "goals:\n  done: counted == 12\n"
    )


@pytest.mark.longer
def test_cases_have_about_six_injections(twelve: str) -> None:
    counts = [len(made.case.injections) for made in close(twelve).cases]
    assert max(counts) <= MAX_INJECTIONS + 1
    assert sum(counts) == 24


@pytest.mark.slow
def test_operations_that_complete_at_once_share_one_suggestion(
    twelve: str, scbm: Callable[..., Any], tmp_path: Path
) -> None:
    file = tmp_path / "twelve.yaml"
    file.write_text(twelve, encoding="utf-8")
    out = scbm("close", file).out
    assert out.count("completes instantly, so nothing can fail") == 1
    assert "change the guard" not in out


def test_one_case_each_is_the_shortest_for_its_obligations() -> None:
    model = read_model(CELL)
    few, each = Closer(model).close(), Closer(model).close(one_case_each=True)
    assert len(each.cases) > len(few.cases)
    assert each.after.visited == few.after.visited
    by_obligation = {str(o): made for made in each.cases for o in made.adds}
    assert [r.outcome for r in by_obligation["work/failed"].case.outcomes] == ["fail"]
    assert not by_obligation["work/completed"].case.outcomes
    assert all(made.execution.verdict.passed for made in each.cases)


def test_one_case_each_is_an_option(scbm: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(CELL, encoding="utf-8")
    ran = scbm("close", file, "--one-case-each")
    assert ran.code == 0
    assert f"scbm close {file} --one-case-each --out closed" in ran.out.replace("\n", " ").replace("  ", " ")
