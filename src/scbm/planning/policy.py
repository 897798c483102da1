"""The canonical plans to one goal from any state: each state is explored once, however many are asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.exploring import DistancesOnDemand
from scbm.planning.answers import Answer, Limit, LimitReached, PlanLimits, Solved, Unsolvable
from scbm.planning.search import breadth_first

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.planning.task import Task


_MOST_REMEMBERED = 1_000_000


class Policy:
    """What `Planner.plan` answers for one goal, from any packed state; `expanded` is 0 where nothing was searched.

    Attributes:
        task: the packed task whose states are asked for (`task.pack`).
    """

    def __init__(self, task: Task, is_goal: Callable[[int], bool], limits: PlanLimits, most: int | None = None) -> None:
        """Prepares the answers.

        Args:
            task: the packed task.
            is_goal: whether a packed state is a goal.
            limits: those of the answers.
            most: for so many states distances are worked out at most, beyond them each answer is searched for; `None`
                for as many as a search may expand.
        """
        self.task = task
        self._is_goal = is_goal
        self._limits = limits
        # While no more states than this are known, no search can come to its limit of expanded states.
        self._distances = DistancesOnDemand(
            task.successors, is_goal, limits.expansions if most is None else min(most, limits.expansions)
        )
        self._answers: dict[int, Answer] = {}

    def plan(self, state: int) -> Answer:
        """The canonical plan from a packed state, or why there is none."""
        known = self._answers.get(state)
        if known is not None:
            return known
        answer = self._answer(state)
        if len(self._answers) < _MOST_REMEMBERED:
            self._answers[state] = replace(answer, expanded=0)
        return answer

    def _answer(self, state: int) -> Answer:
        if not self._distances.know(state):
            return self._searched(state)
        distance = self._distances.distance(state)
        if distance is None:
            # A search would see lost states only. If they may lie too deep for it, it has to say so itself.
            return Unsolvable(0) if self._distances.lost <= self._limits.length else self._searched(state)
        if distance > self._limits.length:
            return LimitReached(Limit.LENGTH, 0)
        return Solved(self._path(state), 0)

    def _searched(self, state: int) -> Answer:
        return breadth_first(self.task, state, self._is_goal, self._limits)

    def _path(self, state: int) -> tuple[str, ...]:
        names = []
        while (step := self._distances.first_move(state)) is not None:
            operation, state = step
            names.append(self.task.operations[operation])
        return tuple(names)
