"""The moments of a run at which its requests are judged: between operations, and where something is sent or ends.

Runs are judged one by one in campaigns, so one pass over the records finds all moments, and most records only cost a
look at their kind.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

from scbm.cases.trace import (
    AutomaticTaken,
    BecameCurrent,
    InjectionApplied,
    OperationStepped,
    PlanAsked,
    PutBack,
    Record,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    RunEnded,
    RunnerStarted,
    RunStarted,
)
from scbm.model import PlanState
from scbm.model.variables import PLAN_STATE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.model import Value
    from scbm.testing.request_protocol import RequestProtocol


class RequestMoment(NamedTuple):
    """A moment at which requests are judged, before its record.

    Attributes:
        at: the index of the record in the trace; of an end of a run, that of its first cancellation.
        record: the record: an operation becomes current, a plan is asked for, a request is sent, or a run ends.
        busy: the triggers that are true, and the request states that are not initial, each with its value.
        is_running: whether a goal is pursued.
        is_aborted: whether `plan.state` is `aborted`.
    """

    at: int
    record: Record
    busy: Mapping[str, Value]
    is_running: bool
    is_aborted: bool


def find_moments(records: Sequence[Record], protocol: RequestProtocol) -> tuple[RequestMoment, ...]:
    """Return the moments of a run at which requests are judged, as far as a built-in requirement could be violated."""
    watch = _RequestWatch(protocol)
    for index, record in enumerate(records):
        use = _RECORD_USES.get(type(record))
        if use is None:  # it neither changes requests nor is a moment
            continue
        if use is _RecordUse.CHANGE:
            watch.follow(record)
        elif use is _RecordUse.BETWEEN:
            if watch.busy:
                watch.note(index, record)
        else:
            watch.handle(index, record)
    return tuple(watch.moments)


class _RecordUse(Enum):
    """The meaning of a kind of record for the judgement of requests."""

    CHANGE = "it can change triggers and request states"
    BETWEEN = "no operation is under way, and it changes no requests"
    OTHER = "it can change `plan.state`, or a request is sent or cancelled, or a run starts or ends"


_RECORD_USES: dict[type, _RecordUse] = {
    OperationStepped: _RecordUse.CHANGE,
    ReplyReceived: _RecordUse.CHANGE,
    PutBack: _RecordUse.CHANGE,
    PlanAsked: _RecordUse.BETWEEN,
    BecameCurrent: _RecordUse.BETWEEN,
    AutomaticTaken: _RecordUse.OTHER,
    InjectionApplied: _RecordUse.OTHER,
    RequestSent: _RecordUse.OTHER,
    RequestCancelled: _RecordUse.OTHER,
    RunnerStarted: _RecordUse.OTHER,
    RunStarted: _RecordUse.OTHER,
    RunEnded: _RecordUse.OTHER,
}
"""The kinds of records that matter."""


class _RequestWatch:
    """The requests after some records, and the moments so far.

    Attributes:
        busy: the triggers that are true, and the request states that are not initial.
        moments: the moments so far.
    """

    def __init__(self, protocol: RequestProtocol) -> None:
        self.busy: dict[str, Value] = {}
        self.moments: list[RequestMoment] = []
        self._triggers = protocol.triggers
        self._at_rest = protocol.at_rest
        self._cancelled: RequestMoment | None = None  # the first cancellation of the end of a run, which follows
        self._is_running = self._is_aborted = False

    def follow(self, record: Record) -> None:
        """Follow the changes of a record."""
        at_rest, busy = self._at_rest, self.busy
        for name, value in record.changes:
            if name in at_rest:
                if value == at_rest[name]:
                    busy.pop(name, None)
                else:
                    busy[name] = value

    def note(self, index: int, record: Record) -> None:
        """Note a moment."""
        self.moments.append(self._moment(index, record))

    def handle(self, index: int, record: Record) -> None:
        """Handle a record that is more than a change of requests."""
        match record:
            case RunnerStarted():
                state = dict(record.state)
                self.busy = {name: state[name] for name, value in self._at_rest.items() if state[name] != value}
            case RunStarted():
                self._is_running, self._is_aborted = True, False
            case RunEnded():
                moment = self._moment(index, record) if self._cancelled is None else self._cancelled
                self.moments.append(moment._replace(record=record))
                self._is_running, self._cancelled = False, None
            case RequestSent():
                if self._is_aborted or not self._is_running:
                    self.note(index, record)
            case RequestCancelled():
                if self._cancelled is None and self._is_end(record):
                    self._cancelled = self._moment(index, record)
            case _:
                self._is_aborted = self._is_aborted or (PLAN_STATE, PlanState.ABORTED.value) in record.changes
        self.follow(record)

    def _moment(self, index: int, record: Record) -> RequestMoment:
        return RequestMoment(index, record, dict(self.busy), self._is_running, self._is_aborted)

    def _is_end(self, record: RequestCancelled) -> bool:
        """Return whether the end of a run cancels a request: only then does the cancellation clear the trigger."""
        return any(name in self._triggers for name, _ in record.changes)
