"""Reads values that a driver publishes on topics into variables of the model.

It reports measured values without a meaning, while their driver can still be corrected.
"""

from __future__ import annotations

import json
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING

from scbm.cases.trace import SENT, InjectionApplied
from scbm.model import format_value
from scbm.model.json_reader import MAX_LONG_TEXT
from scbm.nodes.bindings.ros_binding import binding_of
from scbm.nodes.buses.bus import Topic, Unmatched
from scbm.nodes.links.link import Measurement, PresenceMonitor
from scbm.nodes.types.field_paths import MissingElement
from scbm.running.simulation.excluded_values import EXCLUDED, excluded_values

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from scbm.cases.trace import Changes, Record
    from scbm.model import Resource, Value
    from scbm.nodes.bindings.ros_binding import ActionCall, MeasuredTopic, Reading, ServiceCall
    from scbm.nodes.buses.bus import Bus, Received, Subscription
    from scbm.nodes.links.link import LinkListener
    from scbm.nodes.types.cdr import Message
    from scbm.nodes.types.definitions import Scalar
    from scbm.nodes.types.field_paths import FieldPath
    from scbm.running import Program


class MeasuredTopics:
    """Subscribes to the measured topics of a resource. Each message is one measurement of all its variables."""

    def __init__(self, bus: Bus, resource: Resource, listener: LinkListener) -> None:
        """Made once for each resource.

        Args:
            bus: what carries the topics.
            resource: one with a binding.
            listener: gets values and changes of presence.
        """
        self._bus = bus
        self._resource = resource.name
        self._listener = listener
        self._presence = PresenceMonitor(resource.name, listener, lambda: self.is_there)
        grouped: dict[Topic, list[MeasuredTopic]] = {}
        for measured in binding_of(resource).measured:
            topic = Topic(measured.topic, measured.type, is_best_effort=measured.is_best_effort)
            grouped.setdefault(topic, []).append(measured)
        self._topics = tuple(grouped)
        self._subscriptions: list[Subscription] = []
        for topic, group in grouped.items():
            readings = tuple(measured.reading for measured in group)
            self._subscriptions.append(bus.subscribe(topic, partial(self._receive, readings), self._matched))

    @property
    def is_there(self) -> bool:
        """Whether each topic has a publisher."""
        return len(self._subscriptions) == len(self._topics) and all(heard.peers for heard in self._subscriptions)

    @property
    def missing(self) -> tuple[str, ...]:
        """The topics without a publisher."""
        return tuple(topic.name for topic in self._silent())

    def why_unmatched(self) -> Unmatched | None:
        """Return why a topic has no publisher, if it is known."""
        return Unmatched.by_all(map(self._bus.why_unmatched, self._silent()))

    def _silent(self) -> list[Topic]:
        return [topic for topic, heard in zip(self._topics, self._subscriptions, strict=True) if not heard.peers]

    def _receive(self, readings: tuple[Reading, ...], received: Received) -> None:
        values = values_of(readings, received.message)
        self._listener.on_values(self._resource, Measurement(values, received.stamp_ns))

    def _matched(self, _: int) -> None:
        self._presence.update()


_MAX_SHOWN = MAX_LONG_TEXT // 10
"""Maximum length of a text of a driver; as JSON, with escapes, it fits into a record."""


def values_of(readings: Iterable[Reading], message: Message) -> Changes:
    """Return the values that fields of a message mean, with their variables."""
    return tuple((reading.variable, value_of(reading, message)) for reading in readings)


def outcome_of(call: ServiceCall | ActionCall, message: Message) -> tuple[bool, Changes]:
    """Return whether a response or a result means success, and what it measures.

    The other fields of one that says failed mean nothing.
    """
    succeeded = all(_has_value(message, path, wanted) for path, wanted in call.succeeded)
    return succeeded, values_of(call.measured, message) if succeeded else ()


def _has_value(message: Message, path: FieldPath, wanted: Scalar) -> bool:
    """Return whether a field of a message is there, and has a value."""
    try:
        return bool(path.get(message) == wanted)
    except MissingElement:
        return False


def value_of(reading: Reading, message: Message) -> Value:
    """Return the value that a field of a message means.

    A field that means none comes out as a text that shows it and is the value of no variable, so that the runner
    refuses it and says so: numbers as they are written, other text in quotes as in JSON, cut at the limit of a record.
    So does an element that the message does not have.
    """
    try:
        data = reading.path.get(message)
    except MissingElement as error:
        return f"{_MISSING}{error}"[:_MAX_SHOWN]
    if isinstance(data, str) and len(data) > _MAX_SHOWN:
        return _shown(f"{data[:_MAX_SHOWN]}…")
    if reading.ranges:
        return next((value for value, interval in reading.ranges if data in interval), _shown(data))
    if reading.meanings:
        return dict(reading.meanings).get(data, _shown(data))
    return _shown(data) if isinstance(data, float) else data


_MISSING = "no "
"""How the text for an element begins that a message does not have: `no position[2]: the list has 2 elements`."""


def _shown(data: Scalar) -> str:
    if isinstance(data, float) and not isfinite(data):
        return f"{data:+}"  # `nan` and `inf` could be symbols
    return json.dumps(data)


_MAX_WARNED = 100
"""The maximum number of refused values that are reported: a driver may go on without end."""

_LONGEST = 40
"""Maximum number of characters of a value of a driver that are shown."""


class Refusals:
    """Warns once for each variable of a refused value, with the reason.

    The runner refuses by the same rules, and its trace has all of them; but not what comes between runs.
    """

    def __init__(self, program: Program, warn: Callable[[str], None]) -> None:
        """Before any value has come.

        Args:
            program: of the model.
            warn: gets the sentences.
        """
        self._program = program
        self._readings = {resource.name: binding_of(resource).readings for resource in program.model.resources}
        self._warn = warn
        self._warned: list[tuple[str, str]] = []

    def look(self, resource: str, values: Changes, names: Collection[str]) -> None:
        """Report refused values of a resource, which may send these variables."""
        for name, value in values:
            why = self._why_not(resource, name, value, names)
            if why is not None and (resource, name) not in self._warned and len(self._warned) < _MAX_WARNED:
                self._warned.append((resource, name))
                self._warn(f"`{_shown_value(name)}`: {_shown_value(format_value(value))} is refused: {why}")

    def _why_not(self, resource: str, name: str, value: Value, names: Collection[str]) -> str | None:
        if name not in names:
            return f"`{resource}` may not measure this variable"
        if value in self._program.packing.space[name].domain:
            return None
        readings = [reading for reading in self._readings[resource] if reading.variable == name]
        if readings and isinstance(value, str) and value.startswith(_MISSING):
            return "the message does not have it"
        if any(reading.ranges for reading in readings):
            return "in no range of its binding"
        return "no value of its binding" if any(reading.meanings for reading in readings) else "not in its domain"


class ExclusionWarnings:
    """Warns once for each variable of a value that a driver sends and the model excludes, with the reason."""

    def __init__(self, program: Program, warn: Callable[[str], None]) -> None:
        """Before any value has come; `warn` gets the sentences."""
        self._program = program
        self._warn = warn
        self._known: dict[str, None] = {}

    def look(self, records: Sequence[Record], last: Sequence[Record]) -> None:
        """Report what the last records of a run show.

        Args:
            records: all records of the run.
            last: those of the last event.
        """
        sent = [each for each in last if isinstance(each, InjectionApplied) and each.injection == SENT]
        new = {name: None for each in sent for name, _ in each.changes if name not in self._known}
        self._known |= new
        for excluded in excluded_values(self._program, records) if new else ():
            if excluded.variable in new:
                del new[excluded.variable]
                self._warn(f"{EXCLUDED}: {excluded}")


def _shown_value(text: str) -> str:
    """Return a received value on one line."""
    shown = text if text.isprintable() else json.dumps(text)
    return shown if len(shown) <= _LONGEST else f"{shown[:_LONGEST]}…"
