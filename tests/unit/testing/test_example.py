"""The example comes out as its description says: plans, counts, first figures."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from statistics import median

import pytest

from scbm.cases.coverage import Aspect
from scbm.files import load_model
from scbm.model import BehaviorModel
from scbm.planning import Planner, Solved, explore, find_flaw
from scbm.testing import Campaign, RandomCases, Tester

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air"


@pytest.fixture(scope="module")
def before() -> BehaviorModel:
    return load_model(EXAMPLE / "before.yaml")


@pytest.fixture(scope="module")
def after() -> BehaviorModel:
    return load_model(EXAMPLE / "after.yaml")


def _lengths(model: BehaviorModel) -> list[int]:
    planner = Planner(model)
    lengths = []
    for _, goal in model.goals:
        answer = planner.plan(model.nominal_state, goal)
        assert isinstance(answer, Solved)
        assert find_flaw(model, model.nominal_state, goal, answer.plan) is None
        lengths.append(len(answer.plan))
    return lengths


def _reachable(model: BehaviorModel) -> int:
    task = Planner(model).base_task
    return len(explore(task, [task.pack(model.nominal_state)], 10_000).states)


def _queueable(model: BehaviorModel) -> list[str]:
    """The operations on a plan to any goal from any initial state that may be drawn."""
    planner = Planner(model)
    queued: dict[str, None] = {}
    choices = product(["home", "toolbox_gripper", "toolbox_scanner"], ["box_a", "agv"], ["open", "closed"])
    for robot, gantry, gripper in choices:
        state = model.nominal_state.replace({"robot_at": robot, "gantry_at": gantry, "gripper_act": gripper})
        for _, goal in model.goals:
            answer = planner.plan(state, goal)
            assert isinstance(answer, Solved)
            queued.update(dict.fromkeys(answer.plan))
    return list(queued)


def test_canonical_plans_have_the_lengths_of_the_description(before: BehaviorModel, after: BehaviorModel) -> None:
    assert _lengths(before) == [5, 4, 16, 11]
    assert _lengths(after) == [5, 4, 18, 11, 19]


def test_as_many_planning_states_are_reachable(before: BehaviorModel, after: BehaviorModel) -> None:
    assert (_reachable(before), _reachable(after)) == (190, 152)


@pytest.mark.slow
def test_before_the_repair_two_operations_are_on_no_plan_and_after_it_none(
    before: BehaviorModel, after: BehaviorModel
) -> None:
    names = [operation.name for operation in before.operations]
    assert [n for n in names if n not in _queueable(before)] == ["robot_move_to_home", "robot_unmount_gripper"]
    assert [n for n in names if n not in _queueable(after)] == []


@pytest.mark.slow
def test_random_cases_give_a_first_figure_like_the_papers(before: BehaviorModel) -> None:
    tester, cases = Tester(before), RandomCases(before)
    figures = []
    for seed in range(50):
        campaign = Campaign.of(tester.model, tester.results(cases.first(20, seed)))
        coverage = campaign.coverage
        figures.append(coverage.figure.visited)
        never = [obligation.subject for obligation in coverage.missed(Aspect.QUEUED)]
        assert {"robot_move_to_home", "robot_unmount_gripper"} <= set(never)
        assert coverage.figure_of(Aspect.DISABLED).visited == 0
        assert coverage.figure_of(Aspect.TIMEDOUT).visited == 0
        assert not campaign.failed
    assert 33 <= min(figures) <= median(figures) <= 40
    assert max(figures) <= 46


@pytest.mark.slow
def test_the_requirement_holds_after_the_repair(after: BehaviorModel) -> None:
    tester, cases = Tester(after), RandomCases(after)
    campaign = Campaign.of(tester.model, tester.results(cases.first(200, seed=1)))
    assert not campaign.failed
    assert campaign.coverage.figure_of(Aspect.QUEUED).is_complete
