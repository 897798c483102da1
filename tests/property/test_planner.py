"""The planner against the slow reference, on random models."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.model import BehaviorModel, State
from scbm.planning import (
    Answer,
    Limit,
    LimitReached,
    PlanCache,
    PlanLimits,
    Planner,
    Solved,
    Task,
    Unsolvable,
    explore,
    find_flaw,
    system_of,
)
from scbm.planning.engines import Region
from scbm.planning.engines.exploration import Distances, Exploration
from scbm.planning.policy import plans_everywhere
from support.profiles import examples
from support.reference import canonical_plan, reachable
from support.strategies import planning_models


@given(planning_models())
@examples(300, usual=12)
def test_the_plan_is_the_canonical_one_of_the_reference(model: BehaviorModel) -> None:
    planner = Planner(model)
    for _, goal in model.goals:
        expected = canonical_plan(model, model.nominal_state, goal, most=1_000)
        answer = planner.plan(model.nominal_state, goal)
        if expected is None:
            assert isinstance(answer, Unsolvable)
        else:
            assert isinstance(answer, Solved)
            assert answer.plan == expected
            assert find_flaw(model, model.nominal_state, goal, answer.plan) is None


@given(planning_models(), st.integers(0, 4))
@examples(200, usual=8)
def test_a_limit_on_the_length_is_exact(model: BehaviorModel, most: int) -> None:
    _, goal = model.goals[0]
    unlimited = Planner(model).plan(model.nominal_state, goal)
    limited = Planner(model).plan(model.nominal_state, goal, PlanLimits(length=most))
    if isinstance(unlimited, Solved) and len(unlimited.plan) <= most:
        assert limited == unlimited
    elif isinstance(unlimited, Solved):
        assert isinstance(limited, LimitReached)
        assert limited.limit is Limit.LENGTH
    else:
        assert isinstance(limited, (Unsolvable, LimitReached))


@given(planning_models(), st.integers(0, 6))
@examples(200, usual=8)
def test_a_limit_on_expansions_never_changes_an_answer_that_is_given(model: BehaviorModel, most: int) -> None:
    _, goal = model.goals[0]
    unlimited = Planner(model).plan(model.nominal_state, goal)
    limited = Planner(model).plan(model.nominal_state, goal, PlanLimits(expansions=most))
    assert limited == unlimited or (isinstance(limited, LimitReached) and limited.expanded == most)
    assert isinstance(limited, LimitReached) == (unlimited.expanded > most)


@given(planning_models())
@examples(100, usual=5)
def test_answers_do_not_depend_on_what_was_asked_before(model: BehaviorModel) -> None:
    asked_often = Planner(model)
    for _, goal in [*model.goals, *reversed(model.goals)]:
        assert asked_often.plan(model.nominal_state, goal) == Planner(model).plan(model.nominal_state, goal)


@given(planning_models())
@examples(100)
def test_exploration_finds_what_the_reference_reaches(model: BehaviorModel) -> None:
    task = Task(model, model.space.names)
    found = explore(task, [task.pack(model.nominal_state)], limit=1_000_000)
    expected = {State(model.space, {n: s[n] for n in model.space.names}) for s in reachable(model, model.nominal_state)}
    assert found.complete
    assert {task.packing.unpack(state) for state in found.states} == expected
    assert len(found.states) == len(expected)


def _without_effort(answer: Answer) -> Answer:
    return replace(answer, expanded=0)


def _any_states(model: BehaviorModel) -> st.SearchStrategy[list[State]]:
    values = [st.sampled_from(variable.domain.values) for variable in model.space]
    states = st.tuples(*values).map(
        lambda chosen: State(model.space, dict(zip(model.space.names, chosen, strict=True)))
    )
    return st.lists(states, min_size=1, max_size=8)


@given(planning_models())
@examples(150, usual=8)
def test_an_exploration_of_all_states_plans_as_the_search_does(model: BehaviorModel) -> None:
    everywhere = Region({v.name: (v.initial,) if v.role.is_runner else v.domain.values for v in model.running_space})
    planner = Planner(model)
    for _, goal in model.goals:
        exploration = Exploration(system_of(model), [everywhere], goal.reads())
        distances = exploration.distances(goal)
        for values in product(*(variable.domain.values for variable in model.space)):
            state = dict(zip(model.space.names, values, strict=True))
            answer = planner.plan(state, goal)
            if isinstance(distances, Distances):
                known = {v.name: state.get(v.name, v.initial) for v in model.running_space}
                assert distances.plan(known) == (answer.plan if isinstance(answer, Solved) else None)
            else:
                assert isinstance(answer, Unsolvable)


@pytest.mark.slow
@given(planning_models(), st.data(), st.sampled_from([PlanLimits(), PlanLimits(2, 1_000), PlanLimits(1_000, 3)]))
@examples(300)
def test_remembered_plans_are_those_of_the_search_however_often_they_are_asked_for(
    model: BehaviorModel, data: st.DataObject, limits: PlanLimits
) -> None:
    planner = Planner(model)
    remembered = PlanCache(planner, first_budget=data.draw(st.integers(0, 12)))
    for state in data.draw(_any_states(model)):
        for _, goal in model.goals:
            answer = remembered.plan(state, goal, limits)
            assert _without_effort(answer) == _without_effort(planner.plan(state, goal, limits))


@pytest.mark.slow
@given(planning_models(), st.data(), st.sampled_from([PlanLimits(), PlanLimits(2, 1_000), PlanLimits(1_000, 3)]))
@examples(300)
def test_a_policy_answers_as_the_search_does_from_any_state(
    model: BehaviorModel, data: st.DataObject, limits: PlanLimits
) -> None:
    planner = Planner(model)
    for _, goal in model.goals:
        policy = planner.policy(goal, limits)
        for state in data.draw(_any_states(model)):
            answer = policy.plan(policy.task.pack(state))
            assert _without_effort(answer) == _without_effort(planner.plan(state, goal, limits))


@given(planning_models(), st.data())
@examples(200, usual=8)
def test_plans_from_everywhere_are_those_of_the_search(model: BehaviorModel, data: st.DataObject) -> None:
    planner = Planner(model)
    for _, goal in model.goals:
        problem = planner.problem(goal)
        plans = plans_everywhere(problem, 1_000_000)
        if plans is None:
            continue  # the goal holds nowhere
        for state in data.draw(_any_states(model)):
            answer = planner.plan(state, goal)
            assert plans.plan(problem.task.pack(state)) == (answer.plan if isinstance(answer, Solved) else None)
