"""A state: one value for every variable (paper, Section II). Immutable and hashable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from scbm.model.values import Value, format_value

if TYPE_CHECKING:
    from scbm.model.variables import StateSpace


class State(Mapping[str, Value]):
    """A mapping from the name of each variable of a space to a value of its domain."""

    __slots__ = ("_values", "space")

    def __init__(self, space: StateSpace, values: Mapping[str, Value]) -> None:
        """Raise `ValueError` for a variable without a value, and a value without a variable or outside its domain."""
        unknown = [name for name in values if name not in space]
        if unknown:
            raise ValueError(f"no such variable: {', '.join(unknown)}")
        missing = [name for name in space.names if name not in values]
        if missing:
            raise ValueError(f"no value for {', '.join(missing)}")
        for variable in space:
            if values[variable.name] not in variable.domain:
                raise ValueError(f"{variable.name} cannot be {format_value(values[variable.name])}")
        self.space = space
        self._values = tuple(values[name] for name in space.names)

    @staticmethod
    def nominal(space: StateSpace) -> State:
        """Return the state in which every variable has its nominal value."""
        return State(space, {variable.name: variable.initial for variable in space})

    def __getitem__(self, name: str) -> Value:
        return self._values[self.space.position(name)]

    def __iter__(self) -> Iterator[str]:
        return iter(self.space.names)

    def __len__(self) -> int:
        return len(self._values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, State) and self.space == other.space and self._values == other._values

    def __hash__(self) -> int:
        return hash(self._values)

    def __str__(self) -> str:
        return ", ".join(f"{name}={format_value(value)}" for name, value in self.items())

    def __repr__(self) -> str:
        return f"State({self})"

    def replace(self, changes: Mapping[str, Value]) -> State:
        """Return the state with `changes`. Raises `ValueError` as `State(…)` does."""
        return State(self.space, {**self, **changes})
