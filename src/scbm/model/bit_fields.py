"""Bit fields: the layout of packed states. Each variable has a field with the index of its value in its domain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.model.values import Value
    from scbm.model.variables import StateSpace, Variable


@dataclass(frozen=True, slots=True)
class BitRange:
    """A range of bits of an integer.

    Attributes:
        shift: the lowest bit.
        mask: all its bits, in place.
    """

    shift: int
    mask: int

    def index(self, packed: int) -> int:
        """Return the number that an integer has here."""
        return (packed & self.mask) >> self.shift


@dataclass(frozen=True, slots=True)
class Field(BitRange):
    """The range of bits that has the index of a variable's value in its domain.

    Attributes:
        variable: the variable.
        width: how many bits; 0 for a domain of one value.
    """

    variable: Variable
    width: int

    def bits(self, value: Value) -> int:
        """Return a value, in place. Raises `KeyError` if it is outside the domain."""
        return self.variable.domain.index(value) << self.shift


def bit_width(count: int) -> int:
    """Return the number of bits that `count` different numbers need."""
    return max(count - 1, 0).bit_length()


def lay_out(space: StateSpace) -> tuple[Field, ...]:
    """Return a field for each variable of the space, one after the other."""
    fields = []
    shift = 0
    for variable in space:
        width = bit_width(len(variable.domain))
        fields.append(Field(shift, ((1 << width) - 1) << shift, variable, width))
        shift += width
    return tuple(fields)
