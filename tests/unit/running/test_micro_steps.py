"""The order of micro-steps is written down once, and memoized macro-steps do the same."""

from __future__ import annotations

import pytest

from scbm.cases.injections import CONDITIONS, Condition, Injection
from scbm.cases.trace import (
    AutomaticTaken,
    End,
    PlanReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
)
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, Constant, Equal, Reference
from scbm.running import Measured, Program, Runner, RunnerOptions
from scbm.testing import RandomCases, Tester
from support.driving import SECOND_NS, Hand
from support.histories import EXAMPLE
from support.models import scan_cell

WAVE = "  wave: {pre: {g: true}, post: {g: true, a: [count <- 2]}}\nautomatic_transitions:"


def with_automatic(*transitions: str, more: tuple[tuple[str, str], ...] = ()) -> BehaviorModel:
    lines = "".join(f"  {transition}\n" for transition in transitions)
    return scan_cell(("automatic_transitions:\n", f"automatic_transitions:\n{lines}"), *more)


def holds(name: str, value: str | int) -> Equal:
    return Equal(Reference(name), Constant(value))


# the rest of a plan


def test_the_rest_of_a_plan_is_dropped_when_an_operation_fails() -> None:
    hand = Hand(scan_cell(("automatic_transitions:", WAVE)), plans=[("scan_box", "wave"), ("scan_box",)])
    hand.goal()
    hand.reply(1, 1, succeeded=False)
    assert hand.lifecycle == ["scan_box executing", "scan_box failed by scan_failed", "scan_box executing"]


def test_the_rest_of_a_plan_is_dropped_when_an_operation_times_out() -> None:
    hand = Hand(scan_cell(("automatic_transitions:", WAVE)), plans=[("scan_box", "wave"), ("scan_box",)])
    hand.goal()
    hand.wait(10)
    assert hand.lifecycle == ["scan_box executing", "scan_box timedout", "scan_box executing"]


def test_the_rest_of_a_plan_is_kept_when_an_operation_completes() -> None:
    model = scan_cell(("automatic_transitions:", WAVE), ("scanned: box_is_scanned == true", "scanned: count == 2"))
    hand = Hand(model, plans=[("scan_box", "wave")])
    hand.goal()
    hand.reply(1, 1)
    assert hand.lifecycle[1:] == ["scan_box completed", "wave executing", "wave completed"]
    assert hand.ends == [End.REACHED]


# at the moment of a deadline


def test_failed_comes_before_timedout_at_the_moment_of_the_deadline() -> None:
    failed = "    timedout: [scan_req_trigger <- false]\n    failed: {g: light == red}\n"
    hand = Hand(scan_cell(("    timedout: [scan_req_trigger <- false]\n", failed)))
    hand.inject(Injection("breaks", (("light", "red"),), at_ns=10 * SECOND_NS))
    hand.goal()
    hand.wait(10)
    assert hand.lifecycle[:2] == ["scan_box executing", "scan_box failed"]


def test_an_operation_that_is_enabled_at_its_disabled_deadline_executes() -> None:
    model = scan_cell(("    deadline: 10 seconds\n", "    deadline: 10 seconds\n    disabled_deadline: 2 s\n"))
    hand = Hand(model, state={"light": "red"})
    hand.inject(Injection("enables", (("light", "green"),), at_ns=2 * SECOND_NS))
    hand.goal()
    hand.wait(2)
    assert hand.lifecycle == ["scan_box disabled", "scan_box executing"]
    assert len([record for record in hand.records if isinstance(record, PlanReceived)]) == 1


# injections


def test_an_injection_comes_before_an_automatic_transition() -> None:
    published = ("measures: [temperature]", "publishes: [temperature]")
    hand = Hand(with_automatic("warm: {g: temperature == 9 && count == 0, a: [count <- 1]}", more=(published,)))
    hand.inject(Injection("hot", (("count", 2),), when=holds("temperature", 9)))
    hand.give(Measured((("temperature", 9),)), 1)
    assert hand.runner.state["count"] == 2
    assert not [record for record in hand.records if isinstance(record, AutomaticTaken)]


def test_what_is_put_back_is_put_back_before_an_injection_of_that_moment() -> None:
    hand = Hand(scan_cell())
    hand.inject(Injection("held", (("count", 2),), hold_ns=SECOND_NS))
    hand.inject(Injection("too_late", (("light", "red"),), when=holds("count", 2), at_ns=SECOND_NS))
    hand.wait(1)
    assert (hand.runner.state["count"], hand.runner.state["light"]) == (0, "green")


def test_a_condition_is_reported_when_it_begins_and_when_it_ends_and_not_once_more() -> None:
    """`first` ends while `second` decides, so its end changes nothing."""
    hand = Hand(scan_cell())
    dead, busy = Condition(CONDITIONS["dead"]), Condition(CONDITIONS["occupied"])
    hand.inject(Injection("first", resource="scan", condition=dead, at_ns=0, hold_ns=2 * SECOND_NS))
    hand.inject(Injection("second", resource="scan", condition=busy, at_ns=SECOND_NS, hold_ns=4 * SECOND_NS))
    for seconds in range(7):
        hand.wait(seconds)
    changed = [record for record in hand.records if isinstance(record, ResourceChanged)]
    assert [(record.at_ns // SECOND_NS, record.injection, record.condition) for record in changed] == [
        (0, "first", str(dead)),
        (1, "second", str(busy)),
        (5, "second", str(Condition())),
    ]


# automatic transitions, aborts, requests


def test_an_automatic_transition_comes_before_the_end_of_an_aborted_run() -> None:
    tidies = "tidies: {g: plan.state == aborted && current.name == scan_box, a: [count <- 1]}"
    hand = Hand(with_automatic(tidies))
    hand.goal()
    hand.inject(Injection("aborts", (("plan.state", "aborted"),)), 1)
    assert (hand.ends, hand.runner.state["count"]) == ([End.ABORTED], 1)


def test_a_request_is_sent_before_another_one_is_cancelled() -> None:
    cell = scan_cell(("resources:\n", "resources:\n  lamp: {}\n"), ("gr: light != red", "gr: light == red"))
    hand = Hand(cell, state={"lamp_req_trigger": True})
    hand.goal()
    hand.inject(Injection("swaps", (("lamp_req_trigger", False), ("scan_req_trigger", True))), 2)
    records = [record for record in hand.records if isinstance(record, RequestSent | RequestCancelled)]
    assert [(type(record), record.resource) for record in records] == [
        (RequestSent, "lamp"),
        (RequestSent, "scan"),
        (RequestCancelled, "lamp"),
    ]


class _MicroStepRunner(Runner):
    """Takes one micro-step after the other, and memoizes no macro-steps."""

    def _take_macro_step(self) -> bool:
        return False


@pytest.mark.longer
@pytest.mark.parametrize("name", ["before", "after"])
def test_a_campaign_gives_the_traces_that_micro_steps_give(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = load_model(EXAMPLE / f"{name}.yaml")
    cases = list(RandomCases(model).first(60, 1))
    tester = Tester(model)
    traces = [tester.execute(case).trace for case in cases]
    monkeypatch.setattr("scbm.running.simulation.simulator.Runner", _MicroStepRunner)
    tester = Tester(model)
    assert [tester.execute(case).trace for case in cases] == traces


CELL = """
behavior_model: cell
variables:
  level: {domain: 0..9, initial: 0, source: input}
  seen: {domain: bool, initial: false}
  lamp: {domain: [dark, lit], initial: dark}
  full: {domain: bool, initial: false}
operations:
  fill:
    deadline: 10 s
    pre: {g: full == false}
    post: {g: true, gr: level == 9, a: [full <- true]}
automatic_transitions:
  see: {g: level == 1 && seen == false, a: [seen <- true]}
  light: {g: level == 2 && lamp == dark, a: [lamp <- lit]}
  darken: {g: level == 2 && lamp == lit, a: [lamp <- dark]}
goals:
  full: full == true
"""


def test_a_step_that_is_repeated_at_another_time_does_not_change_the_deadline() -> None:
    program = Program(read_model(CELL))
    for seconds in (3, 5):
        hand = Hand(program)
        hand.goal("full")
        hand.give(Measured((("level", 1),)), seconds)
        assert hand.runner.state["seen"] is True
        assert hand.runner.deadline_ns == 10 * SECOND_NS


@pytest.mark.parametrize("bound", [10, 50, 51, 120])
def test_a_livelock_ends_after_as_many_transitions_when_it_is_repeated(bound: int) -> None:
    program = Program(read_model(CELL))
    for _ in range(2):
        hand = Hand(program, RunnerOptions(livelock_bound=bound))
        hand.goal("full")
        hand.give(Measured((("level", 2),)), 1)
        assert hand.ends == [End.LIVELOCK]
        before = len([record for record in hand.records if isinstance(record, AutomaticTaken)])
        assert before == 2 * bound  # as many again follow the end


def test_equal_queues_are_one_object_so_that_macro_steps_repeat() -> None:
    program = Program(read_model(CELL))
    queue = program.queue(("fill", "fill"))
    assert [operation.name for operation in queue] == ["fill", "fill"]
    assert program.queue(("fill", "fill")) is queue
    assert program.queue(("fill",)) is queue.rest
