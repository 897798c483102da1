"""Breadth-first search for the canonical plan (Russell and Norvig, Artificial Intelligence, chapter 3).

The frontier is kept in the lexicographic order of the paths that lead to it: states are expanded in the order in
which they were found, operations in the order of the model. So the first path found to a state is the canonical
one of its length, and so is the first one found to a goal (semantics 4.2, by induction over the length).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.planning.answers import Answer, Limit, LimitReached, PlanLimits, Solved, Unsolvable

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.planning.task import Task

    Parents: TypeAlias = dict[int, tuple[int, int] | None]


def breadth_first(task: Task, start: int, is_goal: Callable[[int], bool], limits: PlanLimits) -> Answer:
    """The canonical plan from a packed state to a state where `is_goal` holds."""
    if is_goal(start):
        return Solved((), 0)
    parents: Parents = {start: None}
    frontier = [start]
    expanded = 0
    for length in range(1, limits.length + 2):
        found: list[int] = []
        for state in frontier:
            if expanded == limits.expansions:
                return LimitReached(Limit.EXPANSIONS, expanded)
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
