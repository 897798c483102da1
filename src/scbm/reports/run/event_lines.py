"""The log of a run: one line for each record that people want to read, without colours.

The terminal draws these lines below each other, and MCAP carries them as messages.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, assert_never

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.trace import (
    AutomaticTaken,
    BecameCurrent,
    InjectionApplied,
    LivelockedAtRest,
    MeasurementReceived,
    MeasurementRefused,
    MessageDisturbed,
    OperationStepped,
    PlanAsked,
    PlanDropped,
    PlanReceived,
    PutBack,
    Record,
    RecordSeverity,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
    RunStarted,
    assignments,
    differing,
)
from scbm.model import OperationState

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel
    from scbm.testing import Execution

_MAX_IN_A_ROW = 20
"""Maximum number of automatic transitions in a row that have a line each; a livelock has thousands of them."""

_VIOLATED = "✗ "
"""The mark of a line about a violated requirement."""

_STATE_MARKS = dict.fromkeys(OperationState, "└ ") | {
    OperationState.EXECUTING: "┌ ",
    OperationState.DISABLED: "┆ ",
    OperationState.INITIAL: "┆ ",
}


class EventLine(Struct, frozen=True):
    """One line of the log of a run.

    Attributes:
        record: the record that the line is about.
        index: the index of that record in the trace.
        severity: how serious the event is.
        mark: the character that begins the line, and the space behind it.
        label: what happened.
        outcome: what followed from it, or which values it carries.
        changes: the variables that it changed, as `a = 1, b = true`.
        begins_moment: whether the line before it, if any, has another time.
        own_ns: the time of the line; `None` for that of the record.
    """

    record: Record
    index: int
    severity: RecordSeverity
    mark: str
    label: str
    outcome: str = ""
    changes: str = ""
    begins_moment: bool = False
    own_ns: int | None = None

    @property
    def at_ns(self) -> int:
        """The time of the line."""
        return self.record.at_ns if self.own_ns is None else self.own_ns

    @property
    def text(self) -> str:
        """The line as plain text, without its time."""
        outcome = f"  {self.outcome}" if self.outcome else ""
        changes = f"   {self.changes}" if self.changes else ""
        return f"{self.mark}{self.label}{outcome}{changes}"


def event_lines(
    model: BehaviorModel, execution: Execution, end: int | None = None, *, every: bool = False
) -> Iterator[EventLine]:
    """Yield the log of a run, line by line.

    Args:
        model: the model that was run.
        execution: the run.
        end: the number of records to include; all of them if `None`.
        every: whether lines include the variables of resources and of the runner.
    """
    log = _RecordLines(model, execution, every=every)
    for index, record in enumerate(execution.trace.records[:end]):
        yield from log.lines(index, record)


def story_lines(model: BehaviorModel, execution: Execution, *, every: bool = False) -> Iterator[EventLine]:
    """Yield the log of a run with one turn of what repeats until its end, and a line that counts the turns.

    Of the other turns, the lines of violations stay.

    Args:
        model: the model that was run.
        execution: the run.
        every: whether lines include the variables of resources and of the runner.
    """
    found, is_counted = execution.repetition, False
    for line in event_lines(model, execution, every=every):
        if found is not None and line.index >= found.end and not is_counted:
            is_counted, index = True, found.end - 1
            record = execution.trace.records[index]
            yield EventLine(record, index, RecordSeverity.WARNING, "↻ ", found.words, begins_moment=True)
        if found is None or not found.hides(line.index):
            yield line
        elif line.mark == _VIOLATED:
            yield replace(line, begins_moment=True)


class _RecordLines:
    """Makes lines from records, one record after the other."""

    def __init__(self, model: BehaviorModel, execution: Execution, *, every: bool) -> None:
        commands = frozenset(name for resource in model.resources for name in resource.request) - _read(model)
        declared = [variable.name for variable in model.variables if variable.name not in commands]
        self._shown = frozenset(model.running_space.names if every else declared)
        self._nominal = model.nominal_state
        self._execution = execution
        self._last_ns: int | None = None
        self._in_a_row = 0

    def lines(self, index: int, record: Record) -> Iterator[EventLine]:
        """Yield the lines of one record: the event, and the requirements that it violates."""
        is_automatic = isinstance(record, AutomaticTaken) and record.failed is None
        self._in_a_row = self._in_a_row + 1 if is_automatic else 0
        for line in (*self._events(index, record), *self._violated(index, record)):
            yield replace(line, begins_moment=line.at_ns != self._last_ns)
            self._last_ns = line.at_ns

    def _events(self, index: int, record: Record) -> Iterator[EventLine]:
        line = partial(EventLine, record, index, record.severity)
        if self._in_a_row > _MAX_IN_A_ROW:
            if self._in_a_row == _MAX_IN_A_ROW + 1:
                yield line("│ ", "automatic", "… and more, without a pause")
            return
        sentence = self._execution.sentence(record, self._nominal)
        if sentence.label:
            yield line(_mark(record), sentence.numbered_label, sentence.outcome, self._changes(record))
        if isinstance(record, RunStarted):
            yield line("  ", "from", assignments(differing(record, self._nominal)) or "the nominal state")
        if isinstance(record, (AutomaticTaken, InjectionApplied)) and record.failed is not None:
            yield line("└ ", OperationState.FAILED.value)

    def _violated(self, index: int, record: Record) -> Iterator[EventLine]:
        for violation in sorted(self._execution.violations, key=lambda each: each.at_ns):
            if violation.record == index:
                label = f"{violation.requirement}: {violation.reason}"
                yield EventLine(record, index, RecordSeverity.ERROR, _VIOLATED, label, own_ns=violation.at_ns)

    def _changes(self, record: Record) -> str:
        """Return the changes that the line of a record shows; all of them where a tester acts."""
        match record:
            case InjectionApplied() | PutBack():
                return assignments(record.changes)
            case OperationStepped(target=target) if target in (OperationState.DISABLED, OperationState.INITIAL):
                return ""
            case OperationStepped() | AutomaticTaken() | ReplyReceived() | MeasurementReceived():
                return assignments(tuple(change for change in record.changes if change[0] in self._shown))
            case _:  # the words say it all
                return ""


def _mark(record: Record) -> str:
    """Return the character that begins the line of a record, and the space behind it."""
    match record:
        case RunStarted():
            return "● "
        case RunEnded() | LivelockedAtRest():
            return "■ "
        case RunnerStarted() | PlanAsked() | PlanReceived() | PlanDropped() | BecameCurrent():
            return "  "
        case OperationStepped():
            return _STATE_MARKS[record.target]
        case InjectionApplied() | PutBack() | ResourceChanged():
            return "⚡ "
        case (
            AutomaticTaken()
            | (RequestSent() | RequestCancelled() | ReplyReceived() | ReplyDropped())
            | (MeasurementReceived() | MeasurementRefused() | MessageDisturbed())
        ):
            return "│ "
        case _:
            assert_never(record)


def _read(model: BehaviorModel) -> frozenset[str]:
    """Return the variables that a guard or a goal reads; a request shows the values that it alone carries."""
    transitions = [t for operation in model.operations for t in (operation.pre, operation.post)]
    guards = [transition.running_guard for transition in (*transitions, *model.automatic_transitions)]
    return frozenset(name for part in (*guards, *(goal for _, goal in model.goals)) for name in part.reads())
