"""Drawn plans of small models by hand: how often each comes, and what limits do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from random import Random

import pytest

from scbm.cases import RecordedPlan
from scbm.files import read_model
from scbm.model import BehaviorModel, Predicate
from scbm.planning import (
    Answer,
    DrawnPlans,
    Limit,
    LimitReached,
    PlanCache,
    PlanLimits,
    Planner,
    PreferredPlans,
    ShortestPlans,
    Solved,
    Unsolvable,
)

# Two of three robots can serve at once; the third one needs a step more.
ROBOTS = """
behavior_model: robots
variables:
  box: {domain: [shelf, held_1, held_2, held_3, turned, table], initial: shelf}
  door: {domain: [open, closed], initial: closed}
operations:
  open_door: {pre: {g: door == closed}, post: {g: true, a: [door <- open]}}
  pick_1: {pre: {g: box == shelf}, post: {g: true, a: [box <- held_1]}}
  pick_2: {pre: {g: box == shelf}, post: {g: true, a: [box <- held_2]}}
  pick_3: {pre: {g: box == shelf}, post: {g: true, a: [box <- held_3]}}
  turn_3: {pre: {g: box == held_3}, post: {g: true, a: [box <- turned]}}
  place: {pre: {g: box == held_1 || box == held_2 || box == turned}, post: {g: true, a: [box <- table]}}
goals:
  served: box == table
  nothing: box == shelf
  both: box == table && door == open
  impossible: box == shelf && box == table
"""
MODEL = read_model(ROBOTS)


def _shortest(model: BehaviorModel = MODEL) -> ShortestPlans:
    planner = Planner(model)
    return ShortestPlans(planner, PlanCache(planner))


def _drawn(goal: str, count: int, limits: PlanLimits | None = None) -> list[object]:
    shortest, predicate = _shortest(), MODEL.goal(goal)
    assert predicate is not None
    state = MODEL.nominal_state
    answers = (
        DrawnPlans(shortest, Random(f"draw {n}").random).plan(state, predicate, limits or PlanLimits())
        for n in range(count)
    )
    return [answer.plan if isinstance(answer, Solved) else answer for answer in answers]


def test_operations_that_begin_shortest_plans_come_equally_often() -> None:
    counts = Counter(_drawn("served", 2_000))
    assert sorted(map(str, counts)) == ["('pick_1', 'place')", "('pick_2', 'place')"]
    assert all(900 < count < 1_100 for count in counts.values())


@pytest.mark.longer
def test_each_operation_is_drawn_among_those_that_are_left_and_not_each_plan() -> None:
    # Six plans; one in three begins with the door, and then each robot has one in two.
    counts = Counter(_drawn("both", 3_000))
    assert len(counts) == 6
    by_door = {plan: count for plan, count in counts.items() if isinstance(plan, tuple) and plan[0] == "open_door"}
    assert len(by_door) == 2
    assert all(430 < count < 570 for count in by_door.values())
    assert 1_900 < sum(counts.values()) - sum(by_door.values()) < 2_100


def test_a_goal_that_holds_has_the_empty_plan() -> None:
    assert _drawn("nothing", 3) == [()] * 3


def test_a_goal_that_cannot_be_reached_stays_unsolvable() -> None:
    assert all(isinstance(answer, Unsolvable) for answer in _drawn("impossible", 3))


def test_the_limits_are_those_of_the_planner() -> None:
    (answer,) = _drawn("both", 1, PlanLimits(length=2))
    assert isinstance(answer, LimitReached)
    assert answer.limit is Limit.LENGTH
    assert all(isinstance(plan, tuple) and len(plan) == 3 for plan in _drawn("both", 20, PlanLimits(length=3)))


class _Exhausted(PlanCache):
    """Answers the questions of runs, and reaches a limit wherever a plan is to be no longer than another one."""

    def packed_plan(
        self, start: int, goal: Predicate, limits: PlanLimits, should_continue: Callable[[], bool] = lambda: True
    ) -> Answer:
        if limits != PlanLimits():
            return LimitReached(Limit.EXPANSIONS, 0)
        return super().packed_plan(start, goal, limits, should_continue)


def test_an_operation_is_left_out_if_the_planner_does_not_find_how_far_the_goal_is_then() -> None:
    planner = Planner(MODEL)
    shortest = ShortestPlans(planner, _Exhausted(planner))
    served = MODEL.goal("served")
    assert served is not None
    for number in range(20):
        answer = DrawnPlans(shortest, Random(number).random).plan(MODEL.nominal_state, served)
        assert isinstance(answer, Solved)
        assert answer.plan == ("pick_1", "place")


@pytest.mark.parametrize("may_be_longer", [False, True])
def test_preferred_plans_are_used_where_they_are_shortest_ones_or_any(*, may_be_longer: bool) -> None:
    served = MODEL.goal("served")
    assert served is not None
    state = MODEL.nominal_state
    preferred = [
        RecordedPlan("solved", ("pick_2", "place")),
        RecordedPlan("solved", ("pick_3", "turn_3", "place")),  # valid, and too long
        RecordedPlan("solved", ("place", "pick_2")),  # as short, and not valid
        RecordedPlan("unsolvable"),
    ]
    plans = PreferredPlans(_shortest(), preferred, may_be_longer=may_be_longer)
    answers = [plans.plan(state, served) for _ in range(5)]
    found = [answer.plan for answer in answers if isinstance(answer, Solved)]
    second = ("pick_3", "turn_3", "place") if may_be_longer else ("pick_1", "place")
    assert found == [("pick_2", "place"), second, *[("pick_1", "place")] * 3]
