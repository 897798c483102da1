"""Goals that an operation is needed for."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import pytest
from hypothesis import given

from scbm.closing.advice.goal_search import GoalSearch, goal_name
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, InitialStates
from scbm.planning import Planner, Solved
from support.models import scan_cell
from support.profiles import examples
from support.strategies import planning_models

ROOT = Path(__file__).parents[3]
BEFORE = load_model(ROOT / "examples/robot_in_the_air/before.yaml")


def _search(model: BehaviorModel) -> GoalSearch:
    return GoalSearch(model, Planner(model))


def _first(model: BehaviorModel, operation: str, count: int = 1) -> list[str]:
    return [str(goal) for goal in islice(_search(model).candidates(operation), count)]


@pytest.mark.parametrize(
    ("operation", "goals"),
    [
        ("robot_move_to_home", ["robot_at == home"]),
        (
            "robot_unmount_gripper",
            ["mounted == none && gripper_act == open", "mounted == none && gripper_act == closed"],
        ),
        ("robot_unmount_scanner", ["item_a_at == gripper"]),
        ("gantry_move_to_box_a", ["gantry_at == box_a"]),
        ("place_item_a", ["item_a_at == agv"]),
    ],
)
def test_every_operation_of_the_example_is_needed_for_something_natural(operation: str, goals: list[str]) -> None:
    assert _first(BEFORE, operation, len(goals)) == goals


def test_one_search_serves_all_operations_of_the_example() -> None:
    search = _search(BEFORE)
    for operation in BEFORE.operations:
        goal = next(search.candidates(operation.name))
        example = search.example(operation.name, goal)
        assert example is not None
        start, plan = example
        assert operation.name in plan
        assert InitialStates(BEFORE).allows(dict(start))
        answer = Planner(BEFORE).plan(start, goal)
        assert isinstance(answer, Solved)
        assert answer.plan == plan


def test_the_example_of_a_goal_is_a_shortest_plan_from_an_initial_state() -> None:
    search = _search(BEFORE)
    example = search.example("robot_move_to_home", next(search.candidates("robot_move_to_home")))
    assert example is not None
    assert example[0]["robot_at"] == "toolbox_gripper"
    assert example[1] == ("robot_move_to_home",)


ORDERED = """
behavior_model: ordered
variables:
  place: {domain: [home, far], initial: home, random: any}
  lamp: {domain: [dark, lit], initial: dark}
  command: {domain: [nothing, go], initial: nothing}
resources:
  robot: {request: [command]}
operations:
  go: {pre: {g: place == home, a: [command <- go]}, post: {g: true, a: [place <- far]}}
  back: {pre: {g: place == far}, post: {g: true, a: [place <- home]}}
  shine: {pre: {g: place == far, a: [command <- go]}, post: {g: true, a: [lamp <- lit]}}
  stay: {pre: {g: place == home && place == far}, post: {g: true}}
initial_states: place == home
"""


def test_what_the_operation_brings_about_comes_first_and_what_follows_later() -> None:
    assert _first(read_model(ORDERED), "go", 10) == ["place == far"]


def test_goals_may_speak_of_what_planning_does_not_look_at_but_not_of_commands() -> None:
    goals = ["lamp == lit", "place == far && lamp == lit", "place == home && lamp == lit"]
    assert _first(read_model(ORDERED), "shine", 10) == goals


def test_initial_states_that_are_not_allowed_do_not_count() -> None:
    assert _first(read_model(ORDERED), "back") == []
    allowed = ORDERED.replace("initial_states: place == home\n", "")
    assert _first(read_model(allowed), "back") == ["place == home"]


def test_an_operation_that_is_never_enabled_is_needed_for_nothing() -> None:
    assert _first(read_model(ORDERED), "stay") == []


def test_an_operation_that_is_not_there_is_an_error() -> None:
    with pytest.raises(KeyError):
        list(_search(BEFORE).candidates("fly"))


def test_the_name_of_a_goal_is_new() -> None:
    assert goal_name(scan_cell(), "scan_box") == "needs_scan_box"
    model = scan_cell(("  scanned: ", "  needs_scan_box: count == 1\n  needs_scan_box_2: count == 2\n  scanned: "))
    assert goal_name(model, "scan_box") == "needs_scan_box_3"


@given(planning_models())
@examples(150, usual=8)
def test_the_plan_to_every_goal_that_is_found_has_the_operation(model: BehaviorModel) -> None:
    search = _search(model)
    for operation in model.operations:
        goals = list(islice(search.candidates(operation.name), 20))
        assert len(dict.fromkeys(goals)) == len(goals)
        for goal in goals:
            example = search.example(operation.name, goal)
            assert example is not None
            assert operation.name in example[1]
