"""Repetitions: a run without progress does the same again and again until a limit ends it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.trace.records import MeasurementReceived, PlanAsked, RunEnded

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    from scbm.cases.trace.records import Record

FEWEST_TURNS = 5
"""Minimum number of equal turns that count as a repetition."""

_MAX_TURN = 200
"""Maximum number of records of one turn."""

_DIFFERENT = ("at_ns", "ask", "request")
"""The fields that differ between equal turns: times and numbers."""


class Repetition(Struct, frozen=True):
    """The last part of a run, in which one turn repeats: with a question for a plan, or of changes from outside only.

    Attributes:
        begin: the index of the first record of the first turn.
        length: the number of records of a turn.
        turns: the number of turns.
        until_ns: the time of the last record of the last turn.
    """

    begin: int
    length: int
    turns: int
    until_ns: int

    @property
    def words(self) -> str:
        """The number of turns."""
        return f"repeats {self.turns} times"

    @property
    def end(self) -> int:
        """The index of the record behind the last turn."""
        return self.begin + self.length * self.turns

    def hides(self, index: int) -> bool:
        """Return whether a record belongs to a turn that the story of a run leaves out: any but the first."""
        return self.begin + self.length <= index < self.end


def find_repetition(records: Sequence[Record]) -> Repetition | None:
    """Return the repetition with which the last run for a goal ends; `None` if it does not repeat so."""
    last = next((index for index in reversed(range(len(records))) if isinstance(records[index], RunEnded)), None)
    turning = (record for record in records if isinstance(record, (PlanAsked, MeasurementReceived)))
    if last is None or sum(1 for _ in turning) < FEWEST_TURNS:
        return None
    keys = [_key(record) for record in records[:last]]
    for length in range(1, min(_MAX_TURN, last // FEWEST_TURNS) + 1):
        first = last - 1
        while first >= length and keys[first] == keys[first - length]:
            first -= 1
        begin = first - length + 1
        start = _start(records, range(begin, begin + length))
        if start is not None and (last - start) // length >= FEWEST_TURNS:
            turns = (last - start) // length
            return Repetition(start, length, turns, records[start + length * turns - 1].at_ns)
    return None


def _start(records: Sequence[Record], turn: range) -> int | None:
    """Return the record with which a turn begins: its question for a plan, or the first if all come from outside."""
    if all(isinstance(records[index], MeasurementReceived) for index in turn):
        return turn.start
    return next((index for index in turn if isinstance(records[index], PlanAsked)), None)


def _key(record: Record) -> Hashable:
    """Return what is equal in equal turns."""
    names = (name for name in record.__struct_fields__ if name not in _DIFFERENT)
    return record.kind, tuple(getattr(record, name) for name in names)
