"""Normal forms and moves as functions of arrays of codes, and growing sets of codes as sorted arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias, TypeVar, assert_never, cast

import numpy as np

from scbm.model.normal_form import AllOf, AnyOf, NormalForm, OneOf, Pair, indices_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from scbm.model import Value
    from scbm.model.packing import ValueTable
    from scbm.planning.engines.joint_moves import JointMove
    from scbm.planning.engines.reduced_system import StateCodes

    Codes: TypeAlias = NDArray[np.uint64]
    Indices: TypeAlias = NDArray[np.int64]
    Flags: TypeAlias = NDArray[np.bool_]
    Test: TypeAlias = Callable[[Codes], Flags]
    Transfer: TypeAlias = Callable[[Codes], Codes]

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


@dataclass(frozen=True, slots=True)
class VectorStep:
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
