"""What every bus keeps of its promises, whatever carries the messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

import pytest

from scbm.nodes.buses.bus import MISMATCHES, Answered, Bus, Received, Service, Topic, Unmatched
from scbm.nodes.types.definitions import BOOL, FLOAT64, INT64, SET_BOOL, STRING, TRIGGER, MessageDefinition, Scalar
from scbm.testing.transports import TRANSPORTS
from support import loops
from support.kept import Kept

MakeBus: TypeAlias = Callable[[str], Bus]

TALK = Topic("/cell/talk")
LATCHED = Topic("/cell/status", is_latched=True)
SCAN = Service("/scanner/scan", TRIGGER)


@pytest.fixture(params=list(TRANSPORTS))
def make_bus(request: pytest.FixtureRequest) -> Iterator[MakeBus]:
    """Makes buses that reach each other, and have nothing to warn of; called in a running event loop."""
    complaints: list[str] = []
    transport = TRANSPORTS[request.param]
    domain = request.getfixturevalue("domain") if transport.joins_processes else 0
    yield transport.connect(domain, complaints.append, None)
    assert complaints == []


async def closed(*buses: Bus) -> None:
    for bus in buses:
        await bus.close()


@pytest.mark.parametrize(
    ("type_", "data"),
    [
        (STRING, "Grüße an den 🤖"),
        (STRING, ""),
        (STRING, "x" * 3_000_000),
        (BOOL, True),
        (BOOL, False),
        (INT64, 2**63 - 1),
        (INT64, -(2**63)),
        (FLOAT64, 0.1),
        (FLOAT64, float("-inf")),
    ],
)
def test_a_message_arrives_as_it_was_sent(make_bus: MakeBus, type_: MessageDefinition, data: Scalar) -> None:
    async def scenario() -> Received:
        ours, theirs = make_bus("ours"), make_bus("theirs")
        matched, received = Kept[int](), Kept[Received]()
        theirs.subscribe(Topic("/a/b", type_), received)
        publisher = ours.publisher(Topic("/a/b", type_), matched)
        await matched.ends_with(1)
        publisher.publish({"data": data})
        (came,) = await received.first(1)
        await closed(ours, theirs)
        return came

    came = loops.run(scenario())
    assert came.message.data == data
    assert type(came.message.data) is type(data)


def test_nothing_is_lost_and_the_order_is_kept_across_topics(make_bus: MakeBus) -> None:
    topics = [Topic(f"/cell/part_{number}") for number in range(3)]

    async def scenario() -> list[tuple[str, Scalar]]:
        ours, theirs = make_bus("ours"), make_bus("theirs")
        matched, received = Kept[int](), Kept[tuple[str, Scalar]]()
        publishers = [ours.publisher(topic, matched) for topic in topics]
        for topic in topics:
            theirs.subscribe(topic, lambda came, name=topic.name: received((name, came.message.data)))  # type: ignore[misc]
        await matched.first(len(topics))
        for number in range(1_500):
            publishers[number % 3].publish({"data": str(number)})
        came = await received.first(1_500)
        await closed(ours, theirs)
        return came

    assert loops.run(scenario()) == [(topics[number % 3].name, str(number)) for number in range(1_500)]


def test_stamps_do_not_go_back(make_bus: MakeBus) -> None:
    async def scenario() -> list[Received]:
        ours, theirs = make_bus("ours"), make_bus("theirs")
        matched, received = Kept[int](), Kept[Received]()
        theirs.subscribe(TALK, received)
        publisher = ours.publisher(TALK, matched)
        await matched.ends_with(1)
        for number in range(200):
            publisher.publish({"data": str(number)})
        came = await received.first(200)
        await closed(ours, theirs)
        return came

    stamps = [came.stamp_ns for came in loops.run(scenario())]
    assert stamps == sorted(stamps)


def test_a_bus_does_not_hear_itself(make_bus: MakeBus) -> None:
    async def scenario() -> tuple[list[Received], list[Received], int]:
        ours, theirs = make_bus("ours"), make_bus("theirs")
        matched, own, other = Kept[int](), Kept[Received](), Kept[Received]()
        ours.subscribe(TALK, own)
        theirs.subscribe(TALK, other)
        publisher = ours.publisher(TALK, matched)
        await matched.ends_with(1)
        # What comes from `theirs` behind the own one shows that nothing of it is still on its way.
        heard = Kept[int]()
        answer = theirs.publisher(TALK, heard)
        await heard.ends_with(1)
        publisher.publish({"data": "own"})
        await other.first(1)
        answer.publish({"data": "of the other"})
        await own.first(1)
        peers = publisher.peers
        await closed(ours, theirs)
        return own.all, other.all, peers

    own, other, peers = loops.run(scenario())
    assert [came.message.data for came in own] == ["of the other"]
    assert [came.message.data for came in other] == ["own"]
    assert peers == 1


def test_both_sides_learn_how_many_are_matched(make_bus: MakeBus) -> None:
    async def scenario() -> tuple[list[int], list[int], int, int]:
        ours, first, second = make_bus("ours"), make_bus("first"), make_bus("second")
        readers, writers = Kept[int](), Kept[int]()
        publisher = ours.publisher(TALK, readers)
        assert publisher.peers == 0
        subscription = first.subscribe(TALK, lambda _: None, writers)
        await readers.ends_with(1)
        await writers.ends_with(1)
        second.subscribe(TALK, lambda _: None)
        await readers.ends_with(2)
        await second.close()
        await readers.ends_with(1)
        peers = publisher.peers, subscription.peers
        await ours.close()
        await writers.ends_with(0)
        assert subscription.peers == 0
        await first.close()
        return readers.all, writers.all, *peers

    assert loops.run(scenario()) == ([1, 2, 1], [1, 0], 1, 1)


def test_what_is_sent_when_somebody_is_matched_reaches_them(make_bus: MakeBus) -> None:
    async def scenario() -> list[Received]:
        ours, theirs = make_bus("ours"), make_bus("theirs")
        received = Kept[Received]()

        def greet(count: int) -> None:
            if count:
                publisher.publish({"data": "welcome"})

        publisher = ours.publisher(TALK, greet)
        theirs.subscribe(TALK, received)
        await received.first(1)
        await closed(ours, theirs)
        return received.all

    assert [came.message.data for came in loops.run(scenario())] == ["welcome"]


def test_those_that_come_later_get_the_last_latched_message_of_each_publisher(make_bus: MakeBus) -> None:
    async def scenario() -> tuple[list[Scalar], list[Scalar]]:
        ours, theirs, early_bus, late_bus = (make_bus(name) for name in ("ours", "theirs", "early", "late"))
        matched, early, late = Kept[int](), Kept[Received](), Kept[Received]()
        early_bus.subscribe(LATCHED, early, matched)
        first, second = ours.publisher(LATCHED), theirs.publisher(LATCHED)
        await matched.ends_with(2)
        for word in ("one", "two", "three"):
            first.publish({"data": word})
        second.publish({"data": "four"})
        await early.first(4)
        late_bus.subscribe(LATCHED, late)
        await late.first(2)
        # Behind these would be what should not have come.
        first.publish({"data": "five"})
        second.publish({"data": "six"})
        await late.first(4)
        await closed(ours, theirs, early_bus, late_bus)
        return [came.message.data for came in early.all[:4]], [came.message.data for came in late.all]

    early, late = loops.run(scenario())
    assert [word for word in early if word != "four"] == ["one", "two", "three"]
    assert sorted(map(str, late[:2])) == ["four", "three"]
    assert sorted(map(str, late[2:])) == ["five", "six"]


def test_those_that_come_later_get_nothing_of_what_is_not_latched(make_bus: MakeBus) -> None:
    async def scenario() -> list[Scalar]:
        ours, early_bus, late_bus = make_bus("ours"), make_bus("early"), make_bus("late")
        matched, early, late = Kept[int](), Kept[Received](), Kept[Received]()
        publisher = ours.publisher(TALK, matched)
        early_bus.subscribe(TALK, early)
        await matched.ends_with(1)
        publisher.publish({"data": "before"})
        await early.first(1)
        late_bus.subscribe(TALK, late)
        await matched.ends_with(2)
        publisher.publish({"data": "after"})
        await late.first(1)
        await closed(ours, early_bus, late_bus)
        return [came.message.data for came in late.all]

    assert loops.run(scenario()) == ["after"]


def test_publishers_are_distinguished(make_bus: MakeBus) -> None:
    async def scenario() -> list[Received]:
        ours, theirs, ears = make_bus("ours"), make_bus("theirs"), make_bus("ears")
        matched, received = Kept[int](), Kept[Received]()
        ears.subscribe(TALK, received, matched)
        first, second = ours.publisher(TALK), theirs.publisher(TALK)
        await matched.ends_with(2)
        for number in range(5):
            first.publish({"data": f"first {number}"})
            second.publish({"data": f"second {number}"})
        await received.first(10)
        await closed(ours, theirs, ears)
        return received.all

    came = loops.run(scenario())
    by_source: dict[int, list[Scalar]] = {}
    for message in came:
        by_source.setdefault(message.source, []).append(message.message.data)
    assert sorted(map(str, by_source.values())) == sorted(
        str([f"{who} {number}" for number in range(5)]) for who in ("first", "second")
    )


def test_a_publisher_that_leaves_is_reported_behind_the_last_of_its_messages(make_bus: MakeBus) -> None:
    async def scenario() -> list[Received | int]:
        ours, ears = make_bus("ours"), make_bus("ears")
        matched, events = Kept[int](), Kept[Received | int]()
        ears.subscribe(TALK, events, left=events)
        publisher = ours.publisher(TALK, matched)
        await matched.ends_with(1)
        for number in range(300):
            publisher.publish({"data": str(number)})
        await ours.close()
        came = list(await events.first(301))
        await ears.close()
        return came

    *messages, last = loops.run(scenario())
    assert [came.message.data for came in messages if isinstance(came, Received)] == [
        str(number) for number in range(300)
    ]
    assert [last] == sorted({came.source for came in messages if isinstance(came, Received)})


def test_nothing_is_called_back_behind_close(make_bus: MakeBus) -> None:
    async def scenario() -> tuple[list[object], list[object]]:
        ours, closing, staying = make_bus("ours"), make_bus("closing"), make_bus("staying")
        matched, before, after = Kept[int](), Kept[object](), Kept[object]()
        closing.subscribe(TALK, before, before, before)
        staying.subscribe(TALK, after)
        publisher = ours.publisher(TALK, matched)
        await matched.until(lambda kept: kept[-1:] == [2])
        await before.first(1)
        publisher.publish({"data": "last words"})
        # Without a turn of the loop between: the message is on its way to both.
        await closing.close()
        known = list(before.all)
        await matched.ends_with(1)
        publisher.publish({"data": "more"})
        await after.first(2)
        await closed(ours, staying)
        return known, before.all

    known, in_the_end = loops.run(scenario())
    assert known == [1]
    assert in_the_end == known


def test_closing_twice_is_closing(make_bus: MakeBus) -> None:
    async def scenario() -> None:
        bus = make_bus("ours")
        bus.publisher(TALK)
        await bus.close()
        await bus.close()

    loops.run(scenario())


def test_another_type_at_the_name_is_why_nobody_is_there(make_bus: MakeBus) -> None:
    async def scenario() -> Unmatched | None:
        ours, theirs = make_bus("ours"), make_bus("theirs")
        wrong, other = Topic(TALK.name, BOOL), Topic("/cell/other")
        met = Kept[int]()
        ours.publisher(TALK)
        ours.publisher(other, met)
        theirs.subscribe(wrong, lambda _: None)
        theirs.subscribe(other, lambda _: None)
        await met.ends_with(1)
        why = ours.why_unmatched(TALK)
        await closed(ours, theirs)
        return why

    why = loops.run(scenario())
    assert why is not None
    assert why.kind in MISMATCHES
    assert "`/cell/talk`" in why.why
    assert "std_msgs/msg/Bool" in why.why
    assert "std_msgs/msg/String" in why.why


def test_nothing_shows_where_nobody_is(make_bus: MakeBus) -> None:
    async def scenario() -> Unmatched | None:
        bus = make_bus("ours")
        bus.publisher(TALK)
        why = bus.why_unmatched(TALK)
        await bus.close()
        return why

    assert loops.run(scenario()) is None


def test_a_call_is_answered_once_with_the_number_it_had(make_bus: MakeBus) -> None:
    async def scenario() -> tuple[list[int], list[Answered]]:
        ours, theirs = make_bus("ours"), make_bus("theirs")
        matched, answers = Kept[int](), Kept[Answered]()
        client = ours.client(Service("/light", SET_BOOL), answers, matched)
        theirs.serve(Service("/light", SET_BOOL), lambda asked: {"success": asked.data, "message": f"was {asked.data}"})
        await matched.ends_with(1)
        calls = [client.call({"data": number % 2 == 0}) for number in range(50)]
        await answers.first(50)
        peers = client.peers
        await theirs.close()
        await matched.ends_with(0)
        assert (peers, client.peers) == (1, 0)
        await ours.close()
        return calls, answers.all

    calls, answers = loops.run(scenario())
    assert {answer.call: dict(vars(answer.message)) for answer in answers} == {
        call: {"success": number % 2 == 0, "message": f"was {number % 2 == 0}"} for number, call in enumerate(calls)
    }
    assert len(answers) == len(calls)


def test_another_type_of_service_is_why_nobody_serves(make_bus: MakeBus) -> None:
    async def scenario() -> Unmatched | None:
        ours, theirs = make_bus("ours"), make_bus("theirs")
        met = Kept[int]()
        ours.client(SCAN, lambda _: None)
        ours.publisher(TALK, met)
        theirs.serve(Service(SCAN.name, SET_BOOL), lambda _: {"success": True, "message": ""})
        theirs.subscribe(TALK, lambda _: None)
        await met.ends_with(1)
        why = ours.why_unmatched(SCAN)
        await closed(ours, theirs)
        return why

    why = loops.run(scenario())
    assert why is not None
    assert why.kind in MISMATCHES
    assert "`/scanner/scan`" in why.why
    assert "std_srvs/srv/SetBool" in why.why
    assert "std_srvs/srv/Trigger" in why.why
