"""How a participant appears in ROS 2: it says itself which endpoints belong to which node (rmw_dds_common)."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.topic import Topic

from scbm.realtime.bus import BusError
from scbm.realtime.dds.raw import RawWriter, delete
from scbm.realtime.dds.types import PARTICIPANT_ENTITIES, NodeEntities, participant_entities

if TYPE_CHECKING:
    from cyclonedds.core import Entity
    from cyclonedds.domain import DomainParticipant

TOPIC = "ros_discovery_info"
"""Without the prefix that topics of nodes have."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,254}")
_NAMESPACE = re.compile(r"/|(/[A-Za-z_][A-Za-z0-9_]*)+")
_BLOCKS_NS = 2_000_000_000
"""So long writing waits for readers that do not acknowledge: longer than a lost one stays matched."""

_QOS = Qos(
    Policy.Reliability.Reliable(_BLOCKS_NS),
    Policy.Durability.TransientLocal,
    Policy.History.KeepLast(1),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


class NodeAnnouncement:
    """A node, its publishers and its subscriptions, as `ros2 node list` and `ros2 node info` show them."""

    def __init__(self, participant: DomainParticipant, node: str, namespace: str = "/") -> None:
        """Announces a node, the only one of its participant, without endpoints.

        Raises `BusError` if that is no name of a node, or no namespace.
        """
        if not _NAME.fullmatch(node):
            raise BusError(f"`{node}` is no name of a node of ROS 2", "use letters, digits and underscores")
        if not _NAMESPACE.fullmatch(namespace):
            raise BusError(f"`{namespace}` is no namespace of ROS 2", "use `/` or one such as `/cell/line_1`")
        self._name = node
        self._namespace = namespace
        self._readers: tuple[bytes, ...] = ()
        self._writers: tuple[bytes, ...] = ()
        try:
            self._participant = participant.guid.bytes
            self._writer = RawWriter(participant, Topic(participant, TOPIC, PARTICIPANT_ENTITIES), _QOS)
        except DDSException as error:
            raise BusError(f"DDS refuses `{TOPIC}`: {error}") from error
        self._say()

    def add_writer(self, writer: Entity) -> None:
        """The node has one more writer of DDS: of a topic, or of a service."""
        self._writers = (*self._writers, writer.guid.bytes)
        self._say()

    def add_reader(self, reader: Entity) -> None:
        """The node has one more reader of DDS: of a topic, or of a service."""
        self._readers = (*self._readers, reader.guid.bytes)
        self._say()

    def close(self) -> None:
        """The node is gone, and nothing is said any more."""
        self._send([])
        delete(self._writer)

    def _say(self) -> None:
        self._send([NodeEntities(self._namespace, self._name, self._readers, self._writers)])

    def _send(self, nodes: list[NodeEntities]) -> None:
        try:
            self._writer.write_payload(participant_entities(self._participant, nodes).serialize(use_version_2=False))
        except DDSException as error:
            raise BusError(f"DDS cannot send on `{TOPIC}`: {error}") from error
