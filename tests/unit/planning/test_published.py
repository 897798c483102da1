"""The published problems of the benchmarks: their sizes, their known optimal lengths, and their files."""

from __future__ import annotations

import pytest
from published import GOAL, PROBLEMS

from scbm.files import read_model, write_model
from scbm.planning import Planner, Solved
from support.profiles import slow_where

OPERATIONS = {
    "blocks-6-0": 72,
    "blocks-8-0": 128,
    "blocks-9-0": 162,
    "blocks-17-0": 578,
    "logistics-8-0": 156,
    "rovers-05": 111,
    "gripper-14": 114,
    "factory-157": 157,
    "factory-246": 246,
    "factory-846": 846,
    "flags_all_16": 16,
    "line_s7p4t2": 136,
    "independent-10x10": 100,
    "machining_cell": 21,
}

SHORTEST = {"blocks-6-0": 12, "gripper-6": 17, "gripper-8": 23, "agv-5x5": 18, "machining_cell": 26}


@pytest.mark.parametrize("name", OPERATIONS)
def test_a_problem_has_the_published_number_of_operations(name: str) -> None:
    assert len(PROBLEMS[name]().operations) == OPERATIONS[name]


@pytest.mark.parametrize("name", SHORTEST)
def test_the_shortest_plan_has_the_published_length(name: str) -> None:
    model = PROBLEMS[name]()
    goal = model.goal(GOAL)
    assert goal is not None
    answer = Planner(model).plan(model.nominal_state, goal)
    assert isinstance(answer, Solved)
    assert len(answer.plan) == SHORTEST[name]


@pytest.mark.parametrize(
    "name",
    slow_where(
        lambda name: name == "rovers-05", [name for name in PROBLEMS if name in {*SHORTEST, "rovers-05", "factory-157"}]
    ),
)
def test_a_problem_can_be_written_and_read(name: str) -> None:
    model = PROBLEMS[name]()
    assert read_model(write_model(model)) == model
