"""Topics next to plain endpoints of cyclonedds, which know nothing of scbm."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, TypeAlias

import pytest
from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic
from cyclonedds.util import duration

from scbm.nodes.buses.bus import BusError, Received, Topic
from scbm.nodes.buses.dds.dds_bus import DdsBus
from scbm.nodes.buses.dds.dds_classes import message_class
from scbm.nodes.buses.dds.raw_samples import RawWriter, delete, listener
from scbm.nodes.types.cdr import codec_of
from scbm.nodes.types.definitions import BOOL, INT64, STRING, MessageDefinition
from support import loops
from support.kept import Kept
from support.wording import Wording

TALK = Topic("/cell/talk")
ROS_DEFAULT = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(10), Policy.Durability.Volatile
)


Complain: TypeAlias = Callable[[str], None]


def _ignore(_: object) -> None:
    """Of what is heard nothing matters here."""


class Peer:
    """A participant of its own, with the topic of a bus as ROS 2 has it."""

    def __init__(self, domain: int, name: str = "rt/cell/talk", type_: MessageDefinition = STRING) -> None:
        self.participant = DomainParticipant(domain)
        self.topic: DdsTopic[Any] = DdsTopic(self.participant, name, message_class(type_))

    def writer(self, qos: Qos = ROS_DEFAULT) -> RawWriter:
        return RawWriter(self.participant, self.topic, qos)

    def reader(self, qos: Qos = ROS_DEFAULT) -> DataReader[Any]:
        return DataReader(self.participant, self.topic, qos)

    def close(self) -> None:
        delete(self.participant)


def test_endpoints_look_as_those_of_ros(domain: int, warn: Complain) -> None:
    async def scenario() -> list[Qos]:
        bus = DdsBus.open("ours", domain, warn)
        publisher, subscription = bus.publisher(TALK), bus.subscribe(TALK, _ignore)
        assert publisher.writer.topic.name == subscription.reader.topic.name == "rt/cell/talk"
        assert publisher.writer.topic.typename == subscription.reader.topic.typename == "std_msgs::msg::dds_::String_"
        qualities = [publisher.writer.get_qos(), subscription.reader.get_qos()]
        await bus.close()
        return qualities

    for qos in loops.run(scenario()):
        assert isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable)
        assert qos[Policy.Durability] == Policy.Durability.Volatile
        assert qos[Policy.History] == Policy.History.KeepAll
        assert qos[Policy.DataRepresentation] == Policy.DataRepresentation(use_cdrv0_representation=True)
        assert qos[Policy.Partition] is None


SENSOR_DATA = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(5), Policy.Durability.Volatile)
"""As ROS 2 calls the qualities that drivers of sensors publish with."""


@pytest.mark.parametrize("qos", [SENSOR_DATA, ROS_DEFAULT], ids=["best effort", "reliable"])
def test_who_asks_for_best_effort_hears_publishers_of_both_kinds(domain: int, warn: Complain, qos: Qos) -> None:
    async def scenario() -> list[Received]:
        loop = asyncio.get_running_loop()
        received, matched = Kept[Received](), Kept[int]()
        bus = DdsBus.open("ours", domain, warn)
        subscription = bus.subscribe(Topic("/cell/talk", is_best_effort=True), received)
        assert subscription.reader.get_qos()[Policy.Reliability] == Policy.Reliability.BestEffort
        peer = Peer(domain)

        def report(_: object, status: Any) -> None:  # noqa: ANN401 - of cyclonedds
            loop.call_soon_threadsafe(matched, status.current_count)

        writer = RawWriter(peer.participant, peer.topic, qos, listener(on_publication_matched=report))
        await matched.ends_with(1)
        writer.write_payload(codec_of(STRING).encode({"data": "near"}))
        await received.first(1)
        await bus.close()
        peer.close()
        return received.all

    assert [came.message.data for came in loops.run(scenario())] == ["near"]


def test_messages_of_others_that_are_none_are_reported_and_dropped(domain: int, wording: Wording) -> None:
    async def scenario() -> tuple[list[str], list[str]]:
        complaints, matched, received = Kept[str](), Kept[int](), Kept[str]()
        bus = DdsBus.open("ours", domain, complaints)
        bus.subscribe(TALK, lambda came: received(came.message.data), matched)
        peer = Peer(domain)
        writer = peer.writer()
        await matched.ends_with(1)
        writer.write_payload(codec_of(STRING).encode({"data": "before"}))
        writer.write_payload(b"\x00\x01\x00\x00\x02\x00\x00\x00\xff\x00\x00\x00")
        writer.write_payload(codec_of(STRING).encode({"data": "after"}))
        await received.first(2)
        await bus.close()
        peer.close()
        return complaints.all, received.all

    complaints, received = loops.run(scenario())
    assert received == ["before", "after"]
    (complaint,) = complaints
    wording(complaint)


def test_a_plain_reader_reads_what_is_published(domain: int, warn: Complain) -> None:
    async def scenario() -> list[Any]:
        matched = Kept[int]()
        bus = DdsBus.open("ours", domain, warn)
        number = Topic("/cell/talk", INT64)
        publisher = bus.publisher(number, matched)
        peer = Peer(domain, type_=INT64)
        reader = peer.reader()
        await matched.ends_with(1)
        publisher.publish({"data": -7})
        (sample,) = await asyncio.to_thread(lambda: [reader.take_one(timeout=duration(seconds=600))])
        await bus.close()
        peer.close()
        return [sample.data]

    assert loops.run(scenario()) == [-7]


def test_what_the_type_cannot_carry_is_not_sent(domain: int, warn: Complain) -> None:
    async def scenario() -> None:
        bus = DdsBus.open("ours", domain, warn)
        publisher = bus.publisher(Topic("/cell/on", BOOL))
        with pytest.raises(BusError, match="std_msgs/msg/Bool"):
            publisher.publish({"data": "yes"})
        await bus.close()

    loops.run(scenario())


def test_a_closed_bus_sends_nothing(domain: int, warn: Complain) -> None:
    async def scenario() -> None:
        bus = DdsBus.open("ours", domain, warn)
        publisher = bus.publisher(TALK)
        await bus.close()
        with pytest.raises(BusError, match="`/cell/talk`"):
            publisher.publish({"data": "hello"})

    loops.run(scenario())


def test_a_subscription_that_takes_nothing_is_reported(
    domain: int, warn: Complain, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    def full(_writer: RawWriter, _payload: bytes) -> None:
        raise DDSException(DDSException.DDS_RETCODE_TIMEOUT)

    async def scenario() -> None:
        bus = DdsBus.open("ours", domain, warn)
        publisher = bus.publisher(TALK)
        monkeypatch.setattr(RawWriter, "write_payload", full)
        with wording.raises(BusError):
            publisher.publish({"data": "hello"})
        monkeypatch.undo()
        await bus.close()

    loops.run(scenario())


def test_names_that_ros_cannot_have_are_refused(domain: int, warn: Complain, wording: Wording) -> None:
    async def scenario() -> None:
        bus = DdsBus.open("ours", domain, warn)
        with wording.raises(BusError):
            bus.publisher(Topic("no root"))
        with wording.raises(BusError):
            bus.subscribe(Topic("/a//b"), _ignore)
        await bus.close()

    loops.run(scenario())
