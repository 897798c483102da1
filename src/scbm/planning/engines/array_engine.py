"""The engine for codes of up to 63 bits: states in sorted arrays, one level at a time, and their distances.

Normal forms and moves are functions of arrays of codes, and growing sets of codes are sorted arrays. Distances are
computed backwards along the edges between the states.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias, TypeVar, assert_never, cast

import numpy as np
from msgspec import Struct

from scbm.model.normal_form import AllOf, AnyOf, NormalForm, OneOf, Pair, indices_of
from scbm.planning.engines.engine import check_bytes, check_states
from scbm.planning.engines.reduced_system import StateCodes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from scbm.model import Value
    from scbm.model.packing import ValueTable
    from scbm.planning.engines.engine import ExplorationLimits
    from scbm.planning.engines.joint_moves import JointMove
    from scbm.planning.engines.reduced_system import ReducedRegion, ReducedSystem

    Codes: TypeAlias = NDArray[np.uint64]
    Indices: TypeAlias = NDArray[np.int64]
    Flags: TypeAlias = NDArray[np.bool_]
    Test: TypeAlias = Callable[[Codes], Flags]
    Transfer: TypeAlias = Callable[[Codes], Codes]
    Places: TypeAlias = NDArray[np.int32]

Number = TypeVar("Number", np.uint64, np.int32)


class SortedRuns:
    """A set of codes in sorted arrays. Each array is more than twice as long as the next, so that there are few."""

    def __init__(self) -> None:
        self._runs: list[Codes] = []

    def __len__(self) -> int:
        return sum(map(len, self._runs))

    def add(self, codes: Codes) -> None:
        """Add sorted codes that are all new."""
        if not len(codes):
            return
        while self._runs and len(self._runs[-1]) <= 2 * len(codes):
            codes = _merged(self._runs.pop(), codes)
        self._runs.append(codes)

    def without(self, codes: Codes) -> Codes:
        """Return those of some sorted codes that are not in the set."""
        for run in self._runs:
            codes = codes[~contained(codes, run)]
        return codes

    def all(self) -> Codes:
        """Return all codes, sorted, as one array."""
        while len(self._runs) > 1:
            self._runs.append(_merged(self._runs.pop(), self._runs.pop()))
        return self._runs[0] if self._runs else np.empty(0, np.uint64)


def distinct(numbers: NDArray[Number]) -> NDArray[Number]:
    """Return each of the numbers once, sorted. Sorting takes a tenth of the time of hashing (`numpy.unique`)."""
    numbers = np.sort(numbers)
    is_first = np.ones(len(numbers), np.bool_)
    np.not_equal(numbers[1:], numbers[:-1], out=is_first[1:])
    return numbers[is_first]


def contained(codes: Codes, run: Codes) -> NDArray[np.bool_]:
    """Return which of the codes are in a sorted array."""
    if not len(run):
        return np.zeros(len(codes), np.bool_)
    places = np.searchsorted(run, codes)
    found: NDArray[np.bool_] = run[np.minimum(places, len(run) - 1)] == codes
    return found


def _merged(one: Codes, other: Codes) -> Codes:
    """Return both arrays merged; the stable sort finds the two sorted runs."""
    both = np.concatenate((one, other))
    both.sort(kind="stable")
    return both


class VectorStep(Struct, frozen=True):
    """A move as functions of arrays.

    Attributes:
        index: the place of the move in its system.
        is_enabled: in which states the move is enabled.
        transfer: the successors of states in which the move is enabled.
    """

    index: int
    is_enabled: Test
    transfer: Transfer


class Vectors:
    """Compiles normal forms and moves for one layout of fields; constants are one AND and one OR."""

    def __init__(self, layout: StateCodes) -> None:
        self._shifts = tuple(stride.bit_length() - 1 for stride in layout.strides)
        self._masks = tuple((1 << max(count - 1, 0).bit_length()) - 1 for count in layout.counts)

    def test(self, condition: NormalForm) -> Test:
        """Return the form as a function from codes to flags."""
        match condition:
            case bool():
                return lambda codes: np.full(len(codes), condition)
            case OneOf():
                return self._one_of(condition)
            case Pair():
                return self._pair(condition)
            case AllOf(parts):
                return self._all_of(parts)
            case AnyOf(parts):
                tests = [self.test(part) for part in parts]
                return lambda codes: np.logical_or.reduce([test(codes) for test in tests])
            case _:
                assert_never(condition)

    def _one_of(self, literal: OneOf) -> Test:
        if literal.allowed.bit_count() == 1:
            return self._cube((literal,))
        read = self._reader(literal.variable)
        table = np.zeros(self._masks[literal.variable] + 1, np.bool_)
        table[list(indices_of(literal.allowed))] = True
        return lambda codes: table[read(codes)]

    def _all_of(self, parts: tuple[NormalForm, ...]) -> Test:
        """Compile literals with one value as one comparison, then the rest."""
        single = tuple(part for part in parts if isinstance(part, OneOf) and part.allowed.bit_count() == 1)
        tests = [self.test(part) for part in parts if part not in single]
        if single:
            tests.insert(0, self._cube(single))
        return lambda codes: np.logical_and.reduce([test(codes) for test in tests])

    def _cube(self, parts: tuple[OneOf, ...]) -> Test:
        mask = sum(self._masks[part.variable] << self._shifts[part.variable] for part in parts)
        bits = sum(part.allowed.bit_length() - 1 << self._shifts[part.variable] for part in parts)
        masked, wanted = np.uint64(mask), np.uint64(bits)
        return lambda codes: codes & masked == wanted

    def _pair(self, pair: Pair) -> Test:
        numbers = _numbers(pair)
        read_left, read_right = self._reader(pair.left), self._reader(pair.right)
        left, left_fits = _column(pair.left_values, numbers)
        right, right_fits = _column(pair.right_values, numbers)
        # The operators of numbers are those of arrays.
        compare = cast("Callable[[Indices, Indices], Flags]", pair.compare)

        def test(codes: Codes) -> Flags:
            one, other = read_left(codes), read_right(codes)
            compared = compare(left[one], right[other])
            return (compared if pair.wanted else ~compared) & left_fits[one] & right_fits[other]

        return test

    def step(self, step: JointMove) -> VectorStep:
        """Return a move as functions of arrays."""
        return VectorStep(step.index, self.test(step.guard), self._transfer(step))

    def _transfer(self, step: JointMove) -> Transfer:
        keep = ~np.uint64(sum(self._masks[write.target] << self._shifts[write.target] for write in step.writes))
        tables = [self._table(write) for write in step.writes]
        bits = np.uint64(sum(table[0] for _, table in tables if len(frozenset(table)) == 1))
        moving = [(read, np.array(table, np.uint64)) for read, table in tables if len(frozenset(table)) > 1]

        def transfer(codes: Codes) -> Codes:
            after: Codes = codes & keep | bits
            for read, table in moving:
                after |= table[read(codes)]
            return after

        return transfer

    def _table(self, write: ValueTable) -> tuple[Callable[[Codes], Indices], list[int]]:
        """Return how the source is read, and the bits of the new value for each of its values.

        Where the move is not enabled any value will do. The first new value is taken, so that constants are seen as
        such.
        """
        known = [after for after in write.indices if after is not None]
        placed = [(known[0] if after is None else after) << self._shifts[write.target] for after in write.indices]
        return self._reader(write.source), placed

    def _reader(self, variable: int) -> Callable[[Codes], Indices]:
        """Return a function that reads a variable; codes have 63 bits, so that signed indices have the same value."""
        shift, mask = np.uint64(self._shifts[variable]), np.uint64(self._masks[variable])
        return lambda codes: (codes >> shift & mask).view(np.int64)


def _numbers(pair: Pair) -> dict[Value, int]:
    """Return a number for each value that is compared; the numbers compare like the values."""
    values = (value for value in (*pair.left_values, *pair.right_values) if value is not None)
    if pair.is_order:
        return {value: int(value) for value in values}
    return {value: number for number, value in enumerate(dict.fromkeys(values))}


def _column(values: tuple[Value | None, ...], numbers: dict[Value, int]) -> tuple[Indices, Flags]:
    """Return the numbers of a column of values, and where there is a value."""
    found = [0 if value is None else numbers[value] for value in values]
    return np.array(found, np.int64), np.array([value is not None for value in values], np.bool_)


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
