"""Distances to a goal for states that are asked for one after the other, each explored once.

The known states are closed: the successors of a known state are known, unless it is a goal. So a later request can
change no distance, and it explores only states that are not known yet.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.planning.engines.breadth_first import BreadthFirst

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    Successors: TypeAlias = Callable[[int], Iterable[tuple[int, int]]]


class DistancesOnDemand:
    """The distances of known states from a goal, and the moves that lead closer.

    Attributes:
        lost: the number of known states from which no goal is reachable.
    """

    def __init__(self, successors: Successors, is_goal: Callable[[int], bool], most: int) -> None:
        """Explore nothing yet.

        Args:
            successors: the moves from a state, by index and in order, with the states that they lead to.
            is_goal: whether a state is a goal.
            most: the maximum number of known states; what would exceed it is not explored.
        """
        self.lost = 0
        self._successors = successors
        self._is_goal = is_goal
        self._most = most
        self._is_full = False
        self._distances: dict[int, int | None] = {}

    def know(self, state: int) -> bool:
        """Return whether the distance of the state is known now; explore from it unless the limit is reached."""
        if state not in self._distances and not self._is_full:
            is_goal = self._explore(state)
            if is_goal is None:
                self._is_full = True
            else:
                self._measure(is_goal)
        return state in self._distances

    def distance(self, state: int) -> int | None:
        """Return the minimum number of moves from a known state to a goal; `None` if no path exists."""
        return self._distances[state]

    def first_move(self, state: int) -> tuple[int, int] | None:
        """Return the first move, in order, that leads a known state closer to a goal, and its successor."""
        distance = self._distances[state]
        if not distance:
            return None
        return next(step for step in self._successors(state) if self._distances[step[1]] == distance - 1)

    def _explore(self, start: int) -> dict[int, bool] | None:
        """Return the unknown states that `start` leads to, and whether each is a goal; `None` if they are too many."""
        is_goal: dict[int, bool] = {}

        def unknown_successors(state: int) -> Iterable[tuple[int, int]]:
            is_goal[state] = self._is_goal(state)
            if is_goal[state]:
                return ()
            return [step for step in self._successors(state) if step[1] not in self._distances]

        exploration = BreadthFirst((start,), unknown_successors)
        while exploration.frontier and len(self._distances) + len(exploration.states) <= self._most:
            exploration.expand_level()
        return None if exploration.frontier else is_goal

    def _measure(self, found: dict[int, bool]) -> None:
        """Compute the distances of new states, backwards from the goals among them and from known successors."""
        before: dict[int, list[int]] = {state: [] for state in found}
        levels: dict[int, list[int]] = {0: [state for state, is_goal in found.items() if is_goal]}
        for state in (state for state, is_goal in found.items() if not is_goal):
            for _, after in self._successors(state):
                if after in found:
                    before[after].append(state)
                elif (distance := self._distances[after]) is not None:
                    levels.setdefault(distance + 1, []).append(state)
        measured = _spread(levels, before)
        self._distances.update((state, measured.get(state)) for state in found)
        self.lost += len(found) - len(measured)


def _spread(levels: dict[int, list[int]], before: dict[int, list[int]]) -> dict[int, int]:
    """Return the distance of each state that reaches one in `levels`, which has upper bounds by distance."""
    measured: dict[int, int] = {}
    distance = 0
    while levels:
        now = [state for state in dict.fromkeys(levels.pop(distance, ())) if state not in measured]
        measured.update(dict.fromkeys(now, distance))
        distance += 1
        if reached := [state for after in now for state in before[after] if state not in measured]:
            levels.setdefault(distance, []).extend(reached)
    return measured
