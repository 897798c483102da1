"""The tester of a cell: sends cases, decides what resources do, follows the runs (paper, Figure 5)."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from typing import TYPE_CHECKING

from msgspec import Struct, structs

from scbm.cases.trace import End, MessageDisturbed, ResourceChanged, Trace, ends_of, trace_digest
from scbm.files import write_case
from scbm.model import PlannerIdentity
from scbm.model.json_reader import JsonError
from scbm.nodes.buses.bus import MISMATCHES, BusError, UnmatchedKind
from scbm.nodes.node_messages import (
    VERSION,
    Abandon,
    Answering,
    Busy,
    Ended,
    Forgot,
    Go,
    GoalChanged,
    Prepare,
    Prepared,
    Refused,
    Stepped,
    decode,
    encode,
)
from scbm.nodes.node_messages import Note as NoteMessage
from scbm.nodes.roles.cell_topics import GIVEN_UP, START_WITHIN_S, CellTopics, Membership, new_run
from scbm.nodes.roles.director import Director
from scbm.nodes.roles.readiness import Lack, NotReadyError, Reason, beyond_reach
from scbm.nodes.roles.wall_clock import Clock
from scbm.planning import planner_of_random_runs
from scbm.running import InjectionGiven, Program, RunFinished, records_of
from scbm.running.simulation import Simulated
from scbm.running.simulation.case_runner import CaseRunner
from scbm.testing.event_logs.event_log import EventLog, LogStep
from scbm.testing.event_logs.event_records import OptionsRecord, event_of, note_record

if TYPE_CHECKING:
    from collections.abc import Callable
    from fractions import Fraction

    from scbm.cases import Case
    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel
    from scbm.nodes.buses.bus import Received
    from scbm.nodes.node_messages import Become, Fate, Message, React, RestartResource, Trouble
    from scbm.nodes.roles.cell_topics import NodeContext
    from scbm.running import Effect, Event, RunnerOptions
    from scbm.running.simulation import Choices
    from scbm.testing.event_logs.event_records import Note

_MAX_RUNS = 1_000
"""The goals of so many last runs are counted: a goal may end after its run."""

_QUIET_S = 1.0
"""A tester that waits longer than this reports the missing nodes."""

_READY_S = 5.0
"""Maximum time that nodes may take to prepare a run."""

_BUSY_S = START_WITHIN_S + _READY_S
"""Maximum time that nodes may take to prepare a run if one of them serves another tester, which it may drop."""

_AGAIN_S = 0.1
"""Period in which the tester repeats `prepare` to a node that has not answered."""

_SILENT_NS = 3_000_000_000
"""A controller that says nothing for so long after a deadline of its run has passed is lost, even if it is there."""


_LACKS: dict[str, Lack] = {
    UnmatchedKind.ABSENT: Lack.DRIVER,
    UnmatchedKind.BUSY: Lack.GOAL,
    UnmatchedKind.MISMATCH: Lack.BINDING,
    UnmatchedKind.OTHER_VENDOR: Lack.VENDOR,
    UnmatchedKind.CROWDED: Lack.SERVERS,
}
"""The problem of a cell for each kind of a trouble."""


class LostError(Exception):
    """A run that was not finished, with the reason.

    Attributes:
        partial: the run up to the loss; `None` if it had not begun.
    """

    def __init__(self, why: str) -> None:
        super().__init__(why)
        self.partial: NodeRun | None = None


class NotBegunError(LostError):
    """A run that ended before any request was sent, as its controller left: another controller may run the case."""


class NodeRun(Struct, frozen=True):
    """The result of a run over nodes.

    Attributes:
        run: its end and its records, as of a simulated run.
        log: what happened to the runner and to the requests; a fresh runner makes the same records of it.
    """

    run: Simulated
    log: EventLog


class TesterNode:
    """Runs cases in a cell, one by one.

    Attributes:
        program: the compiled model.
        goals: the numbers of goals at real drivers, by resource and `GoalFate`.
        warn, now_ns: those of its context.
    """

    __test__ = False  # its name looks to pytest like that of a class of tests

    def __init__(self, context: NodeContext, time_scale: Fraction, *, is_first: bool = False) -> None:
        """Join the cell, on the running event loop.

        Args:
            context: where it is.
            time_scale: how many seconds of a run pass in one of the wall.
            is_first: whether the others are started for this one: those that are older are not its own.
        """
        bus, model = context.bus, context.model
        self._bus = bus
        self._model = model
        self.warn = context.warn
        self.now_ns = context.now_ns
        self._time_scale = time_scale
        self._is_first = is_first
        self.program = Program(model)
        self.goals: Counter[tuple[str, str]] = Counter()
        self._runs: deque[str] = deque(maxlen=_MAX_RUNS)
        self._resources = {resource.name: resource for resource in model.resources}
        self._topics = topics = CellTopics.of(model)
        self._run: _DirectedRun | None = None
        self._warned: tuple[str, ...] = ()
        self._changed = asyncio.Event()
        self.membership = Membership(bus, topics, context.status)
        self.membership.changed = self._look
        self._to_all = bus.publisher(topics.case)
        bus.subscribe(topics.run, self._hear, left=self._lose)
        bus.subscribe(topics.simulated, self._hear)

    # the cell

    @property
    def real(self) -> tuple[str, ...]:
        """The resources that are reached at real drivers."""
        controller = self.membership.controller()
        return () if controller is None else controller.resources

    async def wait_for_cell(
        self, wait_s: float, waiting: Callable[[tuple[Reason, ...]], None] = lambda _: None
    ) -> None:
        """Wait until all nodes have joined. Raises `NotReadyError` with all problems after the timeout.

        Args:
            wait_s: the timeout in seconds.
            waiting: gets what is missing after a second, and again whenever that changes.
        """
        try:
            async with asyncio.timeout(wait_s):
                await self._wait(waiting)
        except TimeoutError:
            pass
        reasons = self._wrong() or self._missing()
        if reasons:
            raise NotReadyError(reasons)

    async def _wait(self, waiting: Callable[[tuple[Reason, ...]], None]) -> None:
        loop = asyncio.get_running_loop()
        reported: tuple[Reason, ...] = ()
        settled, late = asyncio.Event(), asyncio.Event()  # who was there before is known then
        timers = [loop.call_at(self.membership.settles_s, wake) for wake in (settled.set, self._changed.set)]
        timers += [loop.call_later(_QUIET_S, wake) for wake in (late.set, self._changed.set)]
        try:
            while not settled.is_set() or (self._missing() and not self._wrong()):
                missing = self._missing()
                if late.is_set() and missing != reported:
                    waiting(missing)
                    reported = missing
                self._changed.clear()
                await self._changed.wait()
        finally:
            for timer in timers:
                timer.cancel()

    def _wrong(self) -> tuple[Reason, ...]:
        """Return the problems that waiting does not solve."""
        rival = self.membership.rival()
        reasons = [] if rival is None else [Reason(Lack.RIVAL, f"another tester is at work: {rival.words}")]
        if self.real and self._time_scale != 1:
            message = f"`{self.real[0]}` is real and cannot be made faster: it needs a time scale of 1"
            reasons.append(Reason(Lack.TIME_SCALE, message))
        controller = self.membership.controller()
        troubles = () if controller is None else controller.troubles
        reasons += [_missing_driver(trouble) for trouble in troubles if trouble.kind in MISMATCHES]
        there = [controller, *map(self.membership.node_of, self._simulated())]
        for other in filter(None, dict.fromkeys(there)):
            node = self.words_of(other.node)
            if self._is_first and other.since_ns < self.membership.own.since_ns:
                reasons.append(Reason(Lack.FOREIGN, f"{node} belongs to another tester: {other.words}"))
            elif other.version != VERSION:
                message = f"{node} has protocol version {other.version}, and this scbm {VERSION}: {other.words}"
                reasons.append(Reason(Lack.VERSION, message))
            elif other.digest != self.membership.own.digest:
                reasons.append(Reason(Lack.MODEL, f"{node} has another version of the model: {other.words}"))
        return tuple(reasons)

    def _missing(self) -> tuple[Reason, ...]:
        """Return the nodes that are missing."""
        controller = self.membership.controller()
        names = tuple(name for name in self._simulated() if not self.membership.node_of(name))
        if controller is None:
            unmatched = self._bus.why_unmatched(self._topics.status)
            unreadable = (*self.membership.unreadable, *(() if unmatched is None else (unmatched.why,)))
            first = Reason(Lack.CONTROLLER, f"no controller of `{self._model.name}`", names)
            return (first, *(Reason(Lack.UNREADABLE, message) for message in unreadable))
        troubles = tuple(map(_missing_driver, controller.troubles))
        if not names:
            return troubles
        message = f"no node simulates {', '.join(f'`{name}`' for name in names)}"
        return (*troubles, Reason(Lack.RESOURCES, message, names))

    def _simulated(self) -> list[str]:
        return [name for name in self._resources if name not in self.real]

    def simulating(self) -> dict[str, tuple[str, ...]]:
        """Return the ids of the nodes that simulate resources, with their resources."""
        found = map(self.membership.node_of, self._simulated())
        return {other.node: other.resources for other in found if other is not None}

    def _look(self) -> None:
        """Handle a node that came or left."""
        self._changed.set()
        if self._run is not None:
            self._run.look()
            if self._run.is_going and self.membership.controller() is not None:
                self._report_lacks()

    def _report_lacks(self) -> None:
        """Report a resource that is lost during a run once: the run goes on, and may wait long for it."""
        lacks = self.lacks()
        for message in lacks:
            if message not in self._warned:
                self.warn(f"{message}; the run goes on, by the deadlines of the model")
        if self._warned and not lacks:
            self.warn("all resources are reached again")
        self._warned = lacks

    def lacks(self) -> tuple[str, ...]:
        """Return the missing resources, if there is a controller."""
        return tuple(r.message for r in self._missing() if r.lack not in (Lack.CONTROLLER, Lack.UNREADABLE))

    # runs

    async def run(self, case: Case, choices: Choices, options: RunnerOptions) -> NodeRun:
        """Run a case. Raises `LostError` if it is not finished, `NotBegunError` if it can begin again."""
        if (why := beyond_reach(case, self._model, self.real)) is not None:
            raise LostError(why)
        run = _DirectedRun(self, case, choices, options, self._time_scale)
        self._run = run
        self._runs.append(run.id)
        self._warned = ()
        try:
            return await run.finish()
        except (LostError, asyncio.CancelledError) as error:
            self.say(Abandon(run.id))
            if isinstance(error, LostError):
                error.partial = run.partial()
            raise
        finally:
            run.close()
            self._run = None

    def expected(self) -> tuple[str, ...]:
        """Return the ids of the nodes that must be ready."""
        controller = self.membership.controller()
        return (*(() if controller is None else (controller.node,)), *self.simulating())

    def why_not(self) -> str | None:
        """Return why no run can start now, as a clause."""
        return next((reason.message for reason in (*self._wrong(), *self._missing())), None)

    def say(self, message: Prepare | Go | NoteMessage | Abandon | React | Fate | Become | RestartResource) -> None:
        """Publish a message to all nodes; the run is lost if the bus does not take it."""
        try:
            self._to_all.publish({"data": encode(message)})
        except BusError as error:
            self.warn(f"a `{message.kind}` is lost: {error.message}")
            if self._run is not None:
                self._run.fail("a message of the tester could not be sent")

    def words_of(self, node: str) -> str:
        """Return a node in words."""
        for other in self.membership.others:
            if other.node == node:
                return "the controller" if other.role == "controller" else f"the node of {', '.join(other.resources)}"
        return "a node that is gone"

    @property
    def model(self) -> BehaviorModel:
        """The model under test."""
        return self._model

    # what comes

    def _hear(self, received: Received) -> None:
        try:
            message = decode(received.message.data)
        except JsonError as error:
            self.warn(f"a message was dropped: {error}")
            return
        if isinstance(message, GoalChanged) and message.run in self._runs and message.resource in self._resources:
            self.goals[message.resource, message.fate] += 1
        run = self._run
        if run is not None and getattr(message, "run", None) == run.id:
            run.hear(message, received)

    def _lose(self, source: int) -> None:
        if self._run is not None:
            self._run.lose(source)


def _missing_driver(trouble: Trouble) -> Reason:
    return Reason(_LACKS[trouble.kind], trouble.words)


class _DirectedRun:
    """One run, with a second runner that makes the records from the steps of the controller."""

    def __init__(
        self, node: TesterNode, case: Case, choices: Choices, options: RunnerOptions, time_scale: Fraction
    ) -> None:
        self.id = new_run()
        self.is_going = False
        self._node = node
        self._case = case
        self._options = options
        self._scale = time_scale
        self._runner = CaseRunner(node.program, case, options)
        resources = {resource.name: resource for resource in node.model.resources}
        self._real = tuple(name for name in resources if name in node.real)
        self._director = Director(self.id, resources, self._real, choices, self)
        self._loop = asyncio.get_running_loop()
        self._done: asyncio.Future[Ended] = self._loop.create_future()
        self._ready: dict[str, bool] = {}
        self._busy: dict[str, str] = {}
        self._preparing = asyncio.timeout(_READY_S)
        self._all_ready = asyncio.Event()
        self._controller: int | None = None
        self._clock = Clock(0, time_scale)
        self._timers: list[asyncio.TimerHandle] = []
        self._watch: asyncio.TimerHandle | None = None
        self._records: list[Record] = []
        self._steps: list[LogStep] = []
        self._finished: RunFinished | None = None
        self._again: asyncio.TimerHandle | None = None

    async def finish(self) -> NodeRun:
        """Prepare all nodes, start the run, and wait until it has ended. Raises `LostError`."""
        await self._prepare()
        self.is_going = True
        self._node.say(Go(self.id))
        self._arm_watch(_SILENT_NS)
        ended = await self._done
        finished = self._finished
        if finished is None or ended.steps != len(self._steps):
            raise LostError("steps of the controller did not arrive")
        records = tuple(self._records)
        model = self._node.model
        digest = trace_digest(Trace(model.name, self._case.name, records))
        if digest != ended.trace:
            raise LostError("the steps that arrived do not reproduce the trace of the controller")
        is_missed = any(ended.end != End.REACHED.value for ended in ends_of(records))
        if is_missed and (lacks := self._node.lacks()):
            raise LostError(lacks[0])
        if self._runner.waiting is not None:
            raise LostError(self._runner.waiting.never_came)
        return self._done_so_far(finished.end, digest, PlannerIdentity.parse(ended.planner))

    def partial(self) -> NodeRun | None:
        """Return the run as far as it got before it was lost; `None` if it had not begun."""
        if not self._steps:
            return None
        model = self._node.model
        digest = trace_digest(Trace(model.name, self._case.name, tuple(self._records)))
        return self._done_so_far(End.LOST, digest, planner_of_random_runs(model))

    def _done_so_far(self, end: End, digest: str, planner: PlannerIdentity) -> NodeRun:
        records = tuple(self._records)
        log = EventLog(
            self._node.model.name,
            self._node.membership.own.digest,
            self._case,
            self._options,
            self._scale,
            self._real,
            tuple(self._steps),
            self._director.reactions(records),
            end,
            digest,
            planner=planner,
        )
        return NodeRun(Simulated(end, log.ended_ns, records), log)

    def close(self) -> None:
        """Stop waiting."""
        self.is_going = False
        for timer in self._timers:
            timer.cancel()
        for pending in (self._watch, self._again):
            if pending is not None:
                pending.cancel()
        self._done.cancel()

    async def _prepare(self) -> None:
        """Prepare the nodes before the run: wait for nodes that leave meanwhile, and include nodes that join."""
        text = write_case(self._case, self._node.model, None)
        relayed, own = self._director.is_relayed, self._node.membership.own
        options = OptionsRecord.of(self._options)
        prepare = Prepare(self.id, (), text, options, str(self._scale), relayed, own.words, self._real)
        self.look()
        self._say_until_ready(prepare)
        try:
            async with self._preparing:
                await self._all_ready.wait()
        except TimeoutError:
            if (why := self._node.why_not()) is not None:
                raise NotBegunError(why) from None
            busy = [f"{self._node.words_of(node)} {why}" for node, why in self._busy.items()]
            if busy:
                raise LostError("; ".join(busy)) from None
            silent = [self._node.words_of(node) for node, is_ready in self._ready.items() if not is_ready]
            raise LostError(f"{', '.join(silent)} did not prepare the run") from None
        if self._done.done():
            self._done.result()

    def _say_until_ready(self, prepare: Prepare) -> None:
        """Ask again and again: a node may be known before it receives, or rejoin during the run."""
        nodes = tuple(node for node, is_ready in self._ready.items() if not is_ready)
        if nodes:
            self._node.say(structs.replace(prepare, nodes=nodes))
        self._again = self._loop.call_later(_AGAIN_S, self._say_until_ready, prepare)

    def look(self) -> None:
        """Handle a node that came or left: every node must be ready, and so must one that joins during the run."""
        rival = self._node.membership.rival()
        if rival is not None:
            self.fail(f"another tester is at work: {rival.words}")
        self._look_at_real()
        expected = self._node.simulating() if self.is_going else self._node.expected()
        self._ready = {node: self._ready.get(node, False) for node in expected}
        self._see_who_is_ready()

    def _look_at_real(self) -> None:
        """Return the real resources, which do not change during a run."""
        is_led = self._node.membership.controller() is not None
        if is_led and not self.is_going and set(self._node.real) != set(self._real):
            self.fail("another controller came, with other real resources")

    def _see_who_is_ready(self) -> None:
        if self._controller is not None and all(self._ready.values()) and self._node.why_not() is None:
            self._all_ready.set()

    # the stage of the director

    def publish(self, message: React | Fate | Become | RestartResource) -> None:
        """Send a message to the node that simulates the resource."""
        self._node.say(message)

    def note(self, record: Note) -> None:
        """Add a record to the trace."""
        self._node.say(NoteMessage(self.id, note_record(record)))

    # what comes

    def hear(self, message: Message, received: Received) -> None:
        """Handle a message of this run."""
        match message:
            case Prepared(node=node):
                self._be_ready(node, received.source)
            case Refused(node=node, why=why):
                self.fail(f"{self._node.words_of(node)} refused the run: {why}")
            case Busy(node=node) if node in self._ready:
                self._be_refused(message)
            case Forgot() if self.is_going and received.source == self._controller and not self._steps:
                self.fail("the controller left before it began the run", NotBegunError)
            case Forgot(node=node) if node in self._ready:
                self._ready[node] = False
            case Stepped():
                self._step(message, received.stamp_ns)
            case Answering():
                self._answering(message, received.stamp_ns)
            case Ended() if not self._done.done():
                self._done.set_result(message)
            case _:
                pass

    def _answering(self, message: Answering, stamp_ns: int) -> None:
        try:
            self._director.answering(message, self._clock.of_run_ns(stamp_ns))
        except ValueError as error:
            self._node.warn(f"a message was dropped: {error}")

    def _be_refused(self, message: Busy) -> None:
        """Ask a node that serves another tester until it drops that one, and say so once."""
        why = f"serves another tester, {message.tester}, since {message.for_ns / 1e9:.0f} s"
        if not self._busy and not self.is_going and not self._preparing.expired():
            self._preparing.reschedule(self._loop.time() + _BUSY_S)
            self._node.warn(f"{self._node.words_of(message.node)} {why}; the case waits for {_BUSY_S:g} s at most")
        self._busy[message.node] = why

    def _be_ready(self, node: str, source: int) -> None:
        if self._ready.get(node, True):
            return
        self._ready[node] = True
        self._busy.pop(node, None)
        controller = self._node.membership.controller()
        if controller is not None and controller.node == node:
            self._controller = source
        if self.is_going:
            self._node.say(Go(self.id))  # else a node that joins during the run would drop this tester
            self._director.publish_again(self._node.simulating()[node])
        self._see_who_is_ready()

    def lose(self, source: int) -> None:
        """Handle the loss of a controller."""
        if source == self._controller:
            self._controller = None
            if self.is_going and self._steps:
                self.fail("the controller was lost")
            elif self.is_going:
                self.fail("the controller was lost before it began the run", NotBegunError)

    def fail(self, why: str, error: type[LostError] = LostError) -> None:
        """Mark the run as lost; `why` is a clause."""
        self._all_ready.set()
        if not self._done.done():
            self._done.set_exception(error(why))

    def _step(self, message: Stepped, stamp_ns: int) -> None:
        if self._done.done():
            return
        if message.number != len(self._steps) + 1:
            self.fail("a step of the controller did not arrive")
            return
        if not self._steps:
            self._begin(stamp_ns)
        try:
            event = event_of(message.event, self._node.model, message.at_ns)
            self._follow(message.at_ns, event)
        except ValueError as error:
            self.fail(f"a step of the controller makes no sense: {error}")
            return
        if isinstance(event, InjectionGiven) and event.injection.name == GIVEN_UP:
            if self._director.has_requests:
                self.fail("the controller gave the run up")
            else:
                self.fail("the controller gave the run up before it sent a request", NotBegunError)
        deadline_ns = self._runner.deadline_ns
        if deadline_ns is not None:
            self._arm_watch(self._clock.wall_ns(deadline_ns) - self._node.now_ns() + _SILENT_NS)

    def _follow(self, at_ns: int, event: Event | Note) -> None:
        if isinstance(event, MessageDisturbed | ResourceChanged):
            effects: list[Effect] = [event]
        else:
            effects = self._runner.handle(event, at_ns)
        self._steps.append(LogStep(at_ns, event))
        self._records += records_of(effects)
        self._finished = next((each for each in reversed(effects) if isinstance(each, RunFinished)), self._finished)
        self._director.follow(effects, at_ns)

    def _begin(self, stamp_ns: int) -> None:
        """Schedule the timed faults of the case: the controller started the run about now."""
        self._clock = Clock(stamp_ns, self._scale)
        for restart in self._case.network.restarts_of_resources:
            self._at(restart.at_ns, restart.resource, is_down=True)
            self._at(restart.at_ns + restart.for_ns, restart.resource, is_down=False)

    def _at(self, at_ns: int, resource: str, *, is_down: bool) -> None:
        when = self._clock.wall_ns(at_ns) / 1e9
        work = lambda: self._director.restart(resource, is_down=is_down)  # noqa: E731 - a keyword that call_at cannot give
        self._timers.append(self._loop.call_at(when, work))

    def _arm_watch(self, wait_ns: int) -> None:
        if self._watch is not None:
            self._watch.cancel()
        self._watch = self._loop.call_later(wait_ns / 1e9, self.fail, "the controller sends no messages any more")
