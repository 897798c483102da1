"""Distances to a goal for states that are asked for one after the other, each explored once.

What is known is closed: beside a known state that is no goal stand all states that it leads to. So a state that is
asked for later can change no distance, and only what is unknown on the way from it is explored.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    Successors: TypeAlias = Callable[[int], Iterable[tuple[int, int]]]


class DistancesOnDemand:
    """How far states are from a goal, and which moves lead closer.

    Attributes:
        lost: how many of the known states lead to no goal.
    """

    def __init__(self, successors: Successors, is_goal: Callable[[int], bool], most: int) -> None:
        """Explores `most` states in all.

        Args:
            successors: the moves from a state, by index and in order, with the states that they lead to.
            is_goal: whether a state is one.
            most: once there are more states to explore than this, no more are.
        """
        self.lost = 0
        self._successors = successors
        self._is_goal = is_goal
        self._most = most
        self._is_full = False
        self._distances: dict[int, int | None] = {}

    def know(self, state: int) -> bool:
        """Whether the state is known now."""
        if state not in self._distances and not self._is_full:
            found = self._explore(state)
            self._is_full = len(self._distances) + len(found) > self._most
            if not self._is_full:
                self._measure(found)
        return state in self._distances

    def distance(self, state: int) -> int | None:
        """The fewest moves from a known state to a goal; `None` if there is no way."""
        return self._distances[state]

    def first_move(self, state: int) -> tuple[int, int] | None:
        """The first move, in order, that leads a known state closer to a goal, and where it leads."""
        distance = self._distances[state]
        if not distance:
            return None
        return next(step for step in self._successors(state) if self._distances[step[1]] == distance - 1)

    def _explore(self, start: int) -> dict[int, bool]:
        """The unknown states on the way from `start`, and whether each is a goal; about as many as are allowed."""
        found = {start: self._is_goal(start)}
        frontier = [start]
        while frontier and len(self._distances) + len(found) <= self._most:
            leading_on = (state for state in frontier if not found[state])
            reached = dict.fromkeys(after for state in leading_on for _, after in self._successors(state))
            frontier = [state for state in reached if state not in found and state not in self._distances]
            found.update((state, self._is_goal(state)) for state in frontier)
        return found

    def _measure(self, found: dict[int, bool]) -> None:
        """The distances of new states: backwards from goals among them, and from what was known before."""
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
    """The distance of each state that leads to one in `levels`, where states stand at a distance that they can have."""
    measured: dict[int, int] = {}
    distance = 0
    while levels:
        now = [state for state in dict.fromkeys(levels.pop(distance, ())) if state not in measured]
        measured.update(dict.fromkeys(now, distance))
        distance += 1
        if reached := [state for after in now for state in before[after] if state not in measured]:
            levels.setdefault(distance, []).extend(reached)
    return measured
