"""In wall time a deadline passes at its own time: before what came later, and behind what came before (decision 26)."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from fractions import Fraction

import pytest

from scbm.cases import Case, Injection
from scbm.cases.trace import NETWORK, End, MessageDisturbed, Record, ResourceChanged
from scbm.model import BehaviorModel
from scbm.nodes.roles.wall_clock import Clock, Driver
from scbm.running import (
    AskPlan,
    CancelRequest,
    Event,
    GoalGiven,
    InjectionGiven,
    PlanAnswered,
    PlanStatus,
    Program,
    ReplyArrived,
    RunFinished,
    RunnerOptions,
    SendRequest,
    TimePassed,
)
from scbm.running.simulation.case_runner import CaseRunner
from scbm.testing.event_logs.event_records import Note
from support.models import scan_cell
from support.virtual_loop import VirtualLoop, run_virtually

SECOND_NS = 10**9


@dataclass
class World:
    """A driver of the scanning cell, and what it wanted; plans are made at once if `plans` says so."""

    loop: VirtualLoop
    model: BehaviorModel = field(default_factory=scan_cell)
    scale: Fraction = Fraction(1)
    plans: bool = True
    sent: list[int] = field(default_factory=list)
    cancelled: list[int] = field(default_factory=list)
    asked: list[AskPlan] = field(default_factory=list)
    steps: list[tuple[int, Event | Note]] = field(default_factory=list)
    records: list[Record] = field(default_factory=list)
    ends: list[RunFinished] = field(default_factory=list)
    sent_at_the_end: list[list[int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.start_ns = self.loop.now_ns()
        clock = Clock(self.start_ns, self.scale)
        case = Case("scans", *self.model.goals[0], self.model.nominal_state)
        self.driver = Driver(CaseRunner(Program(self.model), case, RunnerOptions()), clock, self)

    def give(self, event: Event | Note, at_ns: int | None = None) -> None:
        """Something happens now, or came at a time of the run."""
        stamp_ns = self.loop.now_ns() if at_ns is None else Clock(self.start_ns, self.scale).wall_ns(at_ns)
        self.driver.give(event, stamp_ns)

    def goal(self) -> None:
        predicate = self.model.goal("scanned")
        assert predicate is not None
        self.give(GoalGiven("scanned", predicate))

    def times(self, kind: type) -> list[float]:
        return [at_ns / SECOND_NS for at_ns, event in self.steps if isinstance(event, kind)]

    def kinds(self) -> list[str]:
        return [f"{type(event).__name__} {at_ns / SECOND_NS:g}" for at_ns, event in self.steps]

    # the surroundings of the driver

    def send(self, request: SendRequest) -> None:
        self.sent.append(request.request)

    def cancel(self, request: CancelRequest) -> None:
        self.cancelled.append(request.request)

    def plan(self, asked: AskPlan) -> None:
        self.asked.append(asked)
        if self.plans:
            answer = PlanAnswered(asked.ask, PlanStatus.SOLVED, ("scan_box",))
            self.loop.call_soon(self.give, answer)

    def stepped(self, at_ns: int, event: Event | Note, records: tuple[Record, ...]) -> None:
        self.steps.append((at_ns, event))
        self.records += records

    def finished(self, end: RunFinished) -> None:
        self.ends.append(end)
        self.sent_at_the_end.append(list(self.sent))


def play(scene: Callable[[World], Awaitable[None]], scale: Fraction = Fraction(1), *, plans: bool = True) -> None:
    async def main(loop: VirtualLoop) -> None:
        await scene(World(loop, scale=scale, plans=plans))

    run_virtually(main)


@pytest.mark.parametrize("scale", [Fraction(1), Fraction(20), Fraction(1, 3)])
def test_a_deadline_passes_at_its_own_time(scale: Fraction) -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle(int(10.5 * SECOND_NS / scale))
        assert world.times(TimePassed) == [10.0]
        assert (world.sent, world.cancelled) == ([1, 2], [1])
        assert world.steps[-1][0] == 10 * SECOND_NS  # the plan of the next try is made at once

    play(scene, scale)


def test_a_deadline_passes_at_its_own_time_though_the_process_is_busy_then() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle()
        world.loop.let_pass_ns(11 * SECOND_NS)
        await world.loop.settle()
        assert world.times(TimePassed) == [10.0]
        assert world.times(PlanAnswered)[-1] == 11.000001  # it came then: that is no deadline

    play(scene)


def test_a_reply_that_came_before_a_deadline_is_in_time_though_it_is_handled_after_it() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle()
        world.loop.let_pass_ns(11 * SECOND_NS)
        world.give(ReplyArrived(1, succeeded=True), 10 * SECOND_NS - 1)
        assert world.kinds()[-1] == "ReplyArrived 10"
        assert world.times(TimePassed) == []
        assert [end.end for end in world.ends] == [End.REACHED]

    play(scene)


def test_a_reply_of_the_very_time_of_a_deadline_is_in_time() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle()
        world.loop.let_pass_ns(11 * SECOND_NS)
        world.give(ReplyArrived(1, succeeded=True), 10 * SECOND_NS)
        assert (world.times(TimePassed), len(world.ends)) == ([], 1)

    play(scene)


def test_a_deadline_passes_before_a_reply_that_came_later() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle()
        world.loop.let_pass_ns(11 * SECOND_NS)
        world.give(ReplyArrived(1, succeeded=True), 10 * SECOND_NS + 1)
        assert world.kinds()[-2:] == ["TimePassed 10", "ReplyArrived 10"]
        assert [record.kind for record in world.records if record.kind.startswith("reply")] == ["reply_dropped"]

    play(scene)


def test_what_stands_in_the_queue_when_the_timer_fires_is_looked_at_first() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle()
        came_ns = world.loop.now_ns() + 10 * SECOND_NS - 2_000
        # The middleware hands it over, and then the process is busy until behind the deadline.
        world.loop.call_soon(world.loop.call_soon, world.driver.give, ReplyArrived(1, succeeded=True), came_ns)
        world.loop.let_pass_ns(11 * SECOND_NS)
        await world.loop.settle()
        assert (world.times(TimePassed), [end.end for end in world.ends]) == ([], [End.REACHED])

    play(scene)


def test_deadlines_in_between_pass_in_their_order() -> None:
    async def scene(world: World) -> None:
        for number, at_ns in enumerate((3 * SECOND_NS, SECOND_NS)):
            set_light = Injection(f"i{number}", (("count", number + 1),), at_ns=at_ns, hold_ns=SECOND_NS // 2)
            world.give(InjectionGiven(set_light))
        world.goal()
        await world.loop.settle()
        world.loop.let_pass_ns(5 * SECOND_NS)
        world.give(ReplyArrived(1, succeeded=True))
        assert world.kinds()[-5:] == [
            "TimePassed 1",
            "TimePassed 1.5",
            "TimePassed 3",
            "TimePassed 3.5",
            "ReplyArrived 5",
        ]

    play(scene)


def test_time_never_runs_backwards_for_the_runner() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle()
        world.loop.let_pass_ns(10 * SECOND_NS)
        await world.loop.settle()
        world.give(ReplyArrived(2, succeeded=True), 9 * SECOND_NS)
        times_ns = [at_ns for at_ns, _ in world.steps]
        assert times_ns == sorted(times_ns)
        assert times_ns[-1] >= 10 * SECOND_NS

    play(scene)


def test_what_came_before_the_run_began_happens_when_it_begins() -> None:
    async def scene(world: World) -> None:
        world.driver.give(ResourceChanged(0, NETWORK, "scan", "down"), world.start_ns - 5)
        assert world.steps == [(0, ResourceChanged(0, NETWORK, "scan", "down"))]
        world.driver.close()

    play(scene)


def test_notes_get_the_time_at_which_they_came_and_are_no_event_of_the_runner() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle()
        world.give(MessageDisturbed(0, 1, "scan", "reply", 0), 2 * SECOND_NS)
        noted = MessageDisturbed(2 * SECOND_NS, 1, "scan", "reply", 0)
        assert world.steps[-1] == (2 * SECOND_NS, noted)
        assert world.records[-1] == noted
        world.driver.close()

    play(scene)


def test_a_deadline_that_is_not_there_any_more_does_not_pass() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle(5 * SECOND_NS)
        world.give(ReplyArrived(1, succeeded=False))
        await world.loop.settle(7 * SECOND_NS)  # the second try began at five seconds
        assert world.times(TimePassed) == []
        await world.loop.settle(4 * SECOND_NS)
        assert world.times(TimePassed) == [15.0]
        world.driver.close()

    play(scene)


def test_nothing_happens_behind_the_end_of_the_run() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle(SECOND_NS)
        world.give(ReplyArrived(1, succeeded=True))
        (steps, ends) = len(world.steps), len(world.ends)
        world.give(ReplyArrived(1, succeeded=True))
        world.give(ResourceChanged(0, NETWORK, "scan", "down"))
        await world.loop.settle(4_000 * SECOND_NS)
        assert (len(world.steps), len(world.ends), ends) == (steps, 1, 1)

    play(scene)


def test_what_comes_behind_a_deadline_that_ends_the_run_is_nothing() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle()
        world.loop.let_pass_ns(4_000 * SECOND_NS)
        world.give(ReplyArrived(1, succeeded=True))
        assert world.times(ReplyArrived) == []
        assert [end.end for end in world.ends] == [End.TIME_LIMIT]

    play(scene, plans=False)


def test_a_closed_driver_lets_nothing_happen() -> None:
    async def scene(world: World) -> None:
        world.goal()
        await world.loop.settle()
        steps = len(world.steps)
        world.driver.close()
        world.give(ReplyArrived(1, succeeded=True))
        await world.loop.settle(20 * SECOND_NS)
        assert (len(world.steps), world.ends) == (steps, [])

    play(scene)


TRIGGERS_AT_THE_END = """
  asks_again: {g: plan.state == completed && light == green, a: [light <- red, scan_req_trigger <- true]}
"""


def test_what_the_model_triggers_after_the_end_of_the_run_is_not_sent() -> None:
    async def main(loop: VirtualLoop) -> None:
        model = scan_cell(("automatic_transitions:", f"automatic_transitions:{TRIGGERS_AT_THE_END}"))
        world = World(loop, model)
        world.goal()
        await loop.settle()
        world.give(ReplyArrived(1, succeeded=True))
        assert world.sent_at_the_end == [[1]]

    run_virtually(main)
