"""One run in virtual time: a heap of events, the runner, and simulated resources."""

from __future__ import annotations

import heapq
from copy import copy
from functools import cached_property
from itertools import count
from typing import TYPE_CHECKING, TypeAlias, assert_never

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases import AT_ONCE
from scbm.cases.trace import NETWORK, BecameCurrent, End, MessageDisturbed, OperationStepped, ResourceChanged
from scbm.model import OperationState
from scbm.planning import PlanCache, PlanLimits, Planner, PlanRefusedError, Solved, recorded_answer
from scbm.running.events import (
    OUTWARD,
    AskPlan,
    CancelRequest,
    ChangeResource,
    Event,
    GoalGiven,
    InjectionGiven,
    Measured,
    PlanAnswered,
    PlanStatus,
    ReplyArrived,
    RunFinished,
    RunnerOptions,
    SendRequest,
    TimePassed,
)
from scbm.running.program import Program
from scbm.running.runner import Runner
from scbm.running.simulation.device_hazards import DeviceWatch
from scbm.running.simulation.environment_moves import ClockTick, event_of, parts_of
from scbm.running.simulation.free_choices import MessageKind
from scbm.running.simulation.impossible_changes import ImpossibleChange, why_impossible
from scbm.running.simulation.rate_watch import RateWatch
from scbm.running.simulation.simulated_resources import Job, SimulatedResource

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.cases import Case, CaseLimits, EnvironmentChange, Reaction, Restart
    from scbm.cases.trace import Changes, Record
    from scbm.model import BehaviorModel
    from scbm.planning import Answer, PlanSource
    from scbm.running.events import OutwardEffect
    from scbm.running.simulation.device_hazards import Hazard
    from scbm.running.simulation.environment_moves import EnvironmentMoves
    from scbm.running.simulation.free_choices import Choices


class Simulated(Struct, frozen=True):
    """The result of a simulated run.

    Attributes:
        end: how the run for the last goal ended.
        ended_ns: the virtual time of the end.
        records: the trace.
        moves: what the environment changed; `None` if nothing decided about it.
        impossible: the change of the case that no maker could make; then `end` is `impossible`, and it is no run.
        left_out: the changes of the case that no maker could make on a mutant.
        off_rates: a sentence for each change that came at another time than the rates of the model allow.
        missing: the changes of the case whose moments did not come before the end.
        hazards: what devices did and the controller did not know.
    """

    end: End
    ended_ns: int
    records: tuple[Record, ...]
    moves: tuple[EnvironmentChange, ...] | None = None
    impossible: ImpossibleChange | None = None
    left_out: tuple[ImpossibleChange, ...] = ()
    off_rates: tuple[str, ...] = ()
    missing: tuple[EnvironmentChange, ...] = ()
    hazards: tuple[Hazard, ...] = ()


class UnfinishedRunError(Exception):
    """A run was not finished.

    Attributes:
        records: the records so far.
        reactions: what was decided about its requests so far.
    """

    def __init__(self, message: str, records: tuple[Record, ...], reactions: tuple[Reaction, ...]) -> None:
        super().__init__(message)
        self.records, self.reactions = records, reactions


class TooLongError(UnfinishedRunError):
    """A run has more records than the caller allows."""

    def __init__(self, records: tuple[Record, ...], reactions: tuple[Reaction, ...]) -> None:
        super().__init__(f"more than {len(records)} records", records, reactions)


class UnplannedError(UnfinishedRunError):
    """A run asks for a plan that the source of plans refuses.

    Attributes:
        plans: the number of plans that the run has got before.
    """

    def __init__(self, plans: int, records: tuple[Record, ...], reactions: tuple[Reaction, ...]) -> None:
        super().__init__(f"plan {plans + 1} is refused", records, reactions)
        self.plans = plans


class Simulator:
    """Simulates runs of one model. Runs do not influence each other."""

    def __init__(
        self,
        model: BehaviorModel,
        options: RunnerOptions | None = None,
        plan_limits: PlanLimits | None = None,
        plans: PlanSource | None = None,
        program: Program | None = None,
    ) -> None:
        self.model = model
        self.options = options or RunnerOptions()
        self.plan_limits = plan_limits or PlanLimits.of(model)
        self.program = program or Program(model)
        self.plans: PlanSource = plans or PlanCache(self.planner)
        self.resources = {resource.name: resource for resource in model.resources}
        self.is_of_mutant = False

    @cached_property
    def planner(self) -> Planner:
        """The planner of the model; the source of plans may have another one that answers alike."""
        return Planner.of(self.model)

    def of_mutant(self, mutant: BehaviorModel, *, plans_alike: bool) -> Simulator:
        """Return a simulator of a mutant of the model, with the same limits.

        It asks the planner where a plan that a case has is no plan of the mutant, and leaves out impossible changes.

        Args:
            mutant: the mutant.
            plans_alike: whether each planning problem has the same answer in both, so that they share the answers.
        """
        simulator = copy(self)
        simulator.model, simulator.is_of_mutant = mutant, True
        simulator.program = self.program.of_mutant(mutant)
        simulator.resources = {resource.name: resource for resource in mutant.resources}
        simulator.planner = self.planner if plans_alike else Planner.of(mutant)
        if not plans_alike:
            simulator.plans = PlanCache(simulator.planner)
        return simulator

    def run(self, case: Case, choices: Choices, most_records: int | None = None) -> Simulated:
        """Run a case until each of its goals is reached or given up, or a change that it lists is impossible.

        Args:
            case: the case.
            choices: decides how resources react, and how messages travel.
            most_records: maximum number of records; `None` for no limit.

        Raises:
            TooLongError: the run has more records.
            UnplannedError: the source of plans refuses a plan.
        """
        runner = Runner(self.program, case.initial, self.options_for(case.limits))
        run = _SimulationRun(self, runner, choices, case)
        for injection in case.injections:
            run.schedule(0, InjectionGiven(injection))
        for goal in case.goals:
            run.schedule(0, GoalGiven(goal.name, goal.predicate, goal.when))
        run.plan_restarts(case.network.restarts_of_resources)
        run.begin_environment()
        return run.finish(most_records)

    def options_for(self, limits: CaseLimits) -> RunnerOptions:
        """Return the limits of a case; where it has none, those of the simulator."""
        options = self.options
        if limits.time_ns is not None:
            options = replace(options, time_limit_ns=limits.time_ns)
        return options if limits.plans is None else replace(options, plan_limit=limits.plans)


class _Arrives(Struct, frozen=True):
    """A copy of a request, or of its cancellation, arrives at its resource."""

    message: MessageKind
    request: int
    resource: str


class _Finishes(Struct, frozen=True):
    """The time that a resource takes for a job is over."""

    resource: str
    job: Job


class _Restarts(Struct, frozen=True):
    """A resource goes down, or comes up again."""

    resource: str
    is_down: bool


class _Changes(Struct, frozen=True):
    """Something outside the model changes variables now; several entries of one change follow each other."""

    values: Changes
    by: str


_Occurrence: TypeAlias = Event | _Arrives | _Finishes | _Restarts | ClockTick | _Changes

_BEHIND_ALL_OTHERS = 1 << 62
"""Added to the order of a change of the environment: at one moment it comes after all other events."""


class _ImpossibleChangeError(Exception):
    """No maker can make a change that the case lists."""

    def __init__(self, change: ImpossibleChange) -> None:
        super().__init__(str(change))
        self.change = change


class _SimulationRun:
    """The state of one simulation."""

    def __init__(self, simulator: Simulator, runner: Runner, choices: Choices, case: Case) -> None:
        self._simulator = simulator
        self._case = case
        self._runner = runner
        self._choices = choices
        self._environment = choices.environment
        self._rates = RateWatch(simulator.program) if case.environment else None
        self._left_out: list[ImpossibleChange] = []
        self._is_waiting = self._waited_to_limit = False
        self._order = count()
        self._heap: list[tuple[int, int, _Occurrence]] = []
        self._resources = {name: SimulatedResource.of(resource) for name, resource in simulator.resources.items()}
        self._devices = None if choices.is_plain else DeviceWatch(self._resources)
        self._operation: str | None = None
        self._records: list[Record] = []
        self._now_ns = 0
        self._end: End | None = None
        self._goals = self._ungiven = 1 + len(case.later)

    def schedule(self, at_ns: int, occurrence: _Occurrence) -> None:
        """Schedule an event; events of one moment happen in the order in which they were scheduled."""
        heapq.heappush(self._heap, (at_ns, next(self._order), occurrence))

    def plan_restarts(self, restarts: Iterable[Restart]) -> None:
        """Schedule the restarts of resources."""
        for restart in restarts:
            self.schedule(restart.at_ns, _Restarts(restart.resource, is_down=True))
            self.schedule(restart.at_ns + restart.for_ns, _Restarts(restart.resource, is_down=False))

    def begin_environment(self) -> None:
        """Schedule what the environment does from the beginning of the run."""
        if self._environment is not None:
            self._schedule_ticks(self._environment.begin())
            self._runner.changes_pending = self._environment.is_pending

    def _schedule_ticks(self, ticks: Iterable[ClockTick]) -> None:
        for tick in ticks:
            order = next(self._order) + (-_BEHIND_ALL_OTHERS if tick.precedes else _BEHIND_ALL_OTHERS)
            heapq.heappush(self._heap, (tick.at_ns, order, tick))

    def finish(self, most_records: int | None) -> Simulated:
        """Process events until the run for the last goal ends; raise `TooLongError` beyond `most_records`."""
        impossible = None
        try:
            while self._goals:
                if most_records is not None and len(self._records) > most_records:
                    raise TooLongError(tuple(self._records), self._choices.taken)
                self._handle(self._next_event())
        except _ImpossibleChangeError as error:
            self._end, impossible = End.IMPOSSIBLE, error.change
        assert self._end is not None  # noqa: S101 - a case has a goal, and its run has ended
        moves = None if self._environment is None else self._environment.taken(is_waiting=self._waited_to_limit)
        off_rates = () if self._rates is None else tuple(self._rates.left)
        left_out = tuple(self._left_out)
        missing = () if self._environment is None else self._environment.missing()
        missing = () if self._end is End.TIME_LIMIT else missing  # what may still come makes a run wait
        records = tuple(self._records)
        hazards = () if self._devices is None else self._devices.hazards(self._simulator.resources, records)
        return Simulated(self._end, self._now_ns, records, moves, impossible, left_out, off_rates, missing, hazards)

    def _handle(self, event: Event) -> None:
        """Let the runner handle an event, and carry out what it wants."""
        self._ungiven -= isinstance(event, GoalGiven)
        for effect in self._runner.handle(event, self._now_ns):
            if isinstance(effect, OUTWARD):
                self._perform(effect)
            else:
                self._records.append(effect)
                if self._choices.needs_operation:
                    self._follow_operation(effect)
        if self._environment is not None and self._goals and not self._ungiven:
            self._observe(self._environment)

    # the environment

    def _observe(self, environment: EnvironmentMoves) -> None:
        """Start and stop clocks in the state in which the runner is settled."""
        state = self._runner.packed_state
        self._schedule_ticks(environment.observe(state, self._now_ns))
        if self._rates is not None:
            self._rates.observe(state, self._now_ns)
        self._is_waiting = self._runner.awaits_change

    def _tick(self, tick: ClockTick) -> Event | None:
        assert self._environment is not None  # noqa: S101 - only an environment has clocks
        change, following = self._environment.tick(
            tick, self._runner.packed_state, is_waiting=self._runner.awaits_change
        )
        if following is not None:
            self._schedule_ticks((following,))
        self._waited_to_limit &= change is None
        return None if change is None else self._begin_change(change)

    def _begin_change(self, change: EnvironmentChange) -> Event:
        """Return the event of a change. One that no maker makes at once is several, one for each of its sources."""
        parts = parts_of(change, self._runner)
        for number, part in enumerate(parts[1:], start=1 - len(parts)):
            heapq.heappush(self._heap, (self._now_ns, number - _BEHIND_ALL_OTHERS, _Changes(part, change.by)))
        return self._change(parts[0], change.by)

    def _change(self, values: Changes, by: str) -> Event:
        """Return the event in which something outside the model changes variables."""
        event = event_of(values, by, self._runner)
        if event is None:
            return self._refuse(values, by)
        if self._rates is not None and event.by:
            self._rates.act(event.by, self._now_ns)
        return event

    def _refuse(self, values: Changes, by: str) -> Event:
        """End the run, as a change of the case is impossible; leave out the change on a mutant."""
        state, is_settled = self._runner.state, self._runner.is_settled
        reason = why_impossible(self._simulator.model, state, values, by, is_settled=is_settled)
        change = ImpossibleChange(self._now_ns, values, by, reason)
        if not self._simulator.is_of_mutant:
            raise _ImpossibleChangeError(change)
        self._left_out.append(change)
        return Measured(())

    # time

    def _next_event(self) -> Event:
        """Return the next event of the runner; at one moment other events precede a deadline, as they are in time."""
        deadline_ns = self._runner.deadline_ns
        while self._heap and (deadline_ns is None or self._heap[0][0] <= deadline_ns):
            self._now_ns, _, occurrence = heapq.heappop(self._heap)
            event = self._occur(occurrence)
            if event is not None:
                return event
        assert deadline_ns is not None  # noqa: S101 - a goal that is pursued has a time limit
        self._now_ns = deadline_ns
        return TimePassed()

    def _occur(self, occurrence: _Occurrence) -> Event | None:
        """Process an entry of the heap; return the event for the runner, if there is one."""
        match occurrence:
            case _Finishes(resource, job):
                return self._answer(resource, job)
            case _Arrives(message, request, resource):
                self._arrive(message, request, resource)
            case _Restarts(resource, is_down):
                self._restart(resource, is_down=is_down)
            case ClockTick():
                return self._tick(occurrence)
            case _Changes(values, by):
                return self._change(values, by)
            case _:
                return occurrence
        return None

    def _perform(self, effect: OutwardEffect) -> None:
        """Carry out an effect of the runner."""
        match effect:
            case SendRequest():
                self._choices.react(self._simulator.resources[effect.resource], self._operation)
                self._send(MessageKind.REQUEST, effect.request, effect.resource)
            case CancelRequest(request, resource):
                self._send(MessageKind.CANCEL, request, resource)
            case ChangeResource(resource, condition):
                for job, latency_ns in self._resources[resource].become(condition):
                    self.schedule(self._now_ns + latency_ns, _Finishes(resource, job))
                self._observe_device(resource)
            case AskPlan():
                self._plan(effect)
            case RunFinished():
                self._end = effect.end
                self._goals -= 1
                self._waited_to_limit |= self._is_waiting and effect.end in (End.TIME_LIMIT, End.NOT_STARTED)
            case _:
                assert_never(effect)

    def _follow_operation(self, record: Record) -> None:
        """Keep track of the current operation, which the records of one event may change several times."""
        if isinstance(record, BecameCurrent):
            self._operation = record.operation
        elif isinstance(record, OperationStepped) and record.target is OperationState.INITIAL:
            self._operation = None

    # resources and messages

    def _send(self, message: MessageKind, request: int, resource: str) -> None:
        """Send a message to a resource; without a delay it arrives at once."""
        for delay_ns in self._travel(message, request, resource):
            if self._devices is not None and message is MessageKind.CANCEL:
                self._devices.cancel(request, self._now_ns + delay_ns)
            if delay_ns:
                self.schedule(self._now_ns + delay_ns, _Arrives(message, request, resource))
            else:
                self._arrive(message, request, resource)

    def _travel(self, message: MessageKind, request: int, resource: str) -> tuple[int, ...]:
        delivery = self._choices.travel(request, message, self._now_ns)
        if delivery is not AT_ONCE and len(delivery) != 1:
            record = MessageDisturbed(self._now_ns, request, resource, message.value, len(delivery))
            self._records.append(record)
        return delivery

    def _arrive(self, message: MessageKind, request: int, name: str) -> None:
        resource = self._resources[name]
        begun = None
        if message is MessageKind.CANCEL:
            resource.cancel(request)
        else:
            begun = resource.receive(request, self._choices.taken_by(request))
        if begun is not None:
            job, latency_ns = begun
            self.schedule(self._now_ns + latency_ns, _Finishes(name, job))
        self._observe_device(name)

    def _observe_device(self, name: str, finished: Job | None = None) -> None:
        """Note at which requests a resource works now; `finished` is the job whose time is over."""
        if self._devices is not None:
            self._devices.observe(name, self._now_ns, finished)

    def _answer(self, resource: str, job: Job) -> Event | None:
        """Finish a job; return its reply if it arrives at once. A delayed reply is scheduled."""
        if not self._resources[resource].finish(job):
            return None
        self._observe_device(resource, job)
        reply = ReplyArrived(job.request, job.succeeds, job.measured)
        at_once = None
        for delay_ns in self._travel(MessageKind.REPLY, job.request, resource):
            if delay_ns or at_once is not None:
                self.schedule(self._now_ns + delay_ns, reply)
            else:
                at_once = reply
        return at_once

    def _restart(self, name: str, *, is_down: bool) -> None:
        resource = self._resources[name]
        resource.downs += 1 if is_down else -1
        resource.forget()
        self._observe_device(name)
        condition = "down" if resource.is_down else str(resource.condition)
        self._records.append(ResourceChanged(self._now_ns, NETWORK, name, condition))

    # planning

    def _plan(self, asked: AskPlan) -> None:
        """Plan now; the answer comes after the time that plans of the case take, by default at once."""
        simulator = self._simulator
        if self._case.plans and not simulator.is_of_mutant:
            known = recorded_answer(self._case, asked.ask, simulator.planner, asked.state, asked.goal)
            self._answer_later(PlanAnswered(asked.ask, PlanStatus(known.status), known.plan))
            return
        try:
            plans = self._choices.plans or simulator.plans
            answer = plans.plan(asked.state, asked.goal, simulator.plan_limits)
        except PlanRefusedError as error:
            raise UnplannedError(asked.ask - 1, tuple(self._records), self._choices.taken) from error
        plan = answer.plan if isinstance(answer, Solved) else ()
        if self._case.plans and self._is_still_a_plan(asked, answer):
            plan = self._case.plans[asked.ask - 1].plan
        self._answer_later(PlanAnswered(asked.ask, PlanStatus(answer.status), plan))

    def _answer_later(self, answer: PlanAnswered) -> None:
        self.schedule(self._now_ns + self._case.planning_ns, answer)

    def _is_still_a_plan(self, asked: AskPlan, answer: Answer) -> bool:
        """Return whether the plan that the case has is as good as the answer of the planner of a mutant."""
        if asked.ask > len(self._case.plans) or not isinstance(answer, Solved):
            return False
        known, planner = self._case.plans[asked.ask - 1], self._simulator.planner
        if known.status != Solved.status or planner.find_flaw(asked.state, asked.goal, known.plan) is not None:
            return False
        return planner.entry.is_external or len(known.plan) == len(answer.plan)
