"""The planners by name. To add one: a function from a planning problem and limits to an answer, and an entry here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from scbm.planning.plan_answers import always
from scbm.planning.plan_search import search_plan

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.planning.plan_answers import Answer, PlanLimits, ShouldContinue
    from scbm.planning.planning_task import Task


@dataclass(frozen=True, slots=True)
class PlanProblem:
    """One planning problem: find operations that lead from `start` to a state in which `is_goal` holds.

    States are packed integers of `task`. `task.successors(state)` gives each enabled operation, by its index in
    `task.operations`, with the state that it leads to.

    Attributes:
        task: the model as a packed transition system.
        start: the packed state to plan from.
        is_goal: whether the goal holds in a packed state.
        should_continue: called at intervals by long searches, through `raise_if_cancelled`.
    """

    task: Task
    start: int
    is_goal: Callable[[int], bool]
    should_continue: ShouldContinue = always


class PlanFunction(Protocol):
    """A planner. Its answer depends on the problem and the limits alone, never on earlier calls."""

    def __call__(self, problem: PlanProblem, limits: PlanLimits) -> Answer:
        """Return a plan, the proof that there is none, or the limit that ended the search."""
        ...


def canonical(problem: PlanProblem, limits: PlanLimits) -> Answer:
    """Return the canonical plan: the shortest, and of the shortest the first in the order of the model."""
    return search_plan(problem.task, problem.start, problem.is_goal, limits, problem.should_continue)


PLANNERS: dict[str, PlanFunction] = {"canonical": canonical}
"""The function of each planner by the name that `--planner` takes."""

DEFAULT_PLANNER = "canonical"
"""The planner of runs, tests and proofs: their traces and certificates rely on canonical plans."""
