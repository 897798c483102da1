"""A runner at rest: it settles when it starts, and a goal is given to a settled runner only (semantics 5)."""

from __future__ import annotations

import pytest

from scbm.cases.coverage import Obligations
from scbm.cases.trace import AutomaticTaken, End, LivelockedAtRest, RunEnded, RunnerStarted, RunStarted
from scbm.files import read_case, read_model
from scbm.model import BehaviorModel
from scbm.testing import Execution, FailureKind, RandomCases, Tester
from support.wording import Wording

CELL = """
behavior_model: cell
variables:
  warm: {domain: bool, initial: false}
  lamp: {domain: [dark, lit], initial: dark}
  done: {domain: bool, initial: false}
resources:
  heater: {}
operations:
  work: {pre: {g: done == false}, post: {g: true, a: [done <- true]}}
automatic_transitions:
  warms_up: {g: plan.state == idle && warm == false, a: [warm <- true]}
goals: {done: done == true}
runs: {goals: GOALS}
"""
LIT = "  lights: {g: warm == true && lamp == dark, a: [lamp <- lit]}\n"
BLINKS = LIT + "  dims: {g: lamp == lit, a: [lamp <- dark]}\n"


def cell(more: str = "", goals: str = "single") -> BehaviorModel:
    return read_model(CELL.replace("GOALS", goals).replace("goals: {done", f"{more}goals: {{done"))


def run(model: BehaviorModel, text: str = "") -> Execution:
    return Tester(model).execute(read_case(f"case: one\ngoal: done\n{text}", model))


@pytest.mark.parametrize("goals", ["single", "sequence"])
def test_what_is_taken_before_the_first_goal_is_recorded_before_it_and_visited(goals: str) -> None:
    model = cell(goals=goals)
    execution = run(model)
    kinds = [type(record) for record in execution.trace.records]
    assert kinds[:3] == [RunnerStarted, AutomaticTaken, RunStarted]
    assert "automatic/warms_up" in Obligations.of(model).names(execution.visited_freely)


def test_nothing_is_sent_before_the_first_goal() -> None:
    asks = "  asks: {g: heater_req_trigger == false && heater_req_state == initial, a: [heater_req_trigger <- true]}\n"
    kinds = [record.kind for record in run(cell(asks)).trace.records]
    assert kinds.index("request_sent") > kinds.index("run_started")


def test_requirements_are_checked_before_the_first_goal_too() -> None:
    execution = run(cell(), "requirements: {cold: never warm == true && plan.state == idle}\n")
    (violation,) = execution.violations
    assert isinstance(execution.trace.records[violation.record], AutomaticTaken)


def test_injections_that_are_due_at_once_act_after_the_runner_has_settled_and_before_the_goal() -> None:
    execution = run(cell(), "injections: [{name: cools, set: {warm: false}}]\n")
    kinds = [record.kind for record in execution.trace.records]
    assert kinds[:4] == ["runner_started", "automatic", "injection", "automatic"]
    assert kinds.index("run_started") > 3


def test_a_livelock_at_rest_fails_the_case_and_no_goal_begins(wording: Wording) -> None:
    execution = run(cell(BLINKS))
    assert any(isinstance(record, LivelockedAtRest) for record in execution.trace.records)
    assert not any(isinstance(record, RunStarted) for record in execution.trace.records)
    assert [record.end for record in execution.trace.records if isinstance(record, RunEnded)] == ["livelock"]
    (failure, *_) = execution.verdict.failures
    assert (execution.verdict.end, failure.kind) == (End.LIVELOCK, FailureKind.LIVELOCK)
    wording(execution.verdict.failures)


def test_a_livelock_after_the_end_of_a_run_fails_the_case_though_the_goal_was_reached() -> None:
    after = BLINKS.replace("warm == true", "plan.state == completed")
    for text in ("", "expect: {verdict: reached}\n"):
        verdict = run(cell(after), text).verdict
        assert (verdict.end, [failure.kind for failure in verdict.failures]) == (End.REACHED, [FailureKind.LIVELOCK])


def test_an_injection_that_changes_nothing_leaves_no_record_and_is_no_disturbance() -> None:
    plain = run(cell())
    execution = run(cell(), "injections: [{name: warms, set: {warm: true}}]\n")
    assert execution.trace.records == plain.trace.records
    assert [sentence.split()[:2] for sentence in execution.unused] == [["injection", "warms"]]


def test_drawn_cases_begin_at_rest_too() -> None:
    model = cell()
    execution = Tester(model).execute(RandomCases(model).case(1, 1))
    assert isinstance(execution.trace.records[0], RunnerStarted)
