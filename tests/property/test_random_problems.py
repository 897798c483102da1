"""The plans of all planners for 1,000 random problems, checked by slow references that share no code with planners."""

from __future__ import annotations

import os
from importlib.util import find_spec

import pytest

from scbm.planning import PLANNERS, Planner, Solved, Unsolvable
from support.profiles import share
from support.random_problems import RandomProblem, random_problem
from support.reference import canonical_plan, step, world

_PROBLEMS = 1_000
_BATCH = 50
"""Number of problems in a test, so that tests run on all processors."""

_BY_OTHERS = 20
"""Number of problems for each of the other programs without all examples: they start a process for each problem."""

BUILT_IN = [name for name, entry in PLANNERS.items() if not entry.is_external]
SHORTEST = ("canonical", "fast-downward-optimal")
OTHER_PROGRAMS = ["fast-downward", "fast-downward-optimal"]


def batches(count: int) -> list[range]:
    """Return the numbers of the first problems in batches."""
    return [range(first, min(first + _BATCH, count + 1)) for first in range(1, count + 1, _BATCH)]


def reaches(problem: RandomProblem, plan: tuple[str, ...]) -> bool:
    """Whether each operation of a plan is enabled when its turn comes, and the goal holds at the end."""
    now = world(problem.model, problem.start)
    for name in plan:
        after = step(problem.model, name, now)
        if after is None:
            return False
        now = after
    return problem.goal.holds(now)


def check(name: str, number: int) -> None:
    """Plan one problem, and compare the answer with the reference."""
    problem = random_problem(number)
    expected = canonical_plan(problem.model, problem.start, problem.goal, most=1_000)
    answer = Planner(problem.model, name).plan(problem.start, problem.goal)
    if expected is None:
        assert isinstance(answer, Unsolvable), number
        return
    assert isinstance(answer, Solved), number
    assert reaches(problem, answer.plan), number
    assert name not in SHORTEST or len(answer.plan) == len(expected), number
    assert name != "canonical" or answer.plan == expected, number


@pytest.mark.slow
@pytest.mark.parametrize("name", BUILT_IN)
@pytest.mark.parametrize("numbers", batches(_PROBLEMS), ids=lambda numbers: f"{numbers[0]}-{numbers[-1]}")
def test_answers_of_built_in_planners_are_right(name: str, numbers: range) -> None:
    for number in numbers:
        check(name, number)


@pytest.mark.peer
@pytest.mark.filterwarnings("ignore")  # those of libraries of others
@pytest.mark.skipif(
    find_spec("up_fast_downward") is None and os.environ.get("SCBM_ALL_TOOLS") != "1",
    reason="not installed: up-fast-downward",
)
@pytest.mark.parametrize("name", OTHER_PROGRAMS)
@pytest.mark.parametrize(
    "numbers", batches(share(_PROBLEMS, usual=_BY_OTHERS)), ids=lambda numbers: f"{numbers[0]}-{numbers[-1]}"
)
def test_answers_of_other_programs_are_right(name: str, numbers: range) -> None:
    for number in numbers:
        check(name, number)


@pytest.mark.slow
def test_the_problems_are_of_all_kinds() -> None:
    lengths: dict[int | None, int] = {}
    for number in range(1, share(_PROBLEMS) + 1):
        problem = random_problem(number)
        plan = canonical_plan(problem.model, problem.start, problem.goal, most=1_000)
        length = None if plan is None else min(len(plan), 4)
        lengths[length] = lengths.get(length, 0) + 1
    assert all(lengths[length] >= share(_PROBLEMS) // 25 for length in (None, 0, 1, 2, 3, 4)), lengths
