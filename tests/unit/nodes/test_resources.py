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
    Busy,
    Fate,
    Forgot,
    Go,
    Message,
    Prepare,
    Prepared,
    React,
    Refused,
    RestartResource,
    decode,
    encode,
)
from scbm.nodes.roles.cell_topics import CellTopics
from scbm.nodes.roles.resources_node import ResourcesNode
from support.event_records import OPTIONS
from support.models import scan_cell
from support.nodes import Stage
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

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
class Harness:
    """A node of resources between a controller and a tester that a test plays."""

    loop: VirtualLoop
    replies: list[tuple[int, dict[str, Any]]] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.stage = Stage.virtual(MODEL, self.loop)
        self.drawing = Drawing()
        self.begun_ns = self.loop.now_ns()
        self.node = ResourcesNode(self.stage.context("resources", ["scan"]), self.drawing)
        self.tester = self.stage.join("tester")
        self.tester.subscribe(TOPICS.simulated, self._hear)
        self.cases = self.tester.publisher(TOPICS.case)
        self.controller = self.stage.join("controller")
        self.controller.subscribe(TOPICS.reply("scan"), self._answered)
        self.requests = self.controller.publisher(TOPICS.request("scan"))

    def _hear(self, received: Received) -> None:
        self.messages.append(decode(received.message.data))

    def _answered(self, received: Received) -> None:
        assert isinstance(received.message.data, str)
        self.replies.append((received.stamp_ns - self.begun_ns, json.loads(received.message.data)))

    # the tester

    def say(self, message: Message) -> None:
        self.cases.publish({"data": encode(message)})

    def prepare(
        self, run: str = "run_1", *, relayed: bool = False, scale: str = "1", nodes: tuple[str, ...] = ()
    ) -> None:
        nodes = nodes or (self.node.membership.own.node,)
        self.say(Prepare(run, nodes, "", OPTIONS, scale, relayed, "process 1", ()))

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
        self.requests.publish({"data": json.dumps({"id": f"{run}-{request}", "request": {"scan_command": "scan_box"}})})

    def cancel(self, request: int, run: str = "run_1") -> None:
        self.requests.publish({"data": json.dumps({"id": f"{run}-{request}", "cancel": True})})

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
        return [message for message in self.messages if isinstance(message, Answering)]


def play(scene: Callable[[Harness], Awaitable[None]]) -> None:
    async def main(loop: VirtualLoop) -> None:
        await scene(Harness(loop))

    run_virtually(main)


# what a tester decides


@pytest.mark.parametrize("first", ["request", "reaction"])
def test_a_request_is_worked_on_once_both_it_and_its_reaction_are_there(first: str) -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.send(1) if first == "request" else harness.react(1)
        assert await harness.after(5) == []
        harness.react(1) if first == "request" else harness.send(1)
        assert await harness.after(0.9) == []
        assert await harness.after(0.2) == [("run_1-1", True)]
        assert harness.seconds == [pytest.approx(6.0)]
        assert harness.drawing.count == 0

    play(scene)


def test_a_reply_says_what_was_decided() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        for number, outcome in enumerate(("succeed", "fail", "timeout"), 1):
            harness.react(number, SECOND_NS * number, outcome, measured={"temperature": 3})
            harness.send(number)
        await harness.after(10)
        assert [replied for _, replied in harness.replies] == [
            {"id": "run_1-1", "succeeded": True, "measured": {"temperature": 3}},
            {"id": "run_1-2", "succeeded": False, "measured": {"temperature": 3}},
        ]

    play(scene)


@pytest.mark.parametrize("scale", ["2", "1/2"])
def test_latencies_are_of_the_time_of_the_run(scale: str) -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare(scale=scale)
        harness.react(1)
        harness.send(1)
        await harness.after(10)
        assert harness.seconds == [float(1 / Fraction(scale))]

    play(scene)


def test_nothing_is_done_twice() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.send(1)
        harness.send(1)
        harness.react(1)
        harness.react(1, 2 * SECOND_NS, "fail")
        harness.send(1)
        harness.prepare()  # again, as a tester does until all are ready
        assert await harness.after(3) == [("run_1-1", True)]
        harness.send(1)
        harness.react(1)
        assert await harness.after(3) == [("run_1-1", True)]

    play(scene)


def test_each_copy_that_the_network_makes_of_a_request_is_worked_on_when_it_arrives() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.react(1, copies=(0, SECOND_NS // 2))
        harness.react(2, copies=())
        harness.send(1)
        harness.send(2)
        assert await harness.after(5) == [("run_1-1", True), ("run_1-1", True)]
        assert harness.seconds == [1.0, 1.5]

    play(scene)


def test_requests_of_a_run_that_is_announced_later_wait_for_it() -> None:
    async def scene(harness: Harness) -> None:
        harness.send(1)
        harness.send(2)
        harness.send(3, run="run_other")
        harness.cancel(2)
        await harness.after(1)
        harness.prepare()
        for number in (1, 2, 3):
            harness.react(number)
        assert await harness.after(5) == [("run_1-1", True)]
        assert harness.drawing.count == 0

    play(scene)


def test_a_request_that_is_cancelled_is_not_answered() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.send(1)
        harness.react(1)
        await harness.after(0.5)
        harness.cancel(1)
        harness.cancel(9)  # an unknown request
        assert await harness.after(5) == []

    play(scene)


def test_a_request_that_is_cancelled_before_it_is_decided_is_never_begun() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.send(1)
        harness.cancel(1)
        await harness.after(0.5)
        harness.react(1)
        assert await harness.after(5) == []
        assert not [line for line in harness.stage.output if "gets" in line]

    play(scene)


# conditions


def test_an_occupied_resource_keeps_requests_until_it_is_well_again() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.become("occupied")
        for number in (1, 2):
            harness.react(number)
            harness.send(number)
        assert await harness.after(2) == []
        harness.cancel(2)
        harness.become("well")
        assert await harness.after(2) == [("run_1-1", True)]
        assert harness.seconds == [pytest.approx(3.0)]

    play(scene)


def test_a_dead_resource_forgets_and_gets_nothing() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        for number in (1, 2):
            harness.react(number)
        harness.send(1)
        await harness.after(0.5)
        harness.become("dead")
        harness.send(2)
        await harness.after(1)
        harness.become("well")
        assert await harness.after(5) == []

    play(scene)


def test_a_failing_resource_fails_what_arrives_from_then_on() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        for number in (1, 2):
            harness.react(number, measured={"temperature": 3})
        harness.send(1)
        await harness.after(0.5)
        harness.become("failing")
        harness.send(2)
        assert await harness.after(5) == [("run_1-1", True), ("run_1-2", False)]
        assert harness.replies[1][1].keys() == {"id", "succeeded"}

    play(scene)


def test_a_slower_resource_takes_a_multiple_of_its_time() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.become("slower", "5/2")
        harness.react(1)
        harness.send(1)
        await harness.after(5)
        assert harness.seconds == [2.5]

    play(scene)


def test_a_restart_forgets_and_while_it_is_down_nothing_arrives() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        for number in (1, 2, 3):
            harness.react(number)
        harness.send(1)
        await harness.after(0.5)
        harness.restart(is_down=True)
        harness.restart(is_down=True)
        harness.send(2)
        await harness.after(2)
        harness.restart(is_down=False)
        harness.send(3)
        assert await harness.after(2) == [("run_1-3", True)]

    play(scene)


# relayed messages


def test_a_relayed_reply_travels_as_the_tester_says() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare(relayed=True)
        harness.react(1)
        harness.send(1)
        assert await harness.after(2) == []
        (asked,) = harness.asked
        assert (asked.run, asked.request, asked.resource) == ("run_1", 1, "scan")
        harness.say(Fate("run_1", 1, "scan", asked.job, (0, SECOND_NS)))
        assert await harness.after(0.5) == [("run_1-1", True)]
        assert await harness.after(1) == [("run_1-1", True)] * 2
        harness.say(Fate("run_1", 1, "scan", asked.job, (0,)))  # nothing is sent twice
        assert len(await harness.after(1)) == 2

    play(scene)


def test_a_relayed_reply_that_is_lost_never_comes() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare(relayed=True)
        for number in (1, 2):
            harness.react(number)
            harness.send(number)
        await harness.after(2)
        assert [asked.request for asked in harness.asked] == [1, 2]
        harness.say(Fate("run_1", 1, "scan", harness.asked[0].job, ()))
        harness.say(Fate("run_1", 2, "scan", harness.asked[1].job, (0,)))
        assert await harness.after(2) == [("run_1-2", True)]

    play(scene)


def test_a_relayed_cancellation_arrives_when_the_tester_says() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare(relayed=True)
        for number in (1, 2):
            harness.react(number)
            harness.send(number)
            harness.cancel(number)  # it is under way
        await harness.after(0.2)
        harness.say(Fate("run_1", 1, "scan", 0, (SECOND_NS // 2,)))
        harness.say(Fate("run_1", 2, "scan", 0, (2 * SECOND_NS,)))
        await harness.after(5)
        assert [asked.request for asked in harness.asked] == [2]

    play(scene)


# other runs, other controllers


def test_an_answer_waits_until_the_controller_hears_it() -> None:
    async def scene(harness: Harness) -> None:
        await harness.controller.close()
        late = harness.stage.join("controller")
        harness.requests = late.publisher(TOPICS.request("scan"))
        harness.prepare("run_2")
        for number in (1, 2):
            harness.send(number, "run_2")
            harness.react(number, run="run_2")
        assert await harness.after(5) == []
        late.subscribe(TOPICS.reply("scan"), harness._answered)
        assert await harness.after(0.1) == [("run_2-1", True), ("run_2-2", True)]

    play(scene)


def test_an_answer_that_nobody_heard_is_forgotten_with_its_run() -> None:
    async def scene(harness: Harness) -> None:
        await harness.controller.close()
        late = harness.stage.join("controller")
        harness.requests = late.publisher(TOPICS.request("scan"))
        harness.prepare("run_2")
        harness.send(1, "run_2")
        harness.react(1, run="run_2")
        await harness.after(5)
        harness.prepare("run_3")
        await harness.after(1)
        late.subscribe(TOPICS.reply("scan"), harness._answered)
        assert await harness.after(5) == []

    play(scene)


def test_requests_of_others_are_answered_alone_each_once() -> None:
    async def scene(harness: Harness) -> None:
        harness.send(1, run="me")
        harness.send(1, run="me")
        harness.send(2, run="me")
        harness.cancel(2, run="me")
        assert await harness.after(2) == [("me-1", True)]

    play(scene)


def test_who_asks_by_hand_may_leave_before_the_answer() -> None:
    async def scene(harness: Harness) -> None:
        hand = harness.stage.join("ros2cli")
        hand.publisher(TOPICS.request("scan")).publish(
            {"data": '{"id": "hand-1", "request": {"scan_command": "scan_box"}}'}
        )
        await harness.after(0.1)
        await hand.close()
        assert await harness.after(2) == [("hand-1", True)]

    play(scene)


@pytest.mark.slow
def test_what_is_remembered_of_others_and_of_runs_that_nobody_announces_is_bounded() -> None:
    async def scene(harness: Harness) -> None:
        for request in range(1_500):
            harness.send(request)  # of a run that is announced later
        await harness.after(0.1)
        harness.prepare()
        for request in range(1_500):
            harness.react(request)
        assert len(await harness.after(2)) == len(harness.stage.complaints) + 500 == 1_000
        harness.replies.clear()
        for request in range(1_500):
            harness.send(request, run="me")
        assert len(await harness.after(2)) == 1_001  # older ones are given up

    play(scene)


def test_a_request_that_waits_for_its_run_is_forgotten_with_its_controller() -> None:
    async def scene(harness: Harness) -> None:
        harness.send(1)
        hearing = harness.stage.join("another controller")
        hearing.subscribe(TOPICS.reply("scan"), harness._answered)
        hearing.publisher(TOPICS.request("scan"))
        await harness.after(0.1)
        await harness.controller.close()
        await harness.after(0.1)
        harness.prepare()
        harness.react(1)
        assert await harness.after(2) == []

    play(scene)


def test_a_node_that_does_not_know_a_run_reports_that_when_it_gets_a_request() -> None:
    async def scene(harness: Harness) -> None:
        harness.react(1)
        await harness.after(0.1)
        assert harness.messages == [Forgot("run_1", harness.node.membership.own.node)]

    play(scene)


def test_requests_of_others_do_not_touch_those_of_a_run() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare(relayed=True)
        harness.react(1)
        harness.send(1)
        harness.send(1, run="me")
        harness.cancel(1, run="me")
        harness.send(2, run="me")
        assert await harness.after(2) == [("me-2", True)]
        assert [asked.request for asked in harness.asked] == [1]

    play(scene)


def test_requests_of_others_that_waited_are_answered_to_them() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.become("occupied")
        harness.send(1, run="me")
        harness.react(1)
        harness.send(1)
        await harness.after(1)
        harness.become("well")
        assert sorted(await harness.after(2)) == [("me-1", True), ("run_1-1", True)]

    play(scene)


def test_decisions_about_another_run_are_nothing() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.become("dead", run="run_0")
        harness.react(1, run="run_0")
        harness.say(Abandon("run_0"))
        harness.prepare("run_2", nodes=("another",))
        harness.send(1)
        assert await harness.after(2) == []
        harness.react(1)
        assert await harness.after(2) == [("run_1-1", True)]

    play(scene)


def test_a_tester_whose_run_it_does_not_know_is_reported_and_what_came_meanwhile_is_begun_with_the_run() -> None:
    async def scene(harness: Harness) -> None:
        harness.send(1)
        harness.react(1)
        await harness.after(1)
        assert harness.messages == [Forgot("run_1", harness.node.membership.own.node)]
        harness.prepare()
        harness.react(1)
        assert await harness.after(2) == [("run_1-1", True)]

    play(scene)


@pytest.mark.parametrize("how", ["prepare", "abandon", "tester", "controller", "close"])
def test_what_was_begun_is_forgotten_with_its_run_its_tester_or_its_controller(how: str) -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.react(1)
        harness.send(1)
        harness.send(2)
        harness.react(3, copies=(SECOND_NS,))  # it is still under way
        harness.send(3)
        await harness.after(0.5)
        hearing = harness.stage.join("another controller")
        hearing.subscribe(TOPICS.reply("scan"), harness._answered)
        match how:
            case "prepare":
                harness.prepare("run_2")
            case "abandon":
                harness.say(Abandon("run_1"))
            case "tester":
                await harness.tester.close()
            case "controller":
                await harness.controller.close()
                await harness.loop.settle()
                harness.react(2)  # it does not begin without a caller
            case _:
                await harness.node.close()
        assert await harness.after(5) == []

    play(scene)


def test_another_tester_that_leaves_ends_nothing() -> None:
    async def scene(harness: Harness) -> None:
        other = harness.stage.join("tester")
        other.publisher(TOPICS.case)
        harness.prepare()
        harness.react(1)
        harness.send(1)
        await harness.after(0.5)
        await other.close()
        assert await harness.after(1) == [("run_1-1", True)]

    play(scene)


def test_conditions_do_not_outlive_a_run() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.become("dead")
        harness.restart(is_down=True)
        await harness.after(1)
        harness.prepare("run_2")
        harness.react(1, run="run_2")
        harness.send(1, run="run_2")
        assert await harness.after(2) == [("run_2-1", True)]

    play(scene)


# other testers


def test_a_second_tester_gets_busy_until_the_first_is_dropped(wording: Wording) -> None:
    async def scene(harness: Harness) -> None:
        node = harness.node.membership.own.node
        harness.prepare()
        await harness.after(7)
        silent, harness.cases = harness.cases, harness.stage.join("other").publisher(TOPICS.case)
        harness.prepare("run_2")
        await harness.after(4)
        harness.prepare("run_2")
        await harness.after(1)
        harness.cases = silent
        harness.prepare()
        await harness.after(1)
        prepared, busy, also_prepared, dropped = harness.messages
        assert (prepared, also_prepared) == (Prepared("run_1", node), Prepared("run_2", node))
        assert isinstance(busy, Busy)
        assert (busy.run, busy.tester, round(busy.for_ns / SECOND_NS)) == ("run_2", "process 1", 7)
        assert isinstance(dropped, Refused)
        assert dropped.run == "run_1"
        wording([dropped.why, *harness.stage.output])

    play(scene)


def test_a_tester_that_started_its_run_is_served_for_as_long_as_that_takes() -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.say(Go("run_1"))
        await harness.after(20)
        harness.react(1)
        harness.send(1)
        assert await harness.after(2) == [("run_1-1", True)]
        other = harness.stage.join("other").publisher(TOPICS.case)
        other.publish(
            {
                "data": encode(
                    Prepare("run_2", (harness.node.membership.own.node,), "", OPTIONS, "1", False, "process 2", ())
                )
            }
        )
        await harness.after(1)
        assert [type(message) for message in harness.messages[1:]] == [Busy]
        harness.say(Abandon("run_1"))
        other.publish(
            {
                "data": encode(
                    Prepare("run_2", (harness.node.membership.own.node,), "", OPTIONS, "1", False, "process 2", ())
                )
            }
        )
        await harness.after(1)
        assert harness.messages[-1] == Prepared("run_2", harness.node.membership.own.node)

    play(scene)


# being ready


def test_it_does_not_wait_for_a_controller_where_the_resource_is_real() -> None:
    async def scene(harness: Harness) -> None:
        await harness.controller.close()
        await harness.loop.settle()
        harness.prepare()
        await harness.loop.settle()
        assert harness.messages == []
        nodes = (harness.node.membership.own.node,)
        harness.say(Prepare("run_1", nodes, "", OPTIONS, "1", is_relayed=False, tester="process 1", real=("scan",)))
        await harness.loop.settle()
        assert harness.messages == [Prepared("run_1", harness.node.membership.own.node)]

    play(scene)


def test_it_is_ready_once_a_controller_reaches_it_and_hears_it() -> None:
    async def scene(harness: Harness) -> None:
        await harness.controller.close()
        harness.prepare()
        await harness.loop.settle()
        assert harness.messages == []
        half = harness.stage.join("controller")
        half.publisher(TOPICS.request("scan"))
        harness.prepare()
        await harness.loop.settle()
        assert harness.messages == []
        half.subscribe(TOPICS.reply("scan"), lambda _: None)
        harness.prepare()
        await harness.loop.settle()
        assert harness.messages == [Prepared("run_1", harness.node.membership.own.node)]

    play(scene)


def test_a_time_scale_that_is_none_is_refused_with_a_sentence(wording: Wording) -> None:
    async def scene(harness: Harness) -> None:
        for scale in ("0", "-1", "1/0", "1e999999999", "x"):
            harness.prepare(scale=scale)
        await harness.loop.settle()
        assert harness.messages == []
        assert len(harness.stage.complaints) == 5
        wording(harness.stage.complaints)

    play(scene)


@pytest.mark.parametrize(
    "replied",
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
def test_a_request_that_is_none_is_dropped_with_a_sentence(replied: str, wording: Wording) -> None:
    async def scene(harness: Harness) -> None:
        harness.requests.publish({"data": replied})
        harness.send(7, run="me")
        assert await harness.after(2) == [("me-7", True)]
        (complaint,) = harness.stage.complaints
        assert "`/scbm/scan_cell/scan/request`" in complaint
        wording(complaint)

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
def test_a_decision_that_makes_no_sense_is_dropped_with_a_sentence(wrong: Message, wording: Wording) -> None:
    async def scene(harness: Harness) -> None:
        harness.prepare()
        harness.say(wrong)
        harness.say(React("run_1", 1, "another resource", "succeed", 1, None, (0,)))
        harness.cases.publish({"data": "what"})
        harness.react(1)
        harness.send(1)
        assert await harness.after(2) == [("run_1-1", True)]
        first, second = harness.stage.complaints
        assert f"`{wrong.kind}`" in first
        wording((first, second))

    play(scene)
