"""Simulated resources: they hear requests, wait for what a tester decides of them, and do nothing twice."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import pytest

from scbm.cases import Reaction
from scbm.model import Outcome
from scbm.nodes.buses.bus import Received
from scbm.nodes.node_messages import (
    Abandon,
    Answering,
    Become,
    Fate,
    Forgot,
    Message,
    Prepare,
    Prepared,
    React,
    RestartResource,
    decode,
    encode,
)
from scbm.nodes.roles.cell_topics import CellTopics
from scbm.nodes.roles.resources_node import ResourcesNode
from support.models import scan_cell
from support.nodes import Stage
from support.virtual_loop import VirtualLoop, run_virtually

MODEL = scan_cell()
TOPICS = CellTopics.of(MODEL)
SECOND_NS = 10**9


class Drawing:
    """Answers alone: succeeds after a second, and counts."""

    def __init__(self) -> None:
        self.count = 0

    def react(self, resource: Any) -> Reaction:  # noqa: ANN401 - a resource
        self.count += 1
        return Reaction(resource.name, Outcome.SUCCEED, SECOND_NS)


@dataclass
class Bench:
    """A node of resources between a controller and a tester that a test plays."""

    loop: VirtualLoop
    replies: list[tuple[int, dict[str, Any]]] = field(default_factory=list)
    told: list[Message] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.stage = Stage.virtual(MODEL, self.loop)
        self.drawing = Drawing()
        self.begun_ns = self.loop.now_ns()
        self.node = ResourcesNode(self.stage.seat("resources", ["scan"]), self.drawing)
        self.tester = self.stage.join("tester")
        self.tester.subscribe(TOPICS.simulated, self._hear)
        self.cases = self.tester.publisher(TOPICS.case)
        self.controller = self.stage.join("controller")
        self.controller.subscribe(TOPICS.reply("scan"), self._answered)
        self.requests = self.controller.publisher(TOPICS.request("scan"))

    def _hear(self, received: Received) -> None:
        self.told.append(decode(received.data))

    def _answered(self, received: Received) -> None:
        assert isinstance(received.data, str)
        self.replies.append((received.stamp_ns - self.begun_ns, json.loads(received.data)))

    # the tester

    def say(self, message: Message) -> None:
        self.cases.publish(encode(message))

    def prepare(
        self, run: str = "run_1", *, relayed: bool = False, scale: str = "1", nodes: tuple[str, ...] = ()
    ) -> None:
        nodes = nodes or (self.node.membership.own.node,)
        self.say(Prepare(run, nodes, "", {}, scale, relayed))

    def react(  # noqa: PLR0913 - the fields of the message
        self,
        request: int,
        latency_ns: int = SECOND_NS,
        outcome: str = "succeed",
        *,
        copies: tuple[int, ...] = (0,),
        run: str = "run_1",
        measured: dict[str, Any] | None = None,
    ) -> None:
        self.say(React(run, request, "scan", outcome, latency_ns, measured, copies))

    def become(self, condition: str, factor: str = "1", run: str = "run_1") -> None:
        self.say(Become(run, "scan", condition, factor))

    def restart(self, *, is_down: bool) -> None:
        self.say(RestartResource("run_1", "scan", is_down))

    # the controller

    def send(self, request: int, run: str = "run_1") -> None:
        self.requests.publish(json.dumps({"id": f"{run}-{request}", "request": {"scan_command": "scan_box"}}))

    def cancel(self, request: int, run: str = "run_1") -> None:
        self.requests.publish(json.dumps({"id": f"{run}-{request}", "cancel": True}))

    # what came of it

    async def after(self, seconds: float) -> list[tuple[str, bool]]:
        """All replies once so much time has passed."""
        await self.loop.settle(round(seconds * SECOND_NS))
        return [(reply["id"], reply["succeeded"]) for _, reply in self.replies]

    @property
    def seconds(self) -> list[float]:
        """When they came."""
        return [at_ns / SECOND_NS for at_ns, _ in self.replies]

    @property
    def asked(self) -> list[Answering]:
        return [message for message in self.told if isinstance(message, Answering)]


def play(scene: Callable[[Bench], Awaitable[None]]) -> None:
    async def main(loop: VirtualLoop) -> None:
        await scene(Bench(loop))

    run_virtually(main)


# what a tester decides


@pytest.mark.parametrize("first", ["request", "reaction"])
def test_a_request_is_worked_on_once_both_it_and_its_reaction_are_there(first: str) -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.send(1) if first == "request" else bench.react(1)
        assert await bench.after(5) == []
        bench.react(1) if first == "request" else bench.send(1)
        assert await bench.after(0.9) == []
        assert await bench.after(0.2) == [("run_1-1", True)]
        assert bench.seconds == [pytest.approx(6.0)]
        assert bench.drawing.count == 0

    play(scene)


def test_a_reply_says_what_was_decided() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        for number, outcome in enumerate(("succeed", "fail", "timeout"), 1):
            bench.react(number, SECOND_NS * number, outcome, measured={"temperature": 3})
            bench.send(number)
        await bench.after(10)
        assert [said for _, said in bench.replies] == [
            {"id": "run_1-1", "succeeded": True, "measured": {"temperature": 3}},
            {"id": "run_1-2", "succeeded": False},
        ]

    play(scene)


@pytest.mark.parametrize("scale", ["2", "1/2"])
def test_latencies_are_of_the_time_of_the_run(scale: str) -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare(scale=scale)
        bench.react(1)
        bench.send(1)
        await bench.after(10)
        assert bench.seconds == [float(1 / Fraction(scale))]

    play(scene)


def test_nothing_is_done_twice() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.send(1)
        bench.send(1)
        bench.react(1)
        bench.react(1, 2 * SECOND_NS, "fail")
        bench.send(1)
        bench.prepare()  # again, as a tester does until all are ready
        assert await bench.after(3) == [("run_1-1", True)]
        bench.send(1)
        bench.react(1)
        assert await bench.after(3) == [("run_1-1", True)]

    play(scene)


def test_each_copy_that_the_network_makes_of_a_request_is_worked_on_when_it_arrives() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.react(1, copies=(0, SECOND_NS // 2))
        bench.react(2, copies=())
        bench.send(1)
        bench.send(2)
        assert await bench.after(5) == [("run_1-1", True), ("run_1-1", True)]
        assert bench.seconds == [1.0, 1.5]

    play(scene)


def test_requests_of_a_run_that_is_announced_later_wait_for_it() -> None:
    async def scene(bench: Bench) -> None:
        bench.send(1)
        bench.send(2)
        bench.send(3, run="run_other")
        bench.cancel(2)
        await bench.after(1)
        bench.prepare()
        for number in (1, 2, 3):
            bench.react(number)
        assert await bench.after(5) == [("run_1-1", True)]
        assert bench.drawing.count == 0

    play(scene)


def test_a_request_that_is_cancelled_is_not_answered() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.send(1)
        bench.react(1)
        await bench.after(0.5)
        bench.cancel(1)
        bench.cancel(9)  # nobody knows that one
        assert await bench.after(5) == []

    play(scene)


def test_a_request_that_is_cancelled_before_it_is_decided_is_never_begun() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.send(1)
        bench.cancel(1)
        await bench.after(0.5)
        bench.react(1)
        assert await bench.after(5) == []
        assert not [line for line in bench.stage.told if "gets" in line]

    play(scene)


# conditions


def test_an_occupied_resource_keeps_requests_until_it_is_well_again() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.become("occupied")
        for number in (1, 2):
            bench.react(number)
            bench.send(number)
        assert await bench.after(2) == []
        bench.cancel(2)
        bench.become("well")
        assert await bench.after(2) == [("run_1-1", True)]
        assert bench.seconds == [pytest.approx(3.0)]

    play(scene)


def test_a_dead_resource_forgets_and_gets_nothing() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        for number in (1, 2):
            bench.react(number)
        bench.send(1)
        await bench.after(0.5)
        bench.become("dead")
        bench.send(2)
        await bench.after(1)
        bench.become("well")
        assert await bench.after(5) == []

    play(scene)


def test_a_failing_resource_fails_what_arrives_from_then_on() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        for number in (1, 2):
            bench.react(number, measured={"temperature": 3})
        bench.send(1)
        await bench.after(0.5)
        bench.become("failing")
        bench.send(2)
        assert await bench.after(5) == [("run_1-1", True), ("run_1-2", False)]
        assert bench.replies[1][1].keys() == {"id", "succeeded"}

    play(scene)


def test_a_slower_resource_takes_a_multiple_of_its_time() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.become("slower", "5/2")
        bench.react(1)
        bench.send(1)
        await bench.after(5)
        assert bench.seconds == [2.5]

    play(scene)


def test_a_restart_forgets_and_while_it_is_down_nothing_arrives() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        for number in (1, 2, 3):
            bench.react(number)
        bench.send(1)
        await bench.after(0.5)
        bench.restart(is_down=True)
        bench.restart(is_down=True)
        bench.send(2)
        await bench.after(2)
        bench.restart(is_down=False)
        bench.send(3)
        assert await bench.after(2) == [("run_1-3", True)]

    play(scene)


# relayed messages


def test_a_relayed_reply_travels_as_the_tester_says() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare(relayed=True)
        bench.react(1)
        bench.send(1)
        assert await bench.after(2) == []
        (asked,) = bench.asked
        assert (asked.run, asked.request, asked.resource) == ("run_1", 1, "scan")
        bench.say(Fate("run_1", 1, "scan", asked.job, (0, SECOND_NS)))
        assert await bench.after(0.5) == [("run_1-1", True)]
        assert await bench.after(1) == [("run_1-1", True)] * 2
        bench.say(Fate("run_1", 1, "scan", asked.job, (0,)))  # nothing is sent twice
        assert len(await bench.after(1)) == 2

    play(scene)


def test_a_relayed_reply_that_is_lost_never_comes() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare(relayed=True)
        for number in (1, 2):
            bench.react(number)
            bench.send(number)
        await bench.after(2)
        assert [asked.request for asked in bench.asked] == [1, 2]
        bench.say(Fate("run_1", 1, "scan", bench.asked[0].job, ()))
        bench.say(Fate("run_1", 2, "scan", bench.asked[1].job, (0,)))
        assert await bench.after(2) == [("run_1-2", True)]

    play(scene)


def test_a_relayed_cancellation_arrives_when_the_tester_says() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare(relayed=True)
        for number in (1, 2):
            bench.react(number)
            bench.send(number)
            bench.cancel(number)  # it is under way
        await bench.after(0.2)
        bench.say(Fate("run_1", 1, "scan", 0, (SECOND_NS // 2,)))
        bench.say(Fate("run_1", 2, "scan", 0, (2 * SECOND_NS,)))
        await bench.after(5)
        assert [asked.request for asked in bench.asked] == [2]

    play(scene)


# other runs, other controllers


def test_an_answer_waits_until_the_controller_hears_it() -> None:
    async def scene(bench: Bench) -> None:
        await bench.controller.close()
        late = bench.stage.join("controller")
        bench.requests = late.publisher(TOPICS.request("scan"))
        bench.prepare("run_2")
        for number in (1, 2):
            bench.send(number, "run_2")
            bench.react(number, run="run_2")
        assert await bench.after(5) == []
        late.subscribe(TOPICS.reply("scan"), bench._answered)
        assert await bench.after(0.1) == [("run_2-1", True), ("run_2-2", True)]

    play(scene)


def test_an_answer_that_nobody_heard_is_forgotten_with_its_run() -> None:
    async def scene(bench: Bench) -> None:
        await bench.controller.close()
        late = bench.stage.join("controller")
        bench.requests = late.publisher(TOPICS.request("scan"))
        bench.prepare("run_2")
        bench.send(1, "run_2")
        bench.react(1, run="run_2")
        await bench.after(5)
        bench.prepare("run_3")
        await bench.after(1)
        late.subscribe(TOPICS.reply("scan"), bench._answered)
        assert await bench.after(5) == []

    play(scene)


def test_requests_of_others_are_answered_alone_each_once() -> None:
    async def scene(bench: Bench) -> None:
        bench.send(1, run="me")
        bench.send(1, run="me")
        bench.send(2, run="me")
        bench.cancel(2, run="me")
        assert await bench.after(2) == [("me-1", True)]

    play(scene)


def test_who_asks_by_hand_may_leave_before_the_answer() -> None:
    async def scene(bench: Bench) -> None:
        hand = bench.stage.join("ros2cli")
        hand.publisher(TOPICS.request("scan")).publish('{"id": "hand-1", "request": {"scan_command": "scan_box"}}')
        await bench.after(0.1)
        await hand.close()
        assert await bench.after(2) == [("hand-1", True)]

    play(scene)


def test_what_is_remembered_of_others_and_of_runs_that_nobody_announces_is_bounded() -> None:
    async def scene(bench: Bench) -> None:
        for request in range(1_500):
            bench.send(request)  # of a run that is announced later
        await bench.after(0.1)
        bench.prepare()
        for request in range(1_500):
            bench.react(request)
        assert len(await bench.after(2)) == len(bench.stage.complaints) + 500 == 1_000
        bench.replies.clear()
        for request in range(1_500):
            bench.send(request, run="me")
        assert len(await bench.after(2)) == 1_001  # older ones are given up

    play(scene)


def test_a_request_that_waits_for_its_run_is_forgotten_with_its_controller() -> None:
    async def scene(bench: Bench) -> None:
        bench.send(1)
        hearing = bench.stage.join("another controller")
        hearing.subscribe(TOPICS.reply("scan"), bench._answered)
        hearing.publisher(TOPICS.request("scan"))
        await bench.after(0.1)
        await bench.controller.close()
        await bench.after(0.1)
        bench.prepare()
        bench.react(1)
        assert await bench.after(2) == []

    play(scene)


def test_a_node_that_does_not_know_a_run_says_so_when_it_is_told_of_a_request() -> None:
    async def scene(bench: Bench) -> None:
        bench.react(1)
        await bench.after(0.1)
        assert bench.told == [Forgot("run_1", bench.node.membership.own.node)]

    play(scene)


def test_requests_of_others_do_not_touch_those_of_a_run() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare(relayed=True)
        bench.react(1)
        bench.send(1)
        bench.send(1, run="me")
        bench.cancel(1, run="me")
        bench.send(2, run="me")
        assert await bench.after(2) == [("me-2", True)]
        assert [asked.request for asked in bench.asked] == [1]

    play(scene)


def test_requests_of_others_that_waited_are_answered_to_them() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.become("occupied")
        bench.send(1, run="me")
        bench.react(1)
        bench.send(1)
        await bench.after(1)
        bench.become("well")
        assert sorted(await bench.after(2)) == [("me-1", True), ("run_1-1", True)]

    play(scene)


def test_decisions_about_another_run_are_nothing() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.become("dead", run="run_0")
        bench.react(1, run="run_0")
        bench.say(Abandon("run_0"))
        bench.prepare("run_2", nodes=("another",))
        bench.send(1)
        assert await bench.after(2) == []
        bench.react(1)
        assert await bench.after(2) == [("run_1-1", True)]

    play(scene)


def test_a_tester_whose_run_it_does_not_know_is_told_so_and_what_came_meanwhile_is_begun_with_the_run() -> None:
    async def scene(bench: Bench) -> None:
        bench.send(1)
        bench.react(1)
        await bench.after(1)
        assert bench.told == [Forgot("run_1", bench.node.membership.own.node)]
        bench.prepare()
        bench.react(1)
        assert await bench.after(2) == [("run_1-1", True)]

    play(scene)


@pytest.mark.parametrize("how", ["prepare", "abandon", "tester", "controller", "close"])
def test_what_was_begun_is_forgotten_with_its_run_its_tester_or_its_controller(how: str) -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.react(1)
        bench.send(1)
        bench.send(2)
        bench.react(3, copies=(SECOND_NS,))  # it is still under way
        bench.send(3)
        await bench.after(0.5)
        hearing = bench.stage.join("another controller")
        hearing.subscribe(TOPICS.reply("scan"), bench._answered)
        match how:
            case "prepare":
                bench.prepare("run_2")
            case "abandon":
                bench.say(Abandon("run_1"))
            case "tester":
                await bench.tester.close()
            case "controller":
                await bench.controller.close()
                await bench.loop.settle()
                bench.react(2)  # it is not begun for nobody
            case _:
                await bench.node.close()
        assert await bench.after(5) == []

    play(scene)


def test_another_tester_that_leaves_ends_nothing() -> None:
    async def scene(bench: Bench) -> None:
        other = bench.stage.join("tester")
        other.publisher(TOPICS.case)
        bench.prepare()
        bench.react(1)
        bench.send(1)
        await bench.after(0.5)
        await other.close()
        assert await bench.after(1) == [("run_1-1", True)]

    play(scene)


def test_conditions_do_not_outlive_a_run() -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.become("dead")
        bench.restart(is_down=True)
        await bench.after(1)
        bench.prepare("run_2")
        bench.react(1, run="run_2")
        bench.send(1, run="run_2")
        assert await bench.after(2) == [("run_2-1", True)]

    play(scene)


# being ready


def test_it_does_not_wait_for_a_controller_where_the_resource_is_real() -> None:
    async def scene(bench: Bench) -> None:
        await bench.controller.close()
        await bench.loop.settle()
        bench.prepare()
        await bench.loop.settle()
        assert bench.told == []
        nodes = (bench.node.membership.own.node,)
        bench.say(Prepare("run_1", nodes, "", {}, "1", is_relayed=False, real=("scan",)))
        await bench.loop.settle()
        assert bench.told == [Prepared("run_1", bench.node.membership.own.node)]

    play(scene)


def test_it_is_ready_once_a_controller_reaches_it_and_hears_it() -> None:
    async def scene(bench: Bench) -> None:
        await bench.controller.close()
        bench.prepare()
        await bench.loop.settle()
        assert bench.told == []
        half = bench.stage.join("controller")
        half.publisher(TOPICS.request("scan"))
        bench.prepare()
        await bench.loop.settle()
        assert bench.told == []
        half.subscribe(TOPICS.reply("scan"), lambda _: None)
        bench.prepare()
        await bench.loop.settle()
        assert bench.told == [Prepared("run_1", bench.node.membership.own.node)]

    play(scene)


def test_a_time_scale_that_is_none_is_refused_with_a_sentence() -> None:
    async def scene(bench: Bench) -> None:
        for scale in ("0", "-1", "1/0", "1e999999999", "x"):
            bench.prepare(scale=scale)
        await bench.loop.settle()
        assert bench.told == []
        assert len(bench.stage.complaints) == 5
        assert all("is not a fraction greater than 0" in words for words in bench.stage.complaints)

    play(scene)


@pytest.mark.parametrize(
    "said",
    [
        "",
        "{}",
        "[]",
        '{"id": "me-1"}',
        '{"id": "me-1", "request": []}',
        '{"id": "me-1", "cancel": false}',
        '{"id": "me-1", "cancel": 1}',
        '{"id": "me-1", "request": {}, "cancel": true}',
        '{"id": 1, "request": {}}',
        '{"id": "me", "request": {}}',
        "[" * 100_000,
    ],
)
def test_a_request_that_is_none_is_dropped_with_a_sentence(said: str) -> None:
    async def scene(bench: Bench) -> None:
        bench.requests.publish(said)
        bench.send(7, run="me")
        assert await bench.after(2) == [("me-7", True)]
        (complaint,) = bench.stage.complaints
        assert complaint.startswith("a message on `/scbm/scan_cell/scan/request` was dropped: ")

    play(scene)


@pytest.mark.parametrize(
    "wrong",
    [
        React("run_1", 1, "scan", "explode", 1, None, (0,)),
        React("run_1", 1, "scan", "succeed", 1, None, (0,) * 1_001),
        Fate("run_1", 1, "scan", 1, (0,) * 1_001),
        Become("run_1", "scan", "asleep", "1"),
        Become("run_1", "scan", "slower", "0"),
        Become("run_1", "scan", "slower", "1e999999999"),
    ],
)
def test_a_decision_that_makes_no_sense_is_dropped_with_a_sentence(wrong: Message) -> None:
    async def scene(bench: Bench) -> None:
        bench.prepare()
        bench.say(wrong)
        bench.say(React("run_1", 1, "another resource", "succeed", 1, None, (0,)))
        bench.cases.publish("what")
        bench.react(1)
        bench.send(1)
        assert await bench.after(2) == [("run_1-1", True)]
        first, second = bench.stage.complaints
        assert first.startswith(f"a `{wrong.kind}` of a tester was dropped: ")
        assert second == "a message of a tester was dropped: this is not JSON"

    play(scene)
