"""The controller runs one case after the other, publishes each step, and ignores messages of other runs."""

from __future__ import annotations

import asyncio
import gc
import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from threading import Event as ThreadEvent
from typing import Any

import pytest
from msgspec import structs
from msgspec.structs import asdict, replace

from scbm.cases import Case
from scbm.cases.trace import MessageDisturbed, Record, ResourceChanged, Trace, trace_digest
from scbm.files import read_bindings, read_case, read_model, write_case
from scbm.model import BehaviorModel
from scbm.nodes import Bus, ControllerNode, new_status
from scbm.nodes.buses.bus import BusError, Received, Service, Topic, UnmatchedKind
from scbm.nodes.buses.loopback import LoopbackBus, LoopbackHub
from scbm.nodes.node_messages import (
    Abandon,
    Busy,
    Ended,
    Forgot,
    Go,
    Message,
    Note,
    Prepare,
    Prepared,
    Refused,
    Stepped,
    Trouble,
    decode,
    encode,
)
from scbm.nodes.roles.cell_topics import CellTopics, Membership
from scbm.nodes.types.definitions import SET_BOOL, TRIGGER, ServiceDefinition
from scbm.planning import PlanCache, PlanLimits, SearchCancelledError
from scbm.running import (
    AskPlan,
    CancelRequest,
    ChangeResource,
    InjectionGiven,
    Measured,
    PlanAnswered,
    Program,
    ReplyArrived,
    RunFinished,
    Runner,
    RunnerOptions,
    SendRequest,
    TimePassed,
)
from scbm.testing.event_logs.event_records import MeasuredRecord, event_of, event_record, note_record
from scbm.testing.event_logs.event_records import Note as NoteEvent
from support import loops
from support.event_records import OPTIONS
from support.models import scan_cell
from support.nodes import JOINS_NS, Stage
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

MODEL = scan_cell(("measures: [temperature]", "measures: [temperature]\n    publishes: [temperature]"))
TOPICS = CellTopics.of(MODEL)
CASE = read_case("case: scans\ngoal: scanned\n", MODEL)
SECOND_NS = 10**9


@dataclass
class Harness:
    """A controller between a tester and a driver that a test plays."""

    stage: Stage
    model: BehaviorModel = MODEL
    plan_limits: PlanLimits | None = None
    messages: list[Message] = field(default_factory=list)
    asked: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.news = asyncio.Event()
        topics = CellTopics.of(self.model)
        self.node = self.stage.controller(self.plan_limits)
        self.tester = self.stage.join("tester")
        self.tester.subscribe(topics.run, self._hear)
        self.cases = self.tester.publisher(topics.case)

    def open_driver(self) -> None:
        self.driver = self.stage.join("driver")
        self.driver.subscribe(TOPICS.request("scan"), self._take)
        self.replies = self.driver.publisher(TOPICS.reply("scan"))

    def _hear(self, received: Received) -> None:
        self.messages.append(decode(received.message.data))
        self.news.set()

    def _take(self, received: Received) -> None:
        assert isinstance(received.message.data, str)
        self.asked.append(json.loads(received.message.data))
        self.news.set()

    async def until(self, is_so: Callable[[], bool]) -> None:
        while not is_so():
            self.news.clear()
            await self.news.wait()

    def say(self, message: Message) -> None:
        self.cases.publish({"data": encode(message)})

    def prepare(self, run: str = "run_1", case: Case = CASE, **other: Any) -> None:  # noqa: ANN401 - fields
        nodes = (self.node.membership.own.node,)
        text = write_case(case, self.model, None)
        self.say(structs.replace(Prepare(run, nodes, text, OPTIONS, "1", False, "process 1", ()), **other))

    def reply(self, request: int, run: str = "run_1", *, succeeded: bool = True) -> None:
        self.replies.publish({"data": json.dumps({"id": f"{run}-{request}", "succeeded": succeeded})})

    # what came of it

    @property
    def steps(self) -> list[Stepped]:
        return [message for message in self.messages if isinstance(message, Stepped)]

    def ended(self) -> list[str]:
        return [message.run for message in self.messages if isinstance(message, Ended)]

    def others(self) -> list[Message]:
        return [message for message in self.messages if not isinstance(message, Stepped | Ended)]

    def events(self, run: str = "run_1") -> list[Any]:
        return [event_of(step.event, self.model, step.at_ns) for step in self.steps if step.run == run]

    def kinds(self, run: str = "run_1") -> list[str]:
        return [type(event).__name__ for event in self.events(run)]


def play(scene: Callable[[Harness, VirtualLoop], Awaitable[None]], model: BehaviorModel = MODEL) -> None:
    async def main(loop: VirtualLoop) -> None:
        harness = Harness(Stage.virtual(model, loop), model)
        harness.open_driver()
        await loop.settle()
        await scene(harness, loop)

    run_virtually(main)


async def going(harness: Harness, loop: VirtualLoop, **other: Any) -> None:  # noqa: ANN401 - fields
    """A run whose first request is sent."""
    harness.prepare(**other)
    await loop.settle()
    harness.say(Go("run_1"))
    await loop.settle()
    assert [sent["id"] for sent in harness.asked] == ["run_1-1"]


def test_a_run_is_prepared_let_go_and_reported_step_by_step_to_its_end() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.prepare()
        await loop.settle(5 * SECOND_NS)
        assert harness.messages == [Prepared("run_1", harness.node.membership.own.node)]
        harness.say(Go("run_1"))
        await loop.settle(2 * SECOND_NS)
        assert harness.asked == [{"id": "run_1-1", "request": {"scan_command": "scan_box"}}]
        harness.reply(1)
        await loop.settle()
        assert harness.kinds() == ["GoalGiven", "PlanAnswered", "ReplyArrived"]
        assert [step.number for step in harness.steps] == [1, 2, 3]
        assert [step.at_ns for step in harness.steps] == [0, 0, 2 * SECOND_NS]
        ended = harness.messages[-1]
        assert isinstance(ended, Ended)
        records = rerun(harness)
        trace = Trace(MODEL.name, "scans", tuple(records))
        assert (ended.steps, ended.trace) == (3, trace_digest(trace))

    play(scene)


def rerun(harness: Harness, run: str = "run_1") -> list[Record]:
    """The records that a fresh runner makes of the steps."""
    runner = Runner(Program(harness.model), CASE.initial)
    records: list[Record] = []
    for step, event in zip(harness.steps, harness.events(run), strict=True):
        effects = [event] if isinstance(event, NoteEvent) else runner.handle(event, step.at_ns)
        outward = (AskPlan, CancelRequest, ChangeResource, RunFinished, SendRequest)
        records += [effect for effect in effects if not isinstance(effect, outward)]
    return records


def test_it_is_ready_once_requests_reach_all_resources() -> None:
    async def main(loop: VirtualLoop) -> None:
        harness = Harness(Stage.virtual(MODEL, loop))
        harness.prepare()
        await loop.settle()
        assert harness.messages == []
        harness.open_driver()
        await loop.settle()
        assert harness.messages == []
        harness.prepare()  # the tester asks again
        await loop.settle()
        assert harness.messages == [Prepared("run_1", harness.node.membership.own.node)]

    run_virtually(main)


def test_what_is_meant_for_another_node_is_not_prepared() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.prepare(nodes=("another",))
        harness.say(Go("run_1"))
        await loop.settle()
        assert (harness.messages, harness.asked) == ([], [])

    play(scene)


@pytest.mark.parametrize("case", ["goal: scanned", "case: x\ngoal: nothing_known", "{" * 1_500])
def test_a_case_that_cannot_be_read_is_refused_with_a_reason(case: str, wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        nodes = (harness.node.membership.own.node,)
        harness.say(Prepare("run_1", nodes, case, OPTIONS, "1", False, "process 1", ()))
        harness.say(Go("run_1"))
        await loop.settle()
        (refused,) = harness.messages
        assert isinstance(refused, Refused)
        assert (refused.run, refused.node) == ("run_1", harness.node.membership.own.node)
        assert "error[" in refused.why
        wording(refused.why)
        harness.prepare("run_2")
        await loop.settle()
        assert harness.messages[1:] == [Prepared("run_2", harness.node.membership.own.node)]

    play(scene)


@pytest.mark.parametrize(
    "wrong",
    [
        {"options": {}},
        {"options": asdict(RunnerOptions()) | {"time_limit_ns": "long"}},
        {"options": asdict(RunnerOptions()) | {"plan_limit": -1}},
        {"options": asdict(RunnerOptions()) | {"more": 1}},
        {"options": asdict(RunnerOptions()) | {"livelock_bound": 10**7}},
        {"options": asdict(RunnerOptions()) | {"instant_bound": 10**7}},
        {"time_scale": "0"},
        {"time_scale": "-2"},
        {"time_scale": "1e999999999"},
    ],
)
def test_a_run_with_options_that_are_none_is_dropped_with_a_sentence(wrong: dict[str, Any], wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        prepare = Prepare("run_1", (harness.node.membership.own.node,), "", OPTIONS, "1", False, "process 1", ())
        harness.cases.publish({"data": json.dumps(json.loads(encode(prepare)) | wrong)})
        harness.say(Go("run_1"))
        await loop.settle()
        assert harness.messages == []
        (complaint,) = harness.stage.complaints
        wording(complaint)

    play(scene)


def test_replies_to_other_runs_are_dropped() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        harness.reply(1, "run_0")
        harness.reply(1, "another")
        await loop.settle()
        assert harness.kinds() == ["GoalGiven", "PlanAnswered"]
        harness.reply(1)
        await loop.settle()
        assert harness.ended() == ["run_1"]
        harness.reply(1)
        await loop.settle()
        assert len(harness.steps) == 3

    play(scene)


def test_values_that_come_unasked_are_given_to_the_run() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        harness.replies.publish({"data": '{"measured": {"temperature": 7}}'})
        await loop.settle()
        assert event_record(harness.events()[-1]) == MeasuredRecord({"temperature": 7})

    play(scene)


class Full:
    """A publisher whose subscriptions do not take what is sent."""

    peers = 1

    def publish(self, _: object) -> None:
        raise BusError("full")


@pytest.mark.parametrize("whose", ["requests", "steps"])
def test_a_message_that_the_bus_does_not_take_is_reported_and_deadlines_pass(
    whose: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    publisher = LoopbackBus.publisher
    full = TOPICS.request("scan") if whose == "requests" else TOPICS.run

    def publisher_that_may_be_full(bus: LoopbackBus, topic: Topic, *others: Any) -> Any:  # noqa: ANN401 - as it is
        made = publisher(bus, topic, *others)
        return Full() if topic == full else made

    monkeypatch.setattr(LoopbackBus, "publisher", publisher_that_may_be_full)

    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.prepare()
        harness.say(Go("run_1"))
        await loop.settle(11 * SECOND_NS)
        lost = {
            "requests": ["request 1 to `scan` is lost: full", "that request 1 to `scan` is cancelled is lost: full"],
            "steps": ["a `step` for the tester is lost: full"],
        }
        assert [sent for sent in lost[whose] if sent not in harness.stage.complaints] == []
        assert whose == "steps" or "TimePassed" in harness.kinds()
        assert whose == "requests" or {"id": "run_1-1", "cancel": True} in harness.asked

    play(scene)


def first_measured(harness: Harness, run: str) -> list[Measured]:
    return [event for event in harness.events(run)[:1] if isinstance(event, Measured)]


def test_what_cannot_be_measured_is_not_remembered() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.replies.publish({"data": '{"measured": {"temperature": 3, "light": "red", "pressure": 1}}'})
        harness.replies.publish({"data": '{"measured": {"temperature": 99}}'})
        await going(harness, loop)
        assert first_measured(harness, "run_1") == [Measured((("temperature", 3),))]

    play(scene)


def test_what_is_refused_of_measured_values_is_reported_in_a_run_and_before_it(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.replies.publish({"data": '{"measured": {"temperature": 99}}'})
        await loop.settle()
        assert len(harness.stage.complaints) == 1
        await going(harness, loop)
        harness.replies.publish({"data": '{"measured": {"temperature": 99}}'})
        reply = {"id": "run_1-1", "succeeded": True, "measured": {"temperature": 98, "light": "red"}}
        harness.replies.publish({"data": json.dumps(reply)})
        await loop.settle()
        temperature, light = harness.stage.complaints
        assert ("`temperature`: 99 " in temperature, "`light`: red " in light) == (True, True)
        wording((temperature, light))
        assert harness.ended() == ["run_1"]

    play(scene)


def test_a_reply_that_measures_replaces_what_was_measured_before() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.replies.publish({"data": '{"measured": {"temperature": 2}}'})
        await going(harness, loop)
        harness.replies.publish({"data": '{"id": "run_1-1", "succeeded": true, "measured": {"temperature": 7}}'})
        harness.prepare("run_2")
        await loop.settle()
        harness.say(Go("run_2"))
        await loop.settle()
        assert first_measured(harness, "run_1") == [Measured((("temperature", 2),))]
        assert first_measured(harness, "run_2") == [Measured((("temperature", 7),))]

    play(scene)


def test_a_reply_of_a_resource_that_was_not_asked_is_dropped_with_a_sentence(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        lamp = harness.stage.join("lamp")
        lamp.subscribe(TOPICS.request("lamp"), lambda _: None)
        replies = lamp.publisher(TOPICS.reply("lamp"))
        await loop.settle()
        await going(harness, loop)
        replies.publish({"data": json.dumps({"id": "run_1-1", "succeeded": True})})
        await loop.settle()
        (complaint,) = harness.stage.complaints
        wording(complaint)
        assert harness.ended() == []
        harness.reply(1)
        await loop.settle()
        assert harness.ended() == ["run_1"]

    play(scene, scan_cell(("resources:\n", "resources:\n  lamp: {}\n")))


def test_going_twice_begins_one_run() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.say(Go("run_1"))  # too early
        await going(harness, loop)
        harness.say(Go("run_1"))
        harness.prepare()  # a run that goes on is not prepared
        await loop.settle()
        assert harness.kinds() == ["GoalGiven", "PlanAnswered"]
        assert len(harness.others()) == 1

    play(scene)


@pytest.mark.parametrize("how", ["prepare", "abandon", "tester", "close"])
def test_a_run_that_is_given_up_ends_by_the_rules_of_the_model(how: str) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        match how:
            case "prepare":
                harness.prepare("run_2")
            case "abandon":
                harness.say(Abandon("run_1"))
            case "tester":
                await harness.tester.close()
            case _:
                await harness.node.close()
        await loop.settle()
        assert harness.asked[1:] == [{"id": "run_1-1", "cancel": True}]
        harness.reply(1)
        await loop.settle(20 * SECOND_NS)
        assert len(harness.asked) == 2
        if how != "tester":
            assert isinstance(harness.events()[-1], InjectionGiven)
            assert harness.ended() == ["run_1"]

    play(scene)


def test_a_controller_that_leaves_forgets_the_run_that_it_has_not_begun_and_takes_no_other() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        own = harness.node.membership.own.node
        harness.prepare()
        await loop.settle()
        assert harness.messages == [Prepared("run_1", own)]
        await harness.node.close()
        harness.say(Go("run_1"))
        harness.prepare("run_2")
        harness.say(Go("run_2"))
        await loop.settle(SECOND_NS)
        assert harness.messages == [Prepared("run_1", own), Forgot("run_1", own)]
        assert harness.asked == []

    play(scene)


def test_a_request_that_still_waits_for_its_resource_is_forgotten_with_its_run() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.prepare()
        await loop.settle()
        await harness.driver.close()
        harness.say(Go("run_1"))
        await loop.settle()
        harness.say(Abandon("run_1"))
        await loop.settle()
        harness.open_driver()
        await loop.settle(SECOND_NS)
        assert harness.asked == []

    play(scene)


def test_another_tester_cannot_take_a_run_away_nor_end_it_by_leaving() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        other = harness.stage.join("tester")
        prepare_as(other, harness, "run_2")
        await loop.settle()
        await other.close()
        await loop.settle()
        assert harness.ended() == []
        harness.reply(1)
        await loop.settle()
        assert harness.ended() == ["run_1"]
        assert [type(message) for message in harness.others()] == [Prepared, Busy]
        assert not any(isinstance(event, InjectionGiven) for event in harness.events())

    play(scene)


def prepare_as(bus: Bus, harness: Harness, run: str) -> None:
    """Prepare a run as another tester."""
    text, nodes = write_case(CASE, MODEL, None), (harness.node.membership.own.node,)
    message = Prepare(run, nodes, text, OPTIONS, "1", False, "process 2", ())
    bus.publisher(TOPICS.case).publish({"data": encode(message)})


def test_a_tester_that_does_not_start_its_run_is_dropped_and_another_one_is_served(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        node = harness.node.membership.own.node
        silent = harness.stage.join("silent")
        prepare_as(silent, harness, "run_0")
        await loop.settle(7 * SECOND_NS)
        harness.prepare()
        await loop.settle(4 * SECOND_NS)
        busy = harness.messages[-1]
        assert isinstance(busy, Busy)
        assert (busy.run, busy.node, busy.tester, busy.for_ns // SECOND_NS) == ("run_1", node, "process 2", 7)
        prepare_as(silent, harness, "run_0")
        await loop.settle()
        assert isinstance(harness.messages[-1], Refused)
        await going(harness, loop, time_scale="1/100")
        await loop.settle(11 * SECOND_NS)
        harness.reply(1)
        await loop.settle()
        assert harness.ended() == ["run_1"]
        wording(harness.stage.output)

    play(scene)


def test_a_tester_that_left_or_gave_up_its_run_makes_way_for_others() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        node = harness.node.membership.own.node
        other = harness.stage.join("tester")
        prepare_as(other, harness, "run_2")
        await loop.settle()
        await other.close()
        await loop.settle()
        harness.prepare()
        await loop.settle()
        harness.say(Abandon("run_1"))
        prepare_as(harness.stage.join("tester"), harness, "run_3")
        await loop.settle()
        assert harness.messages == [Prepared(run, node) for run in ("run_2", "run_1", "run_3")]

    play(scene)


def test_the_next_run_begins_at_the_beginning() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        harness.reply(1)
        await loop.settle()
        harness.prepare("run_2", case=replace(CASE, name="again"))
        await loop.settle(SECOND_NS)
        harness.say(Go("run_2"))
        await loop.settle(SECOND_NS)
        assert [sent["id"] for sent in harness.asked] == ["run_1-1", "run_2-1"]
        harness.reply(1)  # to the run before
        harness.reply(1, "run_2", succeeded=False)
        await loop.settle()
        assert harness.kinds("run_2") == ["GoalGiven", "PlanAnswered", "ReplyArrived", "PlanAnswered"]
        assert [step.number for step in harness.steps if step.run == "run_2"] == [1, 2, 3, 4]

    play(scene)


def test_deadlines_and_records_are_in_time_of_the_run() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop, time_scale="5")
        await loop.settle(2 * SECOND_NS + 1_000)
        assert harness.asked[1] == {"id": "run_1-1", "cancel": True}
        (passed,) = [
            step.at_ns
            for step, event in zip(harness.steps, harness.events(), strict=True)
            if isinstance(event, TimePassed)
        ]
        assert passed == 10 * SECOND_NS

    play(scene)


def test_notes_of_the_tester_stand_in_the_trace_with_the_time_at_which_they_come() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        await loop.settle(SECOND_NS - 2_000)
        harness.say(Note("run_1", note_record(MessageDisturbed(0, 1, "scan", "reply", 0))))
        harness.say(Note("run_0", note_record(MessageDisturbed(0, 1, "scan", "reply", 0))))
        await loop.settle()
        (noted,) = [event for event in harness.events() if isinstance(event, MessageDisturbed)]
        assert noted == MessageDisturbed(noted.at_ns, 1, "scan", "reply", 0)
        assert noted.at_ns == pytest.approx(SECOND_NS, abs=10_000)

    play(scene)


@pytest.mark.parametrize(
    "note", [{}, {"kind": "time"}, {"kind": "resource", "resource": "missing", "condition": "down"}]
)
def test_a_note_that_is_none_is_dropped_with_a_sentence(note: dict[str, Any], wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        harness.cases.publish({"data": json.dumps({"kind": "note", "run": "run_1", "note": note})})
        harness.cases.publish({"data": "what"})
        await loop.settle()
        first, second = harness.stage.complaints
        wording((first, second))
        assert harness.kinds() == ["GoalGiven", "PlanAnswered"]

    play(scene)


def test_a_resource_that_is_lost_or_comes_back_stands_in_the_trace_and_no_request_is_sent_again() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        await harness.driver.close()
        await loop.settle(SECOND_NS)
        harness.open_driver()
        await loop.settle(SECOND_NS)
        changes = [event.condition for event in harness.events() if isinstance(event, ResourceChanged)]
        assert changes == ["down", "well"]
        assert len(harness.asked) == 1

    play(scene)


def test_a_resource_that_is_not_there_when_the_run_begins_gets_its_request_when_it_comes() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.prepare()
        await loop.settle()
        await harness.driver.close()
        await loop.settle()
        harness.say(Go("run_1"))
        await loop.settle(SECOND_NS)
        assert harness.asked == []
        assert harness.events()[1] == ResourceChanged(0, "network", "scan", "down")
        harness.open_driver()
        await loop.settle()
        assert [sent["id"] for sent in harness.asked] == ["run_1-1"]

    play(scene)


def test_a_reply_that_came_before_a_deadline_is_in_time_however_busy_the_process_is() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        await loop.settle(9 * SECOND_NS)
        harness.reply(1)
        loop.let_pass_ns(5 * SECOND_NS)
        await loop.settle()
        assert harness.kinds()[2:] == ["ReplyArrived"]
        assert harness.steps[-1].at_ns == pytest.approx(9 * SECOND_NS, abs=10_000)

    play(scene)


def test_replies_are_heard_while_a_plan_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    may_go_on = ThreadEvent()

    plan = PlanCache.plan

    def plan_late(plans: PlanCache, *arguments: Any) -> Any:  # noqa: ANN401 - as the planner has it
        may_go_on.wait(loops.GUARD_S)
        return plan(plans, *arguments)

    monkeypatch.setattr(PlanCache, "plan", plan_late)

    async def scene() -> None:
        harness = Harness(Stage(MODEL, LoopbackHub().join))
        harness.open_driver()
        await asyncio.sleep(0)  # those who came learn of each other
        harness.prepare()
        await harness.until(lambda: bool(harness.messages))
        harness.say(Go("run_1"))
        await harness.until(lambda: bool(harness.steps))
        harness.replies.publish({"data": '{"measured": {"temperature": 7}}'})
        await harness.until(lambda: len(harness.steps) == 2)
        may_go_on.set()
        await harness.until(lambda: bool(harness.asked))
        assert harness.kinds() == ["GoalGiven", "Measured", "PlanAnswered"]
        await harness.node.close()

    loops.run(scene())


def test_a_planner_that_breaks_refuses_its_run_and_no_other(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    plan, has_begun, may_break = PlanCache.plan, ThreadEvent(), ThreadEvent()
    asked: list[object] = []

    def plan_once(plans: PlanCache, *arguments: Any) -> Any:  # noqa: ANN401 - as the planner has it
        asked.append(arguments)
        has_begun.set()
        if len(asked) < 3:
            may_break.wait(loops.GUARD_S)
            raise MemoryError("full")
        return plan(plans, *arguments)

    monkeypatch.setattr(PlanCache, "plan", plan_once)

    async def scene() -> None:
        harness = Harness(Stage(MODEL, LoopbackHub().join))
        harness.open_driver()
        await asyncio.sleep(0)  # those who came learn of each other
        for run in ("run_1", "run_2", "run_3"):
            harness.prepare(run)
            harness.say(Go(run))
            await harness.until(lambda run=run: any(step.run == run for step in harness.steps))  # type: ignore[misc]
            await asyncio.to_thread(has_begun.wait, loops.GUARD_S)  # else it would never be begun
            if run == "run_2":  # the plan of the run before breaks in this one
                may_break.set()
                await harness.until(lambda: any(isinstance(sent, Refused) for sent in harness.messages))
        await harness.until(lambda: bool(harness.asked))
        refused = [sent for sent in harness.messages if isinstance(sent, Refused)]
        assert [sent.run for sent in refused] == ["run_2"]
        assert harness.stage.complaints == [refused[0].why]
        wording(refused[0].why)
        assert harness.asked[0]["id"] == "run_3-1"
        await harness.node.close()

    loops.run(scene())


def test_a_plan_for_a_run_that_is_over_is_given_to_no_other() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.prepare()
        await loop.settle()
        harness.say(Go("run_1"))
        harness.say(Abandon("run_1"))
        harness.prepare("run_2")
        harness.say(Go("run_2"))
        await loop.settle()
        assert PlanAnswered.__name__ not in harness.kinds("run_1")
        assert harness.kinds("run_2") == ["GoalGiven", "PlanAnswered"]
        assert ReplyArrived.__name__ not in harness.kinds("run_2")

    play(scene)


def test_a_reply_to_a_run_that_was_never_here_is_reported() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        await going(harness, loop)
        harness.reply(1, "run_zz")
        await loop.settle()
        (messages,) = harness.stage.complaints
        assert "`run_zz-1`" in messages
        harness.prepare("run_2")
        await loop.settle()
        harness.reply(1)  # late, which is no fault of anybody's
        await loop.settle()
        assert harness.stage.complaints == [messages]

    play(scene)


# drivers that are not there


SERVICE = "{service: {name: /scan, type: std_srvs/srv/Trigger}}"
BOUND = read_bindings(f"bindings_of: scan_cell\nresources: {{scan: {SERVICE}}}\n", MODEL)
SCAN = Service("/scan", TRIGGER)


@dataclass
class Looking:
    """A controller whose `scan` is real, and its reports about the driver."""

    loop: VirtualLoop

    def __post_init__(self) -> None:
        self.stage = Stage.virtual(BOUND, self.loop)
        self.node = ControllerNode(self.stage.context("controller", ["scan"]))
        self.other = Membership(self.stage.join("tester"), TOPICS, new_status("tester", BOUND, "d" * 64))

    def serve(self, type_: ServiceDefinition = TRIGGER) -> Bus:
        driver = self.stage.join("driver")
        driver.serve(Service(SCAN.name, type_), lambda _: {"success": True, "message": ""})
        return driver

    async def messages(self, after_ns: int = SECOND_NS) -> tuple[int, int]:
        """How many troubles everybody knows of, and how many of them no waiting mends."""
        await self.loop.settle(after_ns)
        controller = self.other.controller()
        assert controller is not None
        kinds = [trouble.kind for trouble in controller.troubles]
        return len(kinds), kinds.count(UnmatchedKind.MISMATCH)


def look(scene: Callable[[Looking], Awaitable[None]]) -> None:
    async def main(loop: VirtualLoop) -> None:
        looking = Looking(loop)
        await scene(looking)
        await looking.node.close()

    run_virtually(main)


def test_a_driver_that_is_lost_is_reported_and_so_is_one_that_comes_back() -> None:
    async def scene(looking: Looking) -> None:
        messages = [await looking.messages()]
        driver = looking.serve()
        messages.append(await looking.messages())
        await driver.close()
        messages.append(await looking.messages())
        looking.serve()
        messages.append(await looking.messages())
        assert messages == [(1, 0), (0, 0), (1, 0), (0, 0)]

    look(scene)


def test_a_driver_that_does_not_go_with_its_binding_is_reported_unless_it_is_replaced_at_once() -> None:
    async def scene(looking: Looking) -> None:
        driver = looking.serve(SET_BOOL)
        messages = [
            await looking.messages(JOINS_NS),
            await looking.messages(SECOND_NS // 5),
            await looking.messages(SECOND_NS),
        ]
        await driver.close()
        messages.append(await looking.messages())
        assert messages == [(1, 0), (1, 0), (1, 1), (1, 0)]

    look(scene)


def test_missing_nodes_are_reported_with_the_reason_whenever_they_change(wording: Wording) -> None:
    async def scene(looking: Looking) -> None:
        sent = looking.stage.output
        await looking.loop.settle(SECOND_NS // 4)
        assert sent == []  # who is there is found out first
        await looking.loop.settle(5 * SECOND_NS)
        wrong = looking.serve(SET_BOOL)
        await looking.loop.settle(5 * SECOND_NS)
        await wrong.close()
        driver = looking.serve()
        await looking.loop.settle(5 * SECOND_NS)
        await driver.close()
        await looking.loop.settle(5 * SECOND_NS)
        missing, _mismatch, _there, _all_there, _gone, again = sent
        assert missing == again
        wording(sent)

    look(scene)


def test_what_could_not_be_reported_is_reported_again(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    publish_troubles, is_full = Membership.publish_troubles, [True]

    def report_if_possible(membership: Membership, troubles: tuple[Trouble, ...]) -> None:
        if is_full[0]:
            raise BusError("full")
        publish_troubles(membership, troubles)

    async def scene(looking: Looking) -> None:
        driver = looking.serve()
        assert await looking.messages() == (0, 0)
        monkeypatch.setattr(Membership, "publish_troubles", report_if_possible)
        await driver.close()
        assert await looking.messages(SECOND_NS // 4) == (0, 0)
        (complaint,) = looking.stage.complaints
        wording(complaint)
        is_full[0] = False
        assert await looking.messages() == (1, 0)

    look(scene)


# searches that are cancelled


DIGITS = "\n".join(f"  d{number}: {{domain: 0..9, initial: 0}}" for number in range(20))
COUNTS = "\n".join(
    f"  count_{n}: {{pre: {{g: d{n} < 9, a: [d{n} += 1]}}, post: {{g: true, a: []}}}}" for n in range(20)
)
ENDLESS = read_model(
    f"""behavior_model: endless
variables:
{DIGITS}
operations:
{COUNTS}
goals: {{all: {" && ".join(f"d{n} == 9" for n in range(20))}, one: d0 == 1}}
"""
)
"""No search sees all of its states; to one of its goals it is one step."""


@pytest.mark.longer
@pytest.mark.parametrize("how", ["abandon", "end", "tester", "close"])
def test_a_search_that_nobody_waits_for_any_more_is_stopped(how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plan, has_begun, has_ended = PlanCache.plan, ThreadEvent(), ThreadEvent()
    ends: list[BaseException] = []

    def plan_and_report(plans: PlanCache, *arguments: Any) -> Any:  # noqa: ANN401 - as the planner has it
        has_begun.set()
        try:
            return plan(plans, *arguments)
        except BaseException as error:
            ends.append(error)
            raise
        finally:
            has_ended.set()

    monkeypatch.setattr(PlanCache, "plan", plan_and_report)

    async def scene() -> None:
        stage = Stage(ENDLESS, LoopbackHub().join)
        harness = Harness(stage, ENDLESS, PlanLimits(length=10**9, expansions=10**15))
        unhandled: list[object] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: unhandled.append(context))
        await asyncio.sleep(0)  # those who came learn of each other
        options = RunnerOptions(time_limit_ns=SECOND_NS // 10) if how == "end" else RunnerOptions()
        harness.prepare(case=read_case("case: far\ngoal: all\n", ENDLESS), options=asdict(options))
        harness.say(Go("run_1"))
        await asyncio.to_thread(has_begun.wait, loops.GUARD_S)
        match how:
            case "abandon":
                harness.say(Abandon("run_1"))
            case "end":
                await harness.until(lambda: harness.ended() == ["run_1"])
            case "tester":
                await harness.tester.close()
            case _:
                await harness.node.close()
        assert await asyncio.to_thread(has_ended.wait, loops.GUARD_S)
        assert [type(error) for error in ends] == [SearchCancelledError]
        if how in ("abandon", "end"):
            harness.prepare("run_2", case=read_case("case: near\ngoal: one\n", ENDLESS))
            harness.say(Go("run_2"))
            await harness.until(lambda: harness.ended() == ["run_1", "run_2"])
        await harness.node.close()
        gc.collect()
        assert (unhandled, harness.stage.complaints) == ([], [])

    loops.run(scene())


def test_a_search_that_was_stopped_as_its_run_was_over_is_nothing_to_log(monkeypatch: pytest.MonkeyPatch) -> None:
    async def main(loop: VirtualLoop) -> None:
        unhandled: list[object] = []
        loop.set_exception_handler(lambda _, context: unhandled.append(context))
        searches: list[asyncio.Future[Any]] = [loop.create_future()]
        monkeypatch.setattr(loop, "run_in_executor", lambda *_: searches[0])
        harness = Harness(Stage.virtual(MODEL, loop))
        harness.open_driver()
        await loop.settle()
        harness.prepare(options=asdict(RunnerOptions(time_limit_ns=SECOND_NS)))
        harness.say(Go("run_1"))
        await loop.settle(2 * SECOND_NS)
        assert harness.ended() == ["run_1"]
        searches.pop().set_exception(SearchCancelledError())
        await loop.settle()
        assert harness.stage.complaints == []
        del harness  # not closed: that would cancel the search, and of what is cancelled a loop logs nothing
        gc.collect()
        assert unhandled == []

    run_virtually(main)
