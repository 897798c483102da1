"""Masks: sets of states as large integers with bit i for the state of code i, and moves as shifts of masks.

A mask holds the states in which a normal form holds; bit planes hold one number per state. All states that agree in the
variables which a move sets and reads are shifted by the same distance.

A move has stages. No stage sets or reads a variable that another stage sets, so their order does not matter. A stage
needs one shift for each way to set its variables; one stage for all variables would need the product.
"""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING, TypeAlias, assert_never

from msgspec import Struct

from scbm.model.normal_form import (
    AllOf,
    AnyOf,
    NormalForm,
    OneOf,
    Pair,
    all_of,
    allowed_values,
    any_of,
    indices_of,
    one_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model.packing import ValueTable
    from scbm.planning.engines.joint_moves import JointMove
    from scbm.planning.engines.reduced_system import StateCodes

    Shifts: TypeAlias = tuple[dict[int, NormalForm], ...]

_BITS_OF_BYTE = tuple(tuple(bit for bit in range(8) if byte >> bit & 1) for byte in range(256))


def holds_bit(members: bytes, number: int) -> bool:
    """Return whether the number is in the set of bytes, little-endian; a large integer would be shifted as a whole."""
    return bool(members[number >> 3] >> (number & 7) & 1)


def codes_of(members: bytes) -> Iterator[int]:
    """Yield the numbers in the set in ascending order."""
    for place, byte in enumerate(members):
        for bit in _BITS_OF_BYTE[byte]:
            yield 8 * place + bit


class BitPlanes:
    """A number for each of many states, 0 at first. Plane k is the set of states whose number has bit k.

    Numbers are added to whole sets of states, to each state at most once. No more are added after the first look-up.
    """

    def __init__(self, size: int) -> None:
        self._bytes_of_plane = size // 8 + 1
        self._planes: list[int] = []
        self._frozen: list[bytes] = []

    def add(self, states: int, number: int) -> None:
        """Give all these states a number."""
        self._planes.extend([0] * (number.bit_length() - len(self._planes)))
        for k in range(number.bit_length()):
            if number >> k & 1:
                self._planes[k] |= states

    def __getitem__(self, code: int) -> int:
        if len(self._frozen) < len(self._planes):
            self._frozen = [plane.to_bytes(self._bytes_of_plane, "little") for plane in self._planes]
        return sum(1 << k for k, plane in enumerate(self._frozen) if holds_bit(plane, code))


class Masks:
    """Makes the masks of one dense layout; all have its width."""

    def __init__(self, layout: StateCodes) -> None:
        self._layout = layout
        self.everything = (1 << layout.size) - 1

    def of(self, condition: NormalForm) -> int:
        """Return the states in which the form holds."""
        match condition:
            case bool():
                return self.everything if condition else 0
            case OneOf(variable, allowed, _):
                return self.among(variable, allowed)
            case Pair():
                return self._pair(condition)
            case AllOf(parts):
                return self._all_of(parts)
            case AnyOf(parts):
                return self._any_of(parts)
            case _:
                assert_never(condition)

    def among(self, variable: int, allowed: int) -> int:
        """Return the states in which a variable has one of some values: a periodic pattern of bits."""
        stride, count = self._layout.strides[variable], self._layout.counts[variable]
        run = (1 << stride) - 1
        pattern = 0
        for value in range(count):
            if allowed >> value & 1:
                pattern |= run << (value * stride)
        return _repeated(pattern, count * stride, self._layout.size // (count * stride))

    def _pair(self, pair: Pair) -> int:
        mask = 0
        for left in range(len(pair.left_values)):
            if row := pair.row(left):
                mask |= self.among(pair.left, 1 << left) & self.among(pair.right, row)
        return mask

    def _all_of(self, parts: tuple[NormalForm, ...]) -> int:
        mask = self.everything
        for part in parts:
            mask &= self.of(part)
        return mask

    def _any_of(self, parts: tuple[NormalForm, ...]) -> int:
        mask = 0
        for part in parts:
            mask |= self.of(part)
        return mask


def _repeated(pattern: int, width: int, times: int) -> int:
    """Return a pattern repeated side by side, by doubling."""
    if times <= 1:
        return pattern * times
    half = _repeated(pattern, width, times // 2)
    doubled = half | half << (width * (times // 2))
    return doubled << width | pattern if times % 2 else doubled


class ShiftStage(Struct, frozen=True):
    """Variables that a move sets and that depend on each other.

    Attributes:
        writes: what the stage sets.
        choices: for every variable that it sets or reads the values that the guard of the move allows.
    """

    writes: tuple[ValueTable, ...]
    choices: Mapping[int, tuple[int, ...]]

    @property
    def combinations(self) -> int:
        """The number of combinations of the variables before the stage."""
        return prod(map(len, self.choices.values()))

    def joined(self, other: ShiftStage) -> ShiftStage:
        """Return both stages as one."""
        return ShiftStage((*self.writes, *other.writes), {**self.choices, **other.choices})

    def shifts(self, layout: StateCodes) -> dict[int, NormalForm]:
        """Return, for each distance, the condition under which codes are shifted so far, where the guard holds."""
        found: dict[int, list[NormalForm]] = {}
        for before in self._assignments():
            if (shift := self._shift(before, layout)) is not None:
                chosen = (one_of(v, 1 << value, layout.counts[v]) for v, value in before.items() if self._is_open(v))
                found.setdefault(shift, []).append(all_of(chosen))
        return {shift: any_of(conditions) for shift, conditions in found.items()}

    def _assignments(self) -> Iterator[dict[int, int]]:
        for values in product(*self.choices.values()):
            yield dict(zip(self.choices, values, strict=True))

    def _shift(self, before: Mapping[int, int], layout: StateCodes) -> int | None:
        shift = 0
        for write in self.writes:
            after = write.indices[before[write.source]]
            if after is None:
                return None
            shift += (after - before[write.target]) * layout.strides[write.target]
        return shift

    def _is_open(self, variable: int) -> bool:
        """Return whether the guard allows more than one value of the variable."""
        return len(self.choices[variable]) > 1


class ShiftedStep:
    """A move on sets of states: for each stage masks, and how far the states under each mask are shifted.

    Attributes:
        index: the place of the move in its system.
    """

    def __init__(self, step: JointMove, shifts: Shifts, layout: StateCodes, masks: Masks) -> None:
        self.index = step.index
        self._step = step
        self._layout = layout
        self._stages = tuple(
            tuple((masks.of(condition), shift) for shift, condition in stage.items()) for stage in shifts
        )

    def after(self, states: int) -> int:
        """Return the successors of these states."""
        for shifts in self._stages:
            found = 0
            for mask, shift in shifts:
                if moved := states & mask:
                    found |= _shifted(moved, shift)
            states = found
        return states

    def target(self, code: int) -> int:
        """Return the successor of one state in which the move is enabled."""
        coordinates = self._layout.coordinates(code)
        moved = list(coordinates)
        for write in self._step.writes:
            after = write.indices[coordinates[write.source]]
            assert after is not None  # noqa: S101 - where a table has nothing the step cannot be taken
            moved[write.target] = after
        return self._layout.code(tuple(moved))

    def before(self, states: int) -> int:
        """Return the predecessors of these states."""
        for shifts in reversed(self._stages):
            found = 0
            for mask, shift in shifts:
                found |= _shifted(states, -shift) & mask
            states = found
        return states


def _shifted(states: int, shift: int) -> int:
    return states << shift if shift >= 0 else states >> -shift


def shifts_of(step: JointMove, layout: StateCodes) -> Shifts:
    """Return the shifts of each stage of a move; the first stage includes its guard."""
    first, *others = (stage.shifts(layout) for stage in stages_of(step, layout))
    return ({shift: all_of((step.guard, condition)) for shift, condition in first.items()}, *others)


def stages_of(step: JointMove, layout: StateCodes) -> tuple[ShiftStage, ...]:
    """Return the stages of a move, at least one; the first has all writes that need one shift only."""
    ready = ShiftStage((), {})
    stages = [ShiftStage(tuple(writes), _choices(step, writes, layout)) for writes in _connected(step.writes)]
    for stage in stages:
        if stage.combinations == 1:
            ready = ready.joined(stage)
    others = [stage for stage in stages if stage.combinations != 1]
    if not others:
        return (ready,)
    return (ready.joined(others[0]), *others[1:])


def _choices(step: JointMove, writes: Sequence[ValueTable], layout: StateCodes) -> dict[int, tuple[int, ...]]:
    variables = dict.fromkeys(variable for write in writes for variable in (write.target, write.source))
    everything = {variable: (1 << layout.counts[variable]) - 1 for variable in variables}
    return {variable: indices_of(bits & allowed_values(step.guard, variable)) for variable, bits in everything.items()}


def _connected(writes: Sequence[ValueTable]) -> list[list[ValueTable]]:
    """Return the writes in groups that have no variable in common."""
    groups: list[list[ValueTable]] = []
    for write in writes:
        near = [group for group in groups if any(_share(write, other) for other in group)]
        groups = [group for group in groups if group not in near]
        groups.append([*(other for group in near for other in group), write])
    return groups


def _share(one: ValueTable, other: ValueTable) -> bool:
    return one.target in (other.target, other.source) or one.source in (other.target, other.source)
