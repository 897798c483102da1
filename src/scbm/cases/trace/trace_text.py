"""The text form of traces: JSON Lines, a header and one line for each record. Equal traces are equal bytes."""

from __future__ import annotations

import json
from functools import cache
from hashlib import sha256
from typing import Any, get_args, get_type_hints

from scbm.cases.trace.records import Record, Trace
from scbm.model import Diagnostic, InputError, Place, PlannerIdentity, Slug, Value, refuse_other_version
from scbm.model.json_reader import JsonError, convert_json, read_json_object

FORMAT_VERSION = 3
"""The version of the format, as `docs/reference/formats.md` describes it; it grows with every incompatible change."""

PAIRED = ("changes", "state", "payload", "measured")
"""The fields that hold variables and their values; they are written as JSON objects."""

_LEFT_OUT = ("by", "measured", "forced")
"""The fields that are left out where they are empty or false."""


def write_trace(trace: Trace) -> str:
    """Return `trace` as JSON Lines; each line ends with a line feed."""
    header = {"format": "scbm-trace", "version": FORMAT_VERSION, "model": trace.model, "case": trace.case}
    planner = trace.planner
    return _lines(header | {"planner": {"name": planner.name, "version": planner.version, **planner.limits}}, trace)


def trace_digest(trace: Trace) -> str:
    """Return the SHA-256 of a trace, in hexadecimal digits: of its text with a header that has no planner.

    Planners that find the same plans give the same digest.
    """
    header = {"format": "scbm-trace", "version": FORMAT_VERSION, "model": trace.model, "case": trace.case}
    return sha256(_lines(header, trace).encode()).hexdigest()


def _lines(header: dict[str, Any], trace: Trace) -> str:
    lines = [header, *records_json(trace)]
    return "".join(f"{json.dumps(line, ensure_ascii=False, separators=(',', ':'))}\n" for line in lines)


def records_json(trace: Trace) -> list[dict[str, Any]]:
    """Return the records of `trace` as data that `json` can write."""
    return [_record(record) for record in trace.records]


def _record(record: Record) -> dict[str, Any]:
    written: dict[str, Any] = {"kind": record.kind}
    for name in record.__struct_fields__:
        value = getattr(record, name)
        if name in _LEFT_OUT and not value:
            continue
        written[name] = dict(value) if name in PAIRED else value
    return written


_MAX_LINE_CHARACTERS = 64 * 1024 * 1024
"""The maximum length of a line of a trace: far beyond the first record, which has the state of the whole model."""

_CLASSES: dict[str, Any] = {record.kind: record for record in get_args(Record)}


def read_trace(text: str, file: str = "trace") -> Trace:
    """Return the trace in `text`. Raises `InputError` with the line in `file` that is wrong."""
    lines = text.removesuffix("\n").split("\n")  # not `splitlines`: a string may contain other line separators
    header = _object(lines[0] if lines else "", Place(file, 1))
    if header.get("format") != "scbm-trace":
        raise _bad("this is not a trace of scbm", Place(file, 1))
    remedy = "write it again: `scbm run MODEL --trace FILE`"
    refuse_other_version("trace", header.get("version"), FORMAT_VERSION, Place(file, 1), remedy)
    planner = _planner(header.get("planner"), Place(file, 1))
    records = tuple(_read_record(line, Place(file, number)) for number, line in enumerate(lines[1:], start=2))
    return Trace(str(header.get("model")), str(header.get("case")), records, planner)


def _planner(value: object, place: Place) -> PlannerIdentity:
    try:
        return convert_json(value, PlannerIdentity)
    except JsonError as error:
        raise _bad(f"`planner` is not the name and the version of a planner: {error.message}", place) from None


def _read_record(line: str, place: Place) -> Record:
    written = _object(line, place)
    kind = _CLASSES.get(str(written.pop("kind", None)))
    if kind is None:
        raise _bad("a record of an unknown kind", place)
    record_kind = f"{'an' if kind.kind[0] in 'aeiou' else 'a'} {kind.kind} record"
    names = [name for name in kind.__struct_fields__ if name not in _LEFT_OUT or name in written]
    if sorted(written) != sorted(names):
        raise _bad(f"{record_kind} has the fields {', '.join(names)}", place)
    try:
        record: Record = kind(**{name: _value(name, written[name], kind) for name in names})
    except JsonError as error:
        raise _bad(f"{record_kind} with a field of the wrong type: {error.message}", place) from None
    return record


def _value(name: str, value: object, kind: type) -> object:
    if name in PAIRED:
        return tuple(convert_json(value, dict[str, Value]).items())
    return convert_json(value, _types_of(kind)[name])


@cache
def _types_of(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _object(line: str, place: Place) -> dict[str, Any]:
    try:
        return read_json_object(line, _MAX_LINE_CHARACTERS)
    except JsonError as error:
        raise _bad(f"a line of a trace is a JSON object: {error.message}", place) from None


def _bad(message: str, place: Place) -> InputError:
    return InputError([Diagnostic(Slug.BAD_TRACE, message, place)])
