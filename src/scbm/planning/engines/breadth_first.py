"""Breadth-first exploration of a graph that is given by a successor function, and distances on demand.

The one loop behind the planner, the exploration of planning states, the hash engine, distances on demand and the graph
of all runs (Russell and Norvig, chapter 3). States are expanded in the order in which they were found, and successors
are taken in the order in which they are given. So the path to a state is the canonical one: of the shortest paths the
first one in lexicographic order (semantics 4.2).

Distances on demand are distances to a goal for states that are asked for one after the other, each explored once. The
known states are closed: the successors of a known state are known, unless it is a goal. So a later request can change
no distance, and it explores only states that are not known yet.

Two engines explore whole sets of states at once, and each has a loop of its own: the dense and the array engine.
Decision 31 lists all searches that do not use this loop, with the reasons.
"""

from __future__ import annotations

import sys
from itertools import islice
from typing import TYPE_CHECKING, Generic, TypeAlias, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    Successors: TypeAlias = Callable[[int], Iterable[tuple[int, int]]]

State = TypeVar("State")
Action = TypeVar("Action")


class BreadthFirst(Generic[State, Action]):
    """An exploration that can be stopped and continued.

    Attributes:
        parents: for each state found, in the order of discovery, the state and the action that it was found by; `None`
            for an initial state.
        states: all states found, in the order of discovery.
        expanded: how many of them were expanded.
    """

    def __init__(self, initial: Iterable[State], successors: Callable[[State], Iterable[tuple[Action, State]]]) -> None:
        """Find the initial states, and expand nothing.

        Args:
            initial: where to begin.
            successors: the actions that are enabled in a state, in order, each with the state that it leads to.
        """
        self.parents: dict[State, tuple[State, Action] | None] = dict.fromkeys(initial)
        self.states = list(self.parents)
        self.expanded = 0
        self._successors = successors
        self._queue = iter(self.states)  # sees the states that are appended while it is read

    @property
    def frontier(self) -> int:
        """The number of states that were found and not expanded."""
        return len(self.states) - self.expanded

    def expand_level(self) -> None:
        """Expand all states that were found and not expanded."""
        self.expand(len(self.states))

    def expand_all(self, is_goal: Callable[[State], bool] | None = None) -> State | None:
        """Expand states until there are none left, or a new one is a goal; return the goal."""
        return self.expand(sys.maxsize, is_goal)

    def expand(self, until: int, is_goal: Callable[[State], bool] | None = None) -> State | None:
        """Expand states until `until` of them have been expanded, or there are none left.

        Args:
            until: a number of states.
            is_goal: ends the exploration at the first new state for which it holds; initial states are not asked.

        Returns:
            The goal; `None` if none was found.
        """
        parents, successors, found = self.parents, self._successors, self.states.append
        count = self.expanded
        for count, state in enumerate(islice(self._queue, max(until - self.expanded, 0)), self.expanded + 1):
            for action, successor in successors(state):
                if successor not in parents:
                    parents[successor] = (state, action)
                    found(successor)
                    if is_goal is not None and is_goal(successor):
                        self.expanded = count
                        return successor
        self.expanded = count
        return None

    def actions_to(self, state: State) -> list[Action]:
        """Return the actions on the canonical path to a state that was found."""
        actions = []
        while (parent := self.parents[state]) is not None:
            state, action = parent
            actions.append(action)
        return actions[::-1]

    def depth(self, state: State) -> int:
        """Return the length of the canonical path to a state that was found."""
        return len(self.actions_to(state))


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
