"""Sentences about records, and the promise that no view of a run forgets a kind of record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from typing import Any, ClassVar, get_args

import pytest
from msgspec.structs import replace

from scbm.cases.trace import (
    SENT,
    AutomaticTaken,
    InjectionApplied,
    MeasurementReceived,
    OperationStepped,
    PlanReceived,
    PutBack,
    Record,
    RecordSeverity,
    ReplyDropped,
    ReplyReceived,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunStarted,
    Trace,
    fault_in,
    sentence_of,
    spans_of,
)
from scbm.files import read_model
from scbm.model import OperationState
from scbm.reports.html.timelines import pack_timelines
from scbm.reports.run.event_lines import event_lines
from scbm.reports.run.mcap_trace import write_mcap
from scbm.reports.run.perfetto import write_perfetto
from scbm.testing import Execution, RandomCases, Tester
from support.models import SCAN_CELL
from support.record_kinds import record_of_each_kind
from support.wording import Wording

MODEL = read_model(SCAN_CELL)
NOMINAL = MODEL.nominal_state
RECORDS = record_of_each_kind(MODEL)
INFO, WARNING, ERROR = RecordSeverity.INFO, RecordSeverity.WARNING, RecordSeverity.ERROR


@dataclass(frozen=True)
class Unheard:
    """A kind of record that no view knows."""

    kind: ClassVar[str] = "unheard"
    severity: ClassVar[RecordSeverity] = INFO
    at_ns: int = 0
    changes: tuple[()] = ()


def executed(*records: Any) -> Execution:  # noqa: ANN401 - one of them is no record
    execution = Tester(MODEL).execute(RandomCases(MODEL).case(1, 1))
    return replace(execution, trace=Trace("m", "c", records), violations=(), ended_ns=10)


def written(write: Callable[..., int], execution: Execution) -> bytes:
    stream = BytesIO()
    write(MODEL, execution, stream)
    return stream.getvalue()


VIEWS: dict[str, Callable[[Execution], object]] = {
    "faults": lambda execution: [fault_in(record) for record in execution.trace.records],
    "sentences": lambda execution: [sentence_of(record, NOMINAL) for record in execution.trace.records],
    "spans": lambda execution: spans_of(execution.trace.records, 10),
    "lines": lambda execution: [line.text for line in event_lines(MODEL, execution)],
    "perfetto": lambda execution: written(write_perfetto, execution),
    "mcap": lambda execution: written(write_mcap, execution),
    "page": lambda execution: pack_timelines(MODEL, [execution]),
}


def test_the_records_of_these_tests_have_every_kind() -> None:
    assert {type(record) for record in RECORDS} == {*get_args(Record)}


@pytest.mark.parametrize("view", VIEWS)
def test_every_view_of_a_run_has_a_case_for_every_kind_of_record(view: str) -> None:
    assert VIEWS[view](executed(*RECORDS))


@pytest.mark.parametrize("view", VIEWS)
def test_no_view_of_a_run_leaves_out_a_new_kind_of_record_in_silence(view: str) -> None:
    with pytest.raises(
        (AssertionError, ValueError)
    ):  # the page does not know its kind, the others end in `assert_never`
        VIEWS[view](executed(*RECORDS, Unheard()))


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: record.kind)
def test_a_sentence_names_its_request_once_and_leaves_no_gap(record: Record) -> None:
    sentence = sentence_of(record, NOMINAL)
    assert sentence.text
    assert "{}" not in sentence.numbered_text
    assert "{}" not in sentence.numbered_label
    assert (sentence.number is not None) == ("{}" in sentence.text)


@pytest.mark.parametrize(
    "record",
    [
        RunStarted(0, "g", "a == b", ()),
        PlanReceived(0, 1, "solved", ("a", "b"), ()),
        PlanReceived(0, 1, "solved", (), ()),
        PlanReceived(0, 1, "limit_reached", (), ()),
        PlanReceived(0, 1, "no_plan_found", (), ()),
        RequestSent(0, 3, "arm", (("x", 1),), ()),
        ReplyReceived(0, 3, "arm", False, ()),
        ReplyDropped(0, 3, "late"),
        AutomaticTaken(0, "stop", "scan", ()),
        RunEnded(0, "g", "time_limit", ("x",), ()),
    ],
)
def test_the_words_of_a_record(record: Record, wording: Wording) -> None:
    sentence = sentence_of(record, NOMINAL)
    wording((sentence.numbered_text, sentence.numbered_label, sentence.outcome))


@pytest.mark.parametrize(
    ("record", "severity"),
    [
        (PlanReceived(0, 1, "solved", (), ()), INFO),
        (PlanReceived(0, 1, "unsolvable", (), ()), WARNING),
        (OperationStepped(0, "a", OperationState.EXECUTING, OperationState.COMPLETED, None, ()), INFO),
        (OperationStepped(0, "a", OperationState.EXECUTING, OperationState.TIMEDOUT, None, ()), WARNING),
        (OperationStepped(0, "a", OperationState.DISABLED, OperationState.INITIAL, None, ()), WARNING),
        (OperationStepped(0, "a", OperationState.COMPLETED, OperationState.INITIAL, None, ()), INFO),
        (AutomaticTaken(0, "t", None, ()), INFO),
        (AutomaticTaken(0, "t", "a", ()), WARNING),
        (ReplyReceived(0, 1, "r", True, ()), INFO),
        (ReplyReceived(0, 1, "r", False, ()), WARNING),
        (InjectionApplied(0, "i", None, ()), WARNING),
        (PutBack(0, "i", ()), INFO),
        (ResourceChanged(0, "i", "r", "dead"), WARNING),
        (ResourceChanged(0, "i", "r", "well"), INFO),
        (RunEnded(0, "g", "reached", (), ()), INFO),
        (RunEnded(0, "g", "unsolvable", (), ()), WARNING),
        (RunEnded(0, "g", "livelock", (), ()), ERROR),
    ],
)
def test_the_severity_of_a_record(record: Record, severity: RecordSeverity) -> None:
    assert record.severity is severity


def test_what_a_driver_sends_beyond_the_model_is_no_injection_of_a_case(wording: Wording) -> None:
    record = InjectionApplied(0, SENT, None, (("temperature", 3),), forced=True)
    wording((sentence_of(record, NOMINAL).text, fault_in(record)))


@pytest.mark.parametrize(("by", "label"), [("", "from outside"), ("opens", "environment opens")])
def test_a_change_that_changes_nothing_says_so(by: str, label: str) -> None:
    record = MeasurementReceived(0, (), by, (("light", "green"),))
    sentence = sentence_of(record, NOMINAL)
    assert (sentence.text, sentence.label, sentence.outcome) == (f"{label}: no change", label, "no change")
    assert sentence_of(MeasurementReceived(0, (("light", "red"),), by), NOMINAL).text == label
