"""The planner's search: breadth-first, so that the first plan found is the canonical one (semantics 4.2)."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.planning.engines.breadth_first import BreadthFirst
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

    from scbm.planning.plan_answers import ShouldContinue
    from scbm.planning.planning_task import Task

POLL_INTERVAL = 1_000
"""Number of expanded states after which a search asks again whether it is cancelled."""


@dataclass(frozen=True, slots=True)
class Reach:
    """The planning states that were found reachable.

    Attributes:
        states: packed states, in the order of discovery.
        complete: whether these are all; `False` if the limit ended the exploration.
    """

    states: tuple[int, ...]
    complete: bool


def explore(task: Task, starts: Iterable[int], limit: int) -> Reach:
    """Return the states that operations reach from `starts`; no more levels once there are more than `limit` states."""
    search = BreadthFirst(starts, task.successors)
    while search.frontier and len(search.states) <= limit:
        search.expand_level()
    return Reach(tuple(search.states), not search.frontier)


def search_plan(
    task: Task, start: int, is_goal: Callable[[int], bool], limits: PlanLimits, should_continue: ShouldContinue = always
) -> Answer:
    """Return the canonical plan from a packed state to a state where `is_goal` holds, or why there is none.

    Raises `SearchCancelledError` once `should_continue` returns `False`.
    """
    return Solved((), 0) if is_goal(start) else _searched(task, start, is_goal, limits, should_continue)


def _searched(
    task: Task, start: int, is_goal: Callable[[int], bool], limits: PlanLimits, should_continue: ShouldContinue
) -> Answer:
    search = BreadthFirst((start,), task.successors)
    levels = _Levels(search)
    while search.frontier:
        expanded = search.expanded
        if expanded == limits.expansions:
            return LimitReached(Limit.EXPANSIONS, expanded)
        if expanded and expanded % POLL_INTERVAL == 0:
            raise_if_cancelled(should_continue)
        until = min(limits.expansions, expanded + POLL_INTERVAL - expanded % POLL_INTERVAL)
        if expanded < limits.length:  # no path is longer than the number of states expanded before its end
            goal = search.expand(min(until, limits.length), is_goal)
        elif levels.advance() < limits.length:
            goal = search.expand(min(until, levels.end), is_goal)
        elif search.expand(min(until, levels.end), _any_state) is not None:
            return LimitReached(Limit.LENGTH, search.expanded)
        else:
            goal = None
        if goal is not None:
            return Solved(tuple(task.operations[action] for action in search.actions_to(goal)), search.expanded)
    return Unsolvable(search.expanded)


class _Levels:
    """The levels of a search: all states at one distance from the start.

    Attributes:
        end: the number of states up to the end of the present level.
    """

    def __init__(self, search: BreadthFirst[int, int]) -> None:
        self.end = 0
        self._search = search
        self._depth = 0

    def advance(self) -> int:
        """Return the distance of the state that is expanded next, and set `end` to the end of its level."""
        states, expanded = self._search.states, self._search.expanded
        if not self.end:
            self._depth = self._search.depth(states[expanded])
            self.end = bisect_right(states, self._depth, lo=expanded, key=self._search.depth)
        elif expanded == self.end:
            self._depth, self.end = self._depth + 1, len(states)
        return self._depth


def _any_state(_: int) -> bool:
    return True
