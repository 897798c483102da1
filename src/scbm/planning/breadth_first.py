"""Breadth-first search for the canonical plan (Russell and Norvig, Artificial Intelligence, chapter 3).

The frontier is kept in the lexicographic order of the paths that lead to it: states are expanded in the order in
which they were found, operations in the order of the model. So the first path found to a state is the canonical
one of its length, and so is the first one found to a goal (semantics 4.2, by induction over the length).

Which planning states can be reached from some states, within a limit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from scbm.planning.plan_answers import (
    Answer,
    Limit,
    LimitReached,
    PlanLimits,
    Solved,
    Unsolvable,
    always,
    raise_if_cancelled,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from scbm.planning.plan_answers import Wanted
    from scbm.planning.planning_task import Task

    Parents: TypeAlias = dict[int, tuple[int, int] | None]


@dataclass(frozen=True, slots=True)
class Reach:
    """What an exploration found.

    Attributes:
        states: packed states, in the order in which they were found.
        complete: whether these are all; `False` if the limit cut the exploration off.
    """

    states: tuple[int, ...]
    complete: bool


def explore(task: Task, starts: Iterable[int], limit: int) -> Reach:
    """All states that the operations can reach from `starts`, but no more than about `limit` of them."""
    found = dict.fromkeys(starts)
    frontier = list(found)
    while frontier and len(found) <= limit:
        successors = dict.fromkeys(state for parent in frontier for _, state in task.successors(parent))
        frontier = [state for state in successors if state not in found]
        found.update(dict.fromkeys(frontier))
    return Reach(tuple(found), not frontier)


LOOK = 1_000
"""After so many states it is asked again whether anybody wants the answer."""


def breadth_first(
    task: Task, start: int, is_goal: Callable[[int], bool], limits: PlanLimits, is_wanted: Wanted = always
) -> Answer:
    """The canonical plan from a packed state to a state where `is_goal` holds.

    Raises `UnwantedError` once `is_wanted` says no.
    """
    return Solved((), 0) if is_goal(start) else _searched(task, start, is_goal, limits, is_wanted)


def _searched(task: Task, start: int, is_goal: Callable[[int], bool], limits: PlanLimits, is_wanted: Wanted) -> Answer:
    parents: Parents = {start: None}
    frontier = [start]
    expanded = 0
    pause = min(LOOK, limits.expansions)
    for length in range(1, limits.length + 2):
        found: list[int] = []
        for state in frontier:
            if expanded == pause:
                if expanded == limits.expansions:
                    return LimitReached(Limit.EXPANSIONS, expanded)
                raise_if_cancelled(is_wanted)
                pause = min(expanded + LOOK, limits.expansions)
            expanded += 1
            for operation, successor in task.successors(state):
                if successor in parents:
                    continue
                if length > limits.length:  # only now is it known that the limit cuts something off
                    return LimitReached(Limit.LENGTH, expanded)
                parents[successor] = (state, operation)
                if is_goal(successor):
                    return Solved(_path(task, parents, successor), expanded)
                found.append(successor)
        if not found:
            return Unsolvable(expanded)
        frontier = found
    raise AssertionError("the length after the last one ends the search")


def _path(task: Task, parents: Parents, state: int) -> tuple[str, ...]:
    operations = []
    while (step := parents[state]) is not None:
        state, operation = step
        operations.append(task.operations[operation])
    return tuple(reversed(operations))
