"""Which requests of a run are at fault (semantics 7.4)."""

from __future__ import annotations

import pytest

from scbm.files import read_case, read_model
from scbm.testing import Excuse, Tester
from scbm.testing.request_faults import RequestFate, is_at_fault, requests_at_fault

CELL = """
behavior_model: cell
variables:
  stop: {domain: [released, pressed], initial: released}
  done: {domain: bool, initial: false}
resources:
  arm: {simulation: {latency: 4 s}}
operations:
  work:
    deadline: 10 s
    pre: {g: done == false && arm_req_state == initial && arm_req_trigger == false, a: [arm_req_trigger <- true]}
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [done <- true, arm_req_trigger <- false, arm_req_state <- initial]
    failed: {g: arm_req_state == failed, a: [arm_req_trigger <- false, arm_req_state <- initial]}
    timedout: [arm_req_trigger <- false]
automatic_transitions:
  halts: {g: stop == pressed && plan.state == executing, a: [plan.state <- aborted]}
goals: {done: done == true}
"""
MODEL = read_model(CELL)
PRESS = "environment: [{at: 3 s, set: {stop: pressed}}]\n"
LATER = "environment: [{at: 5 s, set: {stop: pressed}}]\n"


@pytest.mark.parametrize(
    ("text", "at_fault"),
    [
        ("", []),
        ("outcomes: {arm: [fail]}\n", [0]),
        ("outcomes: {arm: [timeout]}\n", [0]),
        ("outcomes: {arm: [{after: 12 s}]}\n", []),
        ("outcomes: {arm: [{reply: lost}]}\n", [0]),
        ("outcomes: {arm: [{request: lost}]}\n", [0]),
        (f"outcomes: {{arm: [timeout]}}\n{PRESS}", []),
        (f"outcomes: {{arm: [fail]}}\n{PRESS}", []),
        (f"outcomes: {{arm: [{{reply: lost}}]}}\n{PRESS}", []),
        (f"outcomes: {{arm: [{{reply: lost}}]}}\n{LATER}", [0]),
        (f"outcomes: {{arm: [timeout]}}\n{LATER}", []),
        ("injections: [{name: dies, resource: arm, becomes: dead}]\n", [0]),
        ("injections: [{name: taken, resource: arm, becomes: occupied, hold: 1 s}]\n", []),
    ],
)
def test_a_request_is_at_fault_if_it_failed_was_overdue_or_missed_the_deadline(text: str, at_fault: list[int]) -> None:
    case = read_case(f"case: one\ngoal: done\n{text}", MODEL)
    execution = Tester(MODEL).execute(case)
    found = requests_at_fault(case, execution.trace.records, execution.reactions, ())
    assert list(found)[:1] == at_fault


def test_a_reply_that_comes_after_the_deadline_is_late_and_no_fault() -> None:
    case = read_case("case: one\ngoal: done\noutcomes: {arm: [{after: 12 s}]}\n", MODEL)
    execution = Tester(MODEL).execute(case)
    assert any(record.kind in ("reply_dropped", "request_cancelled") for record in execution.trace.records)
    assert requests_at_fault(case, execution.trace.records, execution.reactions, ()) == ()


def test_of_a_request_at_fault_one_reason_is_enough() -> None:
    assert not is_at_fault(RequestFate())
    assert not is_at_fault(RequestFate(is_unanswered=True))
    assert not is_at_fault(RequestFate(has_timed_out=True))
    assert is_at_fault(RequestFate(is_unanswered=True, has_timed_out=True))
    assert is_at_fault(RequestFate(has_failed=True))
    assert is_at_fault(RequestFate(is_overdue=True))


def test_a_cancelled_request_excuses_nothing() -> None:
    verdict = (
        Tester(MODEL).execute(read_case(f"case: one\ngoal: done\noutcomes: {{arm: [timeout]}}\n{PRESS}", MODEL)).verdict
    )
    assert verdict.excuses == (Excuse.INPUT,)
