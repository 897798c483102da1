"""Events as plain data of JSON, read and written as logs and messages have them."""

from __future__ import annotations

import json
from typing import Any

from msgspec import to_builtins

from scbm.model import BehaviorModel
from scbm.model.json_reader import read_json, read_record
from scbm.running import Event, RunnerOptions
from scbm.testing.event_logs.event_records import (
    EventRecord,
    Note,
    NoteRecord,
    OptionsRecord,
    event_of,
    event_record,
)

OPTIONS = OptionsRecord.of(RunnerOptions())

_MAX_CHARACTERS = 1_000_000


def as_text(data: object) -> object:
    """Return data as `read_json` reads it from its text."""
    return read_json(json.dumps(data, ensure_ascii=False), _MAX_CHARACTERS)


def read_event(data: object, model: BehaviorModel, at_ns: int = 0) -> Event | Note:
    """Return the event of data; raise `ValueError`."""
    record: EventRecord = read_record(as_text(data), EventRecord, "the event")
    return event_of(record, model, at_ns)


def read_note(data: object, model: BehaviorModel, at_ns: int) -> Event | Note:
    """Return the note of data; raise `ValueError`."""
    record: NoteRecord = read_record(as_text(data), NoteRecord, "the note")
    return event_of(record, model, at_ns)


def event_json(event: Event | Note) -> dict[str, Any]:
    """Return an event as data."""
    data: dict[str, Any] = to_builtins(event_record(event))
    return data
