"""Where each variable lies in a packed state: a field of bits that holds the index of its value in its domain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.model.values import Value
    from scbm.model.variables import StateSpace, Variable


@dataclass(frozen=True, slots=True)
class Field:
    """Where a variable lies in a packed state.

    Attributes:
        variable: what is packed there.
        shift: the lowest bit.
        width: how many bits; 0 for a domain of one value.
        mask: all its bits, in place.
    """

    variable: Variable
    shift: int
    width: int
    mask: int

    def bits(self, value: Value) -> int:
        """The value, in place. Raises `KeyError` if it is outside the domain."""
        return self.variable.domain.index(value) << self.shift

    def index(self, packed: int) -> int:
        """Which value of the domain the packed state has here."""
        return (packed & self.mask) >> self.shift


def lay_out(space: StateSpace) -> tuple[Field, ...]:
    """A field for each variable, one after the other."""
    fields = []
    shift = 0
    for variable in space:
        width = (len(variable.domain) - 1).bit_length()
        fields.append(Field(variable, shift, width, ((1 << width) - 1) << shift))
        shift += width
    return tuple(fields)
