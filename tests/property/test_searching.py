"""Every engine of the search for canonical plans, against the slow reference and the breadth-first search."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.model import BehaviorModel
from scbm.planning import Answer, LimitReached, PlanLimits, Planner, Solved, Unsolvable
from scbm.planning.plan_search import SEARCHES, breadth_first, search_plan
from scbm.planning.planning_task import Problem
from scbm.planning.searches import array_search
from support.profiles import examples, share, slow_beyond
from support.random_models import random_model
from support.reference import canonical_plan
from support.strategies import planning_models

FROM_BOTH_ENDS = "arrays from both ends"
EACH_ENGINE = pytest.mark.parametrize("engine", [*SEARCHES, FROM_BOTH_ENDS])


def _search(problem: Problem, start: int, limits: PlanLimits, engine: str) -> Answer:
    """The answer of an engine; a search from both ends starts at once from both of them."""
    if engine != FROM_BOTH_ENDS:
        return search_plan(problem, start, limits, engine=engine)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(array_search, "PERIMETER_AFTER", 0)
        return search_plan(problem, start, limits, engine="arrays")


def _answers(model: BehaviorModel, engine: str, limits: PlanLimits) -> list[tuple[Answer, Answer]]:
    """The answers of the breadth-first search and of an engine, for each goal that does not hold already."""
    planner = Planner(model)
    found = []
    for _, goal in model.goals:
        problem = planner.problem(goal)
        start = problem.task.pack(model.nominal_state)
        if not problem.is_goal(start):
            plain = breadth_first(problem, start, limits)
            found.append((plain, _search(problem, start, limits, engine)))
    return found


def _without_effort(answer: Answer) -> Answer:
    return replace(answer, expanded=0)


@EACH_ENGINE
@given(planning_models(8))
@examples(300, usual=6)
def test_the_plan_of_each_engine_is_the_canonical_one_of_the_reference(engine: str, model: BehaviorModel) -> None:
    planner = Planner(model)
    for _, goal in model.goals:
        problem = planner.problem(goal)
        answer = _search(problem, problem.task.pack(model.nominal_state), PlanLimits(), engine)
        expected = canonical_plan(model, model.nominal_state, goal, most=1_000)
        if expected is None:
            assert isinstance(answer, Unsolvable)
        else:
            assert isinstance(answer, Solved)
            assert answer.plan == expected


@EACH_ENGINE
@pytest.mark.parametrize("number", slow_beyond(2, range(share(60))))
def test_each_engine_answers_as_the_breadth_first_search_on_realistic_cells(engine: str, number: int) -> None:
    for expected, answer in _answers(random_model(number), engine, PlanLimits()):
        assert _without_effort(answer) == _without_effort(expected)


@pytest.mark.parametrize("engine", ["dense", "arrays", FROM_BOTH_ENDS])
@given(planning_models(8), st.integers(0, 6), st.sampled_from([0, 1, 2, 5, 20, 1_000]))
@examples(300, usual=6)
def test_where_the_breadth_first_search_decides_within_limits_so_does_each_engine(
    engine: str, model: BehaviorModel, length: int, expansions: int
) -> None:
    limits = PlanLimits(length, expansions)
    for expected, answer in _answers(model, engine, limits):
        if not isinstance(expected, LimitReached):
            assert _without_effort(answer) == _without_effort(expected)
        elif isinstance(answer, Solved):
            assert len(answer.plan) <= length


@given(planning_models(8), st.integers(0, 6), st.sampled_from([0, 1, 2, 3, 5, 8, 20, 1_000]))
@examples(300, usual=8)
def test_the_search_on_arrays_expands_the_same_states_as_the_breadth_first_search(
    model: BehaviorModel, length: int, expansions: int
) -> None:
    for expected, answer in _answers(model, "arrays", PlanLimits(length, expansions)):
        # What the delete relaxation excludes is not searched for.
        assert answer in (expected, Unsolvable(0))
