"""Why an endpoint has no peers: the endpoints of other participants, compared with those that would match."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import Policy
from msgspec import Struct

from scbm.files import nearest
from scbm.nodes.buses.bus import ONLY_BEST_EFFORT, Unmatched, UnmatchedKind
from scbm.nodes.buses.dds import dds_names
from scbm.nodes.buses.dds.raw_samples import delete, refused_policy
from scbm.nodes.buses.dds.vendors import why_not_callable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from uuid import UUID

    from cyclonedds.builtin import BuiltinTopic
    from cyclonedds.core import Qos
    from cyclonedds.domain import DomainParticipant

    from scbm.nodes.buses.bus import Service
    from scbm.nodes.buses.dds.endpoint_pairs import EndpointPair

_MOST = 10_000
"""Maximum number of endpoints of each role that are compared."""

_OF_NODES = "/scbm/"
"""The names of all topics of nodes begin so."""

SERVER = "server"
"""The word for the peer of a client, in messages."""


class EndpointRole(StrEnum):
    """The two sides of a topic."""

    PUBLICATION = "publication"
    SUBSCRIPTION = "subscription"


_BUILTIN: tuple[tuple[EndpointRole, BuiltinTopic], ...] = (
    (EndpointRole.PUBLICATION, BuiltinTopicDcpsPublication),
    (EndpointRole.SUBSCRIPTION, BuiltinTopicDcpsSubscription),
)


class Endpoint(Struct, frozen=True):
    """An endpoint of another participant, with its names in DDS."""

    guid: UUID
    role: EndpointRole
    topic: str
    type: str
    qos: Qos


def others(participant: DomainParticipant) -> list[Endpoint]:
    """Return the endpoints of other participants that discovery has found."""
    own = participant.guid
    found: list[Endpoint] = []
    for role, builtin in _BUILTIN:
        reader = BuiltinDataReader(participant, builtin)
        found += [
            Endpoint(sample.key, role, sample.topic_name, sample.type_name, sample.qos)
            for sample in reader.take(_MOST)
            if sample.participant_key != own
        ]
        delete(reader)
    return found


class WantedEndpoint(Struct, frozen=True):
    """The peers that one of our endpoints can match.

    Attributes:
        name: of the topic or service, as ROS 2 writes it.
        type: of the topic or service, as ROS 2 writes it.
        role: the side that is looked for.
        who: the word for such a peer in messages: `publication`, `server`.
        dds_topic: the name of its topic in DDS.
        qos: ours.
        policy: the number of the policy that kept others away most recently; 0 if none did.
    """

    name: str
    type: str
    role: EndpointRole
    who: str
    dds_topic: str
    qos: Qos
    policy: int = 0


def taker_of_requests(service: Service, pair: EndpointPair) -> WantedEndpoint:
    """Match the readers of servers that receive the requests of a client."""
    return _reader(service, SERVER, dds_names.request_name(service.name), pair)


def giver_of_responses(service: Service, pair: EndpointPair) -> WantedEndpoint:
    """Match the writers of servers that send responses to a client."""
    return _writer(service, SERVER, dds_names.reply_name(service.name), pair)


def giver_of_requests(service: Service, pair: EndpointPair) -> WantedEndpoint:
    """Match the writers of clients that send requests to a server."""
    return _writer(service, "client", dds_names.request_name(service.name), pair)


def taker_of_responses(service: Service, pair: EndpointPair) -> WantedEndpoint:
    """Match the readers of clients that receive the responses of a server."""
    return _reader(service, "client", dds_names.reply_name(service.name), pair)


def _reader(service: Service, who: str, dds_topic: str, pair: EndpointPair) -> WantedEndpoint:
    policy = refused_policy(pair.writer)
    return WantedEndpoint(service.name, service.type.name, EndpointRole.SUBSCRIPTION, who, dds_topic, pair.qos, policy)


def _writer(service: Service, who: str, dds_topic: str, pair: EndpointPair) -> WantedEndpoint:
    policy = refused_policy(pair.reader)
    return WantedEndpoint(service.name, service.type.name, EndpointRole.PUBLICATION, who, dds_topic, pair.qos, policy)


def why_unmatched(wanted: Iterable[WantedEndpoint], there: list[Endpoint], known: list[str]) -> Unmatched | None:
    """Return why no possible peer is matched; `None` if no reason is known.

    Args:
        wanted: the endpoints to explain, in the order in which they are compared.
        there: what others have.
        known: the DDS topics of this process; a peer that uses one of them does not mean another topic.
    """
    wishes = list(wanted)
    found = [
        _why_not(wish, endpoint)
        for wish in wishes
        for endpoint in there
        if endpoint.role is wish.role and endpoint.topic == wish.dds_topic
    ]
    if found:
        return next((reason for reason in found if reason is not None), None)
    hint = next((hint for wish in wishes if (hint := _elsewhere(wish, there, known))), None)
    return None if hint is None else Unmatched(hint)


def _why_not(wish: WantedEndpoint, endpoint: Endpoint) -> Unmatched | None:
    """Return why an endpoint with the right name is not matched, or matched and of no use."""
    if wish.who == SERVER and (why := why_not_callable(wish.name, endpoint.guid)) is not None:
        return Unmatched(why, UnmatchedKind.OTHER_VENDOR)
    type_ = dds_names.ros_type(endpoint.type)
    if type_ != wish.type:
        why = f"`{wish.name}` has a {wish.who} of type {type_}, and not {wish.type}"
        return Unmatched(why, UnmatchedKind.MISMATCH)
    reason = next(_differences(wish, endpoint.qos), None)
    if reason is None and wish.policy:
        reason = f"its {_POLICIES.get(wish.policy, f'policy {wish.policy}')} is incompatible with that of scbm"
    why = f"`{wish.name}` has a {wish.who}, but {reason}"
    return None if reason is None else Unmatched(why, UnmatchedKind.MISMATCH)


_POLICIES = {
    2: "durability",
    3: "presentation",
    4: "deadline",
    5: "latency budget",
    6: "ownership",
    8: "liveliness",
    10: "partition",
    11: "reliability",
    12: "destination order",
    24: "type",
    25: "data representation",
}
"""The names of policies by the numbers that Cyclone DDS has for them."""


def _differences(wish: WantedEndpoint, theirs: Qos) -> Iterator[str]:
    """Return the incompatible QoS policy, with both values in words."""
    they_in, we_in = _partitions(theirs), _partitions(wish.qos)
    if they_in != we_in:
        yield f"it is in {they_in}, and scbm is in {we_in}"
    for what, strength in (("reliability", _reliability), ("durability", _durability)):
        (their_rank, they_say), (our_rank, we_say) = strength(theirs), strength(wish.qos)
        if wish.role is EndpointRole.PUBLICATION and their_rank < our_rank:
            is_measured = what == "reliability" and wish.who == EndpointRole.PUBLICATION  # a binding may ask for less
            yield ONLY_BEST_EFFORT if is_measured else f"it offers {what} {they_say}, and scbm requests {we_say}"
        if wish.role is EndpointRole.SUBSCRIPTION and their_rank > our_rank:
            yield f"it requests {what} {they_say}, and scbm offers {we_say}"


def _partitions(qos: Qos) -> str:
    policy = qos[Policy.Partition]
    return "no partition" if policy is None else "partition " + ", ".join(f"`{name}`" for name in policy.partitions)


def _reliability(qos: Qos) -> tuple[int, str]:
    is_reliable = isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable)
    return (1, "reliable") if is_reliable else (0, "best effort")


def _durability(qos: Qos) -> tuple[int, str]:
    rank = _DURABILITIES.index(qos[Policy.Durability])
    return rank, ("volatile", "transient local", "transient", "persistent")[rank]


_DURABILITIES = [
    Policy.Durability.Volatile,
    Policy.Durability.TransientLocal,
    Policy.Durability.Transient,
    Policy.Durability.Persistent,
]


def _elsewhere(wish: WantedEndpoint, there: list[Endpoint], known: list[str]) -> str | None:
    """Return a similar name that a peer uses. Nodes of scbm and drivers have no topics of each other."""
    prefix = wish.dds_topic.partition("/")[0]
    suffix = wish.dds_topic.removeprefix(prefix).removeprefix(wish.name)
    candidates = [endpoint.topic for endpoint in there if endpoint.role is wish.role and endpoint.topic not in known]
    plain = next((topic for topic in candidates if f"/{topic.lstrip('/')}" == wish.name), None)
    if plain is not None:
        return f"a {wish.who} is at the DDS topic `{plain}`; in ROS 2, `{wish.name}` stands for `{wish.dds_topic}`"
    of_ros = [topic.removeprefix(prefix) for topic in candidates if topic.startswith(f"{prefix}/")]
    is_of_node = wish.name.startswith(_OF_NODES)
    names = [topic.removesuffix(suffix) for topic in of_ros if topic.startswith(_OF_NODES) == is_of_node]
    similar = nearest(wish.name, names)
    return None if similar is None else f"no {wish.who} is at `{wish.name}`, but one is at `{similar}`"
