"""Monitors of requirements: they find the first violation of each requirement in a trace (semantics 7.3).

The forms in `model.requirements` say what violates a sentence. A monitor shows a sentence the states of a trace, and
finds the records that show the violation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct

from scbm.cases.trace import End, Record, RequestCancelled, RunEnded, RunnerStarted, state_after
from scbm.model import format_moment, format_value
from scbm.model.requirements import ObservedState
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.trace import Changes
    from scbm.model import Requirement, Value

LIMIT_WORDS = {
    End.TIME_LIMIT: "the time limit ends the run",
    End.REPLAN_LIMIT: "the limit of plans ends the run",
    End.PLANNER_LIMIT: "a limit of the planner ends the run",
    End.NO_PLAN_FOUND: "the run ends, as the planner finds no plan",
}
"""The ends that are limits, each as a clause."""


class Violation(Struct, frozen=True):
    """The first violation of a requirement in a run.

    Attributes:
        requirement: its name.
        at_ns: when.
        record: the index in the trace of the record that brought it about.
        begins: the index of the record from which on the trace shows it; the same, if that one record does.
        reason: what is wrong, in words.
        operation: the current operation, or `none`.
        values: the variables that the requirement reads, as they were.
        is_built_in: whether the requirement is a built-in one; the reason then names what to change.
    """

    requirement: str
    at_ns: int
    record: int
    begins: int
    reason: str
    operation: str
    values: Changes
    is_built_in: bool = False

    def __str__(self) -> str:
        if self.is_built_in:
            return f"{self.requirement} is violated at {format_moment(self.at_ns)}: {self.reason}"
        values = ", ".join(f"{name} == {format_value(value)}" for name, value in self.values)
        seconds = format_moment(self.at_ns)
        current = "no operation is" if self.operation == NO_OPERATION else f"{self.operation} is"
        return f"{self.requirement} is violated at {seconds}, while {current} current: {self.reason} ({values})"


class WatchedRun:
    """The states that one sentence sees of a trace.

    Attributes:
        end_ns: the time of the last record.
        record: the index of the record of the last state; that of the last record once all states have been seen.
        state: the state after this record.
    """

    __slots__ = ("_limit", "_reads", "_records", "end_ns", "record", "state")

    def __init__(self, records: Sequence[Record], reads: Sequence[str]) -> None:
        self._records = records
        self._reads = frozenset(reads)
        self._limit = limit_of(records)
        self.end_ns = records[-1].at_ns
        self.record = 0
        self.state: dict[str, Value] = {}

    def __iter__(self) -> Iterator[ObservedState]:
        """Yield the state in which the runner starts, and each state in which a variable that is read has changed."""
        return self._states(len(self._records))

    @property
    def ends(self) -> str:
        """How the run ends; call it when all states have been seen."""
        if self._limit is None:
            return "the run ends"
        name, words = self.state[CURRENT_NAME], LIMIT_WORDS[End(self._limit.end.end)]
        return words if name == NO_OPERATION else f"{words} while {name} is {self.state[CURRENT_STATE]}"

    def before_limit(self) -> Iterator[ObservedState]:
        """Yield the same states without those of a limit that ends the run, which cancels requests first."""
        return self._states(len(self._records) if self._limit is None else self._limit.first)

    def _states(self, until: int) -> Iterator[ObservedState]:
        state, reads = self.state, self._reads
        for index, record in enumerate(self._records[:until]):
            changes = record.changes
            if isinstance(record, RunnerStarted):
                state.update(record.state)
                yield ObservedState(record.at_ns, index, state)
            if not changes:
                continue  # most records of a long run
            state.update(changes)
            for name, _ in changes:
                if name in reads:
                    self.record = index
                    yield ObservedState(record.at_ns, index, state)
                    break
        self.record = min(until, len(self._records) - 1)


class LimitedEnd(NamedTuple):
    """The end of the last run of a trace by a limit.

    Attributes:
        first: the index of the first record that the limit brings about: it cancels requests, and then ends the run.
        end: the record of the end.
    """

    first: int
    end: RunEnded


def limit_of(records: Sequence[Record]) -> LimitedEnd | None:
    """Return the end of the last run if it is a limit."""
    last = next((n for n in range(len(records) - 1, -1, -1) if isinstance(records[n], RunEnded)), None)
    end = None if last is None else records[last]
    if last is None or not isinstance(end, RunEnded) or end.end not in LIMIT_WORDS:
        return None
    while isinstance(records[last - 1], RequestCancelled) and records[last - 1].at_ns == end.at_ns:
        last -= 1
    return LimitedEnd(last, end)


def find_violations(requirements: Sequence[Requirement], records: Sequence[Record]) -> tuple[Violation, ...]:
    """Return the first violation of each requirement in a trace, in the order of the requirements."""
    if not records:  # of a run that was lost
        return ()
    found = (_first_violation(requirement, records) for requirement in requirements)
    return tuple(violation for violation in found if violation is not None)


def _first_violation(requirement: Requirement, records: Sequence[Record]) -> Violation | None:
    reads = requirement.sentence.reads()
    run = WatchedRun(records, reads)
    found = requirement.sentence.first_violation(run)
    if found is None:
        return None
    index, state = run.record, run.state
    if found.at_ns < records[index].at_ns:  # it was seen only now that some time had passed
        index = max(i for i, record in enumerate(records[:index]) if record.at_ns <= found.at_ns)
        state = state_after(records[: index + 1])
    begins = index if found.begins is None else min(found.begins, index)
    values = tuple((name, state[name]) for name in reads)
    return Violation(requirement.name, found.at_ns, index, begins, found.reason, str(state[CURRENT_NAME]), values)
