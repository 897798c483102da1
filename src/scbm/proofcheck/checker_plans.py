"""The sets of plans that certificates are about: canonical plans, shortest plans, any plans (semantics 9.3).

Of canonical plans the operations that are left are known. Of the other sets it is known from which state, by the
planner's rules, the rest of a plan starts; which operations follow is decided one by one, by distances from the goal.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeAlias

from scbm.model import PlanSet
from scbm.proofcheck import checker_planner
from scbm.proofcheck.checker_planner import (
    CanonicalPlanner,
    NoPlanExists,
    PlanFound,
    PlannedStates,
    PlanningLimitReached,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.proofcheck.certificate import Queue
    from scbm.proofcheck.checker_planner import WorldState

    Following: TypeAlias = tuple[str | None, Queue]
    """An operation that can follow, and the rest of the plan then; `None` if the plan ends here."""


@dataclass(frozen=True, slots=True)
class PlansFound:
    """There are plans; `queue` stands for all of them."""

    queue: Queue


PlansAnswer: TypeAlias = PlansFound | NoPlanExists | PlanningLimitReached


class CheckedPlans(Protocol):
    """The plans to one goal that the runner may get."""

    names: tuple[str, ...]
    """The variables of a queue that is a state; empty if queues are operations."""

    def answer(self, values: Mapping[str, Value]) -> PlansAnswer:
        """Return the plans from a state, or why there are none."""
        ...

    def following(self, queue: Queue) -> Sequence[Following]:
        """Return everything that can follow in the plans; nothing without a plan."""
        ...

    def queued(self, queue: Queue) -> Iterator[str]:
        """Yield the operations of the plans; those of parts that were asked for before may be left out."""
        ...


def plans_of(plan_set: PlanSet, model: BehaviorModel, goal: Predicate) -> CheckedPlans:
    """Return the plans of a set."""
    return CanonicalPlans(model, goal) if plan_set is PlanSet.CANONICAL else PlansByDistance(plan_set, model, goal)


class CanonicalPlans:
    """The canonical plans to one goal."""

    def __init__(self, model: BehaviorModel, goal: Predicate) -> None:
        self.names: tuple[str, ...] = ()
        self._planner = CanonicalPlanner(model, goal)

    def answer(self, values: Mapping[str, Value]) -> PlansAnswer:
        """Return the canonical plan from a state, or why there is none."""
        answer = self._planner.plan(values)
        return PlansFound(answer.operations or None) if isinstance(answer, PlanFound) else answer

    @staticmethod
    def following(queue: Queue) -> Sequence[Following]:
        """Return the next operation; nothing without a plan."""
        return ((str(queue[0]), queue[1:] or None),) if queue else ()

    @staticmethod
    def queued(queue: Queue) -> Iterator[str]:
        """Yield the operations of the plan."""
        return map(str, queue or ())


class PlansByDistance:
    """The shortest plans, or any plans, to one goal."""

    def __init__(self, plan_set: PlanSet, model: BehaviorModel, goal: Predicate) -> None:
        self._states = PlannedStates(model, goal)
        self.names = self._states.names
        self._is_shortest = plan_set is PlanSet.SHORTEST
        self._distances: dict[WorldState, int | None] = {}
        self._queued_from: dict[WorldState, None] = {}

    def answer(self, values: Mapping[str, Value]) -> PlansAnswer:
        """Return the plans from a state, or why there are none."""
        start = self._states.start(values)
        if not self._know(start):
            return PlanningLimitReached()
        return NoPlanExists() if self._distances[start] is None else PlansFound(start)

    def following(self, queue: Queue) -> Sequence[Following]:
        """Return everything that can follow in the plans."""
        if queue is None or not self._know(queue):
            return ()
        distance = self._distances[queue]
        if distance is None:
            return ()
        found: list[Following] = []
        for operation, after in self._states.successors(queue):
            left = self._distances[after]
            if left is not None and (not self._is_shortest or left == distance - 1):
                found.append((operation, after))
        return (*found, (None, None)) if distance == 0 else tuple(found)

    def queued(self, queue: Queue) -> Iterator[str]:
        """Yield the operations of the plans that no earlier call has yielded for the same states."""
        todo = [] if queue is None else [queue]
        while todo:
            state = todo.pop()
            if state in self._queued_from:
                continue
            self._queued_from[state] = None
            for operation, rest in self.following(state):
                if operation is not None and rest is not None:
                    yield operation
                    todo.append(rest)

    def _know(self, start: WorldState) -> bool:
        """Return whether the distances from `start` on are known; compute them unless that takes too many states."""
        if start in self._distances:
            return True
        before: dict[WorldState, list[WorldState]] = {start: []}
        todo = [start]
        while todo:
            state = todo.pop()
            for _, after in self._states.successors(state):
                if after not in before:
                    before[after] = []
                    if after not in self._distances:
                        todo.append(after)
                before[after].append(state)
            if len(before) > checker_planner.MAX_PLANNING_STATES:
                return False
        self._measure(before)
        return True

    def _measure(self, before: Mapping[WorldState, Sequence[WorldState]]) -> None:
        """Set the distances of new states; `before` has the predecessors of each, and of known states that follow."""
        found: dict[WorldState, int] = {}
        near: list[tuple[int, int, WorldState]] = []
        for number, state in enumerate(before):
            known = self._distances.get(state)
            if known is not None or (state not in self._distances and self._states.is_goal(state)):
                near.append((known or 0, number, state))
        heapq.heapify(near)
        number = len(before)
        while near:
            distance, _, state = heapq.heappop(near)
            if state in found:
                continue
            found[state] = distance
            for other in before[state]:
                number += 1
                heapq.heappush(near, (distance + 1, number, other))
        for state in before:
            self._distances.setdefault(state, found.get(state))
