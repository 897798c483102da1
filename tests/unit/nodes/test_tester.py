"""The tester waits for a whole cell, follows a run step by step, and calls lost whatever it cannot be sure of."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, TypeAlias

import pytest
from msgspec import structs
from msgspec.structs import replace

from scbm.cases import LOST, Case
from scbm.cases.trace import End, ResourceChanged
from scbm.files import digest_of, read_case, write_case
from scbm.nodes import Lack, LostError, NodeRun, NotBegunError, NotReadyError, Reason, TesterNode, new_status
from scbm.nodes.buses.bus import BusError, Received, UnmatchedKind
from scbm.nodes.node_messages import (
    Abandon,
    Answering,
    Busy,
    Ended,
    Forgot,
    Go,
    Message,
    Note,
    Prepare,
    Prepared,
    React,
    Refused,
    RestartResource,
    Status,
    Stepped,
    Trouble,
    decode,
    encode,
)
from scbm.nodes.roles.cell_topics import GIVEN_UP, CellTopics
from scbm.running import (
    Event,
    GoalGiven,
    InjectionGiven,
    PlanAnswered,
    PlanStatus,
    Program,
    ReplyArrived,
    RunnerOptions,
)
from scbm.running.simulation import Choices, PlainReactions
from scbm.testing import Tester
from scbm.testing.event_logs.event_log import replay
from scbm.testing.event_logs.event_records import OptionsRecord, PlanRecord, TimeRecord, event_record
from support.models import scan_cell
from support.nodes import JOINS_NS, Stage, repeat_status, run_case
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

MODEL = scan_cell(("measures: [temperature]", "measures: [temperature]\n    simulation: {latency: 2 s}"))
TOPICS = CellTopics.of(MODEL)
CASE = read_case("case: scans\ngoal: scanned\n", MODEL)
RESTARTS = read_case(
    "case: restarts\ngoal: scanned\nnetwork: {restarts: [{resource: scan, at: 2 s, for: 1 s}]}\n", MODEL
)
SECOND_NS = 10**9
OPTIONS = RunnerOptions()


def choices(case: Case = CASE) -> Choices:
    return Choices(PlainReactions(), case.outcomes, case.network)


@dataclass
class Harness:
    """A tester, and everybody else of its cell played by a test."""

    stage: Stage
    scale: Fraction = Fraction(1)
    heard: list[Message] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.node = self.stage.tester(self.scale)

    def play(self, role: str, *resources: str, **other: Any) -> Played:  # noqa: ANN401 - fields
        status = structs.replace(new_status(role, MODEL, digest_of(MODEL), resources), **other)
        return Played(self, status)

    def cell(self) -> tuple[Played, Played]:
        return self.play("controller"), self.play("resources", "scan")

    def begin(self, case: Case = CASE) -> asyncio.Task[NodeRun]:
        return asyncio.ensure_future(self.node.run(case, choices(case), OPTIONS))

    def sent(self, kind: type) -> list[Any]:
        return [message for message in self.heard if isinstance(message, kind)]


class Played:
    """A node that says who it is, and what a test lets it say."""

    def __init__(self, harness: Harness, status: Status) -> None:
        self.harness = harness
        self.status = status
        self.prepared: list[Prepare] = []
        self.heard: list[Message] = []
        self.is_ready = True
        self.bus = harness.stage.join(status.role)
        self.speaks = self.bus.publisher(TOPICS.run if status.role == "controller" else TOPICS.simulated)
        self.bus.subscribe(TOPICS.case, self._hear)
        repeat_status(self.bus, lambda: self.status)

    def _hear(self, received: Received) -> None:
        message = decode(received.message.data)
        self.heard.append(message)
        if self.status.role == "controller":
            self.harness.heard.append(message)
        if isinstance(message, Prepare) and self.status.node in message.nodes:
            self.prepared.append(message)
            if self.is_ready:
                self.say(Prepared(message.run, self.status.node))

    @property
    def run(self) -> str:
        return self.prepared[-1].run

    def say(self, message: Message) -> None:
        self.speaks.publish({"data": encode(message)})

    def step(self, number: int, at_ns: int, event: Event | ResourceChanged) -> None:
        self.say(Stepped(self.run, number, at_ns, event_record(event)))

    def begin_run(self) -> None:
        """The goal and a plan: the first request is sent."""
        self.step(1, 0, GoalGiven(CASE.goal, CASE.predicate))
        self.step(2, 0, PlanAnswered(1, PlanStatus.SOLVED, ("scan_box",)))


def play(scene: Callable[[Harness, VirtualLoop], Awaitable[None]], scale: Fraction = Fraction(1)) -> None:
    async def main(loop: VirtualLoop) -> None:
        await scene(Harness(Stage.virtual(MODEL, loop), scale), loop)

    run_virtually(main)


async def why_lost(task: asyncio.Task[NodeRun]) -> str:
    with pytest.raises(LostError) as lost:
        await task
    return str(lost.value)


# the cell


Problems: TypeAlias = tuple[tuple[Lack, tuple[str, ...]], ...]
NO_CONTROLLER = (Lack.CONTROLLER, ("scan",))
UNREACHED = "`scan` is not reached: `/scan` is of another type there"
MISMATCHED = (Trouble(UnmatchedKind.MISMATCH, UNREACHED),)
NO_SCAN = (Lack.RESOURCES, ("scan",))


def problems(reasons: Iterable[Reason]) -> Problems:
    """Return what each reason is about, without its words."""
    return tuple((reason.lack, reason.resources) for reason in reasons)


def test_what_it_waits_for_is_reported_after_a_second_and_whenever_that_changes() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        reported: list[tuple[int, Problems]] = []
        begun_ns = loop.now_ns()

        def report(reasons: tuple[Reason, ...]) -> None:
            reported.append(((loop.now_ns() - begun_ns) // SECOND_NS, problems(reasons)))

        waiting = asyncio.ensure_future(harness.node.wait_for_cell(100.0, report))
        await loop.settle(SECOND_NS - 1_000)
        assert reported == []
        await loop.settle(2_000)
        assert reported == [(1, (NO_CONTROLLER,))]
        harness.play("resources", "other")  # which changes nothing
        await loop.settle(2 * SECOND_NS)
        harness.play("controller")
        await loop.settle(2 * SECOND_NS)
        assert reported == [(1, (NO_CONTROLLER,)), (3, (NO_SCAN,))]
        harness.play("resources", "scan")
        await waiting

    play(scene)


def test_who_comes_within_a_second_is_not_reported() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        reported: list[tuple[Reason, ...]] = []
        waiting = asyncio.ensure_future(harness.node.wait_for_cell(100.0, reported.append))
        await loop.settle(SECOND_NS // 2)
        harness.cell()
        await waiting
        await loop.settle(10 * SECOND_NS)
        assert reported == []

    play(scene)


def test_it_waits_until_everybody_is_there() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        waiting = asyncio.ensure_future(harness.node.wait_for_cell(10.0))
        await loop.settle(SECOND_NS)
        harness.play("controller")
        await loop.settle(SECOND_NS)
        assert not waiting.done()
        harness.play("resources", "scan")
        await loop.settle(JOINS_NS)
        assert waiting.done()
        waiting.result()

    play(scene)


@pytest.mark.parametrize(
    ("others", "reasons"),
    [
        ([], (NO_CONTROLLER,)),
        ([("resources", "scan")], ((Lack.CONTROLLER, ()),)),
        ([("controller",)], (NO_SCAN,)),
        ([("controller",), ("resources", "other")], (NO_SCAN,)),
    ],
)
def test_after_that_it_says_who_is_missing(others: list[tuple[str, ...]], reasons: Problems, wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        for role, *resources in others:
            harness.play(role, *resources)
        begun_ns = loop.now_ns()
        with wording.raises(NotReadyError) as raised:
            await harness.node.wait_for_cell(3.0)
        assert problems(raised.value.reasons) == reasons
        assert loop.now_ns() - begun_ns == 3 * SECOND_NS

    play(scene)


@pytest.mark.parametrize(
    ("role", "fields", "lack"),
    [
        ("controller", {"version": 99, "words": "far"}, Lack.VERSION),
        ("controller", {"digest": "other", "words": "far"}, Lack.MODEL),
        ("resources", {"digest": "other", "words": "far"}, Lack.MODEL),
        ("controller", {"troubles": MISMATCHED}, Lack.BINDING),
        ("tester", {"since_ns": 1, "words": "far"}, Lack.RIVAL),
        ("controller", {"troubles": (Trouble(UnmatchedKind.OTHER_VENDOR, UNREACHED),)}, Lack.VENDOR),
    ],
    ids=lambda value: value.name if isinstance(value, Lack) else None,
)
def test_what_no_waiting_mends_is_reported_at_once(
    role: str, fields: dict[str, Any], lack: Lack, wording: Wording
) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.play(role, *(["scan"] if role == "resources" else []), **fields)
        if role == "resources":
            harness.play("controller")
        with wording.raises(NotReadyError) as raised:
            await harness.node.wait_for_cell(1_000.0)
        assert [other.lack for other in raised.value.reasons] == [lack]
        assert loop.now_ns() < 2 * SECOND_NS

    play(scene)


def test_an_unknown_sender_that_cannot_be_understood_is_reported(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.stage.join("old").publisher(TOPICS.status).publish({"data": '{"kind": "status", "role": "controller"}'})
        with wording.raises(NotReadyError) as raised:
            await harness.node.wait_for_cell(1.0)
        assert problems(raised.value.reasons) == (NO_CONTROLLER, (Lack.UNREADABLE, ()))
        assert loop.now_ns() > SECOND_NS

    play(scene)


@pytest.mark.parametrize("kind", UnmatchedKind)
def test_a_trouble_of_each_kind_is_a_lack(kind: UnmatchedKind) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.play("controller", "scan", troubles=(Trouble(kind, UNREACHED),))
        await loop.settle(JOINS_NS)
        assert harness.node.lacks() == (UNREACHED,)

    play(scene)


def test_what_the_controller_lacks_is_missing() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.play("controller", "scan", troubles=(Trouble(UnmatchedKind.ABSENT, UNREACHED),))
        await loop.settle(JOINS_NS)
        assert harness.node.real == ("scan",)
        begun_ns = loop.now_ns()
        with pytest.raises(NotReadyError) as raised:
            await harness.node.wait_for_cell(1.0)
        assert loop.now_ns() - begun_ns == SECOND_NS  # it might have come
        assert raised.value.reasons == (Reason(Lack.DRIVER, UNREACHED),)

    play(scene)


def test_real_resources_cannot_be_made_faster_nor_given_outcomes(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.play("controller", "scan")
        await loop.settle(JOINS_NS)
        with wording.raises(NotReadyError):
            await harness.node.wait_for_cell(1.0)
        case = read_case("case: x\ngoal: scanned\noutcomes: {scan: fail}\n", MODEL)
        wording(await why_lost(harness.begin(case)))
        of_operation = read_case("case: x\ngoal: scanned\noutcomes: {scan_box: fail}\n", MODEL)
        wording(await why_lost(harness.begin(of_operation)))
        wording(await why_lost(harness.begin(RESTARTS)))

    play(scene, Fraction(2))


# preparing


def test_all_are_sent_the_case_and_the_run_begins_once_all_are_ready() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources = harness.cell()
        resources.is_ready = False
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle(SECOND_NS)
        assert harness.sent(Go) == []
        first = controller.prepared[0]
        assert (first.case, first.options) == (write_case(CASE, MODEL, None), OptionsRecord.of(OPTIONS))
        assert (first.time_scale, first.is_relayed) == ("5/2", False)
        assert first.nodes == (controller.status.node, resources.status.node)
        assert len(controller.prepared) == 1  # who is ready is not asked again
        assert len(resources.prepared) > 5
        resources.is_ready = True
        await loop.settle(SECOND_NS)
        assert harness.sent(Go) == [Go(controller.run)]
        task.cancel()

    play(scene, Fraction(5, 2))


def test_a_node_that_refuses_loses_the_case(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _ = harness.cell()
        controller.is_ready = False
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle()
        controller.say(Refused(controller.run, controller.status.node, "it is too late"))
        wording(await why_lost(task))
        await loop.settle()
        assert harness.sent(Abandon) == [Abandon(controller.run)]

    play(scene)


def test_a_node_that_serves_another_tester_is_asked_until_it_drops_that_one(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources = harness.cell()
        resources.is_ready = False
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle()
        for seconds in range(12):
            resources.say(Busy(controller.run, resources.status.node, "process 7 on a", seconds * SECOND_NS))
            await loop.settle(SECOND_NS)
        assert not task.done()
        resources.is_ready = True
        await loop.settle(SECOND_NS)
        assert harness.sent(Go) == [Go(controller.run)]
        task.cancel()
        wording(harness.stage.complaints)

    play(scene)


def test_a_node_that_serves_another_tester_for_long_loses_the_case(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _ = harness.cell()
        controller.is_ready = False
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle()
        controller.say(Busy(controller.run, controller.status.node, "process 7 on a", 12 * SECOND_NS))
        begun_ns = loop.now_ns()
        wording(await why_lost(task))
        assert round((loop.now_ns() - begun_ns) / SECOND_NS) == 15

    play(scene)


@pytest.mark.parametrize("silent", ["controller", "resources"])
def test_a_node_that_says_nothing_loses_the_case(silent: str, wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources = harness.cell()
        (controller if silent == "controller" else resources).is_ready = False
        await loop.settle(JOINS_NS)
        wording(await why_lost(harness.begin()))
        await loop.settle()
        assert len(harness.sent(Abandon)) == 1

    play(scene)


@pytest.mark.parametrize("role", ["controller", "resources"])
def test_who_goes_while_the_run_is_prepared_is_waited_for(role: str) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources = harness.cell()
        lost = controller if role == "controller" else resources
        resources.is_ready = False
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle(SECOND_NS)
        await lost.bus.close()
        resources.is_ready = True
        await loop.settle(SECOND_NS)
        assert harness.sent(Go) == []
        harness.play(role, *lost.status.resources)
        await loop.settle(SECOND_NS)
        assert len(dict.fromkeys(harness.sent(Go))) == 1
        task.cancel()

    play(scene)


def test_who_does_not_come_back_loses_the_case(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources = harness.cell()
        resources.is_ready = False
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle(SECOND_NS)
        await controller.bus.close()
        wording(await why_lost(task))

    play(scene)


def test_a_run_that_no_controller_has_begun_may_begin_with_another(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources = harness.cell()
        resources.is_ready = False
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle(SECOND_NS)
        await controller.bus.close()
        with wording.raises(NotBegunError):
            await task

    play(scene)


def test_a_controller_that_forgets_the_run_before_it_goes_is_asked_again() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources = harness.cell()
        resources.is_ready = False
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle()
        controller.is_ready = False
        controller.say(Forgot(controller.run, controller.status.node))
        resources.is_ready = True
        await loop.settle(SECOND_NS)
        assert len(controller.prepared) > 5
        assert harness.sent(Go) == []
        await controller.bus.close()
        harness.play("controller")
        await loop.settle(SECOND_NS)
        assert len(dict.fromkeys(harness.sent(Go))) == 1
        task.cancel()

    play(scene)


@pytest.mark.parametrize("how", ["forgets", "is-lost"])
def test_a_controller_that_leaves_instead_of_going_has_not_begun_the_run(how: str, wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _ = harness.cell()
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle()
        assert harness.sent(Go) == [Go(controller.run)]
        begun_ns = loop.now_ns()
        if how == "forgets":
            controller.say(Forgot(controller.run, controller.status.node))
        else:
            await controller.bus.close()
        with wording.raises(NotBegunError):
            await task
        assert loop.now_ns() - begun_ns < SECOND_NS  # not the silence is noticed
        await loop.settle()
        assert how == "is-lost" or harness.sent(Abandon) == [Abandon(controller.run)]

    play(scene)


# running


async def going(harness: Harness, loop: VirtualLoop, case: Case = CASE) -> tuple[Played, Played, asyncio.Task[NodeRun]]:
    controller, resources = harness.cell()
    await loop.settle(JOINS_NS)
    task = harness.begin(case)
    await loop.settle()
    assert harness.sent(Go) == [Go(controller.run)]
    controller.begin_run()
    await loop.settle()
    return controller, resources, task


def test_what_becomes_of_each_request_is_reported_once_it_is_sent() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources, task = await going(harness, loop)
        (react,) = [message for message in resources.heard if isinstance(message, React)]
        expected = PlainReactions().react(MODEL.resources[0])
        assert (react.run, react.request, react.latency_ns) == (controller.run, 1, expected.latency_ns)
        task.cancel()

    play(scene)


def test_restarts_of_the_case_happen_at_their_times_of_the_run() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        _, resources, task = await going(harness, loop, RESTARTS)
        await loop.settle(SECOND_NS - 10_000)
        assert harness.sent(RestartResource) == []
        await loop.settle(10_000)
        assert [message.is_down for message in harness.sent(RestartResource)] == [True]
        await loop.settle(SECOND_NS // 2)
        assert [message.is_down for message in resources.heard if isinstance(message, RestartResource)] == [True, False]
        assert [note.note.condition for note in harness.sent(Note)] == ["down", "well"]
        task.cancel()

    play(scene, Fraction(2))


def test_the_run_ends_with_the_trace_that_the_steps_give() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        stage = harness.stage
        stage.controller()
        stage.resources()
        await harness.node.wait_for_cell(1.0)
        execution = await run_case(harness.node, Tester(MODEL), CASE)
        simulated = Tester(MODEL).execute(CASE)
        assert (execution.trace, execution.reactions) == (simulated.trace, simulated.reactions)
        log = execution.log
        assert log is not None
        assert (log.time_scale, log.digest, log.end) == (Fraction(1), digest_of(MODEL), End.REACHED)
        assert loop.now_ns() > simulated.ended_ns

    play(scene)


INJECTION = read_case(
    "case: x\ngoal: scanned\ninjections: [{name: x, set: {plan.state: aborted}}]\n", MODEL
).injections[0]


def finish(controller: Played, trace: str, steps: int = 3) -> None:
    controller.step(3, SECOND_NS, ReplyArrived(1, succeeded=True))
    controller.say(Ended(controller.run, steps, trace, "canonical 1"))


def give_up(controller: Played, number: int) -> None:
    controller.step(number, 5, InjectionGiven(replace(INJECTION, name=GIVEN_UP)))


@pytest.mark.parametrize(
    "play_on",
    [
        pytest.param(lambda node: finish(node, "0" * 64), id="other-trace"),
        pytest.param(lambda node: finish(node, "0" * 64, 4), id="too-few-steps"),
        pytest.param(lambda node: node.say(Ended(node.run, 2, "", "canonical 1")), id="ended-early"),
        pytest.param(lambda node: node.step(4, 5, ReplyArrived(1, succeeded=True)), id="step-left-out"),
        pytest.param(lambda node: node.step(2, 5, ReplyArrived(1, succeeded=True)), id="step-twice"),
        pytest.param(
            lambda node: node.say(Stepped(node.run, 3, 5, PlanRecord(2, "solved", ("fly",)))), id="no-operation"
        ),
        pytest.param(lambda node: give_up(node, 3), id="given-up"),
    ],
)
def test_a_run_that_cannot_be_followed_is_lost(play_on: Callable[[Played], None], wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _, task = await going(harness, loop)
        play_on(controller)
        wording(await why_lost(task))
        await loop.settle()
        assert harness.sent(Abandon) == [Abandon(controller.run)]

    play(scene)


@pytest.mark.parametrize(("steps", "may_begin_again"), [(1, True), (2, False)])
def test_a_run_that_is_given_up_may_begin_again_if_it_has_sent_no_request(
    steps: int, wording: Wording, *, may_begin_again: bool
) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _ = harness.cell()
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle()
        controller.step(1, 0, GoalGiven(CASE.goal, CASE.predicate))
        if steps == 2:
            controller.step(2, 0, PlanAnswered(1, PlanStatus.SOLVED, ("scan_box",)))
        give_up(controller, steps + 1)
        with wording.raises(LostError) as lost:
            await task
        assert isinstance(lost.value, NotBegunError) == may_begin_again

    play(scene)


def test_a_controller_that_is_lost_after_its_first_step_has_begun_the_run(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _ = harness.cell()
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle()
        controller.step(1, 0, GoalGiven(CASE.goal, CASE.predicate))
        await controller.bus.close()
        with wording.raises(LostError) as lost:
            await task
        assert not isinstance(lost.value, NotBegunError)

    play(scene)


def test_time_that_runs_backwards_makes_no_sense(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _, task = await going(harness, loop)
        controller.step(3, SECOND_NS, ResourceChanged(SECOND_NS, "network", "scan", "down"))
        controller.step(4, SECOND_NS, ReplyArrived(9, succeeded=True))
        controller.step(5, 1, ReplyArrived(1, succeeded=True))
        wording(await why_lost(task))

    play(scene)


def test_steps_of_another_run_are_nothing() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources, task = await going(harness, loop)
        controller.say(Stepped("run_0", 7, 5, TimeRecord()))
        controller.say(Ended("run_0", 2, "", "canonical 1"))
        resources.say(Prepared("run_0", "x"))
        await loop.settle(SECOND_NS)
        assert not task.done()
        task.cancel()

    play(scene)


def test_a_controller_that_is_lost_loses_the_case(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _, task = await going(harness, loop)
        await controller.bus.close()
        wording(await why_lost(task))

    play(scene)


def test_a_run_that_ends_without_its_resource_is_lost_with_its_log() -> None:
    limited = read_case("case: x\ngoal: scanned\nlimits: {time: 20 s}\n", MODEL)

    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        stage = harness.stage
        stage.controller()
        resources = stage.resources()
        lost = stage.contexts["resources"].bus
        await harness.node.wait_for_cell(1.0)
        task = asyncio.ensure_future(run_case(harness.node, Tester(MODEL), limited))
        await loop.settle(SECOND_NS // 2)
        await resources.close()
        await lost.close()
        with pytest.raises(LostError) as raised:
            await task
        partial = raised.value.partial
        assert partial is not None
        assert (partial.log.end, len(partial.log.reactions)) == (End.LOST, 2)
        assert replay(partial.log, Program(MODEL)) == partial.run.records

    play(scene)


def test_a_controller_that_says_nothing_is_lost_even_if_it_is_there(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.cell()
        await loop.settle(JOINS_NS)
        begun_ns = loop.now_ns()
        wording(await why_lost(harness.begin()))
        assert loop.now_ns() - begun_ns == pytest.approx(3 * SECOND_NS, abs=SECOND_NS)

    play(scene)


def test_a_message_that_the_bus_does_not_take_loses_the_case(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        harness.cell()
        await loop.settle(JOINS_NS)

        def refuse(_: object) -> None:
            raise BusError("full")

        monkeypatch.setattr(harness.node._to_all, "publish", refuse)
        with wording.raises(LostError):
            await harness.begin()
        of_prepare, of_abandon = harness.stage.complaints
        assert ("`prepare`" in of_prepare, "`abandon`" in of_abandon) == (True, True)
        wording(harness.stage.complaints)

    play(scene)


def test_it_may_say_nothing_until_a_deadline_of_its_run_has_passed(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        _, _, task = await going(harness, loop)
        await loop.settle(12 * SECOND_NS)
        assert not task.done()
        wording(await why_lost(task))

    play(scene)


def test_resources_that_are_lost_are_no_reason_to_stop_and_reported(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        _, resources, task = await going(harness, loop)
        await resources.bus.close()
        await loop.settle(5 * SECOND_NS)
        assert not task.done()
        assert len(harness.stage.complaints) == 1
        harness.play("resources", "scan")
        await loop.settle(JOINS_NS)
        assert len(harness.stage.complaints) == 2
        wording(harness.stage.complaints)
        task.cancel()

    play(scene)


def test_a_driver_that_is_lost_in_a_run_is_reported(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller = harness.play("controller", "scan")
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle()
        assert harness.sent(Go) == [Go(controller.run)]
        controller.status = structs.replace(controller.status, troubles=(Trouble(UnmatchedKind.ABSENT, UNREACHED),))
        await loop.settle(JOINS_NS)
        (reported,) = harness.stage.complaints
        assert reported.startswith(UNREACHED)
        wording(reported)
        task.cancel()

    play(scene)


def test_a_run_that_ends_short_of_its_goal_while_nobody_simulates_a_resource_is_lost(wording: Wording) -> None:
    limited = read_case("case: x\ngoal: scanned\nlimits: {time: 20 s}\n", MODEL)

    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        stage = harness.stage
        stage.controller()
        resources = stage.resources()
        lost = stage.contexts["resources"].bus
        await harness.node.wait_for_cell(1.0)
        task = asyncio.ensure_future(run_case(harness.node, Tester(MODEL), limited))
        await loop.settle(SECOND_NS // 2)
        await resources.close()
        await lost.close()
        with wording.raises(LostError):
            await task

    play(scene)


def test_a_controller_that_comes_with_other_real_resources_loses_the_case(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources = harness.cell()
        resources.is_ready = False
        await loop.settle(JOINS_NS)
        task = harness.begin()
        await loop.settle(SECOND_NS)
        await controller.bus.close()
        harness.play("controller", "scan")
        wording(await why_lost(task))

    play(scene)


def test_a_node_that_joins_late_is_prepared_and_sent_what_holds() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources, task = await going(harness, loop, RESTARTS)
        await loop.settle(int(2.3 * SECOND_NS))
        await resources.bus.close()
        await loop.settle()
        late = harness.play("resources", "scan")
        await loop.settle(JOINS_NS + SECOND_NS // 4)
        assert [prepare.run for prepare in late.prepared] == [controller.run]
        kinds = [message.kind for message in late.heard if not isinstance(message, Prepare | Note)]
        assert kinds == ["go", "restart", "react"]
        task.cancel()

    play(scene)


def test_a_node_that_has_forgotten_the_run_is_prepared_again_and_sent_what_holds() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources, task = await going(harness, loop, RESTARTS)
        await loop.settle(int(2.5 * SECOND_NS))
        resources.heard.clear()
        resources.say(Forgot(controller.run, resources.status.node))
        await loop.settle(SECOND_NS // 4)
        assert [message.kind for message in resources.heard] == ["prepare", "go", "restart", "react"]
        assert len(resources.prepared) == 2
        assert len(controller.prepared) == 1
        task.cancel()

    play(scene)


def test_another_controller_that_leaves_ends_nothing() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        _, _, task = await going(harness, loop)
        late = harness.play("controller")
        await loop.settle(SECOND_NS)
        await late.bus.close()
        await loop.settle(SECOND_NS)
        assert not task.done()
        task.cancel()

    play(scene)


@pytest.mark.parametrize("role", ["tester", "controller", "resources"])
def test_one_status_ends_no_run(role: str) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        _, _, task = await going(harness, loop)
        forged = structs.replace(new_status(role, MODEL, "other", ["scan"]), since_ns=0, troubles=MISMATCHED)
        harness.stage.join("forger").publisher(TOPICS.status).publish({"data": encode(forged)})
        await loop.settle(SECOND_NS)
        assert not task.done()
        assert harness.stage.complaints == []
        task.cancel()

    play(scene)


def test_an_older_tester_that_shows_up_in_a_run_ends_it(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        _, _, task = await going(harness, loop)
        older = harness.play("tester", since_ns=0, words="process 7 on harness")
        await loop.settle(JOINS_NS)
        wording(await why_lost(task))
        await older.bus.close()

    play(scene)


def test_a_run_that_was_lost_restarts_nothing_any_more() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _, task = await going(harness, loop, RESTARTS)
        await controller.bus.close()
        await why_lost(task)
        late = harness.play("controller")
        await loop.settle(5 * SECOND_NS)
        assert [message for message in late.heard if isinstance(message, RestartResource | Note)] == []

    play(scene)


def test_a_case_that_is_cancelled_is_abandoned() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, _, task = await going(harness, loop)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        await loop.settle()
        assert harness.sent(Abandon) == [Abandon(controller.run)]

    play(scene)


def test_answers_to_nothing_are_dropped_with_a_sentence(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        controller, resources, task = await going(harness, loop)
        for request, resource in ((0, "scan"), (5, "scan"), (1, "another")):
            resources.say(Answering(controller.run, request, resource, 1))
        resources.speaks.publish({"data": "what"})
        await loop.settle()
        assert len(harness.stage.complaints) == 4
        wording(harness.stage.complaints)
        assert not task.done()
        task.cancel()

    play(scene)


# whole cells


def test_a_resource_that_is_lost_with_a_request_leaves_it_to_the_deadline_and_the_next_comes_to_its_successor(
    wording: Wording,
) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        stage = harness.stage
        stage.controller()
        first = stage.resources()
        lost = stage.contexts["resources"].bus
        await harness.node.wait_for_cell(1.0)
        tester = Tester(MODEL)
        task = asyncio.ensure_future(run_case(harness.node, tester, CASE))
        await loop.settle(SECOND_NS // 2)
        await first.close()
        await lost.close()
        await loop.settle(SECOND_NS)
        stage.resources()
        execution = await task
        assert execution.verdict.end is End.REACHED
        assert [reaction.reply for reaction in execution.reactions] == [LOST, None]
        changes = [record.condition for record in execution.trace.records if isinstance(record, ResourceChanged)]
        assert changes == ["down", "well"]
        assert len(stage.complaints) == 2
        wording(stage.complaints)

    play(scene)


def test_after_a_case_that_was_lost_the_next_one_runs_as_if_nothing_had_been(wording: Wording) -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        stage = harness.stage
        stage.controller()
        lost = stage.contexts["controller"].bus
        stage.resources()
        await harness.node.wait_for_cell(1.0)
        tester = Tester(MODEL)
        task = asyncio.ensure_future(run_case(harness.node, tester, CASE))
        await loop.settle(SECOND_NS // 2)
        await lost.close()
        with wording.raises(LostError):
            await task
        stage.controller()
        await harness.node.wait_for_cell(1.0)
        execution = await run_case(harness.node, tester, CASE)
        assert execution.trace == tester.execute(CASE).trace

    play(scene)


def test_a_node_of_another_model_is_not_heard() -> None:
    async def scene(harness: Harness, loop: VirtualLoop) -> None:
        other = scan_cell(("behavior_model: scan_cell", "behavior_model: another"))
        stage = Stage(other, harness.stage.join, harness.stage.now_ns)
        stage.controller()
        await loop.settle()
        assert harness.node.membership.others == ()
        assert isinstance(harness.node, TesterNode)

    play(scene)
