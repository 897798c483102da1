"""A* for the length of a shortest plan, then a depth-first search in file order for the canonical one.

A* (Hart, Nilsson and Raphael, 1968) with the LM-cut heuristic proves the length. The depth-first search takes
operations in file order. It leaves a state where the heuristic, or a bound that the search has proved, needs more
operations than are left. So the first plan that it finds is the canonical one.
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import TYPE_CHECKING

from scbm.planning.engines.engine import ExplorationLimits
from scbm.planning.engines.hash_engine import HashedEngine
from scbm.planning.plan_answers import Answer, Limit, LimitReached, PlanLimits, Solved, Unsolvable, raise_if_cancelled
from scbm.planning.searches.landmark_cut import MAX_RELAXED_MOVES, LandmarkCut, count_relaxed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.reduced_system import ReducedSystem
    from scbm.planning.searches.landmark_cut import Landmarks
    from scbm.planning.searches.search_request import SearchRequest

MAX_EVALUATED = 250_000
"""Maximum number of states whose landmarks are computed: each takes 0.1 ms for 150 operations.

Smaller limits of a search keep their meaning: they count states that a breadth-first search expands.
"""

_POLL_INTERVAL = 1_000
"""Number of evaluated states after which a search asks again whether it is cancelled."""

_UNREACHABLE = 1 << 60


class InformedSearch:
    """Finds canonical plans to one goal by a heuristic."""

    def __init__(self, system: ReducedSystem, goal: NormalForm) -> None:
        self.names = system.names
        self.engine = HashedEngine(system, ExplorationLimits())
        self.is_goal = self.engine.test(goal)
        self.heuristic = LandmarkCut(system, goal)

    @staticmethod
    def suits(system: ReducedSystem, limits: PlanLimits) -> bool:
        """Return whether the limit allows to evaluate as many states as a hard problem needs."""
        return limits.expansions >= MAX_EVALUATED and count_relaxed(system) <= MAX_RELAXED_MOVES

    def answer(self, request: SearchRequest) -> Answer:
        """Return the canonical plan or why there is none; states whose landmarks were computed count as expanded."""
        raise_if_cancelled(request.should_continue)
        search = _InformedRun(self, request)
        try:
            length = search.length()
            if length is None:
                return Unsolvable(search.evaluated)
            if length > request.limits.length:
                return LimitReached(Limit.LENGTH, search.evaluated)
            return Solved(search.first_plan(length), search.evaluated)
        except _BudgetSpentError:
            return LimitReached(Limit.EXPANSIONS, search.evaluated)


class _BudgetSpentError(Exception):
    """The search has evaluated as many states as it may."""


class _InformedRun:
    """One search.

    Attributes:
        evaluated: the number of states whose landmarks were computed.
    """

    def __init__(self, search: InformedSearch, request: SearchRequest) -> None:
        self.evaluated = 0
        self._search = search
        self._request = request
        self._start = search.engine.layout.code(request.start)
        self._most = min(request.limits.expansions, MAX_EVALUATED)
        self._landmarks: dict[int, Landmarks | None] = {}
        self._bounds: dict[int, int] = {}
        self._depths: dict[int, int] = {self._start: 0}
        self._predecessors: dict[int, tuple[int, int]] = {}
        self._fields = search.engine.layout.bit_ranges()

    def length(self) -> int | None:
        """Return the length of a shortest plan; `None` if there is no plan."""
        waiting = [(0, 0, 0, self._start, 0)]
        while waiting:
            total, _, _, state, depth = heappop(waiting)
            if depth > self._depths[state]:
                continue
            if self._search.is_goal(state):
                return depth
            needed = depth + self._bound(state)
            if needed >= _UNREACHABLE:
                continue
            if needed > total:  # the state was found with the bound of its predecessor
                heappush(waiting, (needed, needed - depth, -len(self._depths), state, depth))
                continue
            for after, estimate in self._found(state, depth, total):
                heappush(waiting, (depth + 1 + estimate, estimate, -len(self._depths), after, depth + 1))
        return None

    def _found(self, state: int, depth: int, total: int) -> Iterator[tuple[int, int]]:
        """Yield the successors to which no shorter path is known, with bounds; `total` bounds paths through `state`."""
        for index, after in self._search.engine.successors(state):
            if depth + 1 < self._depths.get(after, _UNREACHABLE):
                self._depths[after] = depth + 1
                self._predecessors.setdefault(after, (state, index))
                yield after, max(self._bounds.get(after, 0), total - depth - 1)

    def first_plan(self, length: int) -> tuple[str, ...]:
        """Return the first plan in file order; `length` is that of a shortest plan."""
        engine, plan, states = self._search.engine, list[int](), [self._start]
        options = [iter(engine.successors(self._start))]
        while True:
            left = length - len(plan) - 1
            for index, after in options[-1]:
                if self._search.is_goal(after):
                    return tuple(self._search.names[move] for move in (*plan, index))
                self._predecessors.setdefault(after, (states[-1], index))
                if self._depths.get(after, _UNREACHABLE) > len(plan) and self._bound(after) <= left:
                    plan.append(index)
                    states.append(after)
                    options.append(iter(engine.successors(after)))
                    break
            else:
                options.pop()
                self._bounds[states.pop()] = left + 2
                plan.pop()

    def _bound(self, state: int) -> int:
        """Return a lower bound of the distance of a state from the goal, which does not hold in it: at least one."""
        if state not in self._bounds:
            if self.evaluated >= self._most:
                raise _BudgetSpentError
            self.evaluated += 1
            if not self.evaluated % _POLL_INTERVAL:
                raise_if_cancelled(self._request.should_continue)
            landmarks = self._search.heuristic.landmarks(self._coordinates(state), self._known(state))
            self._landmarks[state] = landmarks
            self._bounds[state] = _UNREACHABLE if landmarks is None else max(1, len(landmarks))
        return self._bounds[state]

    def _known(self, state: int) -> Landmarks:
        """Return the landmarks that remain after the move by which the state was found."""
        if state not in self._predecessors:
            return ()
        before, index = self._predecessors[state]
        landmarks = self._landmarks.get(before)
        return () if landmarks is None else self._search.heuristic.after(landmarks, index)

    def _coordinates(self, state: int) -> list[int]:
        return [(state & field.mask) >> field.shift for field in self._fields]
