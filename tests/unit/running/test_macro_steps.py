"""Macro-steps that are memoized and repeated do what their micro-steps do."""

from __future__ import annotations

import pytest

from scbm.cases.trace import AutomaticTaken, End
from scbm.files import load_model, read_model
from scbm.running import Measured, Program, Runner, RunnerOptions
from scbm.testing import RandomCases, Tester
from support.driving import SECOND_NS, Hand
from support.histories import EXAMPLE


class _MicroStepRunner(Runner):
    """Takes one micro-step after the other, and memoizes no macro-steps."""

    def _take_macro_step(self) -> bool:
        return False


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
