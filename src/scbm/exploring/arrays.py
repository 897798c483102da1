"""The engine for codes of up to 63 bits: states in sorted arrays, all of one level at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from scbm.exploring.array_distances import ArrayDistances
from scbm.exploring.layout import Layout
from scbm.exploring.limits import check_bytes, check_states
from scbm.exploring.sorted_runs import SortedRuns, contained, distinct
from scbm.exploring.vectors import Vectors

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.exploring.box import Box, BoxRegion
    from scbm.exploring.conditions import Condition
    from scbm.exploring.limits import Limits
    from scbm.exploring.vectors import Codes

_CHUNK = 1 << 16
"""So many states are looked at in one go: enough for an array, and few beside all that are found."""

_BYTES_OF_STATE = 32
"""A code where it is kept, and three times while runs are merged."""


class ArrayEngine:
    """Explores level by level."""

    def __init__(self, box: Box, limits: Limits) -> None:
        self.layout = Layout.fields(box.counts)
        self.limits = limits
        self.vectors = Vectors(self.layout)
        self.steps = tuple(map(self.vectors.step, box.steps))
        self._box = box

    def reach(self) -> ArrayStates:
        """Level by level; of each level what was found before is left out."""
        found = SortedRuns()
        frontier = self._starts()
        while len(frontier):
            found.add(frontier)
            check_states(len(found), self.limits)
            check_bytes(len(found) * _BYTES_OF_STATE, self.limits)
            frontier = self._next_level(frontier, found)
        return ArrayStates(self, found.all())

    def _next_level(self, frontier: Codes, found: SortedRuns) -> Codes:
        level = SortedRuns()
        for chunk in chunks(frontier):
            reached = [step.transfer(chunk[step.is_enabled(chunk)]) for step in self.steps]
            level.add(level.without(found.without(distinct(np.concatenate([chunk[:0], *reached])))))
        return level.all()

    def _starts(self) -> Codes:
        return distinct(np.concatenate([np.empty(0, np.uint64), *map(self._start, self._box.starts)]))

    def _start(self, region: BoxRegion) -> Codes:
        """All combinations, of which those are kept in which the condition holds."""
        codes = np.zeros(1, np.uint64)
        for stride, values in zip(self.layout.strides, region.values, strict=True):
            codes = np.add.outer(codes, np.array(values, np.uint64) * np.uint64(stride)).ravel()
        return codes[self.vectors.test(region.where)(codes)]


class ArrayStates:
    """A set of states, closed under the moves."""

    def __init__(self, engine: ArrayEngine, codes: Codes) -> None:
        self._engine = engine
        self._codes = codes

    def __len__(self) -> int:
        return len(self._codes)

    def __contains__(self, code: object) -> bool:
        return isinstance(code, int) and bool(contained(np.array([code], np.uint64), self._codes)[0])

    def __iter__(self) -> Iterator[int]:
        for chunk in chunks(self._codes):
            yield from chunk.tolist()

    def first(self, condition: Condition) -> int | None:
        """The least code in which the condition holds."""
        holds = self._engine.vectors.test(condition)
        for chunk in chunks(self._codes):
            if len(holding := chunk[holds(chunk)]):
                return int(holding[0])
        return None

    def distances(self, goal: Condition) -> ArrayDistances:
        """Backwards along all edges between these states."""
        is_goal = self._engine.vectors.test(goal)
        goals = np.concatenate([np.empty(0, np.bool_), *map(is_goal, chunks(self._codes))])
        return ArrayDistances(self._codes, goals, self._engine.steps, self._engine.limits)


def chunks(codes: Codes) -> Iterator[Codes]:
    """An array in pieces that are small beside all that is found."""
    for begin in range(0, len(codes), _CHUNK):
        yield codes[begin : begin + _CHUNK]
