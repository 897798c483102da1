"""The state at a moment of a run, from its records alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.trace.records import RunStarted

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.model import Value
    from scbm.trace.records import Record


def state_after(records: Iterable[Record]) -> dict[str, Value]:
    """The value of every variable behind these records; empty as long as no run has started."""
    state: dict[str, Value] = {}
    for record in records:
        if isinstance(record, RunStarted):
            state.update(record.state)
        if state:  # what changed before a run is in the state with which it starts
            state.update(record.changes)
    return state
