"""A resource that is reached by a pair of topics: the protocol of drivers (docs/reference/node-protocol.md)."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, TypeAlias

from msgspec import UNSET, UnsetType, field

from scbm.model.json_reader import JsonError, JsonRecord, Values, matching, read_record
from scbm.nodes.bindings.ros_binding import binding_of
from scbm.nodes.buses.bus import BusError, Topic, Unmatched
from scbm.nodes.links.link import Correlation, Measurement, PresenceMonitor, Reply
from scbm.nodes.node_messages import read_object

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.cases.trace import Changes
    from scbm.nodes.buses.bus import Bus, Received
    from scbm.nodes.links.link import LinkContext, LinkListener

_MAX_CHARACTERS = 1_000_000
"""Maximum length of a message of a driver; its event fits into a line of an event log."""

RequestId: TypeAlias = Annotated[
    str, matching("[0-9A-Za-z_]{1,64}-[0-9]{1,18}", "letters, digits or `_`, then `-` and a number")
]
"""The id of a request in the protocol of drivers: `<run>-<n>`."""


class _DriverMessage(JsonRecord, frozen=True):
    """What a driver sends: a reply, or measured values without an id."""

    measured: Values = field(default_factory=dict)
    id: RequestId | UnsetType = UNSET
    succeeded: bool | UnsetType = UNSET


class TopicLink:
    """Sends requests on one topic, and receives replies on another."""

    def __init__(
        self,
        bus: Bus,
        resource: str,
        topics: tuple[Topic, Topic],
        listener: LinkListener,
        warn: Callable[[str], None],
    ) -> None:
        """Made once for each resource.

        Args:
            bus: what carries it.
            resource: its name in the model.
            topics: that of requests, and that of replies.
            listener: gets replies, values and changes of presence.
            warn: gets a sentence about each message that is none of the protocol, and each that cannot be sent.
        """
        self._bus = bus
        self._resource = resource
        self._topics = topics
        self._listener = listener
        self._warn = warn
        self._waiting: dict[Correlation, str] = {}
        self._presence = PresenceMonitor(resource, listener, lambda: self.is_there)
        self._requests = bus.publisher(topics[0], self._matched)
        self._replies = bus.subscribe(topics[1], self._receive, self._matched)

    @property
    def is_there(self) -> bool:
        """Whether the topic of requests has a subscriber, and that of replies a publisher."""
        return bool(self._requests.peers and self._replies.peers)

    @property
    def missing(self) -> tuple[str, ...]:
        """The topics without a peer."""
        return tuple(topic.name for topic in self._lonely())

    def send(self, request: Correlation, values: Changes) -> None:
        """Send a request, or queue it until the driver is there."""
        text = json.dumps({"id": id_text(request), "request": dict(values)}, ensure_ascii=False)
        if self.is_there:
            self._requests.publish({"data": text})
        else:
            self._waiting[request] = text

    def cancel(self, request: Correlation) -> None:
        """Cancel a request."""
        if self._waiting.pop(request, None) is None and self.is_there:
            self._requests.publish({"data": json.dumps({"id": id_text(request), "cancel": True})})

    def end_run(self) -> bool:
        """Return that nothing goes on: the run cancels its requests."""
        return False

    def why_unmatched(self) -> Unmatched | None:
        """Return why the driver is missing, if it is known."""
        return Unmatched.by_all(map(self._bus.why_unmatched, self._lonely()))

    def _lonely(self) -> list[Topic]:
        ends = zip(self._topics, (self._requests, self._replies), strict=True)
        return [topic for topic, end in ends if not end.peers]

    def _matched(self, _: int) -> None:
        if self._presence.update():
            self._send_waiting()

    def _send_waiting(self) -> None:
        """Send the queued requests; warn of one that the bus does not take, and go on with the others."""
        waiting, self._waiting = self._waiting, {}
        for request, text in waiting.items():
            try:
                self._requests.publish({"data": text})
            except BusError as error:
                self._warn(f"request {request.number} to `{self._resource}` is lost: {error.message}")

    def _receive(self, received: Received) -> None:
        try:
            heard = read_reply(received.message.data, received.stamp_ns)
        except JsonError as error:
            self._warn(f"a message on `{self._topics[1].name}` was dropped: {error}")
            return
        if isinstance(heard, Reply):
            self._listener.on_reply(self._resource, heard)
        else:
            self._listener.on_values(self._resource, heard)


def bound_topic_link(context: LinkContext) -> TopicLink:
    """Return the link to a driver that is bound to a pair of topics."""
    binding = binding_of(context.resource)
    assert binding.requests is not None  # noqa: S101 - checked by the caller
    request, reply = map(Topic, binding.requests.topics)
    return TopicLink(context.bus, context.resource.name, (request, reply), context.listener, context.warn)


def id_text(request: Correlation) -> str:
    """Return the id of a request in the protocol of drivers: `<run>-<n>`."""
    return f"{request.run}-{request.number}"


def read_id(text: str) -> Correlation:
    """Return the request of a `RequestId`."""
    run, _, number = text.partition("-")
    return Correlation(run, int(number))


def read_reply(text: object, stamp_ns: int) -> Reply | Measurement:
    """Parse a message of a driver. Raises `JsonError`."""
    message: _DriverMessage = read_record(read_object(text, _MAX_CHARACTERS), _DriverMessage, "the message")
    measured = tuple(message.measured.items())
    if message.id is UNSET:
        if message.succeeded is not UNSET:
            raise JsonError("a reply has the `id` of its request")
        return Measurement(measured, stamp_ns)
    if message.succeeded is UNSET:
        raise JsonError("a reply says `succeeded`: true or false")
    return Reply(read_id(message.id), message.succeeded, measured, stamp_ns)
