"""Why an endpoint has no match, next to plain endpoints of cyclonedds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import pytest
from cyclonedds.core import Entity, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic
from cyclonedds.util import duration

from scbm.nodes.buses.bus import (
    SET_BOOL,
    TRIGGER,
    FieldType,
    MessageType,
    Scalar,
    Service,
    ServiceType,
    Topic,
    Unmatched,
)
from scbm.nodes.buses.dds.dds_bus import DdsBus
from scbm.nodes.buses.dds.message_types import message_class, service_classes
from scbm.nodes.buses.dds.raw_samples import delete
from support import loops
from support.kept import Kept

TALK, LATCHED, MARK = Topic("/cell/talk"), Topic("/cell/talk", is_latched=True), Topic("/cell/mark")
BEST_EFFORT = Topic("/cell/talk", is_best_effort=True)
RELIABLE = Policy.Reliability.Reliable(duration(milliseconds=100))

Use: TypeAlias = Callable[[DdsBus], object]
"""What we have of the topic."""


def _ignore(_: object) -> None:
    """What is heard, and complained of, does not matter here."""


def _nothing(_: Mapping[str, Scalar]) -> Mapping[str, Scalar]:
    return {}


Theirs: TypeAlias = Callable[[DomainParticipant], Entity]
"""What the others have."""

publish: Use = lambda bus: bus.publisher(TALK)  # noqa: E731 - a row says it at a glance
publish_latched: Use = lambda bus: bus.publisher(LATCHED)  # noqa: E731 - the same
hear: Use = lambda bus: bus.subscribe(TALK, _ignore)  # noqa: E731 - the same
hear_best_effort: Use = lambda bus: bus.subscribe(BEST_EFFORT, _ignore)  # noqa: E731 - the same
hear_latched: Use = lambda bus: bus.subscribe(LATCHED, _ignore)  # noqa: E731 - the same


def why_unmatched(domain: int, use: Use, what: Topic | Service, theirs: Theirs) -> Unmatched | None:
    """What the bus says once it knows what the others have."""

    async def scenario() -> Unmatched | None:
        matched = Kept[int]()
        bus = DdsBus.open("ours", domain, _ignore)
        use(bus)
        bus.publisher(MARK, matched)
        peer = DomainParticipant(domain)
        kept = theirs(peer)
        # It is discovered behind the others, so they are known when it is.
        mark = DataReader(peer, _topic(peer, "rt/cell/mark"), Qos(RELIABLE))
        await matched.ends_with(1)
        why = bus.why_unmatched(what)
        await bus.close()
        entities: tuple[Entity, ...] = (mark, kept, peer)
        for entity in entities:
            delete(entity)
        return why

    return loops.run(scenario())


def _topic(peer: DomainParticipant, name: str, type_: MessageType = MessageType.STRING) -> DdsTopic[Any]:
    return DdsTopic(peer, name, message_class(type_))


def writer(*policies: object, name: str = "rt/cell/talk", type_: MessageType = MessageType.STRING) -> Theirs:
    return lambda peer: DataWriter(peer, _topic(peer, name, type_), Qos(*(policies or (RELIABLE,))))


def reader(*policies: object, name: str = "rt/cell/talk", type_: MessageType = MessageType.STRING) -> Theirs:
    return lambda peer: DataReader(peer, _topic(peer, name, type_), Qos(*(policies or (RELIABLE,))))


@pytest.mark.parametrize(
    ("use", "theirs", "why"),
    [
        (
            publish,
            reader(type_=MessageType.BOOL),
            "`/cell/talk` has a subscription of type std_msgs/msg/Bool, and not std_msgs/msg/String",
        ),
        (
            hear,
            writer(type_=MessageType.FLOAT64),
            "`/cell/talk` has a publication of type std_msgs/msg/Float64, and not std_msgs/msg/String",
        ),
        (
            hear,
            writer(Policy.Reliability.BestEffort),
            (
                "`/cell/talk` has a publication, but its reliability is best effort, and we ask for reliable; "
                "a measured topic can say `best_effort: true`"
            ),
        ),
        (
            hear_latched,
            writer(),
            "`/cell/talk` has a publication, but its durability is volatile, and we ask for transient local",
        ),
        (
            publish,
            reader(RELIABLE, Policy.Durability.TransientLocal),
            "`/cell/talk` has a subscription, but it asks for the durability transient local, and ours is volatile",
        ),
        (
            publish_latched,
            reader(RELIABLE, Policy.Durability.Persistent),
            "`/cell/talk` has a subscription, but it asks for the durability persistent, and ours is transient local",
        ),
        (
            publish,
            reader(RELIABLE, Policy.Deadline(duration(seconds=1))),
            "`/cell/talk` has a subscription, but its deadline does not go with ours",
        ),
        (
            publish,
            reader(RELIABLE, Policy.DataRepresentation(use_xcdrv2_representation=True)),
            "`/cell/talk` has a subscription, but its data representation does not go with ours",
        ),
        (
            hear,
            writer(name="rt/cell/tlak"),
            "no publication is at `/cell/talk`, but one is at `/cell/tlak`",
        ),
        (
            publish,
            reader(name="cell/talk"),
            "a subscription is at the DDS topic `cell/talk`; in ROS 2 that of `/cell/talk` is `rt/cell/talk`",
        ),
        (hear_best_effort, writer(Policy.Reliability.BestEffort), None),
        (publish, writer(type_=MessageType.BOOL), None),
        (publish, reader(name="rt/quite/different"), None),
        (publish, reader(), None),
    ],
)
def test_it_says_what_shows(domain: int, use: Use, theirs: Theirs, why: str | None) -> None:
    told = why_unmatched(domain, use, LATCHED if use in {publish_latched, hear_latched} else TALK, theirs)
    is_elsewhere = why is not None and " is at " in why  # a peer may still join the place itself
    assert told == (None if why is None else Unmatched(why, is_mismatch=not is_elsewhere))


def test_partitions_are_named(domain: int) -> None:
    def theirs(peer: DomainParticipant) -> Entity:
        publisher = Publisher(peer, Qos(Policy.Partition(["line_1"])))
        return DataWriter(publisher, _topic(peer, "rt/cell/talk"), Qos(RELIABLE))

    why = why_unmatched(domain, hear, TALK, theirs)
    assert why is not None
    assert why.why == "`/cell/talk` has a publication, but it is in partition `line_1`, and we are in no partition"


def test_names_that_we_use_ourselves_are_not_proposed(domain: int) -> None:
    def use(bus: DdsBus) -> None:
        bus.publisher(TALK)
        bus.publisher(Topic("/cell/talk_2"))

    assert why_unmatched(domain, use, TALK, reader(name="rt/cell/talk_2")) is None


def test_what_the_bus_does_not_use_has_no_reason(domain: int) -> None:
    assert why_unmatched(domain, hear, Topic("/cell/other"), writer(name="rt/cell/other")) is None


def test_similar_names_of_services_are_proposed(domain: int) -> None:
    async def scenario() -> tuple[Unmatched | None, Unmatched | None]:
        ours, theirs = DdsBus.open("ours", domain, _ignore), DdsBus.open("theirs", domain, _ignore)
        matched = Kept[int]()
        ours.client(Service("/scanner/scan", TRIGGER), _ignore)
        ours.serve(Service("/lamp", SET_BOOL), _nothing)
        ours.publisher(MARK, matched)
        theirs.serve(Service("/scaner/scan", TRIGGER), _nothing)
        theirs.client(Service("/lamp", TRIGGER), _ignore)
        theirs.subscribe(MARK, _ignore)
        await matched.ends_with(1)
        why = ours.why_unmatched(Service("/scanner/scan", TRIGGER)), ours.why_unmatched(Service("/lamp", SET_BOOL))
        await ours.close()
        await theirs.close()
        return why

    assert loops.run(scenario()) == (
        Unmatched("no server is at `/scanner/scan`, but one is at `/scaner/scan`", is_mismatch=False),
        Unmatched("`/lamp` has a client of type std_srvs/srv/Trigger, and not std_srvs/srv/SetBool", is_mismatch=True),
    )


# services that are there and do not go with ours


GO = ServiceType("cell_msgs/srv/Go", (("speed", FieldType.FLOAT64),), (("ok", FieldType.BOOL),))
OTHER_REQUEST = ServiceType(GO.name, (("speed", FieldType.INT32), ("label", FieldType.STRING)), GO.response)
OTHER_RESPONSE = ServiceType(GO.name, GO.request, (("ok", FieldType.BOOL), ("message", FieldType.STRING)))
CALL: Use = lambda bus: bus.client(Service("/go", GO), _ignore)  # noqa: E731 - a row says it at a glance
SERVE: Use = lambda bus: bus.serve(Service("/go", GO), _nothing)  # noqa: E731 - the same


def half(
    take: object = RELIABLE, say: object = RELIABLE, type_: ServiceType = GO, *, serves: bool = True
) -> Callable[[DomainParticipant], list[Entity]]:
    """The endpoints of a server, or of a client."""

    def made(peer: DomainParticipant) -> list[Entity]:
        request, response = service_classes(type_)
        requests, responses = DdsTopic(peer, "rq/goRequest", request), DdsTopic(peer, "rr/goReply", response)
        taken, said = (requests, responses) if serves else (responses, requests)
        return [DataReader(peer, taken, Qos(take)), DataWriter(peer, said, Qos(say))]

    return made


@pytest.mark.parametrize(
    ("use", "theirs", "why"),
    [
        (CALL, half(type_=OTHER_REQUEST), "`/go` has a server, but its type does not go with ours"),
        (CALL, half(type_=OTHER_RESPONSE), "`/go` has a server, but its type does not go with ours"),
        (
            CALL,
            half(say=Policy.Reliability.BestEffort),
            "`/go` has a server, but its reliability is best effort, and we ask for reliable",
        ),
        (SERVE, half(type_=OTHER_REQUEST, serves=False), "`/go` has a client, but its type does not go with ours"),
        (SERVE, half(type_=OTHER_RESPONSE, serves=False), "`/go` has a client, but its type does not go with ours"),
        (CALL, half(), None),
        (SERVE, half(serves=False), None),
    ],
)
def test_a_service_that_does_not_go_with_ours_is_a_mismatch(
    domain: int, use: Use, theirs: Callable[[DomainParticipant], list[Entity]], why: str | None
) -> None:
    kept: list[Entity] = []

    def keep(peer: DomainParticipant) -> Entity:
        kept.extend(theirs(peer))
        return kept[0]

    told = why_unmatched(domain, use, Service("/go", GO), keep)
    assert told == (None if why is None else Unmatched(why, is_mismatch=True))
