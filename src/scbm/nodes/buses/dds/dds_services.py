"""Services in the layout of rmw_cyclonedds: a topic of requests, and one of responses.

Each request and response begins with `guid`, which client, and `seq`, which of its calls. All clients of a service
receive all responses, and drop those to other clients.
"""

from __future__ import annotations

import asyncio
import struct
from collections import Counter
from typing import TYPE_CHECKING, TypeAlias
from uuid import uuid4

from msgspec import Struct

from scbm.nodes.buses.bus import Answered, BusError, PeerCount, when_answered
from scbm.nodes.buses.dds import dds_names
from scbm.nodes.buses.dds.endpoint_pairs import EndpointPair
from scbm.nodes.buses.dds.participant import participant_names
from scbm.nodes.buses.dds.vendors import is_callable, why_doubtful
from scbm.nodes.types.cdr import BadPayloadError, BadValueError, codec_of, header_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from uuid import UUID

    from cyclonedds.domain import DomainParticipant

    from scbm.nodes.buses.bus import Answer, Service
    from scbm.nodes.buses.dds.endpoint_pairs import Match, Taken

    HandOver: TypeAlias = Callable[[Callable[[], None]], None]
    Complain: TypeAlias = Callable[[str], None]

_CALL = "Qq"
"""The header of a request and its response: the client, and the number of its call."""

_CALL_BYTES = struct.calcsize(f"={_CALL}")

READER_WAIT_S = 0.1
"""How long a response waits until the server sees the reader of its client, as in rmw_cyclonedds."""


class ServiceClient:
    """Calls one service.

    Attributes:
        pair: its endpoints.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - owner, service and callbacks
        self,
        participant: DomainParticipant,
        service: Service,
        hand_over: HandOver,
        receive: Callable[[Answered], None],
        matched: Callable[[int], None] | None,
        warn: Complain,
    ) -> None:
        """Made once for each service that is called.

        Args:
            participant: whose endpoints these are.
            service: which.
            hand_over: queues work for the event loop, from any thread.
            receive: gets each answer once, on the event loop.
            matched: gets the number of servers whenever that changes, on the event loop.
            warn: gets a sentence about what came and cannot be right.

        Raises `BusError` if DDS cannot have such endpoints, `ValueError` if its name is none of ROS 2.
        """
        self._participant = participant
        self._service = service
        self._receive = receive
        self._warn = warn
        identity = uuid4()
        self._guid = identity.int >> 64
        self._last = 0
        self._waiting: set[int] = set()
        self._peers = PeerCount(matched)
        self._has_met_unknown = False
        self._is_closed = False
        self._requests, self._responses = codec_of(service.type.request), codec_of(service.type.response)
        self.pair = EndpointPair(
            participant,
            f"clientid={_id_text(identity)};",
            written=(dds_names.request_name(service.name), service.type.request),
            read=(dds_names.reply_name(service.name), service.type.response),
            came=lambda taken: hand_over(lambda: self._hear(taken)),
            changed=lambda: hand_over(self._count),
        )

    @property
    def peers(self) -> int:
        """The number of servers with a matched reader of requests and a matched writer of responses.

        It is 0 if one of them is of a vendor whose services cannot be called: it might get requests, too.
        """
        return self._peers.peers

    def server_names(self) -> tuple[str, ...]:
        """Return the process and the machine of each server."""
        return participant_names(self._participant, [match.participant for match in self._servers()])

    def _servers(self) -> list[Match]:
        """Return the readers of requests that servers with a writer of responses have, each server once."""
        responders = Counter(map(_server, self.pair.writers()))
        found = []
        for match in self.pair.readers():
            if responders[_server(match)]:
                responders[_server(match)] -= 1
                found.append(match)
        return found

    def why_doubtful(self) -> str | None:
        """Return why a server may read calls in another layout, if its vendor has several."""
        reasons = (why_doubtful(self._service.name, match.guid) for match in self._servers())
        return next((why for why in reasons if why is not None), None)

    def call(self, values: Mapping[str, object]) -> int:
        """Send a request, and return its number. Raises `BusError` for wrong values, or if DDS cannot take it."""
        number = self._last + 1
        try:
            request = self._requests.encode(values, struct.pack(f"<{_CALL}", self._guid, number))
        except BadValueError as error:
            raise BusError(str(error)) from error
        self.pair.write(request)
        self._last = number
        self._waiting.add(number)
        return number

    def close(self) -> None:
        """Close the client; no callback runs any more."""
        self._is_closed = True
        self.pair.close()

    def _count(self) -> None:
        if self._is_closed:
            return
        servers = self._servers()
        self._peers.are(len(servers) if all(is_callable(match.guid) for match in servers) else 0)

    def _hear(self, taken: Taken) -> None:
        for payload, _ in taken.samples:
            try:
                guid, number = header_of(payload, _CALL)
                if guid == self._guid and not self._is_closed:
                    self._hear_own(number, payload, taken.stamp_ns)
            except BadPayloadError as error:
                self._warn(f"a response of {self._service.name} cannot be read: {error}")
        if taken.fault is not None and not self._is_closed:
            self._warn(f"a response of {self._service.name} cannot be read: {taken.fault}")

    def _hear_own(self, number: int, payload: bytes, stamp_ns: int) -> None:
        if number in self._waiting:
            response = self._responses.decode(payload, _CALL_BYTES)
            self._waiting.remove(number)
            self._receive(Answered(number, response, stamp_ns))
        elif 0 < number <= self._last:
            self._warn(f"a second response to call {number} of {self._service.name} is dropped")
        elif not self._has_met_unknown:
            self._has_met_unknown = True
            self._warn(f"a response of {self._service.name} to call {number}, which was not made, is dropped")


def _server(match: Match) -> str | UUID:
    """Identify a server; servers of one participant that send no identity count as one."""
    return match.identities.get("serviceid", match.participant)


def _id_text(identity: UUID) -> str:
    """Return the 16 bytes in the order of rmw_cyclonedds."""
    return ".".join(f"{byte:x}" for byte in identity.bytes)


class _Response(Struct, frozen=True):
    """A response that waits for the reader of its client, with its deadline."""

    payload: bytes
    writer: int
    timer: asyncio.TimerHandle


class ServiceServer:
    """Serves one service.

    Attributes:
        pair: its endpoints.
    """

    def __init__(
        self,
        participant: DomainParticipant,
        service: Service,
        hand_over: HandOver,
        answer: Answer,
        warn: Complain,
    ) -> None:
        """Made once for each service that is served.

        Args:
            participant: whose endpoints these are.
            service: which.
            hand_over: queues work for the event loop, from any thread.
            answer: gets a request, on the event loop, and returns the fields of the response, or a future of them.
            warn: gets a sentence about what came and cannot be right, and about responses that are lost.

        Raises as `ServiceClient` does.
        """
        self._service = service
        self._answer = answer
        self._warn = warn
        self._clients: dict[int, str | None] = {}
        self._hearing: list[str | None] = []
        self._responses: list[_Response] = []
        self._is_closed = False
        self._request_codec, self._response_codec = codec_of(service.type.request), codec_of(service.type.response)
        self.pair = EndpointPair(
            participant,
            f"serviceid={_id_text(uuid4())};",
            written=(dds_names.reply_name(service.name), service.type.response),
            read=(dds_names.request_name(service.name), service.type.request),
            came=lambda taken: hand_over(lambda: self._hear(taken)),
            changed=lambda: hand_over(self._look),
        )

    def close(self) -> None:
        """Close the service; no callback runs any more, and waiting responses are dropped."""
        self._is_closed = True
        for response in self._responses:
            response.timer.cancel()
        self.pair.close()

    def _hear(self, taken: Taken) -> None:
        for payload, writer in taken.samples:
            if not self._is_closed:
                self._serve(payload, writer)
        if taken.fault is not None and not self._is_closed:
            self._warn(f"a request to {self._service.name} cannot be read: {taken.fault}")

    def _serve(self, payload: bytes, writer: int) -> None:
        try:
            call = header_of(payload, _CALL)
            request = self._request_codec.decode(payload, _CALL_BYTES)
        except BadPayloadError as error:
            self._warn(f"a request to {self._service.name} cannot be read: {error}")
            return
        when_answered(self._answer(request), lambda values: self._respond(values, call, writer))

    def _respond(self, values: Mapping[str, object], call: tuple[int, ...], writer: int) -> None:
        try:
            response = self._response_codec.encode(values, struct.pack(f"<{_CALL}", *call))
        except BadValueError as error:
            self._warn(f"a request to {self._service.name} gets no response: {error}")
            return
        if self._is_heard_by(writer):
            self._send(response)
        else:
            timer = asyncio.get_running_loop().call_later(READER_WAIT_S, self._give_up, response)
            self._responses.append(_Response(response, writer, timer))

    def _is_heard_by(self, writer: int) -> bool:
        """Return whether the client of a writer receives responses, as far as its identity is known."""
        if writer not in self._clients:
            self._look()
        client = self._clients.get(writer)
        return client is None or client in self._hearing

    def _send(self, response: bytes) -> None:
        try:
            self.pair.write(response)
        except BusError as error:
            self._warn(f"a response of {self._service.name} is lost: {error.message}")

    def _give_up(self, payload: bytes) -> None:
        self._responses = [response for response in self._responses if response.payload is not payload]
        self._warn(f"a response of {self._service.name} is lost: its client has no reader for responses")

    def _look(self) -> None:
        """Handle a change of clients: drop the responses that wait for a client that is gone."""
        if self._is_closed:
            return
        self._clients = {match.handle: match.identities.get("clientid") for match in self.pair.writers()}
        self._hearing = [match.identities.get("clientid") for match in self.pair.readers()]
        responses, self._responses = self._responses, []
        for response in responses:
            if self._clients.get(response.writer) in self._hearing:
                response.timer.cancel()
                self._send(response.payload)
            elif response.writer in self._clients:
                self._responses.append(response)
            else:
                response.timer.cancel()
