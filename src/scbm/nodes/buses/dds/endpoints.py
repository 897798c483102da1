"""Publishers and subscriptions of one participant."""

from __future__ import annotations

from functools import partial
from time import monotonic_ns
from typing import TYPE_CHECKING

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.topic import Topic as DdsTopic
from cyclonedds.util import duration
from msgspec import Struct

from scbm.nodes.buses.bus import BusError, PeerCount, Received
from scbm.nodes.buses.dds.dds_classes import message_class
from scbm.nodes.buses.dds.dds_names import topic_name
from scbm.nodes.buses.dds.raw_samples import RawReader, RawWriter, listener, refused_policy
from scbm.nodes.buses.dds.unmatched import EndpointRole, WantedEndpoint
from scbm.nodes.types.cdr import BadPayloadError, BadValueError, LateMessage, codec_of
from scbm.nodes.types.type_hashes import user_data

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from threading import Lock

    from cyclonedds.core import Entity
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.internal import dds_c_t

    from scbm.nodes.buses.bus import Topic
    from scbm.nodes.buses.dds.thread_bridge import HandOver

_BLOCKS_S = 2
"""Maximum time that `publish` waits for subscriptions that do not acknowledge: longer than a lost one stays matched."""

_HANDLE_MASK = 2**64 - 1
"""Handles come as signed numbers with a status, and without a sign with a sample."""


def _qos(topic: Topic) -> Qos:
    # Keep-all at both ends: nothing that is on its way is replaced by what comes behind it. The last message alone is
    # kept for those that come later.
    durability = Policy.Durability.TransientLocal if topic.is_latched else Policy.Durability.Volatile
    reliable = Policy.Reliability.Reliable(duration(seconds=_BLOCKS_S))
    return Qos(
        Policy.Reliability.BestEffort if topic.is_best_effort else reliable,
        durability,
        Policy.History.KeepAll,
        Policy.DurabilityService(0, Policy.History.KeepLast(1), -1, -1, -1),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.WriterDataLifecycle(autodispose=False),
        Policy.IgnoreLocal.Participant,
        Policy.Userdata(user_data(topic.type)),
    )


def wanted_by(topic: Topic, role: EndpointRole, policy: int = 0) -> WantedEndpoint:
    """Return the peers that an endpoint of a topic can match."""
    return WantedEndpoint(topic.name, topic.type.name, role, role.value, topic_name(topic.name), _qos(topic), policy)


class ReceivedSample(Struct, frozen=True):
    """The callbacks of a subscription, which run on the loop.

    Attributes:
        receive, matched, left: as `Bus.subscribe` has them.
        warn: gets a sentence about each message that cannot be decoded.
    """

    receive: Callable[[Received], None]
    matched: Callable[[int], None] | None
    left: Callable[[int], None] | None
    warn: Callable[[str], None]


class DdsPublisher:
    """Publishes on one topic."""

    def __init__(
        self, participant: DomainParticipant, topic: Topic, hand_over: HandOver, matched: Callable[[int], None] | None
    ) -> None:
        self.topic = topic
        self._codec = codec_of(topic.type)
        self._hand_over = hand_over
        self._peers = PeerCount(matched)
        called = listener(on_publication_matched=self._on_matched)
        self.writer = RawWriter(participant, dds_topic(participant, topic), _qos(topic), called)

    @property
    def peers(self) -> int:
        """The number of matched subscriptions."""
        return self._peers.peers

    def wanted(self) -> WantedEndpoint:
        """Return the peers that it can match."""
        return wanted_by(self.topic, EndpointRole.SUBSCRIPTION, refused_policy(self.writer))

    def publish(self, values: Mapping[str, object]) -> None:
        """Send a message; raise `BusError`: not of the type, subscriptions that do not take it, a closed bus."""
        try:
            payload = self._codec.encode(values)
        except BadValueError as error:
            raise BusError(str(error)) from error
        try:
            self.writer.write_payload(payload)
        except DDSException as error:
            raise BusError(f"`{self.topic.name}`: {_why_not(error)}") from error

    # on a thread of Cyclone DDS

    def _on_matched(self, _writer: Entity | None, status: dds_c_t.publication_matched_status) -> None:
        self._hand_over(partial(self._peers.are, status.current_count))


def _why_not(error: DDSException) -> str:
    if error.code == DDSException.DDS_RETCODE_TIMEOUT:
        return f"a subscription has not acknowledged messages for {_BLOCKS_S} seconds"
    return f"nothing can be sent: {error}"


class DdsSubscription:
    """Receives the messages of one topic."""

    def __init__(
        self,
        participant: DomainParticipant,
        topic: Topic,
        hand_over: HandOver,
        order: Lock,
        heard: ReceivedSample,
    ) -> None:
        """Made by its bus.

        Args:
            participant: of DDS.
            topic: which.
            hand_over: to the loop.
            order: is held from taking messages to handing them over, so that two threads of Cyclone DDS do not
                overtake each other.
            heard: the callbacks.
        """
        self.topic = topic
        self._codec = codec_of(topic.type)
        self._hand_over = hand_over
        self._order = order
        self._heard = heard
        self._peers = PeerCount(heard.matched)
        self._is_made = False
        called = listener(on_data_available=self._on_data, on_subscription_matched=self._on_matched)
        self.reader = RawReader(participant, dds_topic(participant, topic), _qos(topic), called)
        with order:
            # What came while the reader was made.
            self._is_made = True
            self._take()

    @property
    def peers(self) -> int:
        """The number of matched publishers."""
        return self._peers.peers

    def wanted(self) -> WantedEndpoint:
        """Return the peers that it can match."""
        return wanted_by(self.topic, EndpointRole.PUBLICATION, refused_policy(self.reader))

    # on a thread of Cyclone DDS

    def _on_data(self, _reader: Entity | None) -> None:
        with self._order:
            self._take()

    def _on_matched(self, _reader: Entity | None, status: dds_c_t.subscription_matched_status) -> None:
        with self._order:
            self._take()
            if status.current_count_change < 0 and self._heard.left is not None:
                self._hand_over(partial(self._heard.left, status.last_publication_handle & _HANDLE_MASK))
            self._hand_over(partial(self._peers.are, status.current_count))

    def _take(self) -> None:
        if not self._is_made:
            return
        try:
            taken = self.reader.take_payloads()
        except DDSException as error:
            # The endpoint is being closed, or Cyclone DDS is broken; no caller could handle the error.
            self._hand_over(partial(self._heard.warn, f"`{self.topic.name}` cannot be read: {error}"))
            return
        stamp_ns = monotonic_ns()
        for payload, info in taken:
            if info.valid_data:
                message = payload if self.topic.is_raw else LateMessage(partial(self._codec.decode, payload))
                self._hand_over(partial(self._receive, Received(message, info.publication_handle, stamp_ns)))

    # on the loop

    def _receive(self, received: Received) -> None:
        """Hand over a message, which is decoded when it is looked at."""
        try:
            self._heard.receive(received)
        except BadPayloadError as error:
            what = f"a message on `{self.topic.name}` is no {self.topic.type} and was dropped: {error}"
            self._heard.warn(what)


def dds_topic(participant: DomainParticipant, topic: Topic) -> DdsTopic[IdlStruct]:
    """Return the DDS topic. Raises `BusError` for an invalid name, or one that has another type in this participant."""
    try:
        return DdsTopic(participant, topic_name(topic.name), message_class(topic.type))
    except ValueError as error:
        raise BusError(str(error)) from error
    except DDSException as error:
        raise BusError(f"`{topic.name}` cannot be used as {topic.type}: {error}") from error
