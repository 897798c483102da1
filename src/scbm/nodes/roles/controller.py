"""The controller of a cell: runner and planner, in a process of its own (paper, Figure 5).

It plans in a thread for long work, which does not keep the process alive.
"""

from __future__ import annotations

import asyncio
from collections import deque
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from fractions import Fraction
from functools import partial
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from msgspec import Struct, field, structs

from scbm.cases import Injection
from scbm.cases.trace import NETWORK, InjectionApplied, ResourceChanged, Trace, spans_of, trace_digest
from scbm.files import read_case
from scbm.model import InputError, RunPlans
from scbm.model.json_reader import JsonError
from scbm.nodes.buses.bus import BusError, UnmatchedKind
from scbm.nodes.links.bound_link import BoundLink, MissingDrivers
from scbm.nodes.links.link import CANCELLED_WITHIN_S, Correlation, LinkContext
from scbm.nodes.links.measured_topics import ExclusionWarnings, Refusals
from scbm.nodes.links.topic_link import TopicLink, id_text
from scbm.nodes.node_messages import (
    Abandon,
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
from scbm.nodes.roles.cell_topics import GIVEN_UP, CellTopics, Membership
from scbm.nodes.roles.served_tester import ServedTester
from scbm.nodes.roles.wall_clock import Clock, Driver
from scbm.planning import (
    DrawnPlans,
    PlanCache,
    PlanLimits,
    Planner,
    ShortestPlans,
    Solved,
    planner_of_random_runs,
    recorded_answer,
)
from scbm.running import (
    GoalGiven,
    InjectionGiven,
    Measured,
    PlanAnswered,
    PlanStatus,
    Program,
    ReplyArrived,
    RunnerOptions,
)
from scbm.running.search_guard import plan_guarded
from scbm.running.simulation.case_runner import CaseRunner
from scbm.testing.event_logs.event_records import event_of, event_record
from scbm.testing.real_drivers import GoalFate

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from scbm.cases import Case, Origin
    from scbm.cases.trace import Record
    from scbm.model import Resource, Value
    from scbm.nodes.buses.bus import Bus, Received
    from scbm.nodes.links.link import Link, Measurement, Reply
    from scbm.nodes.node_messages import Trouble
    from scbm.nodes.roles.cell_topics import NodeContext
    from scbm.running import AskPlan, CancelRequest, Event, RunFinished, SendRequest
    from scbm.testing.event_logs.event_records import Note

    DrawPlans: TypeAlias = Callable[[Origin], Callable[[], float]]


T = TypeVar("T")


class Background(Executor):
    """Runs one piece of work after the other.

    A `ThreadPoolExecutor` keeps the process alive until its work is done, and a thread cannot be interrupted.
    """

    def __init__(self, name: str) -> None:
        self._asked: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._waiting: list[Future[Any]] = []
        Thread(target=self._go_on, name=name, daemon=True).start()

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401 - as it is defined
        """Queue work; it starts when earlier work is done, unless it is cancelled before."""
        future: Future[T] = Future()
        self._waiting = [other for other in self._waiting if not other.done()] + [future]

        def work() -> None:
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(fn(*args, **kwargs))
                except Exception as error:  # noqa: BLE001 - the future passes it on
                    future.set_exception(error)

        self._asked.put(work)
        return future

    def shutdown(self, wait: bool = False, *, cancel_futures: bool = True) -> None:  # noqa: ARG002, FBT001, FBT002 - as it is defined
        """Stop without waiting: queued work is dropped."""
        for future in self._waiting:
            future.cancel()
        self._asked.put(None)

    def _go_on(self) -> None:
        while (work := self._asked.get()) is not None:
            work()


_WITHOUT_EFFECT = {GoalFate.CANCEL_REFUSED: "refused", GoalFate.CANCEL_IGNORED: "ignored"}

_MAX_RUNS = 1_000
"""Late replies to the requests of so many runs are dropped without a word."""

_CANCELS_S = 3.0
"""Maximum time that a controller which leaves waits for goals to be accepted and cancelled: a parent kills it later."""

_CANCELS_LOOK_S = 0.02

_LOOK_S = 0.5
"""Period in which the controller looks for real resources."""


class _ControlledRun(Struct):
    """A prepared or running run.

    Attributes:
        drawn_plans: the plans of a run that draws them.
        asked: the resource of each request.
    """

    id: str
    case: Case
    options: RunnerOptions
    scale: Fraction
    drawn_plans: DrawnPlans | None = None
    driver: Driver | None = None
    steps: int = 0
    asked: dict[int, str] = field(default_factory=dict)


class ControllerNode:
    """Runs the cases of the tester of its cell, one at a time."""

    def __init__(
        self,
        context: NodeContext,
        plan_limits: PlanLimits | None = None,
        drivers: Bus | None = None,
        draw_plans: DrawPlans | None = None,
    ) -> None:
        """Join the cell, on the running event loop.

        Args:
            context: where it is; `resources` of its status are reached at real drivers, as they are bound.
            plan_limits: when planning is given up.
            drivers: what real resources are reached by; the bus of the cell, if there is no other.
            draw_plans: returns the random numbers of a case that draws its plans; without it plans are canonical.
        """
        bus, model = context.bus, context.model
        self._model = model
        self._warn = context.warn
        self._report = context.report
        self._now_ns = context.now_ns
        self._program = Program(model)
        self._refusals = Refusals(self._program, context.warn)
        self._exclusions = ExclusionWarnings(self._program, context.warn)
        self._planner = Planner.of(model)
        self._plans = PlanCache(self._planner)
        self._shortest = ShortestPlans(self._planner, self._plans)
        self._draw_plans = draw_plans if model.runs.plans is RunPlans.DRAWN else None
        self._plan_limits = plan_limits or PlanLimits.of(model)
        self._thread = Background("planner")
        self._loop = asyncio.get_running_loop()
        self._run: _ControlledRun | None = None
        self._tester = ServedTester(context, self._give_up)
        self._is_leaving = False
        self._runs: deque[str] = deque(maxlen=_MAX_RUNS)
        self._records: list[Record] = []
        self._planning: asyncio.Future[PlanAnswered] | None = None
        topics = CellTopics.of(model)
        self._to_tester = bus.publisher(topics.run)
        self._real = context.status.resources
        self._measured: dict[str, Value] = {}
        self._measures = {resource.name: resource.measures for resource in model.resources}
        self._drivers = drivers or bus
        self._links = {resource.name: self._link(context, topics, resource) for resource in model.resources}
        self._missing = MissingDrivers({name: self._links[name] for name in self._real})
        self._reported_troubles: str | None = None
        troubles = self._missing.look()
        self.membership = Membership(bus, topics, structs.replace(context.status, troubles=troubles))
        self._timer: asyncio.Handle | None = self._look_later() if troubles else None
        bus.subscribe(topics.case, self._receive, left=self._lose_tester)

    def _link(self, context: NodeContext, topics: CellTopics, resource: Resource) -> Link:
        if resource.name in self._real:
            count = partial(self._count_goal, resource.name)
            return BoundLink(
                LinkContext(self._drivers, resource, self, context.warn, context.now_ns, count, self._within_s)
            )
        pair = (topics.request(resource.name), topics.reply(resource.name))
        return TopicLink(context.bus, resource.name, pair, self, context.warn)

    def _look_for_troubles(self) -> None:
        """Report which real resources are missing, and why; the reason may be known only after a while."""
        is_over = False
        with self._warning("the report of missing resources is lost"):
            troubles = self._missing.look()
            self._report_troubles(troubles)
            self._refuse_crowded()
            self.membership.publish_troubles(troubles)
            is_over = not troubles
        self._timer = None if is_over else self._look_later()

    def _refuse_crowded(self) -> None:
        """Give up the run if a service has several servers: two robots may have carried out one request."""
        run = self._run
        if run is None or run.driver is None:
            return
        for name in self._real:
            why = self._links[name].why_unmatched()
            if why is not None and why.kind is UnmatchedKind.CROWDED:
                self._say(Refused(run.id, self.membership.own.node, why.why))
                self._give_up()
                return

    def _report_troubles(self, troubles: tuple[Trouble, ...]) -> None:
        words = "; ".join(trouble.words for trouble in troubles) or "all real resources are reached"
        if words != self._reported_troubles:
            self._reported_troubles = words
            self._report(words)

    def _look_later(self) -> asyncio.TimerHandle:
        return self._loop.call_later(_LOOK_S, self._look_for_troubles)

    async def close(self) -> None:
        """Give up the run, cancel requests in flight, and take no more cases. The caller closes the bus."""
        self._is_leaving = True
        self.membership.close()
        if self._run is not None and self._run.driver is None:
            self._say(Forgot(self._run.id, self.membership.own.node))
        self._give_up()
        await self._see_goals_end()
        if self._timer is not None:
            self._timer.cancel()
        self._thread.shutdown()

    async def _see_goals_end(self) -> None:
        """Wait until the goals at real drivers are accepted and cancelled, for a while."""
        ends_s = self._loop.time() + _CANCELS_S
        while sum(link.end_run() for link in self._links.values()) and self._loop.time() < ends_s:  # noqa: ASYNC110 - links report only ends of requests
            await asyncio.sleep(_CANCELS_LOOK_S)

    # the tester

    def _receive(self, received: Received) -> None:
        try:
            message = decode(received.message.data)
        except JsonError as error:
            self._warn(f"a message of a tester was dropped: {error}")
            return
        if isinstance(message, Prepare):
            if self.membership.own.node in message.nodes:
                self._prepare(message, received.source)
            return
        run = self._run
        if run is None or not isinstance(message, Go | NoteMessage | Abandon) or message.run != run.id:
            return  # of a run that is over
        if isinstance(message, Go) and run.driver is None:
            self._go(run, received.stamp_ns)
        elif isinstance(message, NoteMessage) and run.driver is not None:
            self._note(run.driver, message, received.stamp_ns)
        elif isinstance(message, Abandon):
            self._give_up()

    def _prepare(self, message: Prepare, tester: int) -> None:
        if self._is_leaving:
            return  # the tester asks again, and finds another controller
        run = self._run
        if run is not None and run.id == message.run:
            self._be_ready(run)
            return
        if (refusal := self._tester.refusal(message, tester)) is not None:
            self._say(refusal)
            return
        self._give_up()
        try:
            case = read_case(message.case, self._model)
        except InputError as error:
            self._say(Refused(message.run, self.membership.own.node, f"the case cannot be read: {error}"))
            return
        options, scale = message.options.options(), Fraction(message.time_scale)
        self._run = _ControlledRun(message.run, case, options, scale, self._drawn_plans(case))
        self._tester.hold(message, tester)
        self._records = []
        self._runs.append(message.run)
        self._be_ready(self._run)

    def _drawn_plans(self, case: Case) -> DrawnPlans | None:
        """Return the plans of a random case of a model that draws them; `None` for a case with canonical plans."""
        if case.origin is None or case.plans or self._draw_plans is None:
            return None
        return DrawnPlans(self._shortest, self._draw_plans(case.origin))

    def _be_ready(self, run: _ControlledRun) -> None:
        """Confirm once requests reach all resources, which have no goal of an earlier run; the tester asks again."""
        if run.driver is None and all(link.is_there for link in self._links.values()):
            self._say(Prepared(run.id, self.membership.own.node))

    def _go(self, run: _ControlledRun, stamp_ns: int) -> None:
        self._tester.start()
        runner = CaseRunner(self._program, run.case, run.options)
        run.driver = driver = Driver(runner, Clock(stamp_ns, run.scale), self)
        for injection in run.case.injections:
            driver.give(InjectionGiven(injection), stamp_ns)
        # What was measured before the run is true in it, whatever the case says.
        for values in self._program.outside.parts(tuple(self._measured.items())):
            driver.give(Measured(values), stamp_ns)
        for goal in run.case.goals:
            driver.give(GoalGiven(goal.name, goal.predicate, goal.when), stamp_ns)
        for name, link in self._links.items():
            if not link.is_there:
                self.on_presence(name, is_there=False)

    def _note(self, driver: Driver, message: NoteMessage, stamp_ns: int) -> None:
        try:
            note = event_of(message.note, self._model)
        except ValueError as error:
            self._warn(f"a note of the tester was dropped: {error}")
            return
        driver.give(note, stamp_ns)

    def _lose_tester(self, source: int) -> None:
        if self._run is not None and self._tester.source == source:
            self._report("the tester is gone, and its run is given up")
            self._give_up()

    def _give_up(self) -> None:
        """End the run by the rules of the model: abort the plan, and cancel requests in flight."""
        run = self._run
        if run is not None and run.driver is not None:
            injection = Injection(GIVEN_UP, assign=(("plan.state", "aborted"),))
            for _ in run.case.goals:  # the next goal begins as soon as one is aborted
                run.driver.give(InjectionGiven(injection), self._now_ns())
            run.driver.close()
        if self._planning is not None:
            self._planning.cancel()  # the next run does not wait for a plan that has not been begun
        self._leave_run()

    def _leave_run(self) -> None:
        if self._run is not None:
            for link in self._links.values():
                link.end_run()
        self._run = None
        self._tester.release()

    def _say(self, message: Prepared | Forgot | Refused | Busy | Stepped | Ended | GoalChanged) -> None:
        with self._warning(f"a `{message.kind}` for the tester is lost"):
            self._to_tester.publish({"data": encode(message)})

    @contextmanager
    def _warning(self, what: str) -> Iterator[None]:
        """Warn of a message that the bus does not take; the run goes on, and its deadlines pass."""
        try:
            yield
        except BusError as error:
            self._warn(f"{what}: {error.message}")

    # what the driver wants

    def send(self, request: SendRequest) -> None:
        """Send a request to its resource."""
        assert self._run is not None  # noqa: S101 - only a run sends
        self._run.asked[request.request] = request.resource
        with self._warning(f"request {request.request} to `{request.resource}` is lost"):
            self._links[request.resource].send(Correlation(self._run.id, request.request), request.payload)

    def cancel(self, request: CancelRequest) -> None:
        """Cancel a request at its resource."""
        assert self._run is not None  # noqa: S101 - only a run cancels
        with self._warning(f"that request {request.request} to `{request.resource}` is cancelled is lost"):
            self._links[request.resource].cancel(Correlation(self._run.id, request.request))

    def plan(self, asked: AskPlan) -> None:
        """Plan in a thread, so that replies are handled meanwhile; the case may say how long a plan takes at least."""
        run = self._run
        assert run is not None and run.driver is not None  # noqa: S101, PT018 - only a run asks
        due_ns = run.driver.wall_ns_after(run.case.planning_ns) if run.case.planning_ns else 0
        should_continue = lambda: run is self._run  # noqa: E731 - asked in the thread: a run that is over wants nothing
        self._planning = self._loop.run_in_executor(self._thread, self._answer, asked, should_continue)
        self._planning.add_done_callback(lambda done: self._planned(run, done, due_ns))

    def _answer(self, asked: AskPlan, should_continue: Callable[[], bool]) -> PlanAnswered:
        run = self._run
        if run is not None and run.case.plans:
            known = recorded_answer(run.case, asked.ask, self._planner, asked.state, asked.goal)
            return PlanAnswered(asked.ask, PlanStatus(known.status), known.plan)
        plans = self._plans if run is None or run.drawn_plans is None else run.drawn_plans
        answer = plan_guarded(plans, asked.state, asked.goal, self._plan_limits, should_continue)
        plan = answer.plan if isinstance(answer, Solved) else ()
        return PlanAnswered(asked.ask, PlanStatus(answer.status), plan)

    def _planned(self, run: _ControlledRun, done: asyncio.Future[PlanAnswered], due_ns: int) -> None:
        error = None if done.cancelled() else done.exception()
        if run is not self._run or run.driver is None or done.cancelled():
            return
        if error is None and due_ns > self._now_ns():
            self._loop.call_at(due_ns / 1e9, run.driver.give, done.result(), due_ns)
        elif error is None:
            run.driver.give(done.result(), self._now_ns())
        else:
            self._warn(f"planning failed: {error!r}")
            self._say(Refused(run.id, self.membership.own.node, f"planning failed: {error!r}"))
            self._give_up()

    def stepped(self, at_ns: int, event: Event | Note, records: tuple[Record, ...]) -> None:
        """Publish a step for the tester."""
        run = self._run
        assert run is not None  # noqa: S101 - only a run steps
        run.steps += 1
        self._records.extend(records)
        self._exclusions.look(self._records, records)
        self._say(Stepped(run.id, run.steps, at_ns, event_record(event)))

    def finished(self, end: RunFinished) -> None:
        """Publish the end of the run with the digest of its trace, which the tester compares with its own."""
        run = self._run
        assert run is not None  # noqa: S101 - only a run ends
        trace = Trace(self._model.name, run.case.name, tuple(self._records))
        planner = self._planner.identity if run.drawn_plans is None else planner_of_random_runs(self._model)
        self._say(Ended(run.id, run.steps, trace_digest(trace), str(planner)))
        applied = [record.injection for record in self._records if isinstance(record, InjectionApplied)]
        how = GIVEN_UP if GIVEN_UP in applied else end.end.replace("_", " ")
        self._report(f"{run.case.name}: {how} after {self._records[-1].at_ns / 1e9:.3f} s")
        self._leave_run()

    # callbacks of links

    def on_reply(self, resource: str, reply: Reply) -> None:
        """Handle a reply; ignore one of another run, and one of a resource that got no such request."""
        run, number = self._run, reply.request.number
        if run is None or run.driver is None or reply.request.run != run.id:
            if reply.request.run not in self._runs:
                why = f"this controller did not send the request `{id_text(reply.request)}`"
                self._warn(f"a reply of `{resource}` was dropped: {why}")
            return
        asked = run.asked.get(number, resource)  # the runner records a reply to a request that was not sent
        if asked != resource:
            self._warn(f"a reply of `{resource}` to request {number} was dropped: that request was sent to `{asked}`")
            return
        self._refusals.look(resource, reply.measured, self._measures[resource])
        self._remember((name, value) for name, value in reply.measured if name in self._measured)
        run.driver.give(ReplyArrived(number, reply.succeeded, reply.measured), reply.stamp_ns)

    def on_values(self, resource: str, measurement: Measurement) -> None:
        """Handle values that a resource published."""
        run = self._run
        self._refusals.look(resource, measurement.values, self._program.measurable)
        self._remember(measurement.values)
        if run is not None and run.driver is not None:
            run.driver.give(Measured(measurement.values), measurement.stamp_ns)

    def _remember(self, values: Iterable[tuple[str, Value]]) -> None:
        """Keep measured values for the next run; not those that the runner of this one refuses and records."""
        known, space = self._program.measurable, self._program.packing.space
        self._measured.update((name, value) for name, value in values if name in known and value in space[name].domain)

    def _count_goal(self, resource: str, request: Correlation, fate: GoalFate) -> None:
        """Publish what became of a goal, and record a cancellation without effect."""
        self._say(GoalChanged(request.run, resource, fate.value))
        run, without = self._run, _WITHOUT_EFFECT.get(fate)
        if without is not None and run is not None and run.driver is not None and run.id == request.run:
            condition = f"busy with request {request.number}, whose cancellation is {without}"
            run.driver.give(ResourceChanged(0, NETWORK, resource, condition), self._now_ns())

    def _within_s(self, request: Correlation) -> float:
        """Return the deadline of the operation that sent a request of the last run."""
        spans = spans_of(self._records).requests
        names = [span.operation for span in spans if span.request == request.number]
        deadlines_ns = [each.deadline_ns for each in self._model.operations if each.name in names and each.deadline_ns]
        return deadlines_ns[0] / 1e9 if deadlines_ns else CANCELLED_WITHIN_S

    def on_presence(self, resource: str, *, is_there: bool) -> None:
        """Record that a resource came or was lost; the deadlines of the model decide."""
        self._report(f"{resource} {'is reached' if is_there else 'is not reached'}")
        if resource in self._real and self._timer is None:
            self._timer = self._loop.call_soon(self._look_for_troubles)
        if resource in self._real and not is_there:
            self._refuse_crowded()
        run = self._run
        if run is not None and run.driver is not None:
            noted = ResourceChanged(0, NETWORK, resource, "well" if is_there else "down")
            run.driver.give(noted, self._now_ns())
