"""A run that repeats until a limit ends it: reports show the cause, one turn, and the number of turns."""

from __future__ import annotations

import json
from base64 import b64decode
from zlib import decompress

import pytest

from scbm.cases import Case, CaseLimits, OutcomeRule
from scbm.cases.trace import End
from scbm.cases.trace.repetitions import FEWEST_TURNS
from scbm.files import read_model
from scbm.model import BehaviorModel, Outcome
from scbm.reports.html.timelines import pack_timelines
from scbm.reports.terminal.failure_report import failure_lines, lines_that_show
from scbm.reports.terminal.timeline import timeline
from scbm.testing import Execution, RandomCases, Tester
from scbm.testing.campaign_results_json import repetition_json
from support.wording import Wording

RISING_EDGE = """
behavior_model: rising_edge
variables:
  stage: {domain: [out, at_mark], initial: out, source: state}
  execute: {domain: bool, initial: false, source: state}
  seen_low: {domain: bool, initial: true, source: state}
resources:
  motor: {simulation: {latency: 3 s}}
operations:
  move:
    deadline: 20 s
    pre: {g: stage == out, a: [execute <- true]}
    post:
      g: true
      gr: motor_req_state == succeeded
      a: [stage <- at_mark, execute <- false, motor_req_trigger <- false, motor_req_state <- initial]
    failed: {g: motor_req_state == failed, a: [motor_req_trigger <- false, motor_req_state <- initial]}
    timedout: [motor_req_trigger <- false]
automatic_transitions:
  low: {g: execute == false && seen_low == false, a: [seen_low <- true]}
  start:
    g: execute == true && seen_low == true && motor_req_state == initial && current.state == executing
    a: [seen_low <- false, motor_req_trigger <- true]
goals:
  marked: stage == at_mark
"""
MODEL = read_model(RISING_EDGE)


def _execution(plans: int | None = None, model: BehaviorModel = MODEL) -> Execution:
    rule = OutcomeRule("motor", 1, 1, Outcome.FAIL)
    case = Case(
        "stuck", "marked", model.goals[0][1], model.nominal_state, outcomes=(rule,), limits=CaseLimits(plans=plans)
    )
    return Tester(model).execute(case)


def test_the_story_has_the_cause_and_one_turn(wording: Wording) -> None:
    execution = _execution()
    assert execution.verdict.end is End.REPLAN_LIMIT
    lines = [line.plain for line in failure_lines(MODEL, execution)]
    assert any("3.000 s" in line and "reply 1" in line for line in lines)
    assert sum("┌ move" in line for line in lines) == 2
    wording("\n".join(lines))


@pytest.mark.parametrize("reasons", ["all", "violation"])
def test_a_violation_within_the_turns_is_in_the_story(reasons: str) -> None:
    model = read_model(RISING_EDGE + "requirements: {late: execute == true leads to stage == at_mark within 100 s}\n")
    execution = _execution(model=model)
    (violation,) = (each for each in execution.violations if each.requirement == "late")
    assert execution.repetition is not None
    assert violation.record >= execution.repetition.begin + execution.repetition.length
    failures = [each for each in execution.verdict.failures if reasons == "all" or each.subject == "late"]
    excerpt = [line.plain for line in lines_that_show(model, execution, failures)]
    replayed = [line.plain for line in timeline(model, execution, every=False)]
    for lines in (excerpt, replayed):
        (marked,) = (number for number, line in enumerate(lines) if "✗ late: " in line)
        assert lines[marked][:11] == "  100.000 s"
        assert "↻ repeats 99 times" in lines[marked + 1]


def test_a_repetition_has_its_place_in_json() -> None:
    execution = _execution()
    found = repetition_json(execution)
    assert found is not None
    assert (found["turns"], found["begins_seconds"], found["until_seconds"]) == (99, 3.0, 1983.0)
    first, length = found["first_record"], found["records"]
    kinds = [record.kind for record in execution.trace.records]
    assert kinds[first : first + length] == kinds[first + length : first + 2 * length]
    assert kinds[first] == "plan_asked"


def test_the_page_counts_the_turns(wording: Wording) -> None:
    packed = pack_timelines(MODEL, [_execution()])
    texts = json.loads(decompress(b64decode(packed["shared"])))["texts"]
    wording([text for text in texts if "repeats" in text])


WAITING = """
behavior_model: waiting
variables:
  gate: {domain: [closed, open], initial: closed}
  done: {domain: bool, initial: false}
operations:
  look: {pre: {g: done == true}, post: {g: true}}
environment:
  open: {guard: gate == closed, actions: [gate <- open], every: 35 s}
  close: {guard: gate == open, actions: [gate <- closed], after: 10 s}
goals: {done: done == true}
"""


def test_changes_from_outside_that_repeat_are_one_turn_behind_the_cause() -> None:
    model = read_model(WAITING)
    execution = Tester(model).execute(next(RandomCases(model).first(1, seed=1)))
    assert execution.verdict.end is End.TIME_LIMIT
    found = execution.repetition
    assert found is not None
    assert (found.length, found.turns) == (2, 102)
    lines = [line.plain for line in timeline(model, execution, every=False)]
    assert sum("environment open" in line for line in lines) == 1
    assert any("repeats 102 times" in line for line in lines)
    assert any("unsolvable" in line.plain for line in lines_that_show(model, execution, execution.verdict.failures))


@pytest.mark.parametrize("turns", [FEWEST_TURNS - 1, FEWEST_TURNS])
def test_a_few_turns_are_shown_one_by_one(turns: int) -> None:
    found = _execution(plans=turns + 1).repetition
    assert (found is not None) == (turns >= FEWEST_TURNS)
