"""A bus inside the process behaves as one of a middleware does."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import TypeAlias

import pytest

from scbm.nodes.buses.bus import MISMATCHES, Answered, BusError, Received, Service, Topic
from scbm.nodes.buses.loopback import LoopbackHub
from scbm.nodes.types.cdr import Message
from scbm.nodes.types.definitions import FLOAT64, SET_BOOL, TRIGGER, Scalar
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

TALK = Topic("/talk")
LATCHED = Topic("/status", is_latched=True)
SCAN = Service("/scan", TRIGGER)


Settle: TypeAlias = Callable[[], Awaitable[None]]


def scene(play: Callable[[LoopbackHub, Settle], Awaitable[None]]) -> None:
    """Plays on a hub; the second argument lets everything happen that is under way."""

    async def main(loop: VirtualLoop) -> None:
        await play(LoopbackHub(loop.now_ns), loop.settle)

    run_virtually(main)


def test_messages_come_in_order_to_all_others_and_not_to_the_own_bus() -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        own, other, third = hub.join("a"), hub.join("b"), hub.join("c")
        heard: dict[str, list[Scalar]] = {"own": [], "other": [], "third": []}
        hearing = own.subscribe(TALK, lambda received: heard["own"].append(received.message.data))
        other.subscribe(TALK, lambda received: heard["other"].append(received.message.data))
        third.subscribe(TALK, lambda received: heard["third"].append(received.message.data))
        talking = own.publisher(TALK)
        assert (talking.peers, hearing.peers) == (2, 0)
        for number in range(5):
            talking.publish({"data": str(number)})
        assert heard["other"] == []  # no callback runs inside another call
        await settled()
        assert heard == {"own": [], "other": list("01234"), "third": list("01234")}

    scene(play)


def test_messages_say_when_they_came_and_from_which_publisher() -> None:
    async def main(loop: VirtualLoop) -> None:
        hub = LoopbackHub(loop.now_ns)
        received: list[Received] = []
        hub.join("hears").subscribe(TALK, received.append)
        one, other = hub.join("one").publisher(TALK), hub.join("other").publisher(TALK)
        one.publish({"data": "a"})
        await loop.settle()
        came_ns = loop.now_ns()
        other.publish({"data": "b"})
        loop.let_pass_ns(5_000_000)  # the process is busy: the message is handled late, and came in time
        one.publish({"data": "c"})
        await loop.settle()
        first, second, third = received
        assert (second.stamp_ns, third.stamp_ns) == (came_ns, came_ns + 5_000_000)
        assert first.source == third.source != second.source

    run_virtually(main)


def test_the_last_message_of_each_latched_publisher_reaches_those_that_come_later() -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        one, other = hub.join("one"), hub.join("other")
        early, late, casual = [], [], []
        hub.join("early").subscribe(LATCHED, lambda received: early.append(received.message.data))
        publisher = one.publisher(LATCHED)
        publisher.publish({"data": "old"})
        publisher.publish({"data": "new"})
        other.publisher(LATCHED).publish({"data": "other"})
        await settled()
        hub.join("late").subscribe(LATCHED, lambda received: late.append(received.message.data))
        hub.join("casual").subscribe(Topic("/status"), lambda received: casual.append(received.message.data))
        await settled()
        assert early == ["old", "new", "other"]
        assert late == ["new", "other"]
        assert casual == []
        publisher.publish({"data": "more"})
        await settled()
        assert (late[2:], casual) == (["more"], ["more"])

    scene(play)


@pytest.mark.parametrize(
    ("offered", "asked"),
    [
        (Topic("/talk"), Topic("/talk", is_latched=True)),
        (Topic("/talk"), Topic("/talk", FLOAT64)),
        (Topic("/talk"), Topic("/talk2")),
        (Topic("/talk", is_best_effort=True), Topic("/talk")),
    ],
    ids=["nothing is kept", "another type", "another name", "only best effort"],
)
def test_what_does_not_go_together_is_not_matched(offered: Topic, asked: Topic) -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        heard: list[Received] = []
        publisher = hub.join("a").publisher(offered)
        subscription = hub.join("b").subscribe(asked, heard.append)
        publisher.publish({"data": "no subscriber hears this"})
        await settled()
        assert (publisher.peers, subscription.peers, heard) == (0, 0, [])

    scene(play)


@pytest.mark.parametrize("offers_best_effort", [False, True])
def test_who_asks_for_best_effort_hears_publishers_of_both_kinds(*, offers_best_effort: bool) -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        heard: list[Scalar] = []
        publisher = hub.join("a").publisher(Topic("/talk", is_best_effort=offers_best_effort))
        hub.join("b").subscribe(
            Topic("/talk", is_best_effort=True), lambda received: heard.append(received.message.data)
        )
        publisher.publish({"data": "hello"})
        await settled()
        assert (publisher.peers, heard) == (1, ["hello"])

    scene(play)


def test_both_sides_learn_how_many_are_matched_whenever_that_changes() -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        publishing: list[int] = []
        hearing: list[int] = []
        own, other, third = hub.join("a"), hub.join("b"), hub.join("c")
        own.publisher(TALK, publishing.append)
        own.subscribe(Topic("/unmatched"), lambda _: None, publishing.append)
        other.subscribe(TALK, lambda _: None, hearing.append)
        await settled()
        third.subscribe(TALK, lambda _: None)
        await settled()
        await third.close()
        await settled()
        await own.close()
        await settled()
        assert (publishing, hearing) == ([1, 2, 1], [1, 0])

    scene(play)


def test_who_leaves_is_gone_at_once_and_what_was_sent_before_still_comes_first() -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        heard: list[str] = []
        sources: list[int] = []

        def receive(received: Received) -> None:
            heard.append(str(received.message.data))
            sources.append(received.source)

        def left(source: int) -> None:
            assert source == sources[-1]
            heard.append("left")

        hearing = hub.join("b").subscribe(TALK, receive, left=left)
        own = hub.join("a")
        own.publisher(TALK).publish({"data": "last"})
        await own.close()
        assert hearing.peers == 0
        await settled()
        assert heard == ["last", "left"]

    scene(play)


def test_nothing_is_called_back_on_a_closed_bus_and_nothing_can_be_sent_from_it() -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        heard: list[Received] = []
        own, other = hub.join("a"), hub.join("b")
        other.subscribe(TALK, heard.append)
        publisher = own.publisher(TALK)
        publisher.publish({"data": "too late for who leaves now"})
        await other.close()
        await settled()
        assert heard == []
        await own.close()
        with pytest.raises(BusError, match="closed"):
            publisher.publish({"data": "from nowhere"})

    scene(play)


def test_calls_are_answered_each_once_with_a_number_of_their_own() -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        answers: list[Answered] = []
        asked: list[Mapping[str, Scalar]] = []

        def answer(request: Message) -> Mapping[str, Scalar]:
            asked.append(vars(request))
            return {"success": len(asked) == 1, "message": "done"}

        hub.join("server").serve(Service("/light", SET_BOOL), answer)
        hub.join("another server").serve(Service("/light", SET_BOOL), answer)
        client = hub.join("client").client(Service("/light", SET_BOOL), answers.append)
        calls = [client.call({"data": True}), client.call({"data": False})]
        await settled()
        assert asked == [{"data": True}, {"data": False}]
        assert [(answered.call, vars(answered.message)["success"]) for answered in answers] == list(
            zip(calls, [True, False], strict=True)
        )
        assert calls[0] != calls[1]

    scene(play)


def test_a_call_to_nobody_or_to_a_server_that_is_lost_gets_no_answer() -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        answers: list[Answered] = []
        matched: list[int] = []
        client = hub.join("client").client(SCAN, answers.append, matched.append)
        client.call({})
        server = hub.join("server")
        server.serve(SCAN, lambda _: {"success": True, "message": ""})
        await settled()
        assert client.peers == 1
        client.call({})
        await server.close()
        await settled()
        assert (answers, matched, client.peers) == ([], [1, 0], 0)

    scene(play)


def test_it_says_why_nobody_is_matched_if_others_use_another_type(wording: Wording) -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        own, other = hub.join("a"), hub.join("b")
        own.publisher(TALK)
        assert own.why_unmatched(TALK) is None
        other.subscribe(Topic("/talk", FLOAT64), lambda _: None)
        other.serve(Service("/scan", SET_BOOL), lambda _: {})
        await settled()
        for what in (TALK, SCAN):
            unmatched = own.why_unmatched(what)
            assert unmatched is not None
            assert unmatched.kind in MISMATCHES
            wording(unmatched.why)
        assert own.why_unmatched(Service("/scan", SET_BOOL)) is None
        assert other.why_unmatched(Topic("/talk", FLOAT64)) is not None

    scene(play)


def test_its_words_are_for_people(wording: Wording) -> None:
    async def play(hub: LoopbackHub, settled: Settle) -> None:
        wording(hub.join("a").words)
        await settled()

    scene(play)
