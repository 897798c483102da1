"""Spans of a run, against its records."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from scbm.cases.trace import (
    AutomaticTaken,
    BecameCurrent,
    FaultSpan,
    InjectionApplied,
    OperationStepped,
    PlanAsked,
    PlanDropped,
    PlanningSpan,
    PlanReceived,
    PlanSpan,
    PutBack,
    Record,
    ReplyReceived,
    RequestCancelled,
    RequestOutcome,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunStarted,
    spans_of,
)
from scbm.files import load_model
from scbm.model import OperationState
from scbm.testing import Execution, RandomCases, Tester

BEFORE = load_model(Path(__file__).parents[4] / "examples" / "robot_in_the_air" / "before.yaml")
EXECUTIONS = [*map(Tester(BEFORE).execute, RandomCases(BEFORE, network=None).first(20, 4))]
INITIAL, DISABLED, EXECUTING = OperationState.INITIAL, OperationState.DISABLED, OperationState.EXECUTING
COMPLETED, FAILED, TIMEDOUT = OperationState.COMPLETED, OperationState.FAILED, OperationState.TIMEDOUT
SUCCEEDED, CANCELLED, UNANSWERED = RequestOutcome.SUCCEEDED, RequestOutcome.CANCELLED, RequestOutcome.UNANSWERED


def step(at_ns: int, source: OperationState, target: OperationState) -> OperationStepped:
    return OperationStepped(at_ns, "scan", source, target, None, ())


def sent(at_ns: int, request: int = 1) -> RequestSent:
    return RequestSent(at_ns, request, "scanner", (("box", "a"),), ())


def reply(at_ns: int, *, succeeded: bool = True) -> ReplyReceived:
    return ReplyReceived(at_ns, 1, "scanner", succeeded, ())


def ended(at_ns: int) -> RunEnded:
    return RunEnded(at_ns, "scanned", "reached", (), ())


@pytest.mark.parametrize("execution", EXECUTIONS, ids=lambda execution: execution.case.name)
def test_spans_lie_within_the_run_between_their_records(execution: Execution) -> None:
    spans, records = execution.spans, execution.trace.records
    for span in (*spans.operations, *spans.requests, *spans.plans, *spans.faults):
        assert 0 <= span.begin_ns <= span.end_ns <= execution.ended_ns
        assert records[span.begin_record].at_ns == span.begin_ns
        assert span.duration_ns == span.end_ns - span.begin_ns
        if span.begin_record < span.end_record < len(records):
            assert records[span.end_record].at_ns == span.end_ns


@pytest.mark.parametrize("execution", EXECUTIONS, ids=lambda execution: execution.case.name)
def test_each_start_of_an_operation_and_each_request_has_one_span(execution: Execution) -> None:
    spans, records = execution.spans, execution.trace.records
    starts = [r for r in records if isinstance(r, OperationStepped) and r.target in (DISABLED, EXECUTING)]
    assert [(s.operation, s.state, s.begin_ns) for s in spans.operations] == [
        (r.operation, r.target, r.at_ns) for r in starts
    ]
    requests = [record.request for record in records if isinstance(record, RequestSent)]
    assert sorted(span.request for span in spans.requests) == requests
    assert all(before.end_record <= after.begin_record for before, after in pairwise(spans.operations))
    assert all(before.end_record <= after.begin_record for before, after in pairwise(spans.plans))


@pytest.mark.parametrize(
    ("last", "outcome"),
    [
        ([step(5, EXECUTING, COMPLETED)], COMPLETED),
        ([step(5, EXECUTING, TIMEDOUT)], TIMEDOUT),
        ([AutomaticTaken(5, "watch", "scan", ())], FAILED),
        ([InjectionApplied(5, "push", "scan", ())], FAILED),
        ([AutomaticTaken(4, "watch", None, ()), ended(5)], None),
        ([], None),
    ],
)
def test_an_operation_span_ends_with_the_state_that_follows(last: list[Record], outcome: OperationState | None) -> None:
    (span,) = spans_of([step(2, INITIAL, EXECUTING), *last], 5).operations
    assert (span.operation, span.state, span.begin_ns, span.end_ns) == ("scan", EXECUTING, 2, 5)
    assert span.outcome is outcome


def test_a_disabled_operation_that_starts_has_two_spans() -> None:
    first, second = spans_of([step(1, INITIAL, DISABLED), step(3, DISABLED, EXECUTING), ended(4)], 4).operations
    assert (first.state, first.end_ns, first.outcome) == (DISABLED, 3, EXECUTING)
    assert (second.state, second.end_ns, second.outcome) == (EXECUTING, 4, None)


@pytest.mark.parametrize(
    ("records", "outcome", "missed_deadline"),
    [
        ([sent(1), reply(2)], SUCCEEDED, False),
        ([sent(1), reply(2, succeeded=False)], RequestOutcome.FAILED, False),
        ([sent(1), RequestCancelled(2, 1, "scanner", ())], CANCELLED, False),
        ([sent(1), ended(2)], UNANSWERED, False),
        ([sent(1), step(2, EXECUTING, TIMEDOUT), RequestCancelled(2, 1, "scanner", ())], CANCELLED, True),
        ([sent(1), step(1, INITIAL, EXECUTING), step(2, EXECUTING, TIMEDOUT)], UNANSWERED, False),
    ],
)
def test_a_request_span_ends_with_its_outcome(
    records: list[Record],
    outcome: RequestOutcome,
    missed_deadline: bool,  # noqa: FBT001 - a parameter of the test
) -> None:
    (span,) = spans_of(records, 2).requests
    assert (span.request, span.resource, span.payload, span.begin_ns, span.end_ns) == (
        1,
        "scanner",
        (("box", "a"),),
        1,
        2,
    )
    assert (span.outcome, span.missed_deadline) == (outcome, missed_deadline)


def test_a_request_knows_the_operation_that_was_current() -> None:
    current = BecameCurrent(0, "scan", ())
    assert [span.operation for span in spans_of([current, sent(1)], 2).requests] == ["scan"]
    assert [span.operation for span in spans_of([sent(1)], 2).requests] == ["none"]
    back = step(0, COMPLETED, INITIAL)
    assert [span.operation for span in spans_of([current, back, sent(1)], 2).requests] == ["none"]


def test_plans_and_the_waits_for_them_follow_each_other() -> None:
    records: list[Record] = [
        PlanAsked(1, 1, ()),
        PlanAsked(2, 2, ()),
        PlanDropped(3, 1),
        PlanReceived(4, 2, "solved", ("scan",), ()),
        PlanAsked(6, 3, ()),
        PlanReceived(6, 3, "unsolvable", (), ()),
        ended(8),
    ]
    plans = spans_of(records, 8).plans
    assert [(type(span), span.ask, span.begin_ns, span.end_ns, span.status) for span in plans] == [
        (PlanningSpan, 1, 1, 2, None),
        (PlanningSpan, 2, 2, 4, "solved"),
        (PlanSpan, 2, 4, 6, "solved"),
        (PlanningSpan, 3, 6, 6, "unsolvable"),
        (PlanSpan, 3, 6, 8, "unsolvable"),
    ]


def test_faults_last_as_long_as_they_are_held() -> None:
    records: list[Record] = [
        RunStarted(0, "g", "true", ()),
        InjectionApplied(1, "once", None, (("lamp", "on"),)),
        InjectionApplied(2, "held", None, ()),
        ResourceChanged(3, "busy", "scanner", "occupied"),
        PutBack(4, "held", ()),
        ResourceChanged(5, "busy", "scanner", "well"),
    ]
    faults = spans_of(records, 9, {"held": 2, "busy": 100}).faults
    assert [(span.injection, span.begin_ns, span.end_ns, span.is_held) for span in faults] == [
        ("once", 1, 1, False),
        ("held", 2, 4, True),
        ("busy", 3, 9, True),
    ]
    assert [span.condition for span in faults] == [None, None, "occupied"]
    assert isinstance(faults[0], FaultSpan)
    assert faults[0].changes == (("lamp", "on"),)
