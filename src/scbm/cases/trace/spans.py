"""Spans of a run: how long operations, requests, plans and faults lasted, and how each ended.

The timeline in the terminal, the traces for viewers and the counts over drivers all take their spans from here, in one
pass over the records. A viewer draws spans and does not match on records to find them.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, assert_never

from msgspec import Struct

from scbm.cases.trace.records import (
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
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
    RunStarted,
)
from scbm.model import OperationState
from scbm.model.variables import NO_OPERATION

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.cases.trace.records import Changes, Record


class RequestOutcome(StrEnum):
    """How a request ended."""

    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    UNANSWERED = "no reply"


class Span(Struct, frozen=True, kw_only=True):
    """A part of a run.

    Attributes:
        begin_ns: the time of the record that begins the span.
        end_ns: the time of the record that ends it, or the end of the run.
        begin_record: the index of the record that begins the span.
        end_record: the index of the record that ends it, or the number of records.
    """

    begin_ns: int
    end_ns: int
    begin_record: int
    end_record: int

    @property
    def duration_ns(self) -> int:
        """How long the span lasts."""
        return self.end_ns - self.begin_ns


class OperationSpan(Span, frozen=True, kw_only=True):
    """The time for which an operation was executing, or was disabled.

    Attributes:
        operation: its name.
        state: `executing` or `disabled`.
        outcome: the state that followed; `None` if the run ended first.
    """

    operation: str
    state: OperationState
    outcome: OperationState | None


class RequestSpan(Span, frozen=True, kw_only=True):
    """A request from sending to its reply or its cancellation.

    Attributes:
        request: its id.
        resource: the resource that it was sent to.
        payload: the values that it carried.
        operation: the current operation when it was sent, or `none`.
        outcome: how it ended.
        missed_deadline: whether the operation that sent it timed out before a reply or a cancellation.
    """

    request: int
    resource: str
    payload: Changes
    operation: str
    outcome: RequestOutcome
    missed_deadline: bool


class PlanningSpan(Span, frozen=True, kw_only=True):
    """The wait for a plan.

    Attributes:
        ask: the number of the question.
        status: the status of the planner's answer; `None` if the run went on without an answer.
    """

    ask: int
    status: str | None


class PlanSpan(Span, frozen=True, kw_only=True):
    """The time from the planner's answer to the next question or the end of the run.

    Attributes:
        ask: the number of the question that was answered.
        status: the status of the answer; `solved` if there is a plan.
        plan: the operations of the plan.
    """

    ask: int
    status: str
    plan: tuple[str, ...]


class FaultSpan(Span, frozen=True, kw_only=True):
    """A fault that the test case injected.

    Attributes:
        injection: the name of the injection, or `network`.
        resource: the resource whose condition changed, if the injection changes one.
        condition: the new condition of that resource.
        changes: the variables that the injection changed.
        is_held: whether the injection holds its values for a duration; otherwise the span has no duration.
    """

    injection: str
    resource: str | None
    condition: str | None
    changes: Changes
    is_held: bool


class RunSpans(Struct, frozen=True):
    """All spans of a run; each kind in the order in which its spans ended, faults in the order in which they began."""

    operations: tuple[OperationSpan, ...]
    requests: tuple[RequestSpan, ...]
    plans: tuple[PlanningSpan | PlanSpan, ...]
    faults: tuple[FaultSpan, ...]


def spans_of(records: Sequence[Record], end_ns: int | None = None, holds: Mapping[str, int] | None = None) -> RunSpans:
    """Return the spans of a run.

    Args:
        records: the records of the run.
        end_ns: the time at which the run ended, where open spans end; `None` for the time of the last record.
        holds: the duration of each injection that holds its values, in nanoseconds, by the injection's name.
    """
    if end_ns is None:
        end_ns = records[-1].at_ns if records else 0
    builder = _SpanBuilder(end_ns, holds or {})
    for index, record in enumerate(records):
        builder.add(index, record)
    return builder.finished(len(records))


class _SpanBuilder:
    """Collects the spans of a run, record by record.

    At most one operation and one plan are open at a time, and one request for each resource. An open span is the record
    that began it with its index.
    """

    def __init__(self, end_ns: int, holds: Mapping[str, int]) -> None:
        self._end_ns = end_ns
        self._holds = holds
        self._current = NO_OPERATION
        self._operation: tuple[int, OperationStepped] | None = None
        self._plan: tuple[int, PlanAsked | PlanReceived] | None = None
        self._requests: dict[str, _OpenRequest] = {}
        self._operations: list[OperationSpan] = []
        self._ended_requests: list[RequestSpan] = []
        self._plans: list[PlanningSpan | PlanSpan] = []
        self._faults: dict[str, FaultSpan] = {}

    def add(self, index: int, record: Record) -> None:  # noqa: C901, PLR0912 - one case for each kind of record
        """Add the record at `index` of the run."""
        match record:
            case OperationStepped():
                self._step(index, record)
            case RequestSent():
                self._requests[record.resource] = _OpenRequest(index, record, self._current)
            case ReplyReceived(succeeded=succeeded):
                self._end_request(index, record, RequestOutcome.SUCCEEDED if succeeded else RequestOutcome.FAILED)
            case RequestCancelled():
                self._end_request(index, record, RequestOutcome.CANCELLED)
            case BecameCurrent():
                self._current = record.operation
            case AutomaticTaken():
                if record.failed is not None:
                    self._end_operation(index, record.at_ns, OperationState.FAILED)
            case PlanAsked() | PlanReceived():
                self._end_plan(index, record)
                self._plan = index, record
            case InjectionApplied() | ResourceChanged():
                self._inject(index, record)
            case RunEnded():
                self._end_plan(index, record)
                self._end_operation(index, record.at_ns, None)
                self._current = NO_OPERATION
            case RunnerStarted() | RunStarted() | PlanDropped() | ReplyDropped() | MessageDisturbed() | PutBack():
                pass
            case MeasurementReceived() | MeasurementRefused() | LivelockedAtRest():
                pass
            case _:
                assert_never(record)

    def finished(self, count: int) -> RunSpans:
        """Return all spans of a run with `count` records; what is open ends with the run."""
        self._end_operation(count, self._end_ns, None)
        self._end_plan(count, None)
        unanswered = [each.span(count, self._end_ns, RequestOutcome.UNANSWERED) for each in self._requests.values()]
        return RunSpans(
            tuple(self._operations),
            (*self._ended_requests, *unanswered),
            tuple(self._plans),
            tuple(self._faults.values()),
        )

    def _end_plan(self, index: int, record: PlanAsked | PlanReceived | RunEnded | None) -> None:
        """End the open plan, or the open question, before `record` or at the end of the run."""
        if self._plan is None:
            return
        begin_record, begun = self._plan
        begin_ns, end_ns = begun.at_ns, self._end_ns if record is None else record.at_ns
        answer = record if isinstance(record, PlanReceived) and record.ask == begun.ask else None
        if isinstance(begun, PlanReceived):
            span: PlanningSpan | PlanSpan = PlanSpan(
                begin_ns=begin_ns,
                end_ns=end_ns,
                begin_record=begin_record,
                end_record=index,
                ask=begun.ask,
                status=begun.status,
                plan=begun.plan,
            )
        else:
            span = PlanningSpan(
                begin_ns=begin_ns,
                end_ns=end_ns,
                begin_record=begin_record,
                end_record=index,
                ask=begun.ask,
                status=None if answer is None else answer.status,
            )
        self._plans.append(span)
        self._plan = None

    def _step(self, index: int, record: OperationStepped) -> None:
        self._end_operation(index, record.at_ns, record.target)
        match record.target:
            case OperationState.TIMEDOUT:
                for request in self._requests.values():
                    request.missed_deadline |= request.is_of_operation
            case OperationState.EXECUTING:
                for request in self._requests.values():
                    request.is_of_operation = False
                self._operation = index, record
            case OperationState.DISABLED:
                self._operation = index, record
            case OperationState.INITIAL:
                self._current = NO_OPERATION
            case OperationState.COMPLETED | OperationState.FAILED:
                pass
            case _:
                assert_never(record.target)

    def _end_operation(self, index: int, at_ns: int, outcome: OperationState | None) -> None:
        if self._operation is None:
            return
        begin_record, begun = self._operation
        self._operations.append(
            OperationSpan(
                begin_ns=begun.at_ns,
                end_ns=at_ns,
                begin_record=begin_record,
                end_record=index,
                operation=begun.operation,
                state=begun.target,
                outcome=outcome,
            )
        )
        self._operation = None

    def _end_request(self, index: int, record: ReplyReceived | RequestCancelled, outcome: RequestOutcome) -> None:
        request = self._requests.pop(record.resource, None)
        if request is not None:
            self._ended_requests.append(request.span(index, record.at_ns, outcome))

    def _inject(self, index: int, record: InjectionApplied | ResourceChanged) -> None:
        """Add a fault; only the first record of an injection, as the next one puts it back."""
        if isinstance(record, InjectionApplied) and record.failed is not None:
            self._end_operation(index, record.at_ns, OperationState.FAILED)
        name = record.injection
        if name in self._faults:
            return
        hold_ns = self._holds.get(name)
        changed = record if isinstance(record, ResourceChanged) else None
        self._faults[name] = FaultSpan(
            begin_ns=record.at_ns,
            end_ns=record.at_ns if hold_ns is None else min(record.at_ns + hold_ns, self._end_ns),
            begin_record=index,
            end_record=index,
            injection=name,
            resource=None if changed is None else changed.resource,
            condition=None if changed is None else changed.condition,
            changes=record.changes,
            is_held=hold_ns is not None,
        )


class _OpenRequest(Struct):
    """A request in flight.

    Attributes:
        index: the index of the record that sent it.
        sent: that record.
        operation: the operation that was current then.
        is_of_operation: whether no operation has begun to execute since, so that the executing one has sent it.
        missed_deadline: whether that operation has timed out.
    """

    index: int
    sent: RequestSent
    operation: str
    is_of_operation: bool = True
    missed_deadline: bool = False

    def span(self, index: int, at_ns: int, outcome: RequestOutcome) -> RequestSpan:
        """Return the span of the request, ended by the record at `index`."""
        return RequestSpan(
            begin_ns=self.sent.at_ns,
            end_ns=at_ns,
            begin_record=self.index,
            end_record=index,
            request=self.sent.request,
            resource=self.sent.resource,
            payload=self.sent.payload,
            operation=self.operation,
            outcome=outcome,
            missed_deadline=self.missed_deadline,
        )
