"""The text form of traces: JSON Lines, a header and one line for each record. Equal traces are equal bytes."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any, get_args

from scbm.cases.trace.records import Record, Trace
from scbm.model import Diagnostic, InputError, OperationState, Place, Slug

FORMAT_VERSION = 1
"""The version of the format, as `docs/reference/formats.md` describes it; it grows with every incompatible change."""

PAIRED = ("changes", "state", "payload")
"""The fields that hold variables and their values; they are written as JSON objects."""


def write_trace(trace: Trace) -> str:
    """Return `trace` as JSON Lines; each line ends with a line feed."""
    header = {"format": "scbm-trace", "version": FORMAT_VERSION, "model": trace.model, "case": trace.case}
    lines = [header, *records_json(trace)]
    return "".join(f"{json.dumps(line, ensure_ascii=False, separators=(',', ':'))}\n" for line in lines)


def records_json(trace: Trace) -> list[dict[str, Any]]:
    """Return the records of `trace` as data that `json` can write."""
    return [_record(record) for record in trace.records]


def _record(record: Record) -> dict[str, Any]:
    written: dict[str, Any] = {"kind": record.kind}
    for field in fields(record):
        value = getattr(record, field.name)
        written[field.name] = dict(value) if field.name in PAIRED else value
    return written


_CLASSES: dict[str, Any] = {record.kind: record for record in get_args(Record)}


def read_trace(text: str, file: str = "trace") -> Trace:
    """Return the trace in `text`. Raises `InputError` with the line in `file` that is wrong."""
    lines = text.removesuffix("\n").split("\n")  # not `splitlines`: a string may contain other line separators
    header = _object(lines[0] if lines else "", Place(file, 1))
    if header.get("format") != "scbm-trace":
        raise _bad("this is not a trace of scbm", Place(file, 1))
    if header.get("version") != FORMAT_VERSION:
        message = f"version {header.get('version')} of the trace format; this scbm reads version {FORMAT_VERSION}"
        raise _bad(message, Place(file, 1))
    records = tuple(_read_record(line, Place(file, number)) for number, line in enumerate(lines[1:], start=2))
    return Trace(str(header.get("model")), str(header.get("case")), records)


def _read_record(line: str, place: Place) -> Record:
    written = _object(line, place)
    kind = _CLASSES.get(str(written.pop("kind", None)))
    if kind is None:
        raise _bad("a record of an unknown kind", place)
    names = [field.name for field in fields(kind)]
    if sorted(written) != sorted(names):
        raise _bad(f"a {kind.kind} record has the fields {', '.join(names)}", place)
    try:
        record: Record = kind(**{name: _value(name, written[name]) for name in names})
    except (TypeError, ValueError, AttributeError):
        raise _bad(f"a {kind.kind} record with a field of the wrong type", place) from None
    return record


def _value(name: str, value: Any) -> Any:  # noqa: ANN401 - JSON; the class of the record declares the types of its fields
    if name in PAIRED:
        return tuple(value.items())
    if name in ("source", "target"):
        return OperationState(value)
    return tuple(value) if isinstance(value, list) else value


def _object(line: str, place: Place) -> dict[str, Any]:
    try:
        value = json.loads(line)
    except ValueError:
        value = None
    if not isinstance(value, dict):
        raise _bad("a line of a trace is a JSON object", place)
    return value


def _bad(message: str, place: Place) -> InputError:
    return InputError([Diagnostic(Slug.BAD_TRACE, message, place)])
