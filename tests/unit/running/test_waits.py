"""Injections that never act or act later, and waits of unsolvable runs (semantics 5.6, 7.2)."""

from __future__ import annotations

import pytest

from scbm.cases import Case, Condition, ConditionKind, Injection
from scbm.cases.trace import (
    AutomaticTaken,
    End,
    InjectionApplied,
    PlanAsked,
    RunEnded,
    RunnerStarted,
    RunStarted,
    Trace,
    write_trace,
)
from scbm.files import parse_predicate, read_model
from scbm.files.language.scope import Scope, Where
from scbm.model import BehaviorModel, Predicate
from scbm.running import GoalGiven, Measured, RunnerOptions, TimePassed
from scbm.running.simulation import Choices, PlainReactions, Simulated, Simulator
from support.driving import SECOND_NS, Hand
from support.models import scan_cell

FADE = ("automatic_transitions:", "automatic_transitions:\n  fade: {g: light == blue, a: [light <- green]}")

STUCK = """\
behavior_model: stuck
variables:
  gate: {domain: [open, closed], initial: closed, source: input}
  lamp: {domain: [dark, lit], initial: dark, source: input}
  there: {domain: bool, initial: false}
operations:
  go:
    pre: {g: there == false && gate == open, a: []}
    post: {g: "true", a: [there <- true]}
automatic_transitions:
  shine: {g: lamp == lit && there == true, a: [lamp <- dark]}
goals:
  there: there == true
"""


def predicate(text: str, model: BehaviorModel) -> Predicate:
    return parse_predicate(text, Scope.of(model), Where.GUARD)


def simulated(model: BehaviorModel, *injections: Injection, **initial: object) -> Simulated:
    goal, wanted = model.goals[0]
    case = Case("case", goal, wanted, model.nominal_state.replace(initial), injections=injections)  # type: ignore[arg-type]  # values of the model
    return Simulator(model).run(case, Choices(PlainReactions()))


def text_of(run: Simulated) -> str:
    return write_trace(Trace("model", "case", run.records))


def never_acting(model: BehaviorModel) -> list[Injection]:
    never = predicate("plan.state == unsolvable && plan.state == executing", model)
    values = (("light", "red"),) if "light" in model.space else (("lamp", "lit"),)
    return [
        Injection("late", values, at_ns=10_000 * SECOND_NS),
        Injection("never", values, never),
        Injection("never_later", values, never, at_ns=SECOND_NS),
        Injection("never_after", values, never, after_ns=SECOND_NS),
        Injection("never_held", values, never, hold_ns=SECOND_NS),
    ]


@pytest.mark.parametrize("index", range(5))
@pytest.mark.parametrize("state", [{}, {"light": "blue"}, {"box_is_scanned": True}])
def test_an_injection_that_never_acts_changes_nothing(index: int, state: dict[str, str]) -> None:
    model = scan_cell(FADE)
    injection = never_acting(model)[index]
    assert text_of(simulated(model, injection, **state)) == text_of(simulated(model, **state))


@pytest.mark.parametrize("index", range(1, 5))
def test_an_unsolvable_run_does_not_wait_for_an_injection_that_never_acts(index: int) -> None:
    model = read_model(STUCK)
    run = simulated(model, never_acting(model)[index])
    assert (run.end, run.ended_ns) == (End.UNSOLVABLE, 0)
    assert text_of(run) == text_of(simulated(model))


def test_automatic_transitions_of_the_initial_state_come_before_the_goal_though_a_later_injection_exists() -> None:
    hand = Hand(scan_cell(FADE), state={"light": "blue"})
    hand.inject(Injection("later", (("light", "red"),), at_ns=SECOND_NS))
    hand.goal()
    assert [type(record) for record in hand.records[:3]] == [RunnerStarted, AutomaticTaken, RunStarted]


def test_injections_that_are_given_are_no_events_of_the_run() -> None:
    hand = Hand(scan_cell(), RunnerOptions(instant_bound=3))
    for number in range(5):
        hand.inject(Injection(f"later{number}", (("count", 1),), at_ns=SECOND_NS))
    hand.goal()
    assert (hand.ends, hand.lifecycle) == ([], ["scan_box executing"])


# after


def test_an_injection_acts_some_time_after_its_predicate_became_true() -> None:
    model = scan_cell()
    hand = Hand(model)
    executing = predicate("scan_box.state == executing", model)
    hand.inject(Injection("dim", (("light", "red"),), executing, after_ns=SECOND_NS))
    hand.goal()
    assert hand.runner.deadline_ns == SECOND_NS
    hand.wait_for_deadline()
    assert [(r.at_ns, r.injection) for r in hand.records if isinstance(r, InjectionApplied)] == [(SECOND_NS, "dim")]


def test_without_time_it_acts_at_the_moment_at_which_its_predicate_becomes_true() -> None:
    model = scan_cell()
    hand = Hand(model)
    current = predicate("current.name == scan_box && scan_box.state == initial", model)
    hand.inject(Injection("dim", (("light", "red"),), current, after_ns=0))
    hand.goal()
    assert hand.lifecycle == ["scan_box disabled"]


def test_it_acts_then_though_the_predicate_is_false_again() -> None:
    model = scan_cell()
    hand = Hand(model)
    hand.inject(Injection("red", (("light", "red"),), predicate("plan.state == idle", model), after_ns=1000))
    hand.goal()
    hand.wait_for_deadline()
    acted = [record for record in hand.records if isinstance(record, InjectionApplied)]
    assert [record.at_ns for record in acted] == [1000]


def test_the_time_begins_no_earlier_than_at() -> None:
    model = scan_cell()
    hand = Hand(model)
    executing = predicate("scan_box.state == executing", model)
    injection = Injection("red", (("light", "red"),), executing, at_ns=2 * SECOND_NS, after_ns=SECOND_NS)
    hand.inject(injection)
    hand.goal()
    assert hand.runner.deadline_ns == 2 * SECOND_NS
    hand.wait_for_deadline()
    assert hand.runner.deadline_ns == 3 * SECOND_NS
    hand.wait_for_deadline()
    assert any(isinstance(record, InjectionApplied) for record in hand.records)


def test_an_operation_that_no_longer_executes_is_not_failed() -> None:
    model = scan_cell()
    executing = predicate("scan_box.state == executing", model)
    fail = Injection("fail", (("current.state", "failed"),), executing, after_ns=5 * SECOND_NS)
    assert not any(isinstance(record, InjectionApplied) for record in simulated(model, fail).records)


# waits


def test_an_unsolvable_run_waits_for_an_injection_that_acts_and_reaches_its_goal() -> None:
    model = read_model(STUCK)
    run = simulated(model, Injection("opens", (("gate", "open"),), at_ns=5 * SECOND_NS))
    assert (run.end, run.ended_ns) == (End.REACHED, 5 * SECOND_NS)
    lit = predicate("lamp == lit", model)
    later = simulated(
        model,
        Injection("light", (("lamp", "lit"),), at_ns=SECOND_NS),
        Injection("opens", (("gate", "open"),), lit, after_ns=SECOND_NS),
    )
    assert (later.end, later.ended_ns) == (End.REACHED, 2 * SECOND_NS)


def test_a_goal_whose_predicate_does_not_hold_begins_later_or_not_at_all() -> None:
    model = read_model(STUCK)
    opened = predicate("gate == open", model)
    hand = Hand(model)
    hand.give(GoalGiven("there", model.goals[0][1], when=opened))
    assert hand.ends == [End.NOT_STARTED]  # nothing is pending that could open the gate
    waiting = Hand(model, RunnerOptions(time_limit_ns=5 * SECOND_NS))
    waiting.inject(Injection("opens", (("gate", "open"),), at_ns=3 * SECOND_NS))
    waiting.give(GoalGiven("there", model.goals[0][1], when=opened))
    assert (waiting.ends, waiting.runner.deadline_ns) == ([], 3 * SECOND_NS)
    waiting.wait_for_deadline()
    assert waiting.ends == [End.REACHED]


def test_it_waits_until_a_held_injection_is_put_back() -> None:
    model = read_model(STUCK)
    held = Injection("closes", (("gate", "closed"),), hold_ns=3 * SECOND_NS)
    run = simulated(model, held, gate="open")
    assert (run.end, run.ended_ns) == (End.REACHED, 3 * SECOND_NS)


def test_only_a_variable_that_the_planner_reads_asks_for_a_new_plan() -> None:
    hand = Hand(read_model(STUCK), RunnerOptions(awaits_measurements=True))
    hand.goal("there")
    hand.give(Measured((("lamp", "lit"),)), 1)
    assert sum(isinstance(record, PlanAsked) for record in hand.records) == 1
    hand.give(Measured((("gate", "open"),)), 2)
    assert sum(isinstance(record, PlanAsked) for record in hand.records) == 2
    assert hand.ends == [End.REACHED]


def test_a_run_that_had_a_plan_in_between_asks_again_in_a_state_without_plan() -> None:
    stuck = STUCK.replace("pre: {g", "deadline: 1 s\n    pre: {g").replace('g: "true",', "g: true, gr: lamp == lit,")
    hand = Hand(read_model(stuck), RunnerOptions(awaits_measurements=True))
    hand.goal("there")
    hand.give(Measured((("gate", "open"),)), 1)
    hand.give(Measured((("gate", "closed"),)), 1.5)
    hand.wait(2)
    assert hand.lifecycle == ["go executing", "go timedout"]
    assert [record.at_ns / SECOND_NS for record in hand.records if isinstance(record, PlanAsked)] == [0, 1, 2]
    assert hand.runner.state["plan.state"] == "planning"


def test_plans_of_a_wait_do_not_count_towards_the_limit() -> None:
    model = read_model(STUCK.replace("gate == open, a: []", "gate == open && lamp == lit"))
    hand = Hand(model, RunnerOptions(awaits_measurements=True, plan_limit=2))
    hand.goal("there")
    for second in range(1, 11):
        hand.give(Measured((("gate", "open" if second % 2 else "closed"),)), second)
    assert sum(isinstance(record, PlanAsked) for record in hand.records) == 11
    assert hand.ends == []
    hand.give(Measured((("gate", "open"), ("lamp", "lit"))), 11)
    assert hand.ends == [End.REACHED]


# one rule for all ends

ENDS = """\
behavior_model: ends
variables:
  step: {domain: 0..3, initial: 0}
  mode: {domain: [work, spin, stop, fault, stuck], initial: work, random: any}
  tidy: {domain: bool, initial: false}
  closed: {domain: bool, initial: false}
resources:
  arm: {}
operations:
  move:
    deadline: 2 s
    pre: {g: step == 0 && mode != stuck, ar: [arm_req_trigger <- true]}
    post: {g: "true", gr: arm_req_state == succeeded, a: [step <- 3]}
    timedout: [step -= 1]
automatic_transitions:
  halt: {g: mode == stop && move.state == executing && arm_req_state == executing, a: [plan.state <- aborted]}
  spin: {g: mode == spin && move.state == executing && tidy == false, a: [tidy <- true]}
  unspin: {g: mode == spin && move.state == executing && tidy == true, a: [tidy <- false]}
  close:
    g: plan.state in {completed, unsolvable, aborted} && closed == false && current.name == none
    a: [closed <- true, arm_req_trigger <- true]
goals:
  moved: step == 3
"""


@pytest.mark.parametrize(
    ("end", "mode", "options"),
    [
        (End.UNSOLVABLE, "stuck", RunnerOptions()),
        (End.ABORTED, "stop", RunnerOptions()),
        (End.TIME_LIMIT, "work", RunnerOptions(time_limit_ns=SECOND_NS)),
        (End.LIVELOCK, "spin", RunnerOptions(livelock_bound=10)),
        (End.REPLAN_LIMIT, "work", RunnerOptions(plan_limit=0)),
        (End.LIVELOCK, "work", RunnerOptions(instant_bound=1)),
        (End.MODEL_ERROR, "work", RunnerOptions()),
    ],
)
def test_after_every_end_automatic_transitions_follow_and_nothing_is_sent(
    end: End, mode: str, options: RunnerOptions
) -> None:
    hand = Hand(read_model(ENDS), options, {"mode": mode})
    hand.goal("moved")
    if not hand.ends:
        hand.wait_for_deadline()
    assert hand.ends == [end]
    index = next(i for i, record in enumerate(hand.records) if isinstance(record, RunEnded))
    after = [r.transition for r in hand.records[index:] if isinstance(r, AutomaticTaken)]
    assert after == ["close"]
    assert len(hand.cancelled) == len(hand.sent)
    state = hand.runner.state
    assert (state["closed"], state["arm_req_state"], state["move.state"]) == (True, "initial", "initial")
    sent = len(hand.sent)
    hand.give(TimePassed(), 100)
    assert len(hand.sent) == sent


def test_a_condition_of_a_resource_that_never_changes_is_no_change_either() -> None:
    model = scan_cell()
    never = predicate("light == red", model)
    dead = Injection("dead", (), never, resource="scan", condition=Condition(ConditionKind.DEAD))
    assert text_of(simulated(model, dead)) == text_of(simulated(model))
