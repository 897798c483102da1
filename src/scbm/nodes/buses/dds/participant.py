"""Participants of a DDS domain: joining, the ROS 2 graph, the names of others, and leaving.

The ROS 2 graph: a participant announces which endpoints belong to which node (rmw_dds_common).
"""

from __future__ import annotations

import os
import re
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsParticipant
from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.topic import Topic

from scbm.nodes.buses.bus import BusError
from scbm.nodes.buses.dds.cyclone_log import captured_log
from scbm.nodes.buses.dds.dds_classes import message_class
from scbm.nodes.buses.dds.interfaces import bound_to_loopback, configuration
from scbm.nodes.buses.dds.raw_samples import RawWriter, delete
from scbm.nodes.types.cdr import codec_of
from scbm.nodes.types.definitions import PARTICIPANT_ENTITIES
from scbm.nodes.types.type_hashes import user_data
from scbm.testing.transports import ALL_INTERFACES, LOOPBACK

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from uuid import UUID

    from cyclonedds.core import Entity


TOPIC = "ros_discovery_info"
"""Without the prefix that topics of nodes have."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,254}")
_NAMESPACE = re.compile(r"/|(/[A-Za-z_][A-Za-z0-9_]*)+")
_BLOCKS_NS = 2_000_000_000
"""Maximum time that writing waits for readers that do not acknowledge: longer than a lost one stays matched."""

_QOS = Qos(
    Policy.Reliability.Reliable(_BLOCKS_NS),
    Policy.Durability.TransientLocal,
    Policy.History.KeepLast(1),
    Policy.DataRepresentation(use_cdrv0_representation=True),
    Policy.Userdata(user_data(PARTICIPANT_ENTITIES)),
)


class NodeAnnouncement:
    """A node, its publishers and its subscriptions, as `ros2 node list` and `ros2 node info` show them."""

    def __init__(self, participant: DomainParticipant, node: str, namespace: str = "/") -> None:
        """Announce a node without endpoints, the only one of its participant.

        Raises `BusError` if that is no name of a node, or no namespace.
        """
        if not _NAME.fullmatch(node):
            raise BusError(f"`{node}` is not a name of a ROS 2 node", "use letters, digits and underscores")
        if not _NAMESPACE.fullmatch(namespace):
            raise BusError(f"`{namespace}` is not a ROS 2 namespace", "use `/` or one such as `/cell/line_1`")
        self._name = node
        self._namespace = namespace
        self._readers: tuple[bytes, ...] = ()
        self._writers: tuple[bytes, ...] = ()
        try:
            self._participant = participant.guid.bytes
            self._writer = RawWriter(participant, Topic(participant, TOPIC, message_class(PARTICIPANT_ENTITIES)), _QOS)
        except DDSException as error:
            raise BusError(f"DDS refuses `{TOPIC}`: {error}") from error
        self._say()

    def add_writer(self, writer: Entity) -> None:
        """Announce one more DDS writer of the node."""
        self._writers = (*self._writers, writer.guid.bytes)
        self._say()

    def add_reader(self, reader: Entity) -> None:
        """Announce one more DDS reader of the node."""
        self._readers = (*self._readers, reader.guid.bytes)
        self._say()

    def close(self) -> None:
        """Announce that the node is gone."""
        self._send([])
        delete(self._writer)

    def _say(self) -> None:
        node: dict[str, object] = {
            "node_namespace": self._namespace,
            "node_name": self._name,
            "reader_gid_seq": [{"data": reader} for reader in self._readers],
            "writer_gid_seq": [{"data": writer} for writer in self._writers],
        }
        self._send([node])

    def _send(self, nodes: list[dict[str, object]]) -> None:
        values = {"gid": {"data": self._participant}, "node_entities_info_seq": nodes}
        try:
            self._writer.write_payload(codec_of(PARTICIPANT_ENTITIES).encode(values))
        except DDSException as error:
            raise BusError(f"DDS cannot send on `{TOPIC}`: {error}") from error


URI = "CYCLONEDDS_URI"
LAST_DOMAIN = 232
"""The ports of higher ones do not exist."""

_OURS = (
    "<CycloneDDS><Domain Id='any'><Discovery><LeaseDuration>1s</LeaseDuration><SPDPInterval>200ms</SPDPInterval>"
    "</Discovery></Domain></CycloneDDS>"
)
"""A process that was killed is missed after the lease. Each says so often that it is there that one which stands still
for half of that is not; Cyclone DDS by itself missed it, and found it again only after half a minute. `CYCLONEDDS_URI`
comes behind, so it may say otherwise.
"""

_CORRECT = f"correct `{URI}`, or unset it"
_REMEDIES = (
    ("participant index", f"end other processes in this domain, or raise `MaxAutoParticipantIndex` in `{URI}`"),
    (
        "failed to find interfaces",
        "the machine needs a network interface that is up; for itself alone: `ip link set lo up`",
    ),
    (
        "available interface",
        f"correct the network interface in `{URI}`, or unset it; `ip address` lists the interfaces",
    ),
    ("configuration file", _CORRECT),
    ("config:", _CORRECT),
)


class Participant:
    """A participant of a domain, as a ROS 2 context has one.

    Attributes:
        entity: of DDS.
        warnings: what Cyclone DDS had to say, though it started.
    """

    def __init__(self, node: str, domain: int, interface: str | None = None) -> None:
        """Join the domain on a network interface, or as `CYCLONEDDS_URI` says. Raises `BusError`."""
        if not 0 <= domain <= LAST_DOMAIN:
            raise BusError(f"there is no DDS domain {domain}", f"domains are numbered from 0 to {LAST_DOMAIN}")
        self.warnings: list[str] = []
        try:
            # One thread at a time reads the log, so the environment is changed by one thread at a time, too.
            isolated = bound_to_loopback(self.warnings) if interface == LOOPBACK else nullcontext()
            with captured_log(self.warnings), _completed_configuration(interface), isolated:
                self.entity = DomainParticipant(domain, _qos(node))
        except DDSException as error:
            raise _error(domain, self.warnings, error) from error
        if interface == ALL_INTERFACES:  # those that are down are left out
            self.warnings = [line for line in self.warnings if "optional interface was not found" not in line]
        if interface is not None and os.environ.get(URI):
            self.warnings.append(f"`{URI}` is not read, because `--interface {interface}` is given")

    @property
    def lease_ns(self) -> int:
        """The lease that the participant announces, as the configuration of Cyclone DDS says."""
        return int(self.entity.get_qos()[Policy.Liveliness].lease_duration)

    def close(self) -> None:
        """Leave. Block up to a second for acknowledgements of sent messages."""
        delete(self.entity)


@contextmanager
def _completed_configuration(interface: str | None) -> Iterator[None]:
    """Cyclone DDS reads the configuration with the first participant of a process in a domain.

    A `Domain` with a configuration of its own would be there until it is deleted, and take the participants of others
    in the process with it.
    """
    uri = os.environ.get(URI)
    os.environ[URI] = f"{_OURS},{(uri or '') if interface is None else configuration(interface)}"
    try:
        yield
    finally:
        if uri is None:
            del os.environ[URI]
        else:
            os.environ[URI] = uri


def _qos(node: str) -> Qos:
    return Qos(Policy.Userdata(b"enclave=/;"), Policy.EntityName(node))


def _error(domain: int, lines: list[str], error: DDSException) -> BusError:
    """Return the reason: Cyclone DDS logs it, and raises only a code."""
    reasons = "; ".join(lines) or str(error)
    remedy = next((remedy for part, remedy in _REMEDIES if part in reasons), None)
    return BusError(f"DDS domain {domain} cannot be joined: {reasons}", remedy)


_MOST = 1000
"""Maximum number of participants that are looked through."""


def participant_names(participant: DomainParticipant, keys: Iterable[UUID]) -> tuple[str, ...]:
    """Return a name for each of some participants, sorted; a participant without properties is named by its key."""
    reader = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
    known = {sample.key: _name(sample.qos) for sample in reader.take(_MOST)}
    delete(reader)
    return tuple(sorted(known.get(key) or f"participant {key}" for key in keys))


def _name(qos: Qos) -> str | None:
    properties = {policy.key: policy.value for policy in qos if isinstance(policy, Policy.Property)}
    process, number, machine = (properties.get(f"__{key}") for key in ("ProcessName", "Pid", "Hostname"))
    if number is None:
        return None
    return f"{process or 'a program'} (process {number}{f' on {machine}' if machine else ''})"
