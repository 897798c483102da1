"""Distances of the states of a sorted array, backwards along the edges between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from scbm.exploring.limits import check_bytes
from scbm.exploring.sorted_runs import distinct

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from scbm.exploring.limits import Limits
    from scbm.exploring.vectors import Codes, Flags, Indices, VectorStep

    Places: TypeAlias = NDArray[np.int32]

_CHUNK = 1 << 16

_BYTES_OF_EDGE = 32
"""Both ends, where they are found and where they are joined; then the order of the edges, and their sources in it."""

_BYTES_OF_STATE = 24
"""Its code, its distance, its first move, and where the edges to it begin."""

_NONE = -1
"""Instead of a distance, where there is no way; instead of a move, where none leads closer."""


class ArrayDistances:
    """Distances and first moves of all states of a set, at their places in its array."""

    def __init__(self, codes: Codes, goals: Flags, steps: Sequence[VectorStep], limits: Limits) -> None:
        """Makes all edges, unless there is no goal.

        Args:
            codes: the states, in order; closed under the steps.
            goals: which of them are goals.
            steps: the steps, in order.
            limits: raises `LimitExceededError` if the edges take too much.
        """
        self._codes = codes
        self._steps = steps
        self._distances = np.where(goals, 0, _NONE).astype(np.int32)
        self._first = np.full(len(codes), _NONE, np.int32)
        if goals.any():
            self._measure(*self._edges_by_target(limits))
            self._choose()

    def distance(self, code: int) -> int | None:
        """The fewest moves to the goal; `None` if there is no way."""
        distance = int(self._distances[self._place(code)])
        return None if distance == _NONE else distance

    def first_move(self, code: int) -> tuple[int, int] | None:
        """The first move on the way, and where it leads; `None` at the goal, and where there is no way."""
        number = int(self._first[self._place(code)])
        if number == _NONE:
            return None
        step = self._steps[number]
        return step.index, int(step.transfer(np.array([code], np.uint64))[0])

    def _place(self, code: int) -> int:
        return int(np.searchsorted(self._codes, np.uint64(code)))

    def _edges(self) -> Iterator[tuple[int, Places, Places]]:
        """For each piece of the array and each step, in order: its number, and where it leads from and to."""
        for begin in range(0, len(self._codes), _CHUNK):
            chunk = self._codes[begin : begin + _CHUNK]
            for number, step in enumerate(self._steps):
                enabled = np.flatnonzero(step.is_enabled(chunk))
                targets = np.searchsorted(self._codes, step.transfer(chunk[enabled]))
                yield number, (enabled + begin).astype(np.int32), targets.astype(np.int32)

    def _edges_by_target(self, limits: Limits) -> tuple[Places, Indices]:
        """The sources of all edges in the order of their targets, and where those of each target begin."""
        found_sources: list[Places] = [np.empty(0, np.int32)]
        found_targets: list[Places] = [np.empty(0, np.int32)]
        count = 0
        for _, sources, targets in self._edges():
            moving = sources != targets
            found_sources.append(sources[moving])
            found_targets.append(targets[moving])
            count += len(found_sources[-1])
            check_bytes(count * _BYTES_OF_EDGE + len(self._codes) * _BYTES_OF_STATE, limits)
        targets = np.concatenate(found_targets)
        found_targets.clear()
        begins = np.concatenate(([0], np.cumsum(np.bincount(targets, minlength=len(self._codes)))))
        order = np.argsort(targets)
        return np.concatenate(found_sources)[order], begins

    def _measure(self, sources: Places, begins: Indices) -> None:
        """Level by level, backwards."""
        level = np.flatnonzero(self._distances == 0)
        distance = 0
        while len(level):
            distance += 1
            before = sources[_ranges(begins[level], begins[level + 1])]
            level = distinct(before[self._distances[before] == _NONE])
            self._distances[level] = distance

    def _choose(self) -> None:
        """Each state takes the first step that leads closer."""
        for number, sources, targets in self._edges():
            distances = self._distances[sources]
            closer = (distances > 0) & (self._distances[targets] == distances - 1) & (self._first[sources] == _NONE)
            self._first[sources[closer]] = number


def _ranges(begins: Indices, ends: Indices) -> Indices:
    """All numbers of some ranges, one range after the other."""
    counts = ends - begins
    offsets = np.concatenate(([0], np.cumsum(counts)[:-1])) if len(counts) else counts
    ranges: Indices = np.repeat(begins - offsets, counts) + np.arange(counts.sum())
    return ranges
