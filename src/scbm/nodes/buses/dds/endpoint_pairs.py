"""A writer and a reader of one client or one server of a service.

User data of both, `clientid=…;` or `serviceid=…;`, identify them as a pair to other participants.
"""

from __future__ import annotations

import time
from threading import Lock
from typing import TYPE_CHECKING

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.topic import Topic
from msgspec import Struct

from scbm.nodes.buses.bus import BusError
from scbm.nodes.buses.dds.dds_classes import message_class
from scbm.nodes.buses.dds.raw_samples import RawReader, RawWriter, delete, listener
from scbm.nodes.types.type_hashes import user_data

if TYPE_CHECKING:
    from collections.abc import Callable
    from uuid import UUID

    from cyclonedds.builtin import DcpsEndpoint
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct

    from scbm.nodes.types.definitions import MessageDefinition

_BLOCKS_NS = 2_000_000_000
"""Maximum time that writing waits for readers that do not acknowledge: longer than a lost one stays matched."""

_HANDLES = 2**64
"""Handles are so many; some functions of cyclonedds take them as signed numbers, some do not."""


class Taken(Struct, frozen=True):
    """Samples taken from a reader.

    Attributes:
        samples: payloads in the order in which they came, each with the handle of its writer.
        fault: why nothing can be taken; `None` if it can.
        stamp_ns: when the middleware handed it over, by `time.monotonic_ns`.
    """

    samples: tuple[tuple[bytes, int], ...]
    stamp_ns: int
    fault: str | None = None


class Match(Struct, frozen=True):
    """A matched endpoint.

    Attributes:
        handle: identifies it in this process.
        guid: identifies it among all others; it begins with the vendor.
        participant: identifies its participant among all others.
        identities: what its user data says: `{"clientid": "1.f0.…"}`.
    """

    handle: int
    guid: UUID
    participant: UUID
    identities: dict[str, str]


class EndpointPair:
    """A writer and a reader: reliable, volatile, and keep-all, because the depth of ROS 2, 10, loses samples silently.

    Attributes:
        qos: of both, but for the hash of what passes there.
        writer: of the one topic.
        reader: of the other.
    """

    def __init__(  # noqa: PLR0913 - both topics, and callbacks
        self,
        participant: DomainParticipant,
        identity: str,
        *,
        written: tuple[str, MessageDefinition],
        read: tuple[str, MessageDefinition],
        came: Callable[[Taken], None],
        changed: Callable[[], None],
    ) -> None:
        """Made for one client or server.

        Args:
            participant: whose endpoints these are.
            identity: in the user data of both, such as `clientid=…;`.
            written: the topic of the writer, and what passes there behind the header of a call.
            read: the same of the reader.
            came: gets what the reader had, on a thread of the middleware's.
            changed: is called when there are more or fewer matches, behind what came until then, on such a thread.

        Raises `BusError` if the middleware cannot have such endpoints.
        """
        self._came = came
        self._changed = changed
        self._is_closed = False
        self._order = Lock()
        self.qos = _qos(user_data(written[1], identity))
        try:
            self.writer = RawWriter(participant, _topic(participant, *written), self.qos)
            self.reader = RawReader(participant, _topic(participant, *read), _qos(user_data(read[1], identity)))
        except DDSException as error:
            raise BusError(f"DDS refuses `{written[0]}` or `{read[0]}`: {error}") from error
        # A listener that is there from the start may be called before Python knows the reader.
        matched = self._has_more_or_fewer
        self.writer.set_listener(listener(on_publication_matched=matched))
        self.reader.set_listener(listener(on_data_available=self._has_data, on_subscription_matched=matched))
        matched()

    def write(self, payload: bytes) -> None:
        """Send a payload; raise `BusError` if the middleware cannot take it."""
        try:
            self.writer.write_payload(payload)
        except DDSException as error:
            raise BusError(f"DDS cannot send on `{self.writer.topic.name}`: {error}") from error

    def readers(self) -> list[Match]:
        """Return the readers that the writer is matched with."""
        return _matches(self.writer.get_matched_subscriptions, self.writer.get_matched_subscription_data)

    def writers(self) -> list[Match]:
        """Return the writers that the reader is matched with."""
        return _matches(self.reader.get_matched_publications, self.reader.get_matched_publication_data)

    def close(self) -> None:
        """Delete both; all peers lose them."""
        self._is_closed = True
        delete(self.writer)
        delete(self.reader)

    # on threads of the middleware's, two of which do not overtake each other from taking samples to handing them over

    def _has_data(self, _: object) -> None:
        with self._order:
            self._take()

    def _has_more_or_fewer(self, *_: object) -> None:
        with self._order:
            self._take()
            self._changed()

    def _take(self) -> None:
        try:
            taken = [(each, info.publication_handle) for each, info in self.reader.take_payloads() if info.valid_data]
        except DDSException as error:
            if not self._is_closed:
                self._came(Taken((), time.monotonic_ns(), str(error)))
            return
        if taken:
            samples = tuple((payload, handle % _HANDLES) for payload, handle in taken)
            self._came(Taken(samples, time.monotonic_ns()))


def _topic(participant: DomainParticipant, name: str, definition: MessageDefinition) -> Topic[IdlStruct]:
    return Topic(participant, name, message_class(definition, is_call=True))


def _qos(data: bytes) -> Qos:
    return Qos(
        Policy.Reliability.Reliable(_BLOCKS_NS),
        Policy.Durability.Volatile,
        Policy.History.KeepAll,
        Policy.WriterDataLifecycle(autodispose=False),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.Userdata(data),
    )


def _matches(handles: Callable[[], list[int]], describe: Callable[[int], DcpsEndpoint | None]) -> list[Match]:
    described = [(handle % _HANDLES, describe(handle)) for handle in _all(handles)]
    return [
        Match(handle, endpoint.key, endpoint.participant_key, _identities(endpoint))
        for handle, endpoint in described
        if endpoint is not None  # it has left meanwhile
    ]


def _all(handles: Callable[[], list[int]]) -> list[int]:
    """The number is asked first, and then that many are read: there may be more by then."""
    while True:
        try:
            return handles()
        except IndexError:
            continue


def _identities(endpoint: DcpsEndpoint) -> dict[str, str]:
    data = [policy.data for policy in endpoint.qos if isinstance(policy, Policy.Userdata)]
    text = b"".join(data).decode(errors="replace")
    pairs = (part.partition("=") for part in text.split(";"))
    return {key: value for key, equals, value in pairs if equals}
