"""Measured values that mean nothing, told of while somebody can still mend their driver."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from scbm.model import Binding, format_value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.model import Reading, Value
    from scbm.running import Program
    from scbm.trace import Changes

_MOST_TOLD = 100
"""So many are told of: a driver may go on for ever."""

_LONGEST = 40
"""So many characters are shown of what a driver said."""


class Refusals:
    """Says of each variable once that a value for it was refused, and why.

    The runner refuses by the same rules, and its trace has all of them; but not what comes between runs.
    """

    def __init__(self, program: Program, complain: Callable[[str], None]) -> None:
        """Before any value has come.

        Args:
            program: of the model.
            complain: gets the sentences.
        """
        self._program = program
        self._bindings = {resource.name: resource.binding or Binding() for resource in program.model.resources}
        self._complain = complain
        self._told: list[tuple[str, str]] = []

    def look(self, resource: str, values: Changes, measurable: tuple[str, ...]) -> None:
        """Values came from a resource, which may be of certain variables."""
        for name, value in values:
            why = self._why_not(resource, name, value, measurable)
            if why is not None and (resource, name) not in self._told and len(self._told) < _MOST_TOLD:
                self._told.append((resource, name))
                self._complain(f"`{_shown(name)}`: {_shown(format_value(value))} is refused: {why}")

    def _why_not(self, resource: str, name: str, value: Value, measurable: tuple[str, ...]) -> str | None:
        if name not in measurable:
            return f"that is no variable that `{resource}` may measure"
        if value in self._program.packing.space[name].domain:
            return None
        readings = [reading for reading in _readings(self._bindings[resource]) if reading.variable == name]
        if any(reading.ranges for reading in readings):
            return "in no range of its binding"
        return "no text of its binding" if any(reading.texts for reading in readings) else "not in its domain"


def _readings(binding: Binding) -> Iterator[Reading]:
    for call in binding.calls:
        yield from (reading for _, reading in call.measured)
    yield from (measured.reading for measured in binding.measured)


def _shown(text: str) -> str:
    """On one line, whatever was sent."""
    shown = text if text.isprintable() else json.dumps(text)
    return shown if len(shown) <= _LONGEST else f"{shown[:_LONGEST]}…"
