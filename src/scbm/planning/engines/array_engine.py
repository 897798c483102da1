"""The engine for codes of up to 63 bits: states in sorted arrays, one level at a time, and their distances.

Distances are computed backwards along the edges between the states.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from scbm.planning.engines.array_functions import SortedRuns, Vectors, contained, distinct
from scbm.planning.engines.engine import check_bytes, check_states
from scbm.planning.engines.reduced_system import StateCodes

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.array_functions import Codes, Flags, Indices, VectorStep
    from scbm.planning.engines.engine import ExplorationLimits
    from scbm.planning.engines.reduced_system import ReducedRegion, ReducedSystem

    Places: TypeAlias = NDArray[np.int32]

_DISTANCE_CHUNK = 1 << 16

_BYTES_OF_EDGE = 32
"""Memory of an edge: its ends where they are found and where they are joined, its place in the order, and its source.
"""

_BYTES_OF_DISTANCE = 24
"""Memory of a state: its code, its distance, its first move, and where the edges to it begin."""

_NONE = -1
"""Stands for a distance where no path exists, and for a move where none leads closer."""


class ArrayDistances:
    """Distances and first moves of all states of a set, by their places in its array."""

    def __init__(self, codes: Codes, goals: Flags, steps: Sequence[VectorStep], limits: ExplorationLimits) -> None:
        """Make all edges, unless there is no goal.

        Args:
            codes: the states, in order; closed under the steps.
            goals: which of them are goals.
            steps: the steps, in order.
            limits: raises `LimitExceededError` if the edges need too much memory.
        """
        self._codes = codes
        self._steps = steps
        self._distances = np.where(goals, 0, _NONE).astype(np.int32)
        self._first = np.full(len(codes), _NONE, np.int32)
        if goals.any():
            self._measure(*self._edges_by_target(limits))
            self._choose()

    def distance(self, code: int) -> int | None:
        """Return the minimum number of moves to the goal; `None` if no path exists."""
        distance = int(self._distances[self._place(code)])
        return None if distance == _NONE else distance

    def first_move(self, code: int) -> tuple[int, int] | None:
        """Return the first move of the canonical path and its successor; `None` at the goal or without a path."""
        number = int(self._first[self._place(code)])
        if number == _NONE:
            return None
        step = self._steps[number]
        return step.index, int(step.transfer(np.array([code], np.uint64))[0])

    def _place(self, code: int) -> int:
        return int(np.searchsorted(self._codes, np.uint64(code)))

    def _edges(self) -> Iterator[tuple[int, Places, Places]]:
        """Yield, for each piece of the array and each step, the number of the step, its sources and its targets."""
        for begin in range(0, len(self._codes), _DISTANCE_CHUNK):
            chunk = self._codes[begin : begin + _DISTANCE_CHUNK]
            for number, step in enumerate(self._steps):
                enabled = np.flatnonzero(step.is_enabled(chunk))
                targets = np.searchsorted(self._codes, step.transfer(chunk[enabled]))
                yield number, (enabled + begin).astype(np.int32), targets.astype(np.int32)

    def _edges_by_target(self, limits: ExplorationLimits) -> tuple[Places, Indices]:
        """Return the sources of all edges in the order of their targets, and where the sources of each target begin."""
        found_sources: list[Places] = [np.empty(0, np.int32)]
        found_targets: list[Places] = [np.empty(0, np.int32)]
        count = 0
        for _, sources, targets in self._edges():
            moving = sources != targets
            found_sources.append(sources[moving])
            found_targets.append(targets[moving])
            count += len(found_sources[-1])
            check_bytes(count * _BYTES_OF_EDGE + len(self._codes) * _BYTES_OF_DISTANCE, limits)
        targets = np.concatenate(found_targets)
        found_targets.clear()
        begins = np.concatenate(([0], np.cumsum(np.bincount(targets, minlength=len(self._codes)))))
        order = np.argsort(targets)
        return np.concatenate(found_sources)[order], begins

    def _measure(self, sources: Places, begins: Indices) -> None:
        """Compute the distances level by level, backwards."""
        level = np.flatnonzero(self._distances == 0)
        distance = 0
        while len(level):
            distance += 1
            before = sources[_ranges(begins[level], begins[level + 1])]
            level = distinct(before[self._distances[before] == _NONE])
            self._distances[level] = distance

    def _choose(self) -> None:
        """Give each state the first step that leads closer."""
        for number, sources, targets in self._edges():
            distances = self._distances[sources]
            closer = (distances > 0) & (self._distances[targets] == distances - 1) & (self._first[sources] == _NONE)
            self._first[sources[closer]] = number


def _ranges(begins: Indices, ends: Indices) -> Indices:
    """Return all numbers of some ranges, one range after the other."""
    counts = ends - begins
    offsets = np.concatenate(([0], np.cumsum(counts)[:-1])) if len(counts) else counts
    ranges: Indices = np.repeat(begins - offsets, counts) + np.arange(counts.sum())
    return ranges


_CHUNK = 1 << 16
"""Number of states that are expanded together: enough for an array to pay, and few beside all states."""

_BYTES_OF_STATE = 32
"""Memory of a state: its code once in its array, and three times while arrays are merged."""


class ArrayEngine:
    """Explores level by level, on arrays."""

    def __init__(self, system: ReducedSystem, limits: ExplorationLimits) -> None:
        self.layout = StateCodes.fields(system.counts)
        self.limits = limits
        self.vectors = Vectors(self.layout)
        self.steps = tuple(map(self.vectors.step, system.moves))
        self._system = system

    def reach(self) -> ArrayStates:
        """Return all reachable states; each level contains only new states."""
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
        return distinct(np.concatenate([np.empty(0, np.uint64), *map(self._start, self._system.starts)]))

    def _start(self, region: ReducedRegion) -> Codes:
        """Return all combinations of the values of a region for which its condition holds."""
        codes = np.zeros(1, np.uint64)
        for stride, values in zip(self.layout.strides, region.values, strict=True):
            codes = np.add.outer(codes, np.array(values, np.uint64) * np.uint64(stride)).ravel()
        return codes[self.vectors.test(region.where)(codes)]


class ArrayStates:
    """A set of states that is closed under the moves."""

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

    def first(self, condition: NormalForm) -> int | None:
        """Return the least code in which the form holds."""
        holds = self._engine.vectors.test(condition)
        for chunk in chunks(self._codes):
            if len(holding := chunk[holds(chunk)]):
                return int(holding[0])
        return None

    def distances(self, goal: NormalForm) -> ArrayDistances:
        """Return the distances, computed backwards along all edges between these states."""
        is_goal = self._engine.vectors.test(goal)
        goals = np.concatenate([np.empty(0, np.bool_), *map(is_goal, chunks(self._codes))])
        return ArrayDistances(self._codes, goals, self._engine.steps, self._engine.limits)


def chunks(codes: Codes) -> Iterator[Codes]:
    """Yield an array in pieces."""
    for begin in range(0, len(codes), _CHUNK):
        yield codes[begin : begin + _CHUNK]
