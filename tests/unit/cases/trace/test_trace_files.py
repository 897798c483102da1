"""Traces as files: what is written is read, and what is no trace is told by its line."""

from __future__ import annotations

import json

import pytest

from scbm.cases.trace import (
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
    Record,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunStarted,
    Trace,
    read_trace,
    write_trace,
)
from scbm.model import InputError, OperationState

CHANGES = (("light", "red"), ("count", 2), ("done", True))
EVERY_KIND: tuple[Record, ...] = (
    RunStarted(0, "goal", "done == true", CHANGES),
    PlanAsked(0, 1, CHANGES),
    PlanReceived(0, 1, "solved", ("a", "b"), CHANGES),
    PlanDropped(0, 2),
    BecameCurrent(0, "a", CHANGES),
    OperationStepped(0, "a", OperationState.INITIAL, OperationState.EXECUTING, "start_a", CHANGES),
    AutomaticTaken(1, "t", None, CHANGES),
    RequestSent(1, 1, "r", CHANGES, CHANGES),
    RequestCancelled(2, 1, "r", CHANGES),
    ReplyReceived(2, 1, "r", False, CHANGES),
    ReplyDropped(2, 1, "late"),
    MeasurementReceived(2, CHANGES),
    MeasurementRefused(2, "light", 7),
    InjectionApplied(3, "i", None, CHANGES),
    PutBack(3, "i", CHANGES),
    ResourceChanged(3, "i", "scan", "slower 1.5"),
    MessageDisturbed(3, 1, "scan", "reply", 0),
    RunEnded(3, "goal", "livelock", ("t", "u"), CHANGES),
)
TRACE = Trace("model", "case", EVERY_KIND)


def test_every_kind_of_record_is_read_as_it_was_written() -> None:
    assert len({type(record) for record in EVERY_KIND}) == len(Record.__args__)
    assert read_trace(write_trace(TRACE)) == TRACE


@pytest.mark.parametrize("end", ["\u2028", "\x85", "\x0b", "\x1c"])
def test_a_text_with_an_end_of_line_of_its_own_stays_whole(end: str) -> None:
    trace = Trace("cell", "case", (MeasurementRefused(0, "zone", f"near{end}far"),))
    assert read_trace(write_trace(trace)) == trace


def test_values_keep_their_kind() -> None:
    line = json.loads(write_trace(TRACE).splitlines()[2])
    assert line["changes"] == {"light": "red", "count": 2, "done": True}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "trace:1: error[bad-trace]: a line of a trace is a JSON object"),
        ("{}", "trace:1: error[bad-trace]: this is not a trace of scbm"),
        ('{"format": "scbm-trace", "version": 99}', "trace:1: error[bad-trace]: version 99 of the trace format"),
        ("HEADER\nnonsense", "trace:2: error[bad-trace]: a line of a trace is a JSON object"),
        ('HEADER\n{"kind": "party"}', "trace:2: error[bad-trace]: a record of an unknown kind"),
        ('HEADER\n{"kind": "automatic", "at_ns": 1}', "trace:2: error[bad-trace]: a automatic record has the fields"),
        (
            'HEADER\n{"kind": "plan_asked", "at_ns": 0, "ask": 1, "changes": 3}',
            "trace:2: error[bad-trace]: a plan_asked record with a field of the wrong type",
        ),
    ],
)
def test_what_is_no_trace_is_told_by_its_line(text: str, told: str) -> None:
    header = write_trace(TRACE).splitlines()[0]
    with pytest.raises(InputError) as raised:
        read_trace(text.replace("HEADER", header))
    assert str(raised.value).startswith(told)
