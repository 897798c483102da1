"""What a participant says of its node, as another participant reads it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from scbm.nodes.buses.bus import BusError
from scbm.nodes.buses.dds.dds_classes import message_class
from scbm.nodes.buses.dds.participant import NodeAnnouncement
from scbm.nodes.buses.dds.raw_samples import delete
from scbm.nodes.types.definitions import PARTICIPANT_ENTITIES, STRING
from support.wording import Wording

GUARD_NS = 600_000_000_000

AS_ROS_DOES = Qos(
    Policy.Reliability.Reliable(GUARD_NS),
    Policy.Durability.TransientLocal,
    Policy.History.KeepLast(1),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)
ALL_OF_IT = Qos(Policy.History.KeepAll, base=AS_ROS_DOES)


@pytest.fixture
def ours(domain: int) -> Iterator[DomainParticipant]:
    participant = DomainParticipant(domain)
    yield participant
    delete(participant)


@pytest.fixture
def theirs(domain: int) -> Iterator[DomainParticipant]:
    participant = DomainParticipant(domain)
    yield participant
    delete(participant)


def reader(participant: DomainParticipant, qos: Qos) -> Any:  # noqa: ANN401 - its samples have fields that mypy cannot know
    return DataReader(participant, Topic(participant, "ros_discovery_info", message_class(PARTICIPANT_ENTITIES)), qos)


def gids(found: Any) -> list[bytes]:  # noqa: ANN401 - as above
    return [bytes(gid.data) for gid in found]


def test_one_who_comes_later_learns_the_node_and_its_endpoints(
    ours: DomainParticipant, theirs: DomainParticipant
) -> None:
    topic = Topic(ours, "rt/scanner/request", message_class(STRING))
    writer, other, heard = DataWriter(ours, topic), DataWriter(ours, topic), DataReader(ours, topic)
    announcement = NodeAnnouncement(ours, "tester", "/cell/line_1")
    announcement.add_writer(writer)
    announcement.add_reader(heard)
    announcement.add_writer(other)

    announced = reader(theirs, AS_ROS_DOES).take_one(timeout=GUARD_NS)

    assert bytes(announced.gid.data) == ours.guid.bytes
    (node,) = announced.node_entities_info_seq
    assert (node.node_namespace, node.node_name) == ("/cell/line_1", "tester")
    # The ids are those that discovery itself announces.
    assert sorted(gids(node.writer_gid_seq)) == sorted(keys_of(theirs, BuiltinTopicDcpsPublication, 2))
    assert gids(node.reader_gid_seq) == keys_of(theirs, BuiltinTopicDcpsSubscription, 1)
    announcement.close()


def keys_of(participant: DomainParticipant, builtin: Any, count: int) -> list[bytes]:  # noqa: ANN401 - cyclonedds has no type for it
    endpoints: Any = BuiltinDataReader(participant, builtin)
    keys: list[bytes] = []
    for sample in endpoints.take_iter(timeout=GUARD_NS):
        keys += [sample.key.bytes] * (sample.topic_name == "rt/scanner/request")
        if len(keys) == count:
            break
    return keys


def test_each_change_is_reported_and_the_end_too(ours: DomainParticipant, theirs: DomainParticipant) -> None:
    heard = reader(theirs, ALL_OF_IT)
    everything = ReadCondition(heard, ViewState.Any | InstanceState.Any | SampleState.Any)
    samples = heard.take_iter(condition=everything, timeout=GUARD_NS)
    announcement = NodeAnnouncement(ours, "resources")
    (node,) = next(samples).node_entities_info_seq
    assert (node.node_namespace, node.node_name) == ("/", "resources")
    assert node.writer_gid_seq == node.reader_gid_seq == []

    writer = DataWriter(ours, Topic(ours, "rt/scanner/request", message_class(STRING)))
    announcement.add_writer(writer)
    (node,) = next(samples).node_entities_info_seq
    assert gids(node.writer_gid_seq) == [writer.guid.bytes]

    announcement.close()
    assert next(samples).node_entities_info_seq == []


@pytest.mark.parametrize(
    ("node", "namespace"),
    [
        ("", "/"),
        ("a-b", "/"),
        ("a" * 256, "/"),
        ("tester", ""),
        ("tester", "cell"),
        ("tester", "/cell/"),
    ],
)
def test_a_name_that_ros_2_does_not_have_is_refused(
    ours: DomainParticipant, node: str, namespace: str, wording: Wording
) -> None:
    with pytest.raises(BusError) as raised:
        NodeAnnouncement(ours, node, namespace)
    assert raised.value.remedy is not None
    wording((raised.value.message, raised.value.remedy))


def test_a_participant_that_has_left_is_a_bus_error(ours: DomainParticipant) -> None:
    delete(ours)
    with pytest.raises(BusError, match="`ros_discovery_info`"):
        NodeAnnouncement(ours, "tester")
