"""The breadth-first search on arrays: the same order of states and moves, and thousands of states at once.

Each level is an array of states in the order in which the breadth-first search finds them, with the state and the move
that each was found by. So the first goal that is found ends the canonical plan.

A long search asks for a shortcut. Then it goes on from both ends: the smaller of the last level and the perimeter of a
goal is extended. Once they meet, only states whose distance from the goal is known to be right are kept. These are the
states on shortest plans, in the same order as before.
"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from msgspec.structs import replace

from scbm.planning.plan_answers import Answer, Limit, LimitReached, Solved, Unsolvable, raise_if_cancelled
from scbm.planning.searches.array_states import ArrayProblem, KeyCollisionError, VisitedStates
from scbm.planning.searches.perimeter import Perimeter, TooManyGoalsError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from scbm.planning.searches.array_states import Words
    from scbm.planning.searches.search_request import SearchRequest

    Places: TypeAlias = NDArray[np.int32]

_BLOCK = 1 << 13
"""Number of states that are expanded before their successors are joined with the states found so far."""

_POLL_INTERVAL = 1_000
"""Number of expanded states after which a search asks again whether it is cancelled."""

PERIMETER_AFTER = 1 << 14
"""Number of expanded states after which the search goes on from both ends; fewer take less time than to prepare it."""


class ArraySearch(ArrayProblem):
    """Finds canonical plans to one goal."""

    def answer(self, request: SearchRequest) -> Answer:
        """Return the answer of the breadth-first search.

        While it goes forwards only, the number of expanded states is the same, too.
        """
        for attempt in count():
            try:
                return _ArrayLevels(self, request, attempt).answer()
            except KeyCollisionError:
                continue
        raise AssertionError


class _ArrayLevels:
    """One search, level by level.

    Attributes:
        level: the states of the last level, in the order in which the breadth-first search finds them.
        parents: for each level after the first and each of its states the state and the move that it was found by.
    """

    def __init__(self, search: ArrayProblem, request: SearchRequest, attempt: int) -> None:
        self._search = search
        self._request = request
        self._attempt = attempt
        self.level = search.layout.state(request.start)
        self.parents: list[tuple[Places, Places]] = []
        self._found = VisitedStates(search.layout.words, attempt)
        self._found.add(self.level)
        self._forwards = 0
        self._next_poll = _POLL_INTERVAL
        self._is_long = False
        self._perimeter: Perimeter | None = None

    def answer(self) -> Answer:
        while self.level.shape[1]:
            answer = self._grow()
            if answer is not None:
                return answer
            if self._perimeter is not None:
                meeting = self._perimeter.levels[-1].contains(self.level)
                if meeting.any():
                    return self._between(self._perimeter, np.flatnonzero(meeting))
        return Unsolvable(self._expanded)

    def _grow(self) -> Answer | None:
        """Extend the level or the perimeter; return the answer if the search ends there."""
        if not self._is_long and self._forwards >= PERIMETER_AFTER:
            self._is_long = True
            shortcut = self._request.shortcut()
            if shortcut is not None:
                return replace(shortcut, expanded=self._forwards + shortcut.expanded)
            self._perimeter = self._new_perimeter()
        perimeter = self._perimeter_to_grow()
        if perimeter is not None:
            raise_if_cancelled(self._request.should_continue)
            perimeter.grow()
            return None if perimeter.frontier.shape[1] else Unsolvable(self._expanded)
        if not self._left:
            return LimitReached(Limit.EXPANSIONS, self._expanded)
        if len(self.parents) >= self._request.limits.length:
            return self._deepest()
        return self._expand()

    @property
    def _expanded(self) -> int:
        return self._forwards + (self._perimeter.expanded if self._perimeter else 0)

    @property
    def _left(self) -> int:
        """Return how many more states may be expanded forwards."""
        return self._request.limits.expansions - self._forwards

    # forwards

    def _expand(self) -> Answer | None:
        """Expand the level; return the answer if the search ends there."""
        levels, sources, columns = [self.level[:, :0]], [_NO_PLACES], [_NO_PLACES]
        for states, begin in self._blocks():
            after, source, column = self._new(states)
            source += begin
            goals = np.flatnonzero(self._search.is_goal(after))
            if len(goals):
                first = goals[:1]
                self.parents.append((source[first], column[first]))
                self._forwards += int(source[first[0]]) + 1
                return Solved(self._plan(), self._expanded)
            levels.append(after)
            sources.append(source)
            columns.append(column)
        if self.level.shape[1] > self._left:
            self._forwards += self._left
            return LimitReached(Limit.EXPANSIONS, self._expanded)
        self._forwards += self.level.shape[1]
        self.level = np.concatenate(levels, axis=1)
        self.parents.append((np.concatenate(sources), np.concatenate(columns)))
        return None

    def _deepest(self) -> Answer:
        """Return the answer at the maximum length: unsolvable if this level has no new successor."""
        for states, begin in self._blocks():
            _, source, _ = self._new(states)
            if len(source):
                self._forwards += begin + int(source[0]) + 1
                return LimitReached(Limit.LENGTH, self._expanded)
        is_complete = self.level.shape[1] <= self._left
        self._forwards += min(self.level.shape[1], self._left)
        return Unsolvable(self._expanded) if is_complete else LimitReached(Limit.EXPANSIONS, self._expanded)

    def _blocks(self) -> Iterator[tuple[Words, int]]:
        """Yield the states of the level that may be expanded, in blocks, each with the number of its first state."""
        end = min(self.level.shape[1], self._left)
        for begin in range(0, end, _BLOCK):
            if self._forwards + begin >= self._next_poll:
                raise_if_cancelled(self._request.should_continue)
                self._next_poll = self._forwards + begin + _POLL_INTERVAL
            yield self.level[:, begin : min(begin + _BLOCK, end)], begin

    def _new(self, states: Words) -> tuple[Words, Places, Places]:
        """Return the successors that are found first here, with their states and moves; they count as found now."""
        after, sources, columns = self._successors(states)
        new = self._found.add(after)
        return after[:, new], sources[new], columns[new]

    def _successors(self, states: Words) -> tuple[Words, Places, Places]:
        parts = list(self._search.moves.successors(states))
        sources, columns = (np.concatenate([part[i] for part in parts]).astype(np.int32) for i in (1, 2))
        return np.concatenate([part[0] for part in parts], axis=1), sources, columns

    def _plan(self) -> tuple[str, ...]:
        """Return the plan to the first state of the last level."""
        names, indices = self._search.system.names, self._search.moves.indices
        plan, place = [], 0
        for sources, columns in reversed(self.parents):
            plan.append(names[indices[columns[place]]])
            place = int(sources[place])
        return tuple(reversed(plan))

    # from both ends

    def _perimeter_to_grow(self) -> Perimeter | None:
        """Return the perimeter if it is to be extended next, rather than the level."""
        perimeter, limits = self._perimeter, self._request.limits
        if perimeter is None or len(self.parents) + len(perimeter.levels) > limits.length:
            return None
        size = perimeter.frontier.shape[1]
        if perimeter.expanded + size > limits.expansions:
            return None
        return perimeter if size <= self.level.shape[1] or self.level.shape[1] > self._left else None

    def _new_perimeter(self) -> Perimeter | None:
        try:
            return Perimeter(self._search, self._request.start, self._attempt)
        except TooManyGoalsError:
            return None

    def _between(self, perimeter: Perimeter, meeting: NDArray[np.int64]) -> Answer:
        """Return the plan through the states of the level that are in the last level of the perimeter."""
        if len(self.parents) + len(perimeter.levels) - 1 > self._request.limits.length:
            return LimitReached(Limit.LENGTH, self._expanded)
        self.level = self.level[:, meeting]
        if self.parents:
            sources, columns = self.parents[-1]
            self.parents[-1] = sources[meeting], columns[meeting]
        for closer in reversed(perimeter.levels[:-1]):
            after, sources, columns = self._successors(self.level)
            self._forwards += self.level.shape[1]
            kept = np.flatnonzero(closer.contains(after))
            kept = kept[VisitedStates(self._search.layout.words, self._attempt).add(after[:, kept])]
            self.level = after[:, kept]
            self.parents.append((sources[kept], columns[kept]))
        return Solved(self._plan(), self._expanded)


_NO_PLACES = np.empty(0, np.int32)
