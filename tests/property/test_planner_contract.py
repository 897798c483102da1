"""What every planner of `PLANNERS` keeps, on random models: valid plans, true proofs, and its limits."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.model import BehaviorModel, Predicate, State
from scbm.planning import (
    PLANNERS,
    Answer,
    Limit,
    LimitReached,
    PlanLimits,
    Planner,
    Solved,
    Unsolvable,
    find_flaw,
)
from scbm.planning.plan_search import breadth_first
from support.profiles import examples, share, slow_beyond
from support.random_models import random_model
from support.strategies import planning_models

BUILT_IN = [name for name, entry in PLANNERS.items() if not entry.is_external]


def _states(model: BehaviorModel) -> st.SearchStrategy[State]:
    values = st.tuples(*(st.sampled_from(variable.domain.values) for variable in model.space))
    return values.map(lambda chosen: State(model.space, dict(zip(model.space.names, chosen, strict=True))))


def _breadth_first(planner: Planner, state: State, goal: Predicate, limits: PlanLimits | None = None) -> Answer:
    problem = planner.problem(goal)
    start = problem.task.pack(state)
    return Solved((), 0) if problem.is_goal(start) else breadth_first(problem, start, limits or PlanLimits())


@pytest.mark.parametrize("name", BUILT_IN)
@given(planning_models(), st.data())
@examples(1_000, usual=12)
def test_plans_are_valid_and_a_problem_is_unsolvable_where_the_breadth_first_search_says_so(
    name: str, model: BehaviorModel, data: st.DataObject
) -> None:
    planner = Planner(model, name)
    for state in (model.nominal_state, data.draw(_states(model))):
        for _, goal in model.goals:
            answer, expected = planner.plan(state, goal), _breadth_first(planner, state, goal)
            assert type(answer) is type(expected)
            if isinstance(answer, Solved):
                assert find_flaw(model, state, goal, answer.plan) is None


@pytest.mark.parametrize("name", BUILT_IN)
@given(planning_models(), st.integers(0, 4), st.integers(0, 12))
@examples(300, usual=10)
def test_an_answer_keeps_its_limits(name: str, model: BehaviorModel, length: int, expansions: int) -> None:
    limits = PlanLimits(length, expansions)
    for _, goal in model.goals:
        answer = Planner(model, name).plan(model.nominal_state, goal, limits)
        proof = _breadth_first(Planner(model), model.nominal_state, goal)
        assert answer.expanded <= expansions
        if isinstance(answer, Solved):
            assert len(answer.plan) <= length
        elif isinstance(answer, Unsolvable):
            assert isinstance(proof, Unsolvable)
        else:
            assert isinstance(answer, LimitReached)
            assert answer.limit is not Limit.EXPANSIONS or answer.expanded == expansions


@pytest.mark.parametrize("name", BUILT_IN)
@given(planning_models())
@examples(100, usual=6)
def test_an_answer_does_not_depend_on_earlier_ones(name: str, model: BehaviorModel) -> None:
    asked_often = Planner(model, name)
    for _, goal in [*model.goals, *reversed(model.goals)]:
        assert asked_often.plan(model.nominal_state, goal) == Planner(model, name).plan(model.nominal_state, goal)


@pytest.mark.parametrize("name", BUILT_IN)
@pytest.mark.parametrize("number", slow_beyond(4, range(share(200))))
def test_plans_for_random_cells_are_valid(name: str, number: int) -> None:
    model = random_model(number)
    planner = Planner(model, name)
    limits = PlanLimits(expansions=20_000)
    for _, goal in model.goals:
        answer = planner.plan(model.nominal_state, goal, limits)
        expected = _breadth_first(planner, model.nominal_state, goal, limits)
        if isinstance(answer, Solved):
            assert find_flaw(model, model.nominal_state, goal, answer.plan) is None
        if not isinstance(expected, LimitReached):
            assert type(answer) is type(expected)
