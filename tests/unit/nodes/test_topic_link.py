"""Requests and replies on a pair of topics: the protocol of drivers, whatever they say."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.model.json_reader import JsonError
from scbm.nodes.buses.bus import MISMATCHES, BusError, Publisher, Received, Topic
from scbm.nodes.buses.loopback import LoopbackBus, LoopbackHub
from scbm.nodes.links.link import Correlation, Measurement, Reply
from scbm.nodes.links.topic_link import TopicLink, id_text, read_id, read_reply
from scbm.nodes.types.definitions import BOOL, FLOAT64
from support.hearing import Heard
from support.strings import matching
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

REQUEST, REPLY = Topic("/scanner/request"), Topic("/scanner/reply")


@dataclass
class Harness:
    """A link, its callbacks, and drivers that come and go."""

    loop: VirtualLoop
    complaints: list[str] = field(default_factory=list)
    asked: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.hub = LoopbackHub(self.loop.now_ns)
        self.heard = Heard()
        bus = self.hub.join("controller")
        self.link = TopicLink(bus, "scanner", (REQUEST, REPLY), self.heard, self.complaints.append)

    def driver(self, *, hears: bool = True, answers: bool = True) -> tuple[LoopbackBus, Publisher | None]:
        bus = self.hub.join("driver")
        if hears:
            bus.subscribe(REQUEST, self._take)
        return bus, bus.publisher(REPLY) if answers else None

    def _take(self, received: Received) -> None:
        assert isinstance(received.message.data, str)
        self.asked.append(json.loads(received.message.data))

    def send(self, number: int) -> None:
        self.link.send(Correlation("run", number), (("command", "scan"), ("count", 2), ("light", True)))

    def cancel(self, number: int) -> None:
        self.link.cancel(Correlation("run", number))


def play(scene: Callable[[Harness], Awaitable[None]]) -> None:
    async def main(loop: VirtualLoop) -> None:
        await scene(Harness(loop))

    run_virtually(main)


def test_requests_and_cancellations_are_those_of_the_protocol() -> None:
    async def scene(harness: Harness) -> None:
        harness.driver()
        harness.send(7)
        harness.cancel(7)
        await harness.loop.settle()
        assert harness.asked == [
            {"id": "run-7", "request": {"command": "scan", "count": 2, "light": True}},
            {"id": "run-7", "cancel": True},
        ]

    play(scene)


def test_replies_and_values_are_reported_with_the_time_at_which_they_came() -> None:
    async def scene(harness: Harness) -> None:
        _, replies = harness.driver()
        assert replies is not None
        came_ns = harness.loop.now_ns()
        replies.publish({"data": '{"id": "run-7", "succeeded": true, "measured": {"zone": "near", "count": 3}}'})
        replies.publish({"data": '{"id": "other-8", "succeeded": false}'})
        replies.publish({"data": '{"measured": {"zone": "far"}}'})
        await harness.loop.settle()
        assert harness.heard.replies == [
            ("scanner", Reply(Correlation("run", 7), True, (("zone", "near"), ("count", 3)), came_ns)),
            ("scanner", Reply(Correlation("other", 8), False, (), came_ns)),
        ]
        assert harness.heard.values == [("scanner", Measurement((("zone", "far"),), came_ns))]

    play(scene)


@pytest.mark.parametrize("half", [{"hears": False}, {"answers": False}])
def test_somebody_is_there_once_somebody_hears_and_somebody_may_answer(half: dict[str, bool]) -> None:
    async def scene(harness: Harness) -> None:
        harness.send(1)
        bus, _ = harness.driver(**half)
        await harness.loop.settle()
        is_there = [harness.link.is_there]
        assert (harness.asked, harness.heard.presence) == ([], [])
        harness.driver(hears="hears" in half, answers="answers" in half)
        await harness.loop.settle()
        is_there.append(harness.link.is_there)
        assert [body["id"] for body in harness.asked] == ["run-1"]
        await bus.close()
        await harness.loop.settle()
        is_there.append(harness.link.is_there)
        assert is_there == [False, True, False]
        assert harness.heard.presence == [("scanner", True), ("scanner", False)]

    play(scene)


def test_requests_wait_in_order_until_somebody_is_there_but_for_those_that_are_cancelled() -> None:
    async def scene(harness: Harness) -> None:
        for number in (1, 2, 3):
            harness.send(number)
        harness.cancel(2)
        harness.driver()
        await harness.loop.settle()
        assert [body["id"] for body in harness.asked] == ["run-1", "run-3"]
        assert all("request" in body for body in harness.asked)

    play(scene)


def test_no_request_is_sent_twice_whoever_comes_and_goes() -> None:
    async def scene(harness: Harness) -> None:
        harness.send(1)
        bus, _ = harness.driver()
        await harness.loop.settle()
        await bus.close()
        await harness.loop.settle()
        harness.send(2)
        harness.driver()
        await harness.loop.settle()
        assert [body["id"] for body in harness.asked] == ["run-1", "run-2"]

    play(scene)


class Refusing:
    """A publisher without a subscriber, then with one that does not take the first message."""

    def __init__(self) -> None:
        self.peers = 0
        self.sent: list[str] = []

    def publish(self, values: Mapping[str, object]) -> None:
        body = json.loads(str(values["data"]))["id"]
        if body == "run-1":
            raise BusError("full")
        self.sent.append(body)


def test_a_request_that_is_not_taken_keeps_none_of_those_that_wait_behind_it(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    requests = Refusing()
    publisher = LoopbackBus.publisher

    def publisher_that_refuses(bus: LoopbackBus, topic: Topic, *others: Any) -> Any:  # noqa: ANN401 - as it is
        return requests if topic == REQUEST else publisher(bus, topic, *others)

    monkeypatch.setattr(LoopbackBus, "publisher", publisher_that_refuses)

    async def scene(harness: Harness) -> None:
        for number in (1, 2, 3):
            harness.send(number)
        requests.peers = 1
        harness.hub.join("driver").publisher(REPLY)
        await harness.loop.settle()
        (complaint,) = harness.complaints
        wording(complaint)
        assert requests.sent == ["run-2", "run-3"]
        assert harness.heard.presence == [("scanner", True)]

    play(scene)


def test_what_is_missing_is_named_and_the_other_side_is_not_to_blame() -> None:
    async def scene(harness: Harness) -> None:
        missing = [harness.link.missing]
        harness.driver(answers=False)
        harness.hub.join("listener").subscribe(Topic(REQUEST.name, BOOL), lambda _: None)
        await harness.loop.settle()
        assert [*missing, harness.link.missing] == [(REQUEST.name, REPLY.name), (REPLY.name,)]
        assert harness.link.why_unmatched() is None

    play(scene)


def test_a_cancellation_that_nobody_can_hear_is_not_kept() -> None:
    async def scene(harness: Harness) -> None:
        bus, _ = harness.driver()
        harness.send(1)
        await harness.loop.settle()
        await bus.close()
        harness.cancel(1)
        harness.driver()
        await harness.loop.settle()
        assert len(harness.asked) == 1

    play(scene)


def test_why_nobody_is_there_is_reported_if_it_shows(wording: Wording) -> None:
    async def scene(harness: Harness) -> None:
        assert harness.link.why_unmatched() is None
        harness.hub.join("driver").publisher(Topic(REPLY.name, FLOAT64))
        unmatched = harness.link.why_unmatched()
        assert unmatched is not None
        assert unmatched.kind in MISMATCHES
        wording(unmatched.why)

    play(scene)


MALFORMED = [
    "",
    "[]",
    "[" * 100_000,
    '{"id": "run-7"}',
    '{"id": "run-7", "succeeded": "yes"}',
    '{"id": "run-7", "succeeded": null}',
    '{"id": "run-7", "succeeded": true, "measured": []}',
    '{"id": "run-7", "succeeded": true, "measured": {"a": [1]}}',
    '{"id": "run-7", "succeeded": true, "measured": {"a": 1.5}}',
    '{"id": "run-7", "succeeded": true, "measured": {"a": null}}',
    '{"id": "run-7", "succeeded": true, "mesured": {}}',
    '{"id": 7, "succeeded": true}',
    '{"id": "run", "succeeded": true}',
    '{"id": "run--7", "succeeded": true}',
    '{"id": "run-7-8", "succeeded": true}',
    '{"id": "run-x", "succeeded": true}',
    '{"id": "-7", "succeeded": true}',
    '{"id": "run-٣", "succeeded": true}',
    json.dumps({"id": "r" * 65 + "-1", "succeeded": True}),
    '{"succeeded": true, "measured": {}}',
    '{"id": "run-7", "succeeded": true, "measured": {"a": "\\ud800"}}',
    json.dumps({"measured": {"a": "x" * 100_001}}),
    json.dumps({"measured": {"a": ""}, "id": "x" * 1_000_000}),
]


@pytest.mark.parametrize("body", MALFORMED, ids=lambda body: ascii(body)[:60])
def test_what_is_none_of_the_protocol_is_dropped_with_a_sentence(body: str, wording: Wording) -> None:
    async def scene(harness: Harness) -> None:
        _, replies = harness.driver()
        assert replies is not None
        replies.publish({"data": body})
        replies.publish({"data": '{"id": "run-8", "succeeded": true}'})
        await harness.loop.settle()
        (complaint,) = harness.complaints
        assert "`/scanner/reply`" in complaint
        wording(complaint)
        assert len(complaint) < 200
        assert harness.heard.numbers() == [(8, True)]
        assert harness.heard.values == []

    play(scene)


SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from(["run-1", "run", "near"])
KEYS = st.sampled_from(["id", "succeeded", "measured", "x"])


@given(st.recursive(SCALARS, lambda inner: st.lists(inner) | st.dictionaries(KEYS, inner)))
def test_whatever_comes_is_a_reply_or_values_or_refused(body: object) -> None:
    try:
        heard = read_reply(json.dumps(body), 5)
    except JsonError:
        return
    assert isinstance(body, dict)
    values = heard.measured if isinstance(heard, Reply) else heard.values
    assert dict(values) == body.get("measured", {})
    assert isinstance(heard, Reply) == ("id" in body)


@given(matching(r"[0-9A-Za-z_]{1,64}"), st.integers(0, 10**18 - 1))
def test_ids_come_back_as_they_were(run: str, number: int) -> None:
    request = Correlation(run, number)
    assert read_id(id_text(request)) == request
