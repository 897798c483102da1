"""Traces as files: what is written is read, and a line that belongs to no trace is reported by its number."""

from __future__ import annotations

import json
from hashlib import sha256

import pytest
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
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
    RunStarted,
    Trace,
    read_trace,
    trace_digest,
    write_trace,
)
from scbm.model import InputError, OperationState, PlannerIdentity, Slug
from support.wording import Wording

CHANGES = (("light", "red"), ("count", 2), ("done", True))
EVERY_KIND: tuple[Record, ...] = (
    RunnerStarted(0, CHANGES),
    RunStarted(0, "goal", "done == true", CHANGES),
    PlanAsked(0, 1, CHANGES),
    PlanReceived(0, 1, "solved", ("a", "b"), CHANGES),
    PlanDropped(0, 2),
    BecameCurrent(0, "a", CHANGES),
    OperationStepped(0, "a", OperationState.INITIAL, OperationState.EXECUTING, "start_a", CHANGES),
    AutomaticTaken(1, "t", None, CHANGES),
    RequestSent(1, 1, "r", CHANGES, CHANGES),
    RequestCancelled(2, 1, "r", CHANGES),
    ReplyReceived(2, 1, "r", False, CHANGES, (("light", "red"),)),
    ReplyDropped(2, 1, "late"),
    MeasurementReceived(2, CHANGES, "push", (("count", 2),)),
    MeasurementRefused(2, "light", 7),
    InjectionApplied(3, "i", None, CHANGES, forced=True),
    PutBack(3, "i", CHANGES, forced=True),
    ResourceChanged(3, "i", "scan", "slower 1.5"),
    MessageDisturbed(3, 1, "scan", "reply", 0),
    RunEnded(3, "goal", "livelock", ("t", "u"), CHANGES),
    LivelockedAtRest(3, ("t", "u")),
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
    line = json.loads(write_trace(TRACE).splitlines()[3])
    assert line["changes"] == {"light": "red", "count": 2, "done": True}


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", 1),
        ("{}", 1),
        ("HEADER\nnonsense", 2),
        ('HEADER\n{"kind": "party"}', 2),
        ('HEADER\n{"kind": "automatic", "at_ns": 1}', 2),
        (
            'HEADER\n{"kind": "plan_asked", "at_ns": 0, "ask": 1, "changes": 3}',
            2,
        ),
    ],
)
def test_what_is_no_trace_is_reported_by_its_line(text: str, line: int, wording: Wording) -> None:
    header = write_trace(TRACE).splitlines()[0]
    with pytest.raises(InputError) as raised:
        read_trace(text.replace("HEADER", header))
    (error,) = raised.value.diagnostics
    assert (error.slug, error.place.line) == (Slug.BAD_TRACE, line)
    wording(error)


def test_a_trace_names_its_planner_which_the_digest_does_not_cover() -> None:
    other = replace(TRACE, planner=PlannerIdentity("greedy", "3"))
    assert read_trace(write_trace(other)) == other
    assert write_trace(other) != write_trace(TRACE)
    assert trace_digest(other) == trace_digest(TRACE)


def test_the_digest_is_that_of_the_text_with_a_header_without_a_planner() -> None:
    header, rest = write_trace(TRACE).split("\n", 1)
    assert '"planner":{"name":"canonical","version":"1"}' in header
    text = '{"format":"scbm-trace","version":3,"model":"model","case":"case"}\n' + rest
    assert trace_digest(TRACE) == sha256(text.encode()).hexdigest()


@pytest.mark.parametrize("version", ["2", "4", '"3"', "null"])
def test_another_version_of_the_format_is_refused(version: str, wording: Wording) -> None:
    with pytest.raises(InputError) as caught:
        read_trace(write_trace(TRACE).replace('"version":3', f'"version":{version}'))
    (found,) = caught.value.diagnostics
    assert (found.slug, found.place.line) == (Slug.FORMAT_VERSION, 1)
    wording(found)
