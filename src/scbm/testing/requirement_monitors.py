"""Monitors of requirements: they check every state of a trace (semantics 7.3).

A monitor watches one sentence. It is shown the state at the beginning and after every record that changes a
variable which it reads, and says what is wrong as soon as something is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from scbm.cases.trace import Record, RunStarted, state_after
from scbm.model import (
    FORMS,
    AfterAlways,
    Always,
    Before,
    LeadsTo,
    Never,
    format_duration,
    format_moment,
    format_value,
)
from scbm.model.variables import CURRENT_NAME, NO_OPERATION

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.cases.trace import Changes
    from scbm.model import Requirement, RequirementForm, Value

    Valuation = Mapping[str, Value]
    Finding = tuple[int, str]
    """When a sentence was broken, and how."""


@dataclass(frozen=True, slots=True)
class Violation:
    """The first violation of a requirement in a run.

    Attributes:
        requirement: its name.
        at_ns: when.
        record: the index in the trace of the record that brought it about.
        begins: the index of the record from which on the trace shows it; the same, if that one record does.
        reason: what is wrong, in words.
        operation: the current operation, or `none`.
        values: the variables that the requirement reads, as they were.
    """

    requirement: str
    at_ns: int
    record: int
    begins: int
    reason: str
    operation: str
    values: Changes

    def __str__(self) -> str:
        values = ", ".join(f"{name} == {format_value(value)}" for name, value in self.values)
        seconds = format_moment(self.at_ns)
        current = "no operation is" if self.operation == NO_OPERATION else f"{self.operation} is"
        return f"{self.requirement} is violated at {seconds}, while {current} current: {self.reason} ({values})"


class RequirementMonitor(Protocol):
    """Watches one sentence over one run."""

    @property
    def is_open(self) -> bool:
        """Whether an earlier state can still lead to a violation, which then begins there."""
        ...

    def see(self, state: Valuation, at_ns: int) -> Finding | None:
        """Return the violation that the state shows, if any."""
        ...

    def end(self, at_ns: int) -> Finding | None:
        """Return the violation that the end of the run shows, if any."""
        ...


class _InvariantMonitor:
    """Watches `always p` and `never p`."""

    is_open = False

    def __init__(self, sentence: Always | Never, *, expected: bool) -> None:
        self._predicate = sentence.predicate
        self._expected = expected

    def see(self, state: Valuation, at_ns: int) -> Finding | None:
        if self._predicate.holds(state) is self._expected:
            return None
        return at_ns, f"{self._predicate} {'does not hold' if self._expected else 'holds'}"

    def end(self, at_ns: int) -> Finding | None:  # noqa: ARG002 - monitors are alike
        return None


class _LeadsToMonitor:
    """Watches `p leads to q [within d]`: keeps since when q is due."""

    def __init__(self, sentence: LeadsTo) -> None:
        self._sentence = sentence
        self._pending_since_ns: int | None = None

    @property
    def is_open(self) -> bool:
        return self._pending_since_ns is not None

    def see(self, state: Valuation, at_ns: int) -> Finding | None:
        late = self._late(at_ns)
        if late is not None:
            return late
        if self._sentence.effect.holds(state):
            self._pending_since_ns = None
        elif self._pending_since_ns is None and self._sentence.cause.holds(state):
            self._pending_since_ns = at_ns
        return None

    def end(self, at_ns: int) -> Finding | None:
        late = self._late(at_ns)
        if late is None and self._pending_since_ns is not None and self._sentence.within_ns is None:
            since = format_moment(self._pending_since_ns)
            return at_ns, f"the run ends, and {self._sentence.effect} has not held since {since}"
        return late

    def _late(self, at_ns: int) -> Finding | None:
        within_ns = self._sentence.within_ns
        if self._pending_since_ns is None or within_ns is None or at_ns - self._pending_since_ns <= within_ns:
            return None
        since = format_moment(self._pending_since_ns)
        reason = f"{self._sentence.effect} has not held within {format_duration(within_ns)} after {since}"
        return self._pending_since_ns + within_ns, reason


class _BeforeMonitor:
    """Watches `p before q`."""

    is_open = False

    def __init__(self, sentence: Before) -> None:
        self._sentence = sentence
        self._free = False

    def see(self, state: Valuation, at_ns: int) -> Finding | None:
        self._free = self._free or self._sentence.first.holds(state)
        if self._free or not self._sentence.second.holds(state):
            return None
        return at_ns, f"{self._sentence.second} holds, and {self._sentence.first} has not held yet"

    def end(self, at_ns: int) -> Finding | None:  # noqa: ARG002 - monitors are alike
        return None


class _AfterAlwaysMonitor:
    """Watches `after p always q until r`."""

    def __init__(self, sentence: AfterAlways) -> None:
        self._sentence = sentence
        self._bound = False

    @property
    def is_open(self) -> bool:
        return self._bound

    def see(self, state: Valuation, at_ns: int) -> Finding | None:
        self._bound = (self._bound or self._sentence.start.holds(state)) and not self._sentence.stop.holds(state)
        if not self._bound or self._sentence.predicate.holds(state):
            return None
        return at_ns, f"{self._sentence.predicate} does not hold, and {self._sentence.stop} has not held yet"

    def end(self, at_ns: int) -> Finding | None:  # noqa: ARG002 - monitors are alike
        return None


MONITORS: dict[type[RequirementForm], Callable[[Any], RequirementMonitor]] = {
    Always: partial(_InvariantMonitor, expected=True),
    Never: partial(_InvariantMonitor, expected=False),
    LeadsTo: _LeadsToMonitor,
    Before: _BeforeMonitor,
    AfterAlways: _AfterAlwaysMonitor,
}
"""The monitor of each form of requirements: it is called with the sentence that it watches."""


def monitor_of(sentence: RequirementForm) -> RequirementMonitor:
    """Return a monitor for a sentence. Raises `TypeError` for a form without one."""
    _refuse_unwatched([type(sentence)])
    return MONITORS[type(sentence)](sentence)


def _refuse_unwatched(forms: Iterable[type[RequirementForm]]) -> None:
    """Raise `TypeError` if a form has no monitor: its requirements would hold in every run."""
    for form in forms:
        if form not in MONITORS:
            raise TypeError(f"the form `{form.pattern}` has no monitor: add one for {form.__name__} to MONITORS")


_refuse_unwatched(FORMS.values())


def find_violations(requirements: Sequence[Requirement], records: Sequence[Record]) -> tuple[Violation, ...]:
    """Return the first violation of each requirement in a trace, in the order of the requirements."""
    found = (_first_violation(requirement, records) for requirement in requirements)
    return tuple(violation for violation in found if violation is not None)


def _first_violation(requirement: Requirement, records: Sequence[Record]) -> Violation | None:
    monitor, reads = monitor_of(requirement.sentence), requirement.sentence.reads()
    watched = dict.fromkeys(reads)
    state: dict[str, Value] = {}
    index, opened, found = 0, 0, None
    for index, record in enumerate(records):
        if not record.changes and not isinstance(record, RunStarted):
            continue  # most records of a long run; monitors see changes alone
        was_open = monitor.is_open
        found = _look(monitor, watched, state, record)
        opened = opened if was_open else index
        if found is not None:
            break
    else:
        found = monitor.end(records[-1].at_ns) if state else None
    if found is None:
        return None
    at_ns, reason = found
    if at_ns < records[index].at_ns:  # it was seen only now that some time had passed
        index = max(i for i, record in enumerate(records[:index]) if record.at_ns <= at_ns)
        state = state_after(records[: index + 1])
    values = tuple((name, state[name]) for name in reads)
    return Violation(requirement.name, at_ns, index, min(opened, index), reason, str(state[CURRENT_NAME]), values)


def _look(
    monitor: RequirementMonitor, watched: Mapping[str, object], state: dict[str, Value], record: Record
) -> Finding | None:
    """Apply a record to the state, and let a monitor see the state; do nothing before the run starts."""
    if isinstance(record, RunStarted):
        state.update(record.state)
        found = monitor.see(state, record.at_ns)
        if found is not None:
            return found
    elif not state:
        return None
    changes = record.changes
    state.update(changes)
    for name, _ in changes:
        if name in watched:
            return monitor.see(state, record.at_ns)
    return None
