"""The greedy planner: large models, guards and actions of every kind, limits, and equal bytes under every hash seed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from published import GOAL, PROBLEMS

from scbm.files import read_model
from scbm.model import BehaviorModel
from scbm.planning import (
    Answer,
    Limit,
    LimitReached,
    PlanLimits,
    Planner,
    SearchCancelledError,
    Solved,
    Unsolvable,
    find_flaw,
)

ROOT = Path(__file__).parents[3]

EVALUATED = {
    "blocks-12-0": 1_000,
    "blocks-17-0": 1_000,
    "logistics-10-0": 100,
    "logistics-15-0": 1_000,
    "rovers-07": 100,
    "gripper-42": 200,
    "factory-246": 100,
    "line_s7p4t2": 200,
    "independent-10x10": 10,
}
"""More states than the search evaluates today, and far fewer than a blind search expands."""


def _plan(model: BehaviorModel, limits: PlanLimits | None = None) -> Answer:
    goal = dict(model.goals)[GOAL]
    return Planner(model, "greedy").plan(model.nominal_state, goal, limits or PlanLimits())


def _model(variables: str, operations: str, goal: str) -> BehaviorModel:
    return read_model(
        f"behavior_model: small\nvariables: {{{variables}}}\noperations: {{{operations}}}\ngoals: {{goal: {goal}}}\n"
    )


@pytest.mark.parametrize("name", EVALUATED)
def test_a_large_model_is_solved_within_few_states(name: str) -> None:
    model = PROBLEMS[name]()
    answer = _plan(model)
    assert isinstance(answer, Solved)
    assert answer.expanded <= EVALUATED[name]
    assert find_flaw(model, model.nominal_state, dict(model.goals)[GOAL], answer.plan) is None


def test_a_plan_has_no_useless_operations() -> None:
    model = PROBLEMS["blocks-6-0"]()
    answer = _plan(model)
    assert isinstance(answer, Solved)
    for left_out in range(len(answer.plan)):
        shorter = answer.plan[:left_out] + answer.plan[left_out + 1 :]
        assert find_flaw(model, model.nominal_state, dict(model.goals)[GOAL], shorter) is not None


@pytest.mark.parametrize(
    ("variables", "operations", "goal", "length"),
    [
        ("n: {domain: 0..9, initial: 0}", "up: {pre: {g: true, a: [n += 1]}, post: {g: true}}", "n == 7", 7),
        (
            "a: {domain: 0..3, initial: 0}, b: {domain: 0..3, initial: 2}",
            (
                "up: {pre: {g: a < b, a: [a += 1]}, post: {g: true}}, down: {pre: {g: a == b, a: [b <- a, a <- 0]},"
                " post: {g: a == 0, a: [b -= 1]}}"
            ),
            "b == 1 && a == 1",
            4,
        ),
        (
            "a: {domain: [x, y, z], initial: x}, b: {domain: [x, y, z], initial: z}",
            (
                "copy: {pre: {g: true, a: [a <- b]}, post: {g: true}}, turn: {pre: {g: a != b || a == z, a: [b <- y]},"
                " post: {g: true}}"
            ),
            "a == y && b == y",
            2,
        ),
        (
            "a: {domain: 0..200, initial: 0}, b: {domain: 0..200, initial: 3}",
            (
                "up: {pre: {g: a != b, a: [a += 1]}, post: {g: true}}, stop: {pre: {g: a == b, a: [b <- 0]},"
                " post: {g: true}}"
            ),
            "b == 0",
            4,
        ),
    ],
)
def test_counters_comparisons_and_copies_are_planned_with(
    variables: str, operations: str, goal: str, length: int
) -> None:
    answer = _plan(_model(variables, operations, goal))
    assert isinstance(answer, Solved)
    assert len(answer.plan) == length


def test_a_goal_that_no_sequence_of_values_reaches_is_refuted_by_one_state() -> None:
    model = _model(
        "a: {domain: bool, initial: false}, b: {domain: 0..99, initial: 0}, c: {domain: 0..99, initial: 0}",
        "one: {pre: {g: a == true, a: [b += 1]}, post: {g: true}}, two: {pre: {g: true, a: [c += 1]}, post: {g: true}}",
        "b == 1",
    )
    assert _plan(model) == Unsolvable(1)


def test_a_problem_that_only_the_deletions_make_unsolvable_is_exhausted() -> None:
    model = _model(
        "a: {domain: [x, y, z], initial: x}, b: {domain: [x, y, z], initial: x}",
        "one: {pre: {g: a == x && b == x, a: [a <- y]}, post: {g: true}},"
        " two: {pre: {g: a == x && b == x, a: [b <- y]}, post: {g: true}}",
        "a == y && b == y",
    )
    answer = _plan(model)
    assert isinstance(answer, Unsolvable)
    assert answer.expanded <= 3


def test_limits_are_kept_on_large_models() -> None:
    model = PROBLEMS["blocks-9-0"]()
    few = _plan(model, PlanLimits(expansions=10))
    assert few == LimitReached(Limit.EXPANSIONS, 10)
    short = _plan(model, PlanLimits(length=3))
    assert isinstance(short, LimitReached)
    assert short.limit is Limit.LENGTH


def test_a_search_can_be_cancelled() -> None:
    model = PROBLEMS["blocks-9-0"]()
    with pytest.raises(SearchCancelledError):
        Planner(model, "greedy").plan(model.nominal_state, model.goals[0][1], should_continue=lambda: False)


@pytest.mark.slow
def test_plans_are_the_same_under_every_hash_seed() -> None:
    script = (
        "from published import PROBLEMS; from scbm.planning import Planner\n"
        "for name in ('blocks-8-0', 'rovers-05', 'machining_cell'):\n"
        "    model = PROBLEMS[name]()\n"
        "    print(Planner(model, 'greedy').plan(model.nominal_state, model.goals[0][1]))\n"
    )
    path = os.pathsep.join([str(ROOT / "src"), str(ROOT / "benchmarks")])
    outputs = {
        subprocess.run(
            [sys.executable, "-c", script],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "2")
    }
    assert len(outputs) == 1
