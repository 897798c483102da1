"""A run for ui.perfetto.dev and chrome://tracing, in the Trace Event Format that both read.

https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU describes it. A process is a group of
tracks here, a thread a track of slices, and a counter a track of numbers. `docs/how-to/view-traces.md` lists them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias

from scbm.cases.trace import (
    AutomaticTaken,
    InjectionApplied,
    MeasurementReceived,
    MeasurementRefused,
    MessageDisturbed,
    OperationStepped,
    PlanAsked,
    PlanReceived,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunStarted,
    state_after,
)
from scbm.model import OperationState, ValueKind, format_value
from scbm.model.variables import CURRENT_NAME, Role

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases.trace import Changes, Record
    from scbm.model import BehaviorModel, Value
    from scbm.testing import Execution, Violation

    Event = dict[str, Any]
    Arguments = dict[str, Any]

_GROUPS = ("run", "operations", "resources", "injections", "requirements", "variables")
"""The processes, from top to bottom; the first has pid 1."""

_FIRST_TRACK = 101
"""The first tid: a thread whose tid is its process's pid would be taken for its main thread."""

_ASKED = "planning"

_COLOURS = {"failed": "terrible", "timedout": "bad", "cancelled": "bad", "disabled": "yellow", "no reply": "bad"}
"""The colours that chrome://tracing knows, for what is not as it should be; Perfetto colours by name."""


@dataclass(frozen=True, slots=True)
class Slice:
    """Something that lasts, on a track of a group."""

    group: str
    track: str
    name: str
    begin_ns: int
    end_ns: int
    arguments: Arguments
    colour: str | None = None


@dataclass(frozen=True, slots=True)
class Instant:
    """Something that happens, on a track of a group."""

    group: str
    track: str
    name: str
    at_ns: int
    arguments: Arguments


@dataclass(frozen=True, slots=True)
class Sample:
    """What a variable is from now on, as a number."""

    group: str
    track: str
    at_ns: int
    number: int


@dataclass(frozen=True, slots=True)
class Arrow:
    """From the operation that executes to its request."""

    operation: str
    resource: str
    at_ns: int
    request: int


Item: TypeAlias = Slice | Instant | Sample | Arrow


def write_perfetto(model: BehaviorModel, execution: Execution, stream: BinaryIO) -> int:
    """Writes the run to a stream, and says how many events it has.

    Times are in microseconds, with nanoseconds behind the point.
    """
    items = list(_items(model, execution))
    tracks = _tracks(model, items)
    events = [*_metadata(tracks), *(event for item in items for event in _events(item, tracks))]
    written = {"displayTimeUnit": "ns", "otherData": _about(execution), "traceEvents": events}
    # Perfetto shows `\\u2192` as it stands there, so no character is escaped that need not be
    stream.write(f"{json.dumps(written, ensure_ascii=False, separators=(',', ':'))}\n".encode())
    return len(events)


def _about(execution: Execution) -> dict[str, str]:
    case = execution.case
    failures = "; ".join(map(str, execution.verdict.failures))
    told = {"model": execution.trace.model, "case": case.name, "goal": case.goal, "predicate": str(case.predicate)}
    return told | {"verdict": execution.verdict.end.value, "failures": failures}


def _items(model: BehaviorModel, execution: Execution) -> Iterator[Item]:
    """All that is drawn; of each track in the order of time."""
    records, end_ns = execution.trace.records, execution.ended_ns
    yield from _plans(records, end_ns)
    yield from _moments(records)
    yield from _operations(records, end_ns)
    yield from _requests(records, end_ns)
    yield from _injections(execution)
    yield from (_violated(violation, execution) for violation in execution.violations)
    yield from _variables(model, records, end_ns)


# the tracks


def _plans(records: Iterable[Record], end_ns: int) -> Iterator[Item]:
    """Each plan, from its answer until the next question, and each question until its answer if that takes time."""
    opened: tuple[str, int, Arguments] | None = None
    for record in records:
        if isinstance(record, (PlanAsked, PlanReceived, RunEnded)):
            if opened is not None and (opened[0] != _ASKED or opened[1] < record.at_ns):
                yield Slice("run", "plan", opened[0], opened[1], record.at_ns, opened[2])
            opened = _plan(record)
        if isinstance(record, RunStarted):
            yield Instant("run", "goal", record.goal, record.at_ns, {"predicate": record.predicate})
        if isinstance(record, RunEnded):
            yield Instant("run", "goal", record.end, record.at_ns, {"detail": ", ".join(record.detail)})
    if opened is not None:
        yield Slice("run", "plan", opened[0], opened[1], end_ns, opened[2])


def _plan(record: PlanAsked | PlanReceived | RunEnded) -> tuple[str, int, Arguments] | None:
    match record:
        case PlanAsked():
            return _ASKED, record.at_ns, {"ask": record.ask}
        case PlanReceived(status="solved"):
            plan = {f"{number}": name for number, name in enumerate(record.plan, start=1)}
            return " → ".join(record.plan) or "nothing to do", record.at_ns, {"ask": record.ask, "plan": plan}
        case PlanReceived():
            return record.status, record.at_ns, {"ask": record.ask}
        case RunEnded():
            return None


def _moments(records: Iterable[Record]) -> Iterator[Instant]:
    """What takes no time."""
    for record in records:
        told = _values(record.changes)
        match record:
            case AutomaticTaken():
                failed = {} if record.failed is None else {"failed": record.failed}
                yield Instant("run", "automatic", record.transition, record.at_ns, told | failed)
            case MessageDisturbed():
                fate = "lost" if not record.copies else f"delivered {record.copies} times"
                name = f"{record.message} {record.request} of {record.resource} {fate}"
                yield Instant("run", "network", name, record.at_ns, {"copies": record.copies})
            case ReplyDropped():
                name = f"reply {record.request} dropped: {record.why}"
                yield Instant("run", "network", name, record.at_ns, {})
            case MeasurementReceived():
                yield Instant("run", "network", "measured", record.at_ns, told)
            case MeasurementRefused():
                refused = {record.variable: format_value(record.value)}
                yield Instant("run", "network", f"{record.variable} refused", record.at_ns, refused)
            case _:
                pass


def _operations(records: Iterable[Record], end_ns: int) -> Iterator[Slice]:
    """Each time that an operation was disabled or executed, named by how that ended."""
    opened: tuple[str, OperationState, int] | None = None
    for record in records:
        if opened is not None and (after := _state_behind(record)) is not None:
            yield _lasted(*opened, record.at_ns, after)
            opened = None
        if isinstance(record, OperationStepped) and record.target in (
            OperationState.DISABLED,
            OperationState.EXECUTING,
        ):
            opened = record.operation, record.target, record.at_ns
    if opened is not None:
        yield _lasted(*opened, end_ns, "the end")


def _state_behind(record: Record) -> str | None:
    """What the current operation is behind a record, if that changes it."""
    if isinstance(record, OperationStepped):
        return record.target.value
    if isinstance(record, RunEnded):
        return "the end"
    failing = isinstance(record, (AutomaticTaken, InjectionApplied)) and record.failed is not None
    return OperationState.FAILED.value if failing else None


def _lasted(operation: str, state: OperationState, begin_ns: int, end_ns: int, after: str) -> Slice:
    colour = _COLOURS.get(after) or _COLOURS.get(state.value)
    name = f"{state.value} → {after}"
    return Slice("operations", operation, name, begin_ns, end_ns, {"state": state.value, "then": after}, colour)


def _requests(records: Iterable[Record], end_ns: int) -> Iterator[Item]:
    """Each request until its reply, or until it was given up."""
    opened: dict[str, RequestSent] = {}
    current = OperationState.INITIAL.value
    for record in records:
        current = str(dict(record.changes).get(CURRENT_NAME, current))
        if isinstance(record, RequestSent):
            opened[record.resource] = record
            yield Arrow(current, record.resource, record.at_ns, record.request)
        elif isinstance(record, (ReplyReceived, RequestCancelled)) and record.resource in opened:
            yield _requested(opened.pop(record.resource), record.at_ns, _result(record))
    yield from (_requested(sent, end_ns, "no reply") for sent in opened.values())


def _result(record: ReplyReceived | RequestCancelled) -> str:
    if isinstance(record, RequestCancelled):
        return "cancelled"
    return "succeeded" if record.succeeded else "failed"


def _requested(sent: RequestSent, end_ns: int, result: str) -> Slice:
    values = ", ".join(format_value(value) for _, value in sent.payload) or "request"
    name = values if result == "succeeded" else f"{values}: {result}"
    arguments = {"request": sent.request, "result": result, "payload": _values(sent.payload)}
    return Slice("resources", sent.resource, name, sent.at_ns, end_ns, arguments, _COLOURS.get(result))


def _injections(execution: Execution) -> Iterator[Item]:
    """Each injection: what is held lasts, the rest is a moment."""
    holds = {injection.name: injection.hold_ns for injection in execution.case.injections}
    seen: dict[str, int] = {}
    for record in execution.trace.records:
        if not isinstance(record, (InjectionApplied, ResourceChanged)) or record.injection in seen:
            continue
        seen[record.injection] = record.at_ns
        name, hold_ns = record.injection, holds.get(record.injection)
        arguments = _values(record.changes)
        if isinstance(record, ResourceChanged):
            arguments = {"resource": record.resource, "condition": record.condition}
        what = ", ".join(f"{key} = {value}" for key, value in arguments.items()) or "nothing changed"
        if hold_ns is None:
            yield Instant("injections", name, what, record.at_ns, arguments)
        else:
            end_ns = min(record.at_ns + hold_ns, execution.ended_ns)
            yield Slice("injections", name, what, record.at_ns, end_ns, arguments)


def _violated(violation: Violation, execution: Execution) -> Item:
    """A violation; a slice if something was owed for a while."""
    begin_ns = execution.trace.records[violation.begins].at_ns
    arguments = {"reason": violation.reason, "operation": violation.operation, **_values(violation.values)}
    if begin_ns == violation.at_ns:
        return Instant("requirements", violation.requirement, "violated", violation.at_ns, arguments)
    return Slice("requirements", violation.requirement, "violated", begin_ns, violation.at_ns, arguments, "terrible")


def _variables(model: BehaviorModel, records: Iterable[Record], end_ns: int) -> Iterator[Item]:
    """Every variable but the states of operations: numbers as samples, symbols as slices named by their value."""
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
    """For each variable its values, each with the moment from which on it has it; of one moment the last."""
    past: dict[str, list[tuple[int, Value]]] = {}
    for record in records:
        if isinstance(record, RunStarted):
            for name, value in state_after([record]).items():
                past.setdefault(name, []).append((record.at_ns, value))
        elif past:
            for name, value in record.changes:
                moments = past[name]
                if moments[-1][0] == record.at_ns:
                    moments.pop()
                moments.append((record.at_ns, value))
    return {name: _without_repetitions(moments) for name, moments in past.items()}


def _without_repetitions(moments: list[tuple[int, Value]]) -> list[tuple[int, Value]]:
    """Only where the value changes: within a moment it may have come back."""
    return [moment for index, moment in enumerate(moments) if not index or moments[index - 1][1] != moment[1]]


def _values(changes: Changes) -> Arguments:
    return {name: format_value(value) for name, value in changes}


# the format


def _tracks(model: BehaviorModel, items: Iterable[Item]) -> dict[tuple[str, str], int]:
    """The tid of each track with slices or instants: group by group, there in the order of the model."""
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
    """What the format says of an item."""
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
    if item.begin_ns == item.end_ns:  # as a slice it would be put inside the one that begins now
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
    """Microseconds; exact in runs of up to 100 days."""
    return time_ns // 1000 if time_ns % 1000 == 0 else time_ns / 1000
