"""Traces as text: JSON Lines, a header and one line for each record. The same trace is the same bytes."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scbm.trace.records import Record, Trace

FORMAT_VERSION = 1
"""Grows with every change that a reader must know of; `docs/formats.md` describes each version."""

PAIRED = ("changes", "state", "payload")
"""The fields that hold variables and their values; they are written as JSON objects."""


def write_trace(trace: Trace) -> str:
    """The trace as JSON Lines, each line ended."""
    header = {"format": "scbm-trace", "version": FORMAT_VERSION, "model": trace.model, "case": trace.case}
    lines = [header, *records_json(trace)]
    return "".join(f"{json.dumps(line, ensure_ascii=False, separators=(',', ':'))}\n" for line in lines)


def records_json(trace: Trace) -> list[dict[str, Any]]:
    """The records of a trace as data that `json` can write."""
    return [_record(record) for record in trace.records]


def _record(record: Record) -> dict[str, Any]:
    written: dict[str, Any] = {"kind": record.kind}
    for field in fields(record):
        value = getattr(record, field.name)
        written[field.name] = dict(value) if field.name in PAIRED else value
    return written
