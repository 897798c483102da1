"""A bus inside one process: all nodes on one event loop, connected by its queue."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from itertools import count
from time import monotonic_ns
from typing import TYPE_CHECKING

from scbm.nodes.buses.bus import (
    ONLY_BEST_EFFORT,
    Answered,
    BusError,
    Received,
    Service,
    Topic,
    Unmatched,
    UnmatchedKind,
    when_answered,
)
from scbm.nodes.types.cdr import BadValueError, codec_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from scbm.nodes.buses.bus import Answer, Join
    from scbm.nodes.types.cdr import Message
    from scbm.nodes.types.definitions import MessageDefinition


def connect_loopback(_: int, __: Callable[[str], None], ___: str | None) -> Join:
    """Connect the nodes of this process by one queue."""
    return LoopbackHub().join


class LoopbackHub:
    """Connects the buses of one process."""

    def __init__(self, now_ns: Callable[[], int] = monotonic_ns) -> None:
        """`now_ns` is the clock that messages are stamped by."""
        self.now_ns = now_ns
        self._ids = count(1)
        self._publishers: dict[str, list[_LoopbackPublisher]] = {}
        self._subscriptions: dict[str, list[_LoopbackSubscription]] = {}
        self._clients: dict[str, list[_LoopbackClient]] = {}
        self._servers: dict[str, list[_LoopbackServer]] = {}

    def join(self, node: str) -> LoopbackBus:
        """Open a bus for a node of this name, on the running event loop."""
        return LoopbackBus(self, node, asyncio.get_running_loop())

    # topics

    def add_publisher(self, publisher: _LoopbackPublisher) -> None:
        """Add a publisher, and notify the subscriptions of its topic."""
        self._publishers.setdefault(publisher.topic.name, []).append(publisher)
        self._match(publisher.topic)

    def add_subscription(self, subscription: _LoopbackSubscription) -> None:
        """Add a subscription, which gets the last messages of latched publishers."""
        self._subscriptions.setdefault(subscription.topic.name, []).append(subscription)
        self._match(subscription.topic)
        for publisher in self.publishers_for(subscription):
            if publisher.last is not None and subscription.topic.is_latched:
                subscription.deliver(publisher.last, publisher.id)

    def remove_publisher(self, publisher: _LoopbackPublisher) -> None:
        """Remove a publisher, and notify the subscriptions of its topic."""
        heard_it = self.subscriptions_for(publisher)
        self._publishers[publisher.topic.name].remove(publisher)
        for subscription in heard_it:
            subscription.lose(publisher.id)
        self._match(publisher.topic)

    def remove_subscription(self, subscription: _LoopbackSubscription) -> None:
        """Remove a subscription."""
        self._subscriptions[subscription.topic.name].remove(subscription)
        self._match(subscription.topic)

    def publishers_for(self, subscription: _LoopbackSubscription) -> list[_LoopbackPublisher]:
        """Return the publishers of the topic of a subscription."""
        others = self._publishers.get(subscription.topic.name, [])
        return [
            other for other in others if other.bus is not subscription.bus and _fit(other.topic, subscription.topic)
        ]

    def subscriptions_for(self, publisher: _LoopbackPublisher) -> list[_LoopbackSubscription]:
        """Return the subscriptions of the topic of a publisher."""
        others = self._subscriptions.get(publisher.topic.name, [])
        return [other for other in others if other.bus is not publisher.bus and _fit(publisher.topic, other.topic)]

    def types_of(self, name: str, *, but: LoopbackBus) -> list[str]:
        """Return the types that other buses use for a topic."""
        ends: list[_LoopbackPublisher | _LoopbackSubscription] = [
            *self._publishers.get(name, []),
            *self._subscriptions.get(name, []),
        ]
        return [end.topic.type.name for end in ends if end.bus is not but]

    def is_too_weak(self, topic: Topic, *, but: LoopbackBus) -> bool:
        """Return whether another bus publishes as best effort a topic that asks for reliable."""
        others = [end.topic for end in self._publishers.get(topic.name, []) if end.bus is not but]
        return not topic.is_best_effort and any(other.is_best_effort for other in others)

    def _match(self, topic: Topic) -> None:
        for publisher in self._publishers.get(topic.name, []):
            publisher.notify_matched()
        for subscription in self._subscriptions.get(topic.name, []):
            subscription.notify_matched()

    # services

    def add_client(self, client: _LoopbackClient) -> None:
        """Add a client."""
        self._clients.setdefault(client.service.name, []).append(client)
        client.notify_matched()

    def add_server(self, server: _LoopbackServer) -> None:
        """Add a server."""
        self._servers.setdefault(server.service.name, []).append(server)
        self._match_service(server.service)

    def remove_client(self, client: _LoopbackClient) -> None:
        """Remove a client."""
        self._clients[client.service.name].remove(client)

    def remove_server(self, server: _LoopbackServer) -> None:
        """Remove a server."""
        self._servers[server.service.name].remove(server)
        self._match_service(server.service)

    def servers_for(self, client: _LoopbackClient) -> list[_LoopbackServer]:
        """Return the server that takes the calls of a client."""
        servers = self._servers.get(client.service.name, [])
        return [server for server in servers if server.service == client.service]

    def server_types(self, name: str) -> list[str]:
        """Return the types of the servers of a service."""
        return [server.service.type.name for server in self._servers.get(name, [])]

    def _match_service(self, service: Service) -> None:
        for client in self._clients.get(service.name, []):
            client.notify_matched()

    def next_id(self) -> int:
        """Return a number that is unique at this hub."""
        return next(self._ids)


def _fit(offered: Topic, asked: Topic) -> bool:
    keeps_what_is_asked = offered.is_latched or not asked.is_latched
    is_as_reliable = asked.is_best_effort or not offered.is_best_effort
    return offered.type == asked.type and keeps_what_is_asked and is_as_reliable


@dataclass(eq=False)
class _LoopbackPublisher:
    hub: LoopbackHub
    bus: LoopbackBus
    topic: Topic
    id: int
    matched: Callable[[int], None] | None
    last: Message | None = None
    known: int = 0

    @property
    def peers(self) -> int:
        return len(self.hub.subscriptions_for(self))

    def publish(self, values: Mapping[str, object]) -> None:
        if not self.bus.is_open:
            raise BusError(f"`{self.topic.name}`: the bus is closed")
        message = _sent(self.topic.type, values)
        if self.topic.is_latched:
            self.last = message
        for subscription in self.hub.subscriptions_for(self):
            subscription.deliver(message, self.id)

    def notify_matched(self) -> None:
        self.known = _notify(self.bus, self.matched, self.known, self.peers)


@dataclass(eq=False)
class _LoopbackSubscription:
    hub: LoopbackHub
    bus: LoopbackBus
    topic: Topic
    receive: Callable[[Received], None]
    matched: Callable[[int], None] | None
    left: Callable[[int], None] | None
    known: int = 0

    @property
    def peers(self) -> int:
        return len(self.hub.publishers_for(self))

    def deliver(self, message: Message, source: int) -> None:
        given = codec_of(self.topic.type).encode(message) if self.topic.is_raw else message
        self.bus.later(self.receive, Received(given, source, self.hub.now_ns()))

    def lose(self, source: int) -> None:
        if self.left is not None:
            self.bus.later(self.left, source)

    def notify_matched(self) -> None:
        self.known = _notify(self.bus, self.matched, self.known, self.peers)


@dataclass(eq=False)
class _LoopbackServer:
    bus: LoopbackBus
    service: Service
    answer: Answer

    def take(self, call: int, request: Message, client: _LoopbackClient) -> None:
        def respond(values: Mapping[str, object]) -> None:
            if self.bus.is_open:
                response = _sent(self.service.type.response, values)
                client.bus.later(client.receive, Answered(call, response, client.hub.now_ns()))

        when_answered(self.answer(request), respond)


@dataclass(eq=False)
class _LoopbackClient:
    hub: LoopbackHub
    bus: LoopbackBus
    service: Service
    receive: Callable[[Answered], None]
    matched: Callable[[int], None] | None
    known: int = 0
    calls: Iterable[int] = field(default_factory=lambda: count(1))

    @property
    def peers(self) -> int:
        return len(self.hub.servers_for(self))

    def server_names(self) -> tuple[str, ...]:
        return tuple(server.bus.node for server in self.hub.servers_for(self))

    def why_doubtful(self) -> None:
        """None: all nodes understand each other."""

    def call(self, values: Mapping[str, object]) -> int:
        request = _sent(self.service.type.request, values)
        number = next(iter(self.calls))
        for server in self.hub.servers_for(self)[:1]:
            server.bus.later(server.take, number, request, self)
        return number

    def notify_matched(self) -> None:
        self.known = _notify(self.bus, self.matched, self.known, self.peers)


def _sent(definition: MessageDefinition, values: Mapping[str, object]) -> Message:
    """Return a message as its receiver gets it; raise `BusError` for values that it cannot carry."""
    try:
        return codec_of(definition).complete(values)
    except BadValueError as error:
        raise BusError(str(error)) from error


def _mismatch(why: str) -> Unmatched:
    return Unmatched(why, UnmatchedKind.MISMATCH)


def _notify(bus: LoopbackBus, matched: Callable[[int], None] | None, known: int, peers: int) -> int:
    if matched is not None and peers != known:
        bus.later(matched, peers)
    return peers


class LoopbackBus:
    """The bus of one node at a hub."""

    def __init__(self, hub: LoopbackHub, node: str, loop: asyncio.AbstractEventLoop) -> None:
        self.node = node
        self._hub = hub
        self._loop = loop
        self.is_open = True
        self._leave: list[Callable[[], None]] = []

    @property
    def words(self) -> str:
        """This process, in words."""
        return "this process"

    @property
    def lease_ns(self) -> None:
        """None: nodes of one process are never lost."""

    def publisher(self, topic: Topic, matched: Callable[[int], None] | None = None) -> _LoopbackPublisher:
        """Return a publisher."""
        made = _LoopbackPublisher(self._hub, self, topic, self._hub.next_id(), matched)
        self._hub.add_publisher(made)
        self._leave.append(lambda: self._hub.remove_publisher(made))
        return made

    def subscribe(
        self,
        topic: Topic,
        receive: Callable[[Received], None],
        matched: Callable[[int], None] | None = None,
        left: Callable[[int], None] | None = None,
    ) -> _LoopbackSubscription:
        """Subscribe to a topic."""
        made = _LoopbackSubscription(self._hub, self, topic, receive, matched, left)
        self._hub.add_subscription(made)
        self._leave.append(lambda: self._hub.remove_subscription(made))
        return made

    def client(
        self, service: Service, receive: Callable[[Answered], None], matched: Callable[[int], None] | None = None
    ) -> _LoopbackClient:
        """Return a client."""
        made = _LoopbackClient(self._hub, self, service, receive, matched)
        self._hub.add_client(made)
        self._leave.append(lambda: self._hub.remove_client(made))
        return made

    def serve(self, service: Service, answer: Answer) -> None:
        """Serve a service."""
        made = _LoopbackServer(self, service, answer)
        self._hub.add_server(made)
        self._leave.append(lambda: self._hub.remove_server(made))

    def why_unmatched(self, what: Topic | Service) -> Unmatched | None:
        """Return a mismatch if others use another type, or are less reliable."""
        if isinstance(what, Topic):
            types = self._hub.types_of(what.name, but=self)
            others = [name for name in types if name != what.type.name]
            wanted = what.type.name
            if not others and self._hub.is_too_weak(what, but=self):
                return _mismatch(f"`{what.name}` has a publication, but {ONLY_BEST_EFFORT}")
        else:
            others = [name for name in self._hub.server_types(what.name) if name != what.type.name]
            wanted = what.type.name
        return _mismatch(f"`{what.name}` is of type {others[0]} there, and not of {wanted}") if others else None

    def later(self, function: Callable[..., object], *arguments: object) -> None:
        """Run a callback on the loop, unless the bus is closed by then."""
        self._loop.call_soon(self._call, function, *arguments)

    def _call(self, function: Callable[..., object], *arguments: object) -> None:
        if self.is_open:
            function(*arguments)

    async def close(self) -> None:
        """Leave the hub."""
        for leave in reversed(self._leave):
            leave()
        self._leave.clear()
        self.is_open = False
