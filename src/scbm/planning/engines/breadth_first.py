"""Breadth-first exploration of a graph whose states are given by what follows from them.

The one loop behind the planner, the exploration of planning states, the hash engine, distances on demand and the graph
of all runs (Russell and Norvig, chapter 3). States are expanded in the order in which they were found, and successors
are taken in the order in which they are given. So the path to a state is the canonical one: of the shortest paths the
first one in lexicographic order (semantics 4.2).

Two engines explore whole sets of states at once, and each has a loop of its own: the dense and the array engine.
"""

from __future__ import annotations

import sys
from itertools import islice
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

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
        """How many states were found and not expanded."""
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
