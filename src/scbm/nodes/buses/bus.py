"""The interface to a middleware: topics, services, and which peers are matched.

The names are those of ROS 2. `loopback`, `dds` and `rclpy_bus` have buses; nodes and links know this protocol alone.
All that is called back is called on the event loop that the bus was opened on, in the order in which it came.
"""

from __future__ import annotations

import asyncio
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol, TypeAlias

from msgspec import Struct

from scbm.nodes.types.definitions import STRING, MessageDefinition, ServiceDefinition

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from scbm.nodes.types.cdr import Message

__all__ = [
    "ONLY_BEST_EFFORT",
    "Answer",
    "Answered",
    "Bus",
    "BusError",
    "Client",
    "Join",
    "PeerCount",
    "Publisher",
    "Received",
    "Service",
    "Subscription",
    "Topic",
    "Unmatched",
    "UnmatchedKind",
    "when_answered",
]


ONLY_BEST_EFFORT = (
    "it offers reliability best effort, and scbm requests reliable; a measured topic can have `best_effort: true`"
)
"""Why a publication is not matched, and what can be written."""


class Topic(Struct, frozen=True):
    """A topic.

    Attributes:
        name: as ROS 2 writes it, from the root: `/scanner/request`.
        type: what its messages carry.
        is_latched: whether each publisher's last message reaches those that come later (transient local).
        is_best_effort: whether lost messages are not repeated (best effort). A best-effort subscription receives from
            publishers of both kinds, and may lose messages; a reliable one receives only from reliable publishers.
        is_raw: whether a subscription gets payloads in CDR (bytes) in place of messages, as most are of no interest.
    """

    name: str
    type: MessageDefinition = STRING
    is_latched: bool = False
    is_best_effort: bool = False
    is_raw: bool = False


class Service(Struct, frozen=True):
    """A service: its name from the root, and its type."""

    name: str
    type: ServiceDefinition


class Received(Struct, frozen=True):
    """A received message.

    Attributes:
        message: what it carries.
        source: identifies its publisher among those of the same topic, while that publisher exists.
        stamp_ns: when it came, by `time.monotonic_ns`.
    """

    message: Message
    source: int
    stamp_ns: int


class Answered(Struct, frozen=True):
    """The response to a call.

    Attributes:
        call: what `Client.call` returned.
        message: the response.
        stamp_ns: when it came, by `time.monotonic_ns`.
    """

    call: int
    message: Message
    stamp_ns: int


class UnmatchedKind(StrEnum):
    """What ends the lack of a peer. Of several kinds the last one counts."""

    ABSENT = "absent"
    """A peer may come."""
    BUSY = "busy"
    """A server has a goal that must be over first."""
    MISMATCH = "mismatch"
    """A peer is there that does not match: its code or ours must change, waiting does not help."""
    OTHER_VENDOR = "other vendor"
    """A mismatch: plain DDS cannot call a service of this vendor, rclpy can."""
    CROWDED = "crowded"
    """Several servers are there where one is needed: each of them would carry out a request."""


MISMATCHES = (UnmatchedKind.MISMATCH, UnmatchedKind.OTHER_VENDOR)
"""The kinds that waiting does not end."""


class Unmatched(Struct, frozen=True):
    """Why an endpoint has no peers: a clause, and its kind."""

    why: str
    kind: UnmatchedKind = UnmatchedKind.ABSENT

    @staticmethod
    def by_all(reasons: Iterable[Unmatched | None]) -> Unmatched | None:
        """Return all reasons as one; `None` if there are none."""
        shown = [reason for reason in reasons if reason is not None]
        if not shown:
            return None
        kind = max((reason.kind for reason in shown), key=list(UnmatchedKind).index)
        return Unmatched("; ".join(reason.why for reason in shown), kind)


class PeerCount(Struct, eq=False):
    """The number of matched peers as the event loop knows it; `matched` gets each new one."""

    matched: Callable[[int], None] | None
    peers: int = 0

    def are(self, peers: int) -> None:
        """Set the number. Called on the loop."""
        if peers != self.peers:
            self.peers = peers
            if self.matched is not None:
                self.matched(peers)


class Publisher(Protocol):
    """Publishes on one topic; nothing is lost between it and those that are matched, unless that is best effort."""

    @property
    def peers(self) -> int:
        """The number of matched subscriptions."""
        ...

    def publish(self, values: Mapping[str, object]) -> None:
        """Send a message with these fields to all of them; raise `BusError` if the middleware cannot take it.

        Nested messages are mappings. What is left out is zero, empty or false.
        """
        ...


class Subscription(Protocol):
    """Receives the messages of one topic."""

    @property
    def peers(self) -> int:
        """The number of matched publishers."""
        ...


class Client(Protocol):
    """Calls one service. Any number of calls may be under way; a call to a server that is lost gets no answer."""

    @property
    def peers(self) -> int:
        """The number of matched servers. A call goes to each of them."""
        ...

    def server_names(self) -> tuple[str, ...]:
        """Return a name for people for each matched server; none if the middleware does not tell."""
        ...

    def why_doubtful(self) -> str | None:
        """Return why the servers may not understand calls, as a clause; `None` if nothing speaks for it."""
        ...

    def call(self, values: Mapping[str, object]) -> int:
        """Send a request with these fields, as `Publisher.publish` has them.

        Return a number that no other call of this client has.
        """
        ...


class Bus(Protocol):
    """A participant of one middleware, with a name that its tools show."""

    @property
    def words(self) -> str:
        """The domain or process that the nodes share, in words: `this process`, `DDS domain 3`."""
        ...

    @property
    def lease_ns(self) -> int | None:
        """The time of silence after which peers count this node as lost; `None` if there is no such time."""
        ...

    def publisher(self, topic: Topic, matched: Callable[[int], None] | None = None) -> Publisher:
        """Return a publisher. `matched` gets the number of its peers whenever that changes."""
        ...

    def subscribe(
        self,
        topic: Topic,
        receive: Callable[[Received], None],
        matched: Callable[[int], None] | None = None,
        left: Callable[[int], None] | None = None,
    ) -> Subscription:
        """Subscribe to a topic; messages of the bus itself are left out.

        Args:
            topic: which.
            receive: gets each message.
            matched: gets the number of publishers whenever that changes.
            left: gets the `source` of a publisher that is gone, closed or lost, behind the last of its messages.
        """
        ...

    def client(
        self, service: Service, receive: Callable[[Answered], None], matched: Callable[[int], None] | None = None
    ) -> Client:
        """Return a client. `receive` gets each answer once; `matched` the number of servers whenever that changes."""
        ...

    def serve(self, service: Service, answer: Answer) -> None:
        """Serve a service: `answer` gets a request, and returns the fields of the response, or a future of them."""
        ...

    def why_unmatched(self, what: Topic | Service) -> Unmatched | None:
        """Return why no peer is matched, if it is known: another type, incompatible QoS, or a similar name."""
        ...

    async def close(self) -> None:
        """Leave at once: all peers lose its endpoints. Messages sent before are still delivered."""
        ...


class BusError(Exception):
    """A middleware cannot be used: a sentence that says why, a remedy if one is known, and which middleware it is."""

    def __init__(self, message: str, remedy: str | None = None, where: str = "DDS") -> None:
        super().__init__(message)
        self.message = message
        self.remedy = remedy
        self.where = where


Answer: TypeAlias = "Callable[[Message], Mapping[str, object] | asyncio.Future[Mapping[str, object]]]"
"""What serves a service. The response to a future that is done later is sent then."""


def when_answered(
    answer: Mapping[str, object] | asyncio.Future[Mapping[str, object]], respond: Callable[[Mapping[str, object]], None]
) -> None:
    """Call `respond` with the fields of a response: at once, or when the future has them."""
    if isinstance(answer, asyncio.Future):
        answer.add_done_callback(lambda done: None if done.cancelled() else respond(done.result()))
    else:
        respond(answer)


Join: TypeAlias = "Callable[[str], Bus]"
"""Opens the bus of a node, given the name of the node, on the running event loop. Raises `BusError`."""
