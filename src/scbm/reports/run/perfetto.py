"""A run in the Trace Event Format, for ui.perfetto.dev and chrome://tracing.

https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU describes the format. Here
a process is a group of tracks, a thread is a track of slices, and a counter is a track of numbers.
`docs/how-to/view-traces.md` lists them.
"""

from __future__ import annotations

import json
from operator import itemgetter
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias, assert_never

from msgspec import Struct

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
    PlanSpan,
    PutBack,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestOutcome,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
    RunStarted,
    fate_of,
)
from scbm.model import ValueKind, format_value
from scbm.model.variables import Role

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases.trace import Changes, FaultSpan, OperationSpan, PlanningSpan, Record, RequestSpan, RunSpans
    from scbm.model import BehaviorModel, Value
    from scbm.testing import Execution, Violation

    Event = dict[str, Any]
    Arguments = dict[str, Any]

_GROUPS = ("run", "operations", "resources", "injections", "requirements", "variables")
"""The groups of tracks from top to bottom; the first has pid 1."""

_FIRST_TRACK = 101
"""The first tid; viewers take a thread whose tid equals its pid for the main thread."""

_COLOURS = {"failed": "terrible", "timedout": "bad", "cancelled": "bad", "disabled": "yellow", "no reply": "bad"}
"""Colours of chrome://tracing for deviations from the nominal course; Perfetto derives colours from names."""


class Slice(Struct, frozen=True):
    """An event with a duration, on a track of a group."""

    group: str
    track: str
    name: str
    begin_ns: int
    end_ns: int
    arguments: Arguments
    colour: str | None = None


class Instant(Struct, frozen=True):
    """An event without duration, on a track of a group."""

    group: str
    track: str
    name: str
    at_ns: int
    arguments: Arguments


class Sample(Struct, frozen=True):
    """The value of a variable from `at_ns` on, as a number."""

    group: str
    track: str
    at_ns: int
    number: int


class Arrow(Struct, frozen=True):
    """An arrow from the current operation to its request."""

    operation: str
    resource: str
    at_ns: int
    request: int


Item: TypeAlias = Slice | Instant | Sample | Arrow


def write_perfetto(model: BehaviorModel, execution: Execution, stream: BinaryIO) -> int:
    """Write the run to `stream` and return the number of its events.

    Times are in microseconds, with nanoseconds as decimals.
    """
    items = list(_items(model, execution))
    tracks = _tracks(model, items)
    events = [*_metadata(tracks), *(event for item in items for event in _events(item, tracks))]
    written = {"displayTimeUnit": "ns", "otherData": _about(execution), "traceEvents": events}
    # Perfetto shows the escape `\\u2192` literally, so characters are escaped only where JSON requires it
    stream.write(f"{json.dumps(written, ensure_ascii=False, separators=(',', ':'))}\n".encode())
    return len(events)


def _about(execution: Execution) -> dict[str, str]:
    case = execution.case
    failures = "; ".join(map(str, execution.verdict.failures))
    about = {"model": execution.trace.model, "case": case.name, "goal": case.goal_names}
    about["predicate"] = case.predicates
    return about | {"verdict": execution.verdict.end.value, "failures": failures}


def _items(model: BehaviorModel, execution: Execution) -> Iterator[Item]:
    """Yield all items; those of each track in the order of time."""
    records, end_ns = execution.trace.records, execution.ended_ns
    spans = execution.spans
    yield from _plans(spans, records)
    yield from _moments(records)
    yield from map(_operation, spans.operations)
    yield from _requests(spans)
    yield from map(_fault, spans.faults)
    yield from (_violated(violation, execution) for violation in execution.violations)
    yield from _variables(model, records, end_ns)


# the tracks


def _plans(spans: RunSpans, records: Sequence[Record]) -> Iterator[Item]:
    """Yield plans and the waits for them, and the moments at which a goal was begun and ended."""
    items = [(span.end_record, 0, _planned(span)) for span in spans.plans if _takes_time(span)]
    for index, record in enumerate(records):
        if isinstance(record, RunStarted):
            items.append((index, 1, Instant("run", "goal", record.goal, record.at_ns, {"predicate": record.predicate})))
        elif isinstance(record, RunEnded):
            detail = {"detail": ", ".join(record.detail)}
            items.append((index, 1, Instant("run", "goal", record.end, record.at_ns, detail)))
    yield from (item for _, _, item in sorted(items, key=itemgetter(0, 1)))


def _takes_time(span: PlanningSpan | PlanSpan) -> bool:
    """Return whether a span of planning is drawn: in a simulation the planner answers at once."""
    return isinstance(span, PlanSpan) or span.duration_ns > 0


def _planned(span: PlanningSpan | PlanSpan) -> Item:
    name = "planning"
    arguments: Arguments = {"ask": span.ask}
    if isinstance(span, PlanSpan):
        name = span.status
        if span.status == "solved":
            name = " → ".join(span.plan) or "nothing to do"
            arguments["plan"] = {f"{number}": each for number, each in enumerate(span.plan, start=1)}
    return Slice("run", "plan", name, span.begin_ns, span.end_ns, arguments)


def _moments(records: Iterable[Record]) -> Iterator[Instant]:
    """Yield the events on the tracks of automatic transitions and of the network."""
    for record in records:
        changes = _values(record.changes)
        match record:
            case AutomaticTaken():
                failed = {} if record.failed is None else {"failed": record.failed}
                yield Instant("run", "automatic", record.transition, record.at_ns, changes | failed)
            case MessageDisturbed():
                name = f"{record.message} {record.request} of {record.resource} {fate_of(record)}"
                yield Instant("run", "network", name, record.at_ns, {"copies": record.copies})
            case ReplyDropped():
                name = f"reply {record.request} {fate_of(record)}"
                yield Instant("run", "network", name, record.at_ns, {})
            case MeasurementReceived():
                yield Instant("run", "network", "measured", record.at_ns, changes)
            case MeasurementRefused():
                refused = {record.variable: format_value(record.value)}
                yield Instant("run", "network", f"{record.variable} {fate_of(record)}", record.at_ns, refused)
            case RunStarted() | RunEnded() | PlanAsked() | PlanReceived() | PlanDropped():  # on tracks of their own
                pass
            case BecameCurrent() | OperationStepped() | RequestSent() | RequestCancelled() | ReplyReceived():
                pass
            case RunnerStarted() | InjectionApplied() | PutBack() | ResourceChanged() | LivelockedAtRest():
                pass
            case _:
                assert_never(record)


def _operation(span: OperationSpan) -> Slice:
    """Return the slice for the time that an operation was disabled or executing, named by how that ended."""
    after = "the end" if span.outcome is None else span.outcome.value
    colour = _COLOURS.get(after) or _COLOURS.get(span.state.value)
    name, arguments = f"{span.state.value} → {after}", {"state": span.state.value, "then": after}
    return Slice("operations", span.operation, name, span.begin_ns, span.end_ns, arguments, colour)


def _requests(spans: RunSpans) -> Iterator[Item]:
    """Yield a slice for each request, and an arrow to it from the operation that was current."""
    items: list[tuple[int, Item]] = []
    for span in spans.requests:
        items.append((span.begin_record, Arrow(span.operation, span.resource, span.begin_ns, span.request)))
        items.append((span.end_record, _requested(span)))
    yield from (item for _, item in sorted(items, key=itemgetter(0)))


def _requested(span: RequestSpan) -> Slice:
    values = ", ".join(format_value(value) for _, value in span.payload) or "request"
    result = span.outcome.value
    name = values if span.outcome is RequestOutcome.SUCCEEDED else f"{values}: {result}"
    arguments = {"request": span.request, "result": result, "payload": _values(span.payload)}
    return Slice("resources", span.resource, name, span.begin_ns, span.end_ns, arguments, _COLOURS.get(result))


def _fault(span: FaultSpan) -> Item:
    """Return a slice for an injection that is held, and a moment for any other."""
    arguments = _values(span.changes)
    if span.resource is not None:
        arguments = {"resource": span.resource, "condition": span.condition}
    what = ", ".join(f"{key} = {value}" for key, value in arguments.items()) or "nothing changed"
    if span.is_held:
        return Slice("injections", span.injection, what, span.begin_ns, span.end_ns, arguments)
    return Instant("injections", span.injection, what, span.begin_ns, arguments)


def _violated(violation: Violation, execution: Execution) -> Item:
    """Return a violation: a slice from the record that begins it, if time has passed since."""
    begin_ns = execution.trace.records[violation.begins].at_ns
    arguments = {"reason": violation.reason, "operation": violation.operation, **_values(violation.values)}
    if begin_ns == violation.at_ns:
        return Instant("requirements", violation.requirement, "violated", violation.at_ns, arguments)
    return Slice("requirements", violation.requirement, "violated", begin_ns, violation.at_ns, arguments, "terrible")


def _variables(model: BehaviorModel, records: Iterable[Record], end_ns: int) -> Iterator[Item]:
    """Yield the values of variables, numbers as samples and symbols as slices; operations have tracks of their own."""
    shown = [variable for variable in model.running_space if variable.role is not Role.OPERATION_STATE]
    past = _histories(records)
    for variable in shown:
        moments = past.get(variable.name, [])
        if variable.domain.kind is not ValueKind.SYMBOL:
            yield from (Sample("variables", variable.name, at_ns, int(value)) for at_ns, value in moments)
            continue
        ends = [*(at_ns for at_ns, _ in moments[1:]), end_ns]
        for (begin_ns, value), until_ns in zip(moments, ends, strict=bool(moments)):
            yield Slice("variables", variable.name, str(value), begin_ns, until_ns, {})


def _histories(records: Iterable[Record]) -> dict[str, list[tuple[int, Value]]]:
    """Return for each variable its values, each with the time of the change; of one moment the last value."""
    past: dict[str, list[tuple[int, Value]]] = {}
    for record in records:
        if isinstance(record, RunnerStarted):
            past = {name: [(record.at_ns, value)] for name, value in record.state}
        for name, value in record.changes:
            moments = past[name]
            if moments[-1][0] == record.at_ns:
                moments.pop()
            moments.append((record.at_ns, value))
    return {name: _without_repetitions(moments) for name, moments in past.items()}


def _without_repetitions(moments: list[tuple[int, Value]]) -> list[tuple[int, Value]]:
    """Return the moments at which the value differs from the one before: within a moment it may have been restored."""
    return [moment for index, moment in enumerate(moments) if not index or moments[index - 1][1] != moment[1]]


def _values(changes: Changes) -> Arguments:
    return {name: format_value(value) for name, value in changes}


# the format


def _tracks(model: BehaviorModel, items: Iterable[Item]) -> dict[tuple[str, str], int]:
    """Return the tid of each track with slices or instants; tracks are ordered by group and by the model."""
    used = dict.fromkeys((item.group, item.track) for item in items if isinstance(item, (Slice, Instant)))
    operations = (("operations", operation.name) for operation in model.operations)
    resources = (("resources", resource.name) for resource in model.resources)
    ordered = dict.fromkeys(track for track in (*operations, *resources) if track in used) | used
    grouped = sorted(ordered, key=lambda track: _GROUPS.index(track[0]))
    return {track: tid for tid, track in enumerate(grouped, start=_FIRST_TRACK)}


def _metadata(tracks: dict[tuple[str, str], int]) -> Iterator[Event]:
    for group in _GROUPS:
        pid = _pid(group)
        yield {"ph": "M", "pid": pid, "tid": 0, "name": "process_name", "args": {"name": group}}
        yield {"ph": "M", "pid": pid, "tid": 0, "name": "process_sort_index", "args": {"sort_index": pid}}
    for (group, track), tid in tracks.items():
        yield {"ph": "M", "pid": _pid(group), "tid": tid, "name": "thread_name", "args": {"name": track}}
        yield {"ph": "M", "pid": _pid(group), "tid": tid, "name": "thread_sort_index", "args": {"sort_index": tid}}


def _events(item: Item, tracks: dict[tuple[str, str], int]) -> Iterator[Event]:
    """Yield the trace events of an item."""
    if isinstance(item, Arrow):
        source, target = tracks.get(("operations", item.operation)), tracks[("resources", item.resource)]
        if source is not None:
            arrow = {"cat": "request", "name": "request", "id": item.request, "ts": _us(item.at_ns)}
            yield {"ph": "s", "pid": _pid("operations"), "tid": source, **arrow}
            yield {"ph": "f", "bp": "e", "pid": _pid("resources"), "tid": target, **arrow}
        return
    pid = _pid(item.group)
    if isinstance(item, Sample):
        yield {"ph": "C", "pid": pid, "name": item.track, "ts": _us(item.at_ns), "args": {"value": item.number}}
        return
    about = {"pid": pid, "tid": tracks[item.group, item.track], "cat": item.group, "name": item.name}
    if isinstance(item, Instant):
        yield _moment(about, item.at_ns, item.arguments)
        return
    if item.begin_ns == item.end_ns:  # viewers would nest it into the slice that begins now
        yield _moment(about, item.begin_ns, item.arguments)
        return
    colour = {} if item.colour is None else {"cname": item.colour}
    lasting = {"ts": _us(item.begin_ns), "dur": _us(item.end_ns - item.begin_ns)}
    yield {"ph": "X", **about, **lasting, **colour, "args": item.arguments}


def _moment(about: Event, at_ns: int, arguments: Arguments) -> Event:
    return {"ph": "i", "s": "t", **about, "ts": _us(at_ns), "args": arguments}


def _pid(group: str) -> int:
    return _GROUPS.index(group) + 1


def _us(time_ns: int) -> float:
    """Return a time in microseconds; exact in runs of up to 100 days."""
    return time_ns // 1000 if time_ns % 1000 == 0 else time_ns / 1000
