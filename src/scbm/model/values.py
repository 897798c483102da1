"""Values and their finite domains (paper, Section II)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import TypeAlias

Value: TypeAlias = bool | int | str
"""A boolean, an integer of a range, or a symbol."""


class ValueKind(StrEnum):
    """The kind of values of a domain. Values of different kinds are never compared."""

    BOOLEAN = "bool"
    SYMBOL = "symbol"
    INTEGER = "integer"


def kind_of(value: Value) -> ValueKind:
    """Return the kind of a value. Booleans are tested first, because `True` is an `int` in Python."""
    if isinstance(value, bool):
        return ValueKind.BOOLEAN
    return ValueKind.INTEGER if isinstance(value, int) else ValueKind.SYMBOL


def format_value(value: Value) -> str:
    """Return the value as it is written in a model file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)


@dataclass(frozen=True)
class Domain:
    """The finite, ordered set of values of a variable. Never empty, all values of one kind."""

    values: tuple[Value, ...]

    @staticmethod
    def boolean() -> Domain:
        """Return `bool`: false, then true."""
        return Domain((False, True))

    @staticmethod
    def symbols(*symbols: str) -> Domain:
        """Return `[a, b, c]`, in this order."""
        return Domain(symbols)

    @staticmethod
    def integers(low: int, high: int) -> Domain:
        """Return `low..high`, both ends included."""
        return Domain(tuple(range(low, high + 1)))

    @property
    def kind(self) -> ValueKind:
        """The kind of all values."""
        return kind_of(self.values[0])

    def __len__(self) -> int:
        return len(self.values)

    def __contains__(self, value: object) -> bool:
        if not isinstance(value, (int, str)) or value not in self._positions:
            return False
        return isinstance(value, bool) is isinstance(self.values[0], bool)  # 0 and 1 equal the values of `bool`

    @cached_property
    def _positions(self) -> dict[Value, int]:
        return {value: position for position, value in enumerate(self.values)}

    def index(self, value: Value) -> int:
        """Return the index of a value, from 0. Raises `KeyError` for any other value."""
        return self._positions[value]

    def __str__(self) -> str:
        if self.kind is ValueKind.BOOLEAN:
            return "bool"
        if self.kind is ValueKind.INTEGER:
            return f"{self.values[0]}..{self.values[-1]}"
        return f"[{', '.join(map(format_value, self.values))}]"

    def __hash__(self) -> int:
        return hash((self.kind, self.values))

    def __eq__(self, other: object) -> bool:
        # (False, True) == (0, 1) to Python; to this language they are different domains.
        return isinstance(other, Domain) and self.kind is other.kind and self.values == other.values
