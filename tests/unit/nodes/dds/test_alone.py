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

from scbm.nodes.buses.bus import MISMATCHES, Service, Topic, Unmatched
from scbm.nodes.buses.dds.dds_bus import DdsBus
from scbm.nodes.buses.dds.dds_classes import message_class
from scbm.nodes.buses.dds.raw_samples import delete
from scbm.nodes.types.definitions import (
    BOOL,
    FLOAT64,
    SET_BOOL,
    STRING,
    TRIGGER,
    MessageDefinition,
    Scalar,
    ServiceDefinition,
)
from support import loops
from support.kept import Kept
from support.ros_types import service_type
from support.wording import Wording

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


def _topic(peer: DomainParticipant, name: str, type_: MessageDefinition = STRING) -> DdsTopic[Any]:
    return DdsTopic(peer, name, message_class(type_))


def writer(*policies: object, name: str = "rt/cell/talk", type_: MessageDefinition = STRING) -> Theirs:
    return lambda peer: DataWriter(peer, _topic(peer, name, type_), Qos(*(policies or (RELIABLE,))))


def reader(*policies: object, name: str = "rt/cell/talk", type_: MessageDefinition = STRING) -> Theirs:
    return lambda peer: DataReader(peer, _topic(peer, name, type_), Qos(*(policies or (RELIABLE,))))


@pytest.mark.parametrize(
    ("use", "theirs", "is_mismatch"),
    [
        (
            publish,
            reader(type_=BOOL),
            True,
        ),
        (
            hear,
            writer(type_=FLOAT64),
            True,
        ),
        (
            hear,
            writer(Policy.Reliability.BestEffort),
            True,
        ),
        (
            hear_latched,
            writer(),
            True,
        ),
        (
            publish,
            reader(RELIABLE, Policy.Durability.TransientLocal),
            True,
        ),
        (
            publish_latched,
            reader(RELIABLE, Policy.Durability.Persistent),
            True,
        ),
        (
            publish,
            reader(RELIABLE, Policy.Deadline(duration(seconds=1))),
            True,
        ),
        (
            publish,
            reader(RELIABLE, Policy.DataRepresentation(use_xcdrv2_representation=True)),
            True,
        ),
        (
            hear,
            writer(name="rt/cell/tlak"),
            False,
        ),
        (
            publish,
            reader(name="cell/talk"),
            False,
        ),
        (hear_best_effort, writer(Policy.Reliability.BestEffort), None),
        (publish, writer(type_=BOOL), None),
        (publish, reader(name="rt/quite/different"), None),
        (publish, reader(), None),
    ],
    ids=[
        *("type of subscription", "type of publication", "reliability", "durability", "asked durability", "persistent"),
        *("deadline", "representation", "similar name", "name in DDS", "best effort", "publications", "other", "match"),
    ],
)
def test_it_says_what_shows(
    domain: int, use: Use, theirs: Theirs, *, is_mismatch: bool | None, wording: Wording
) -> None:
    """`None`: nothing shows. No mismatch: a peer is elsewhere, and another may still join the place itself."""
    reason = why_unmatched(domain, use, LATCHED if use in {publish_latched, hear_latched} else TALK, theirs)
    assert (None if reason is None else reason.kind in MISMATCHES) == is_mismatch
    if reason is not None:
        wording(reason.why)


def test_partitions_are_named(domain: int, wording: Wording) -> None:
    def theirs(peer: DomainParticipant) -> Entity:
        publisher = Publisher(peer, Qos(Policy.Partition(["line_1"])))
        return DataWriter(publisher, _topic(peer, "rt/cell/talk"), Qos(RELIABLE))

    why = why_unmatched(domain, hear, TALK, theirs)
    assert why is not None
    wording(why.why)


def test_names_that_we_use_ourselves_are_not_proposed(domain: int) -> None:
    def use(bus: DdsBus) -> None:
        bus.publisher(TALK)
        bus.publisher(Topic("/cell/talk_2"))

    assert why_unmatched(domain, use, TALK, reader(name="rt/cell/talk_2")) is None


def test_topics_of_drivers_are_not_proposed_for_those_of_nodes_nor_the_other_way_round(domain: int) -> None:
    of_nodes, of_driver = Topic("/scbm/gantry/status"), Topic("/gantry/status")
    for ours, theirs in ((of_nodes, of_driver), (of_driver, of_nodes)):

        def use(bus: DdsBus, ours: Topic = ours) -> None:
            bus.subscribe(ours, _ignore)

        assert why_unmatched(domain, use, ours, writer(name=f"rt{theirs.name}")) is None


def test_what_the_bus_does_not_use_has_no_reason(domain: int) -> None:
    assert why_unmatched(domain, hear, Topic("/cell/other"), writer(name="rt/cell/other")) is None


def test_similar_names_of_services_are_proposed(domain: int, wording: Wording) -> None:
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

    scan, lamp = loops.run(scenario())
    assert scan is not None
    assert lamp is not None
    assert (scan.kind in MISMATCHES, lamp.kind in MISMATCHES) == (False, True)
    wording((scan.why, lamp.why))


# services that are there and do not go with ours


GO = service_type("cell_msgs/srv/Go", {"speed": "float64"}, {"ok": "bool"})
OTHER_REQUEST = service_type(GO.name, {"speed": "int32", "label": "string"}, {"ok": "bool"})
OTHER_RESPONSE = service_type(GO.name, {"speed": "float64"}, {"ok": "bool", "message": "string"})
CALL: Use = lambda bus: bus.client(Service("/go", GO), _ignore)  # noqa: E731 - a row says it at a glance
SERVE: Use = lambda bus: bus.serve(Service("/go", GO), _nothing)  # noqa: E731 - the same


def half(
    take: object = RELIABLE, say: object = RELIABLE, type_: ServiceDefinition = GO, *, serves: bool = True
) -> Callable[[DomainParticipant], list[Entity]]:
    """The endpoints of a server, or of a client."""

    def made(peer: DomainParticipant) -> list[Entity]:
        request, response = (message_class(part, is_call=True) for part in (type_.request, type_.response))
        requests, responses = DdsTopic(peer, "rq/goRequest", request), DdsTopic(peer, "rr/goReply", response)
        taken, published = (requests, responses) if serves else (responses, requests)
        return [DataReader(peer, taken, Qos(take)), DataWriter(peer, published, Qos(say))]

    return made


@pytest.mark.parametrize(
    ("use", "theirs", "is_mismatch"),
    [
        (CALL, half(type_=OTHER_REQUEST), True),
        (CALL, half(type_=OTHER_RESPONSE), True),
        (CALL, half(say=Policy.Reliability.BestEffort), True),
        (SERVE, half(type_=OTHER_REQUEST, serves=False), True),
        (SERVE, half(type_=OTHER_RESPONSE, serves=False), True),
        (CALL, half(), False),
        (SERVE, half(serves=False), False),
    ],
    ids=["request", "response", "reliability", "request served", "response served", "match", "match served"],
)
def test_a_service_that_does_not_go_with_ours_is_a_mismatch(
    domain: int, use: Use, theirs: Callable[[DomainParticipant], list[Entity]], *, is_mismatch: bool, wording: Wording
) -> None:
    kept: list[Entity] = []

    def keep(peer: DomainParticipant) -> Entity:
        kept.extend(theirs(peer))
        return kept[0]

    reason = why_unmatched(domain, use, Service("/go", GO), keep)
    assert (reason is not None and reason.kind in MISMATCHES) == is_mismatch
    if reason is not None:
        wording(reason.why)
