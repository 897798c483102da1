"""Spans of a run: how long operations, requests, plans and faults lasted, and how each ended.

The timeline in the terminal, the traces for viewers and the counts over drivers all take their spans from here, in one
pass over the records. A viewer draws spans and does not match on records to find them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, assert_never

from scbm.cases.trace.records import (
    AutomaticTaken,
    BecameCurrent,
    InjectionApplied,
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
    RunStarted,
)
from scbm.model import OperationState
from scbm.model.variables import CURRENT_NAME, NO_OPERATION

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.cases.trace.records import Changes, Record


class RequestOutcome(StrEnum):
    """How a request ended."""

    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    UNANSWERED = "no reply"


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
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


@dataclass(frozen=True, slots=True, kw_only=True)
class OperationSpan(Span):
    """The time for which an operation was executing, or was disabled.

    Attributes:
        operation: its name.
        state: `executing` or `disabled`.
        outcome: the state that followed; `None` if the run ended first.
    """

    operation: str
    state: OperationState
    outcome: OperationState | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RequestSpan(Span):
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


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningSpan(Span):
    """The wait for a plan.

    Attributes:
        ask: the number of the question.
        status: the status of the planner's answer; `None` if the run went on without an answer.
    """

    ask: int
    status: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanSpan(Span):
    """The time from the planner's answer to the next question or the end of the run.

    Attributes:
        ask: the number of the question that was answered.
        status: the status of the answer; `solved` if there is a plan.
        plan: the operations of the plan.
    """

    ask: int
    status: str
    plan: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultSpan(Span):
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


@dataclass(frozen=True, slots=True)
class RunSpans:
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
    """Opens and closes spans, record by record.

    At most one operation and one plan are open at a time, and one request for each resource.
    """

    def __init__(self, end_ns: int, holds: Mapping[str, int]) -> None:
        self._end_ns = end_ns
        self._holds = holds
        self._current = NO_OPERATION
        self._operation: OperationSpan | None = None
        self._plan: PlanningSpan | PlanSpan | None = None
        self._requests: dict[str, RequestSpan] = {}
        self._of_operation: dict[str, None] = {}  # the resources with a request since the operation began to execute
        self._operations: list[OperationSpan] = []
        self._ended_requests: list[RequestSpan] = []
        self._plans: list[PlanningSpan | PlanSpan] = []
        self._faults: dict[str, FaultSpan] = {}

    def add(self, index: int, record: Record) -> None:  # noqa: C901, PLR0912 - one case for each kind of record
        """Add the record at `index` of the run."""
        for name, value in record.changes:
            if name == CURRENT_NAME:
                self._current = str(value)
        match record:
            case PlanAsked() | PlanReceived():
                self._end_plan(index, record)
                self._begin_plan(index, record)
            case OperationStepped():
                self._step(index, record)
            case AutomaticTaken():
                if record.failed is not None:
                    self._end_operation(index, record.at_ns, OperationState.FAILED)
            case RequestSent():
                self._send(index, record)
            case RequestCancelled():
                self._end_request(index, record, RequestOutcome.CANCELLED)
            case ReplyReceived(succeeded=succeeded):
                outcome = RequestOutcome.SUCCEEDED if succeeded else RequestOutcome.FAILED
                self._end_request(index, record, outcome)
            case InjectionApplied() | ResourceChanged():
                self._inject(index, record)
            case RunEnded():
                self._end_plan(index, record)
                self._end_operation(index, record.at_ns, None)
            case RunStarted() | PlanDropped() | BecameCurrent() | ReplyDropped() | MessageDisturbed() | PutBack():
                pass
            case MeasurementReceived() | MeasurementRefused():
                pass
            case _:
                assert_never(record)

    def finished(self, count: int) -> RunSpans:
        """Return all spans of a run with `count` records; what is open ends with the run."""
        self._end_operation(count, self._end_ns, None)
        if self._plan is not None:
            self._plans.append(replace(self._plan, end_ns=self._end_ns, end_record=count))
        unanswered = [replace(sent, end_ns=self._end_ns, end_record=count) for sent in self._requests.values()]
        return RunSpans(
            tuple(self._operations),
            (*self._ended_requests, *unanswered),
            tuple(self._plans),
            tuple(self._faults.values()),
        )

    def _begin_plan(self, index: int, record: PlanAsked | PlanReceived) -> None:
        open_ended = {"begin_ns": record.at_ns, "end_ns": self._end_ns, "begin_record": index, "end_record": index}
        if isinstance(record, PlanAsked):
            self._plan = PlanningSpan(ask=record.ask, status=None, **open_ended)
        else:
            self._plan = PlanSpan(ask=record.ask, status=record.status, plan=record.plan, **open_ended)

    def _end_plan(self, index: int, record: PlanAsked | PlanReceived | RunEnded) -> None:
        plan = self._plan
        if isinstance(plan, PlanningSpan) and isinstance(record, PlanReceived) and plan.ask == record.ask:
            plan = replace(plan, status=record.status)
        if plan is not None:
            self._plans.append(replace(plan, end_ns=record.at_ns, end_record=index))
        self._plan = None

    def _step(self, index: int, record: OperationStepped) -> None:
        self._end_operation(index, record.at_ns, record.target)
        if record.target is OperationState.TIMEDOUT:
            for resource in self._of_operation:
                if resource in self._requests:
                    self._requests[resource] = replace(self._requests[resource], missed_deadline=True)
        if record.target is OperationState.EXECUTING:
            self._of_operation.clear()
        if record.target in (OperationState.DISABLED, OperationState.EXECUTING):
            self._operation = OperationSpan(
                begin_ns=record.at_ns,
                end_ns=self._end_ns,
                begin_record=index,
                end_record=index,
                operation=record.operation,
                state=record.target,
                outcome=None,
            )

    def _end_operation(self, index: int, at_ns: int, outcome: OperationState | None) -> None:
        if self._operation is not None:
            self._operations.append(replace(self._operation, end_ns=at_ns, end_record=index, outcome=outcome))
        self._operation = None

    def _send(self, index: int, record: RequestSent) -> None:
        self._of_operation[record.resource] = None
        self._requests[record.resource] = RequestSpan(
            begin_ns=record.at_ns,
            end_ns=self._end_ns,
            begin_record=index,
            end_record=index,
            request=record.request,
            resource=record.resource,
            payload=record.payload,
            operation=self._current,
            outcome=RequestOutcome.UNANSWERED,
            missed_deadline=False,
        )

    def _end_request(self, index: int, record: ReplyReceived | RequestCancelled, outcome: RequestOutcome) -> None:
        sent = self._requests.pop(record.resource, None)
        if sent is not None:
            ended = replace(sent, end_ns=record.at_ns, end_record=index, outcome=outcome)
            self._ended_requests.append(ended)

    def _inject(self, index: int, record: InjectionApplied | ResourceChanged) -> None:
        """Add a fault; only the first record of an injection, as the next one puts it back."""
        if isinstance(record, InjectionApplied) and record.failed is not None:
            self._end_operation(index, record.at_ns, OperationState.FAILED)
        name = record.injection
        if name in self._faults:
            return
        hold_ns = self._holds.get(name)
        end_ns = record.at_ns if hold_ns is None else min(record.at_ns + hold_ns, self._end_ns)
        changed = record if isinstance(record, ResourceChanged) else None
        self._faults[name] = FaultSpan(
            begin_ns=record.at_ns,
            end_ns=end_ns,
            begin_record=index,
            end_record=index,
            injection=name,
            resource=None if changed is None else changed.resource,
            condition=None if changed is None else changed.condition,
            changes=record.changes,
            is_held=hold_ns is not None,
        )
