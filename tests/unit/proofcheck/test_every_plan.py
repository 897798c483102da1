"""The plans of the checker from every state of small models, compared with those of the planner of runs."""

from __future__ import annotations

from itertools import product

import pytest

from scbm.files import read_model
from scbm.model import BehaviorModel, PlanSet, Value
from scbm.planning import Planner, Solved
from scbm.proofcheck.checker_planner import (
    CanonicalPlanner,
    CheckedPlans,
    NoPlanExists,
    PlanFound,
    PlannedStates,
    PlanningLimitReached,
    PlansFound,
    plans_of,
)

DELIVERY = """
behavior_model: delivery
variables:
  at: {domain: [depot, road, shop], initial: depot}
  load: {domain: 0..2, initial: 0}
  order: {domain: 0..2, initial: 2}
  weather: {domain: [dry, wet], initial: dry}
resources: {van: {}}
operations:
  fill:
    pre: {g: at == depot, gr: weather == dry, a: [van_req_trigger <- true]}
    post: {g: true, a: [load += 1, van_req_trigger <- false]}
  fill_all: {pre: {g: at == depot && load == 0}, post: {g: true, a: [load <- order]}}
  leave: {pre: {g: at == depot, a: [at <- road]}, post: {g: at == road && load > 0, ar: [weather <- wet]}}
  arrive: {pre: {g: at == road}, post: {g: true, a: [at <- shop]}}
  shortcut: {pre: {g: at == depot && load == 1}, post: {g: true, a: [at <- shop]}}
  go_back: {pre: {g: at == shop}, post: {g: true, a: [at <- depot, load <- 0]}}
goals:
  delivered: at == shop && load == order
  emptied: at == depot && load == 0
  wet: weather == wet
"""
"""Plans count in `load` and copy `order`. `leave` needs `load > 0` after its start. No plan makes it wet."""

TWINS = """
behavior_model: twins
variables:
  box: {domain: [shelf, left, right, table, lost], initial: shelf}
operations:
  pick_right: {pre: {g: box == shelf}, post: {g: true, a: [box <- right]}}
  pick_left: {pre: {g: box == shelf}, post: {g: true, a: [box <- left]}}
  place_left: {pre: {g: box == left}, post: {g: true, a: [box <- table]}}
  place_right: {pre: {g: box == right}, post: {g: true, a: [box <- table]}}
  drop: {pre: {g: box != shelf && box != lost}, post: {g: true, a: [box <- lost]}}
  swap: {pre: {g: box == left}, post: {g: true, a: [box <- right]}}
goals: {served: box == table}
"""

CASES = [(text, goal) for text in (DELIVERY, TWINS) for goal, _ in read_model(text).goals]


def states(model: BehaviorModel) -> list[dict[str, Value]]:
    """All states of the declared variables; those of resources are at rest."""
    declared = [variable.name for variable in model.variables]
    choices = [v.domain.values if v.name in declared else (v.initial,) for v in model.space]
    return [dict(zip(model.space.names, values, strict=True)) for values in product(*choices)]


@pytest.mark.parametrize(("text", "goal"), CASES)
def test_canonical_plans_are_those_of_the_planner_of_runs(text: str, goal: str) -> None:
    model = read_model(text)
    predicate, planner = dict(model.goals)[goal], Planner(model)
    for order in (states(model), states(model)[::-1]):  # answers are memoized on the way
        checker = CanonicalPlanner(model, predicate)
        for state in order:
            expected = planner.plan(state, predicate)
            assert checker.plan(state) == (PlanFound(expected.plan) if isinstance(expected, Solved) else NoPlanExists())


@pytest.mark.parametrize(("text", "goal"), CASES)
def test_any_plans_go_on_where_the_goal_can_be_reached(text: str, goal: str) -> None:
    model = read_model(text)
    predicate, planner = dict(model.goals)[goal], Planner(model)

    def has_plan(state: dict[str, Value]) -> bool:
        return isinstance(planner.plan(state, predicate), Solved)

    for order in (states(model), states(model)[::-1]):
        plans, steps = plans_of(PlanSet.ANY, model, predicate), PlannedStates(model, predicate)
        for state in order:
            start = steps.start(state)
            assert plans.answer(state) == (PlansFound(start) if has_plan(state) else NoPlanExists())
            expected: list[tuple[object, object]] = [
                (operation, after)
                for operation, after in steps.successors(start)
                if has_plan({**state, **dict(zip(steps.names, after, strict=True))})
            ]
            assert list(plans.following(start)) == expected + [(None, None)] * steps.is_goal(start)


CHAIN = """
behavior_model: chain
variables:
  at: {domain: 0..3, initial: 0}
operations:
  go: {pre: {g: at < 3}, post: {g: true, a: [at += 1]}}
goals: {end: at == 3}
"""


@pytest.mark.parametrize(("plan_set", "states"), [(PlanSet.CANONICAL, 3), (PlanSet.ANY, 4)])
def test_nothing_is_known_beyond_the_limit_of_states(
    plan_set: PlanSet, states: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A search for the canonical plan ends at the goal state, before that state counts."""
    model = read_model(CHAIN)
    for most, expected in ((states, PlansFound), (states - 1, PlanningLimitReached)):
        monkeypatch.setattr("scbm.proofcheck.checker_planner.MAX_PLANNING_STATES", most)
        plans = plans_of(plan_set, model, model.goals[0][1])
        assert isinstance(plans.answer(model.nominal_state), expected)


def test_plans_depend_on_a_variable_that_an_operation_counts_in() -> None:
    model = read_model(
        CHAIN.replace("at < 3", "true")
        .replace("goals: {end: at == 3}", "  wait: {pre: {g: true}, post: {g: true}}\ngoals: {end: other == on}")
        .replace("  at:", "  other: {domain: [off, on], initial: off}\n  at:")
    )
    assert PlannedStates(model, model.goals[0][1]).names == ("other", "at")


@pytest.mark.parametrize("plan_set", PlanSet)
def test_every_operation_of_a_plan_is_queued_once(plan_set: PlanSet) -> None:
    model = read_model(TWINS)
    plans = plans_of(plan_set, model, model.goals[0][1])
    assert (
        queued(plans, model, "shelf")
        == {
            PlanSet.CANONICAL: ["pick_right", "place_right"],
            PlanSet.ANY: ["pick_left", "pick_right", "place_left", "place_right", "swap"],
        }[plan_set]
    )
    if plan_set is not PlanSet.CANONICAL:
        assert queued(plans, model, "shelf") == []


def queued(plans: CheckedPlans, model: BehaviorModel, box: str) -> list[str]:
    answer = plans.answer({**model.nominal_state, "box": box})
    assert isinstance(answer, PlansFound)
    return sorted(dict.fromkeys(plans.queued(answer.queue)))
