"""Plans that are asked for often: searched for once, and for all states at once when that pays."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.files import load_model
from scbm.planning import PlanCache, PlanLimits, Planner, Solved
from support.models import scan_cell

BEFORE = Path(__file__).parents[3] / "examples" / "robot_in_the_air" / "before.yaml"


def test_what_was_asked_before_is_not_searched_for_again() -> None:
    model = scan_cell()
    remembered = PlanCache(Planner(model))
    goal = model.goals[0][1]
    first = remembered.plan(model.nominal_state, goal)
    assert isinstance(first, Solved)
    assert first.expanded
    assert remembered.plan(model.nominal_state, goal) == replace(first, expanded=0)


def test_behind_its_budget_other_states_are_not_searched_for_either() -> None:
    model = load_model(BEFORE)
    goal = dict(model.goals)["item_a_delivered"]
    states = [model.nominal_state.replace({v.name: value}) for v in model.variables[:4] for value in v.domain.values]
    patient = PlanCache(Planner(model), first_budget=1_000_000)
    hasty = PlanCache(Planner(model), first_budget=100)
    assert 0 < sum(hasty.plan(state, goal).expanded for state in states) < 400
    assert sum(patient.plan(state, goal).expanded for state in states) > 1_000


def test_runs_share_the_plans_that_they_ask_for() -> None:
    """Plans from the first states are searched for one by one, and then distances are computed; all are canonical."""
    model = load_model(BEFORE)
    planner, goal = Planner(model), dict(model.goals)["item_a_delivered"]
    policy = planner.shared_policy(goal, PlanLimits(), 1_000)
    states = [model.nominal_state.replace({v.name: value}) for v in model.variables[:4] for value in v.domain.values]
    first = policy.plan(policy.task.pack(states[0]))
    assert isinstance(first, Solved)
    assert policy.planned == first.expanded
    for state in states:
        answer = policy.plan(policy.task.pack(state))
        assert replace(answer, expanded=0) == replace(planner.plan(state, goal), expanded=0)
    assert policy.planned > 1_000
    assert planner.shared_policy(goal, PlanLimits(), 1_000) is policy
    assert planner.shared_policy(goal, PlanLimits(length=3), 1_000) is not policy
    assert planner.with_goals_of(model).shared_policy(goal, PlanLimits(), 1_000) is not policy


@pytest.mark.parametrize("most", [50, 1_000_000])
def test_in_a_large_world_few_states_are_searched_for_before_it_is_explored(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is explored where a search meets the same limit; whatever finds an answer, it is that of a search."""
    monkeypatch.setattr("scbm.planning.policy._MAX_ON_DEMAND", 10)
    monkeypatch.setattr("scbm.planning.policy._SEARCH_WORK", 400_000)  # so that three searches spend a million
    model = load_model(BEFORE)
    planner, goal, limits = Planner(model), dict(model.goals)["item_a_delivered"], PlanLimits(expansions=most)
    policy = planner.policy(goal, limits, whole=0)
    values = [(v.name, value) for v in model.variables[:4] for value in v.domain.values]
    states = {policy.task.pack(each): each for each in (model.nominal_state.replace({n: v}) for n, v in values)}
    planned = []
    for packed, state in states.items():
        answer = policy.plan(packed)
        assert replace(answer, expanded=0) == replace(planner.plan(state, goal, limits), expanded=0)
        planned.append(policy.planned)
    explored_from_the_fourth = planned[3] - planned[2] > 5_000
    assert explored_from_the_fourth == (most > 50)
    assert planned[2] < 5_000
