"""The bus of nodes over Cyclone DDS."""

from __future__ import annotations

import asyncio
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING

from scbm.nodes.buses.bus import BusError, Topic
from scbm.nodes.buses.dds.dds_services import ServiceClient, ServiceServer
from scbm.nodes.buses.dds.endpoints import DdsPublisher, DdsSubscription, ReceivedSample
from scbm.nodes.buses.dds.participant import NodeAnnouncement, Participant
from scbm.nodes.buses.dds.thread_bridge import HandOver
from scbm.nodes.buses.dds.unmatched import (
    giver_of_requests,
    giver_of_responses,
    others,
    taker_of_requests,
    taker_of_responses,
    why_unmatched,
)
from scbm.testing.transports import ALL_INTERFACES

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.nodes.buses.bus import Answer, Answered, Received, Service, Unmatched
    from scbm.nodes.buses.dds.unmatched import WantedEndpoint


class DdsBus:
    """A participant of a DDS domain, as a node of ROS 2. It belongs to one event loop."""

    def __init__(
        self,
        participant: Participant,
        announcement: NodeAnnouncement,
        hand_over: HandOver,
        words: str,
        warn: Callable[[str], None],
    ) -> None:
        """See `open`."""
        self._participant = participant
        self._announcement = announcement
        self._hand_over = hand_over
        self._words = words
        self._warn = warn
        self._order = Lock()
        self._wanted: list[tuple[Topic | Service, Callable[[], WantedEndpoint]]] = []
        self._services: list[ServiceClient | ServiceServer] = []
        self._is_open = True

    @classmethod
    def open(cls, node: str, domain: int, warn: Callable[[str], None], interface: str | None = None) -> DdsBus:
        """Join a domain, on the running event loop; see `scbm.nodes.buses.dds.open_dds`."""
        loop = asyncio.get_running_loop()
        participant = Participant(node, domain, interface)
        try:
            announcement = NodeAnnouncement(participant.entity, node)
        except BusError:
            participant.close()
            raise
        for warning in participant.warnings:
            loop.call_soon(warn, f"Cyclone DDS: {warning}")
        place = "all interfaces" if interface == ALL_INTERFACES else interface
        words = f"DDS domain {domain}" + ("" if place is None else f" on {place}")
        return cls(participant, announcement, HandOver(loop), words, warn)

    @property
    def words(self) -> str:
        """The domain, in words."""
        return self._words

    @property
    def lease_ns(self) -> int:
        """The lease of the participant."""
        return self._participant.lease_ns

    def publisher(self, topic: Topic, matched: Callable[[int], None] | None = None) -> DdsPublisher:
        """Return a publisher. Raises `BusError` for a name that ROS 2 cannot have."""
        made = DdsPublisher(self._participant.entity, topic, self._hand_over, matched)
        self._wanted.append((topic, made.wanted))
        self._announcement.add_writer(made.writer)
        return made

    def subscribe(
        self,
        topic: Topic,
        receive: Callable[[Received], None],
        matched: Callable[[int], None] | None = None,
        left: Callable[[int], None] | None = None,
    ) -> DdsSubscription:
        """Subscribe to a topic. Raises `BusError` for a name that ROS 2 cannot have."""
        heard = ReceivedSample(receive, matched, left, self._warn)
        made = DdsSubscription(self._participant.entity, topic, self._hand_over, self._order, heard)
        self._wanted.append((topic, made.wanted))
        self._announcement.add_reader(made.reader)
        return made

    def client(
        self, service: Service, receive: Callable[[Answered], None], matched: Callable[[int], None] | None = None
    ) -> ServiceClient:
        """Return a client. Raises `BusError` for names that ROS 2 cannot have."""
        entity = self._participant.entity
        try:
            made = ServiceClient(entity, service, self._hand_over, receive, matched, self._warn)
        except ValueError as error:
            raise BusError(str(error)) from error
        self._announce(made)
        self._wanted += [
            (service, partial(whom, service, made.pair)) for whom in (taker_of_requests, giver_of_responses)
        ]
        return made

    def serve(self, service: Service, answer: Answer) -> None:
        """Serve a service. Raises `BusError` for names that ROS 2 cannot have."""
        try:
            made = ServiceServer(self._participant.entity, service, self._hand_over, answer, self._warn)
        except ValueError as error:
            raise BusError(str(error)) from error
        self._announce(made)
        self._wanted += [
            (service, partial(whom, service, made.pair)) for whom in (giver_of_requests, taker_of_responses)
        ]

    def _announce(self, made: ServiceClient | ServiceServer) -> None:
        self._services.append(made)
        self._announcement.add_writer(made.pair.writer)
        self._announcement.add_reader(made.pair.reader)

    def why_unmatched(self, what: Topic | Service) -> Unmatched | None:
        """Return why an endpoint of this bus has no peers, if it is known."""
        wanted = [(where, wish()) for where, wish in self._wanted]
        known = [wish.dds_topic for _, wish in wanted]
        there = others(self._participant.entity)
        return why_unmatched([wish for where, wish in wanted if where == what], there, known)

    async def close(self) -> None:
        """Leave. Wait up to a second for acknowledgements of sent messages."""
        if not self._is_open:
            return
        self._is_open = False
        self._hand_over.stop()
        for service in self._services:
            service.close()
        await asyncio.to_thread(self._leave)
        self._hand_over.close()

    def _leave(self) -> None:
        self._announcement.close()
        self._participant.close()
