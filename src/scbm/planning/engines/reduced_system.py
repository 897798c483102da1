"""Reduced systems: only the relevant variables, and only the values that they can ever have.

A state of a reduced system is one integer, its code: the sum over the variables of number times stride. The first
variable has the least stride, and no two states have the same code. So all layouts order the states alike: by the last
variable, then by the one before it, and so on.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.model.normal_form import NormalForm, allowed_values, bits_of, indices_of, normal_form
from scbm.model.packing import BitRange, bit_width
from scbm.planning.engines.delete_relaxation import Effect, RelaxedRule, relaxed_values
from scbm.planning.engines.joint_moves import JointMove, joint_moves, restricted, restricted_moves
from scbm.planning.engines.transition_system import narrowed, relevant

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from scbm.model import Predicate, StateSpace, Value
    from scbm.model.packing import ValueTable
    from scbm.planning.engines.transition_system import Region, TransitionSystem

Coordinates: TypeAlias = tuple[int, ...]
"""For each variable of a reduced system the index of its value among those that it can ever have."""


class ReducedRegion(Struct, frozen=True):
    """An initial region of a reduced system: for each variable the numbers of its values, and a condition."""

    values: tuple[tuple[int, ...], ...]
    where: NormalForm


class ReducedSystem(Struct, frozen=True, dict=True):
    """The system that an engine explores.

    Attributes:
        space: the relevant variables, in order, with their whole domains.
        values: for each of them the indices, in its domain, of the values that it can ever have; ascending.
        names: the names of all moves.
        moves: the moves that may be enabled and change something, in order, over these values.
        starts: the initial regions.
    """

    space: StateSpace
    values: tuple[tuple[int, ...], ...]
    names: tuple[str, ...]
    moves: tuple[JointMove, ...]
    starts: tuple[ReducedRegion, ...]

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """The number of values that each variable can have."""
        return tuple(map(len, self.values))

    def condition(self, predicate: Predicate) -> NormalForm:
        """Return the predicate over the reduced values. Raises `KeyError` if it reads any other variable."""
        return restricted(normal_form(predicate, self.space), self.values)

    def coordinates(self, state: Mapping[str, Value]) -> Coordinates | None:
        """Return the coordinates of a state, which may have more variables; `None` if it is outside."""
        found = []
        for variable, numbers in zip(self.space, self._numbers, strict=True):
            number = numbers.get(variable.domain.index(state[variable.name]))
            if number is None:
                return None
            found.append(number)
        return tuple(found)

    @cached_property
    def _numbers(self) -> tuple[dict[int, int], ...]:
        return tuple({index: number for number, index in enumerate(indices)} for indices in self.values)

    def state(self, coordinates: Coordinates) -> dict[str, Value]:
        """Return the values of the relevant variables."""
        places = zip(self.space, self.values, coordinates, strict=True)
        return {variable.name: variable.domain.values[indices[number]] for variable, indices, number in places}


def reduce_system(system: TransitionSystem, starts: Sequence[Region], observed: Iterable[str] = ()) -> ReducedSystem:
    """Return the reduced system that has all states reachable from some regions.

    Args:
        system: the system to reduce.
        starts: the initial regions. Raises `KeyError` for a value outside its domain, or a variable without values.
        observed: variables that are relevant besides those that the moves and the regions read.
    """
    space = relevant(system, [*observed, *(name for region in starts for name in region.where.reads())])
    return SystemReducer(narrowed(system, space)).reduced(starts)


class SystemReducer:
    """Reduces one system for different initial regions; its moves are joined once.

    Attributes:
        system: the system, with relevant variables only.
    """

    def __init__(self, system: TransitionSystem) -> None:
        self.system = system
        self._names = tuple(move.name for move in system.moves)
        self._moves = joint_moves(system)
        self._rules = tuple(map(_relaxed, self._moves))

    def reduced(self, starts: Sequence[Region]) -> ReducedSystem:
        """Return the reduced system that has all states reachable from some regions."""
        space = self.system.space
        regions = [_whole_region(region, space) for region in starts]
        values = tuple(map(indices_of, relaxed_values(self._rules, _values_at(regions, space))))
        possible = restricted_moves(self._moves, values)
        return ReducedSystem(
            space,
            values,
            self._names,
            tuple(move for move in possible if move.guard is not False and move.writes),
            tuple(_restricted_region(region, values) for region in regions),
        )


def _whole_region(region: Region, space: StateSpace) -> ReducedRegion:
    """Return a region over whole domains."""
    indices = (map(variable.domain.index, region.values[variable.name]) for variable in space)
    return ReducedRegion(tuple(tuple(dict.fromkeys(found)) for found in indices), normal_form(region.where, space))


def _values_at(regions: Sequence[ReducedRegion], space: StateSpace) -> list[int]:
    """Return the values of each variable in any of the regions, as bits; all 0 if no region has a state."""
    values = [0 for _ in space]
    for region in regions:
        found = [bits_of(indices) & allowed_values(region.where, v) for v, indices in enumerate(region.values)]
        if all(found) and region.where is not False:
            values = [known | more for known, more in zip(values, found, strict=True)]
    return values


def _relaxed(move: JointMove) -> RelaxedRule:
    """Return the move as a rule of the delete relaxation; its effects start from values that the guard allows."""
    return RelaxedRule(move.guard, tuple(_effect(write, move.guard) for write in move.writes))


def _effect(write: ValueTable, guard: NormalForm) -> Effect:
    allowed, table = allowed_values(guard, write.source), write.indices

    def image(sources: int) -> int:
        return bits_of(index for i in indices_of(sources & allowed) if (index := table[i]) is not None)

    return Effect(write.target, write.source, image)


def _restricted_region(region: ReducedRegion, values: Sequence[tuple[int, ...]]) -> ReducedRegion:
    numbers = ({index: number for number, index in enumerate(indices)} for indices in values)
    kept = (tuple(known[i] for i in found if i in known) for known, found in zip(numbers, region.values, strict=True))
    return ReducedRegion(tuple(kept), restricted(region.where, values))


class StateCodes(Struct, frozen=True):
    """The layout of codes.

    Attributes:
        counts: how many values each variable has.
        strides: what adding one to each variable adds to the code.
        size: the upper bound of codes, exclusive.
    """

    counts: tuple[int, ...]
    strides: tuple[int, ...]
    size: int

    @staticmethod
    def dense(counts: tuple[int, ...]) -> StateCodes:
        """Return a layout without gaps (mixed radix): `size` is the number of states."""
        strides, size = [], 1
        for count in counts:
            strides.append(size)
            size *= count
        return StateCodes(counts, tuple(strides), size)

    @staticmethod
    def fields(counts: tuple[int, ...]) -> StateCodes:
        """Return a layout with a field of whole bits for each variable: `size` is a power of two."""
        strides, bits = [], 0
        for count in counts:
            strides.append(1 << bits)
            bits += bit_width(count)
        return StateCodes(counts, tuple(strides), 1 << bits)

    def bit_ranges(self) -> tuple[BitRange, ...]:
        """Return the field of each variable, in a layout made by `fields`."""
        pairs = zip(self.strides, self.counts, strict=True)
        return tuple(
            BitRange(stride.bit_length() - 1, ((1 << bit_width(count)) - 1) * stride) for stride, count in pairs
        )

    def code(self, coordinates: Coordinates) -> int:
        """Return the code of a state."""
        return sum(number * stride for number, stride in zip(coordinates, self.strides, strict=True))

    def coordinates(self, code: int) -> Coordinates:
        """Return the state of a code."""
        ends = (*self.strides[1:], self.size)
        return tuple(code % end // stride for stride, end in zip(self.strides, ends, strict=False))
