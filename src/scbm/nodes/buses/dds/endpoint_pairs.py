"""A writer and a reader of one client or one server of a service.

User data of both, `clientid=…;` or `serviceid=…;`, identify them as a pair to other participants.
"""

from __future__ import annotations

import time
from threading import Lock
from typing import TYPE_CHECKING

from cyclonedds.core import DDSException, Listener, Policy, Qos
from cyclonedds.topic import Topic
from msgspec import Struct

from scbm.nodes.buses.bus import BusError
from scbm.nodes.buses.dds.raw_samples import RawReader, RawWriter, delete

if TYPE_CHECKING:
    from collections.abc import Callable
    from uuid import UUID

    from cyclonedds.builtin import DcpsEndpoint
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.internal import SampleInfo

_BLOCKS_NS = 2_000_000_000
"""Maximum time that writing waits for readers that do not acknowledge: longer than a lost one stays matched."""

_PADDED_TO = 4
"""Payloads in RTPS are as long as that, or a multiple of it."""

_HANDLES = 2**64
"""Handles are so many; some functions of cyclonedds take them as signed numbers, some do not."""


class Taken(Struct, frozen=True):
    """Samples taken from a reader.

    Attributes:
        samples: in the order in which they came, each with the handle of its writer.
        faults: for each that could not be read, why.
        stamp_ns: when the middleware handed it over, by `time.monotonic_ns`.
    """

    samples: tuple[tuple[IdlStruct, int], ...]
    faults: tuple[str, ...]
    stamp_ns: int


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
        qos: of both.
        writer: of the one topic.
        reader: of the other.
    """

    def __init__(  # noqa: PLR0913 - both topics, and callbacks
        self,
        participant: DomainParticipant,
        user_data: str,
        *,
        written: tuple[str, type[IdlStruct]],
        read: tuple[str, type[IdlStruct]],
        came: Callable[[Taken], None],
        changed: Callable[[], None],
    ) -> None:
        """Made for one client or server.

        Args:
            participant: whose endpoints these are.
            user_data: of both.
            written: the topic of the writer and its class.
            read: the topic of the reader and its class.
            came: gets what the reader had, on a thread of the middleware's.
            changed: is called when there are more or fewer matches, behind what came until then, on such a thread.

        Raises `BusError` if the middleware cannot have such endpoints.
        """
        self._came = came
        self._changed = changed
        self._read_class = read[1]
        self._is_closed = False
        self._order = Lock()
        self.qos = _qos(user_data)
        try:
            self.writer = RawWriter(participant, Topic(participant, *written), self.qos)
            self.reader = RawReader(participant, Topic(participant, *read), self.qos)
        except DDSException as error:
            raise BusError(f"DDS refuses `{written[0]}` or `{read[0]}`: {error}") from error
        # A listener that is there from the start may be called before Python knows the reader.
        matched = self._has_more_or_fewer
        self.writer.set_listener(_listener(on_publication_matched=matched))
        self.reader.set_listener(_listener(on_data_available=self._has_data, on_subscription_matched=matched))
        matched()

    def write(self, sample: IdlStruct) -> None:
        """Send a sample; raise `BusError` if the middleware cannot take it."""
        payload = type(sample).serialize(sample, use_version_2=False)  # a field may be called `serialize`
        try:
            self.writer.write_payload(payload + bytes(-len(payload) % _PADDED_TO))
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
            taken = [(payload, info) for payload, info in self.reader.take_payloads() if info.valid_data]
        except DDSException as error:
            if not self._is_closed:
                self._came(Taken((), (str(error),), time.monotonic_ns()))
            return
        if taken:
            self._came(self._read(taken, time.monotonic_ns()))

    def _read(self, taken: list[tuple[bytes, SampleInfo]], stamp_ns: int) -> Taken:
        samples: list[tuple[IdlStruct, int]] = []
        faults: list[str] = []
        for payload, info in taken:
            try:
                samples.append((self._read_class.deserialize(payload), info.publication_handle % _HANDLES))
            except UnicodeDecodeError as error:
                faults.append(f"its text is not UTF-8: {error.reason}")
        return Taken(tuple(samples), tuple(faults), stamp_ns)


def _qos(user_data: str) -> Qos:
    return Qos(
        Policy.Reliability.Reliable(_BLOCKS_NS),
        Policy.Durability.Volatile,
        Policy.History.KeepAll,
        Policy.WriterDataLifecycle(autodispose=False),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.Userdata(user_data.encode()),
    )


def _listener(**called: Callable[..., None]) -> Listener:
    return Listener(**called)  # type: ignore[no-untyped-call]  # cyclonedds gives it no types


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
