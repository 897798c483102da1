"""The operation runner: applies events such as replies to the state of a run (paper, Sections II, IV; semantics 5, 6).

`Runner.handle` takes one event and then micro-steps until none applies. Injections come first; `micro_steps` has the
order of all others. The runner keeps the requests, the plan and the timers, and turns micro-steps into effects.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, assert_never

from msgspec import Struct

from scbm.cases import Condition
from scbm.cases.trace import (
    SENT,
    AutomaticTaken,
    BecameCurrent,
    End,
    InjectionApplied,
    LivelockedAtRest,
    MeasurementReceived,
    MeasurementRefused,
    OperationStepped,
    PlanAsked,
    PlanDropped,
    PlanReceived,
    PutBack,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
    RunStarted,
)
from scbm.model import PlanState
from scbm.model.predicates import TRUE
from scbm.running.events import (
    AskPlan,
    CancelRequest,
    ChangeResource,
    Effect,
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
    records_of,
)
from scbm.running.lifecycle import OperationMove, PlanEffect
from scbm.running.micro_steps import (
    MAX_MACRO_STEPS,
    MAX_TAKEN,
    MIN_PLANS_AT_ONCE,
    NO_TIME_PASSES,
    PLANS_WITHOUT_TIME,
    AutomaticMove,
    MacroStep,
    MicroStep,
    PlanStep,
    RequestCancelling,
    RequestSending,
    RunTurn,
    TimelessRequest,
    name_cycle,
    next_in_plan,
    without_time,
)
from scbm.running.requests import Requests

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from scbm.cases import Injection
    from scbm.cases.trace import Changes
    from scbm.model import Predicate, Value
    from scbm.model.packing import Test
    from scbm.running.compiled_steps import CompiledStep, RequestLine
    from scbm.running.micro_steps import PlanQueue
    from scbm.running.outside_changes import Maker
    from scbm.running.program import Program


_WELL = Condition()


def _nothing_pending(_: int) -> bool:
    return False


class _Armed(Struct):
    """An injection that has not acted yet.

    Attributes:
        injection: the injection.
        step: what it does; with `after` its guard is only what every such assignment needs.
        trigger: the predicate after which the time of `after` runs; `None` without `after`.
        occupies: the shared resource that another user occupies by it, if that is what it does.
        due_ns: when that time is over; `None` until the predicate has been true.
    """

    injection: Injection
    step: CompiledStep
    trigger: Test | None
    occupies: RequestLine | None = None
    due_ns: int | None = None

    def acts(self, now_ns: int, state: int) -> bool:
        """Return whether the injection acts now; begin the time of `after` once its predicate is true."""
        if self.next_ns(now_ns) is not None:
            return False
        if self.trigger is not None and self.due_ns is None:
            if not self.trigger(state):
                return False
            self.due_ns = now_ns + (self.injection.after_ns or 0)
            if self.due_ns > now_ns:
                return False
        return self.step.test(state)

    def next_ns(self, now_ns: int) -> int | None:
        """Return the later time before which the injection does not act; `None` if it only waits for a predicate."""
        earliest_ns = self.injection.at_ns if self.due_ns is None else self.due_ns
        return earliest_ns if earliest_ns is not None and earliest_ns > now_ns else None

    def acts_later(self, now_ns: int, state: int) -> bool:
        """Return whether the injection will act if nothing but time changes."""
        if self.next_ns(now_ns) is None:
            return False
        return (self.trigger is None or self.due_ns is not None or self.trigger(state)) and self.step.test(state)


class _Held(Struct):
    """An injection that acted and will be put back.

    Attributes:
        injection: the injection.
        until_ns: when it is put back.
        before: the earlier values of its variables, without those that something else has changed since.
        occupies: the shared resource that another user occupies by it, if that is what it does.
    """

    injection: Injection
    until_ns: int
    before: dict[str, Value]
    occupies: RequestLine | None = None


class Runner:
    """The runner of one model: pursues one goal after the other.

    Attributes:
        program: the compiled model.
        options: its limits.
        changes_pending: returns whether the caller will report a change from outside if nothing but time passes from a
            settled packed state on. Then a run for which no plan exists waits (semantics 5.6).
    """

    def __init__(
        self, program: Program, state: Mapping[str, Value], options: RunnerOptions | None = None, now_ns: int = 0
    ) -> None:
        """Start in a state of the world; the runner's own variables are at rest.

        Args:
            program: the compiled model.
            state: a value for every variable of the world.
            options: limits.
            now_ns: the time now; events must not come from before it.
        """
        self.program = program
        self.options = options or RunnerOptions()
        self.changes_pending: Callable[[int], bool] = _nothing_pending
        self._now_ns = now_ns
        self._at_once = 0
        self._time_passes = False
        self._state = program.begin(state)
        self._effects: list[Effect] = []
        self._requests = Requests()
        self._waiting: deque[GoalGiven] = deque()
        self._wait_deadline_ns: int | None = None
        self._armed: list[_Armed] = []
        self._held: list[_Held] = []
        self._conditions: dict[str, list[Injection]] = {}
        self._asks = 0
        self._has_started = False
        self._taken: list[tuple[str, int]] = []
        self._cycle: tuple[str, ...] = ()
        self._rest()

    def _rest(self) -> None:
        """Forget the goal, its plan and its timers."""
        self._goal: GoalGiven | None = None
        self._queue = self.program.queue()
        self._steps = self.program.micro_steps(None)
        self._planner_reads = 0
        self._timer_ns: int | None = None
        self._goal_deadline_ns = 0
        self._plans = 0
        self._plans_at_once = 0
        self._counted_ns = -1
        self._last_plan: tuple[str, ...] = ()
        self._asked: int | None = None
        self._asked_in: int | None = None
        self._unsolvable_in: int | None = None
        self._awaits_change = False

    # the public interface

    def handle(self, event: Event, now_ns: int) -> list[Effect]:
        """Handle an event at time `now_ns`, and return its effects in order. Before the first event, settle at rest.

        Deadlines pass with `TimePassed` only. It is due when `deadline_ns` has come, after all other events of that
        moment. Raises `ValueError` if `now_ns` is earlier than the last event.
        """
        if now_ns < self._now_ns:
            raise ValueError(f"time runs backwards, from {self._now_ns} ns to {now_ns} ns")
        self._at_once = self._at_once + 1 if now_ns == self._now_ns else 0
        self._now_ns = now_ns
        self._effects = []
        if not self._has_started:
            self._start()
        self._time_passes = isinstance(event, TimePassed)
        if self._receive(event):
            self._settle()
        return self._effects

    @property
    def deadline_ns(self) -> int | None:
        """The time at which `TimePassed` is due unless another event comes first; `None` if the runner has no timer."""
        timer_ns = self._timer_ns
        if self._goal is None:
            timer_ns = self._wait_deadline_ns
        elif timer_ns is None or self._goal_deadline_ns < timer_ns:
            timer_ns = self._goal_deadline_ns
        if not self._armed and not self._held:
            return timer_ns
        times = [next_ns for armed in self._armed if (next_ns := armed.next_ns(self._now_ns)) is not None]
        times += [held.until_ns for held in self._held]
        return min(times if timer_ns is None else [*times, timer_ns], default=None)

    @property
    def state(self) -> dict[str, Value]:
        """The value of every variable, the runner's own included."""
        return self.program.packing.values(self._state)

    @property
    def packed_state(self) -> int:
        """The state as the program packs it."""
        return self._state

    @property
    def is_at_rest(self) -> bool:
        """Whether no goal is pursued."""
        return self._goal is None

    @property
    def awaits_change(self) -> bool:
        """Whether the runner waits for a change: no plan exists, or `when` of the next goal does not hold."""
        return self._awaits_change or self._wait_deadline_ns is not None

    @property
    def dropped_replies(self) -> dict[str, int]:
        """The number of dropped replies, by the reason: `late`, `repeated`, `unknown`."""
        return dict(self._requests.dropped)

    # events

    def _start(self) -> None:
        """Settle without a goal: automatic transitions are taken, and nothing is sent (semantics 5)."""
        self._has_started = True
        self._effects.append(RunnerStarted(self._now_ns, tuple(self.state.items())))
        self._settle()

    def _receive(self, event: Event) -> bool:
        """Apply an event; return whether micro-steps may follow."""
        match event:
            case ReplyArrived():
                self._receive_reply(event)
            case PlanAnswered():
                self._receive_plan(event)
            case GoalGiven():
                self._waiting.append(event)
                if self._goal is None:  # at once, so that all that follows from the goal belongs to its run
                    self._start_next_goal()
                return not self._cycle
            case Measured():
                self._receive_measured(event)
            case InjectionGiven(injection):
                return self._arm(injection)
            case TimePassed():
                pass
            case _:
                assert_never(event)
        return True

    def _arm(self, injection: Injection) -> bool:
        """Arm an injection; return whether it acts now. One that does not act changes nothing (semantics 7.2)."""
        trigger = None if injection.after_ns is None else self.program.test(injection.when or TRUE)
        armed = _Armed(injection, self.program.injection(injection), trigger, self.program.occupied_by(injection))
        self._armed.append(armed)
        self._at_once -= 1  # an injection that is given is no event of the run
        return armed.acts(self._now_ns, self._state) and self._is_free(armed.occupies)

    def _receive_reply(self, reply: ReplyArrived) -> None:
        line = self._requests.answer(reply.request)
        if isinstance(line, str):
            self._effects.append(ReplyDropped(self._now_ns, reply.request, line))
            return
        known = self.program.measured[line.number]
        measured = self._accepted(reply.measured, known)
        excluded = [(name, value) for name, value in measured if value not in known[name]]
        if excluded and (forcing := self._set(self._with(excluded))):
            self._effects.append(InjectionApplied(self._now_ns, SENT, None, forcing, forced=True))
        keep, bits = line.succeeded if reply.succeeded else line.failed
        changes = self._set(self._with(measured) & keep | bits)
        name = line.resource.name
        self._effects.append(ReplyReceived(self._now_ns, reply.request, name, reply.succeeded, changes, measured))

    def _receive_measured(self, event: Measured) -> None:
        """Apply values that come without a request; if no maker of the model can send them, they force the state."""
        measured = self._accepted(event.values, self.program.measurable)
        target = self._with(measured)
        forced = not self._can_change_to(target)
        changes = self._set(target)
        if forced:
            self._effects.append(InjectionApplied(self._now_ns, event.by or SENT, None, changes, forced))
        else:
            self._effects.append(MeasurementReceived(self._now_ns, changes, event.by, measured))

    def _accepted(self, values: Changes, names: Collection[str]) -> Changes:
        """Return the values of these variables that are in their domains; refuse and record the others."""
        space = self.program.packing.space
        accepted = tuple((name, value) for name, value in values if name in names and value in space[name].domain)
        refused = (pair for pair in values if pair not in accepted) if len(accepted) < len(values) else ()
        self._effects.extend(MeasurementRefused(self._now_ns, name, value) for name, value in refused)
        return accepted

    def _with(self, values: Iterable[tuple[str, Value]]) -> int:
        """Return the packed state with some other values."""
        keep, bits = self.program.packing.assignment(dict(values))
        return self._state & keep | bits

    # changes from outside

    @property
    def in_flight(self) -> tuple[int, ...]:
        """The resources with a request in flight, by number."""
        return tuple([line.number for line in self._requests.in_flight])

    @property
    def is_settled(self) -> bool:
        """Whether no micro-step is left; without a goal automatic transitions may repeat without end."""
        return self._is_settled_in(self._state)

    def can_be_changed(self, values: Changes, by: str = "") -> bool:
        """Return whether a maker outside the model can make a change now; `by`: this environment transition alone."""
        if not by and self._with(values) == self._state:
            return True
        return self.is_settled and self.maker_of(values, by) is not None

    def maker_of(self, values: Changes, by: str = "") -> Maker | None:
        """Return who outside the model makes a change in the present state, if it is settled; `by` as above."""
        return self.program.outside.maker_of(self._state, self._with(values), self.in_flight, by)

    def _can_change_to(self, target: int) -> bool:
        """Return whether something outside the model can change the present state to another one (semantics 9.10)."""
        return self.program.outside.can_lead(self._state, target, self.in_flight, self._is_settled_in)

    def _is_settled_in(self, state: int) -> bool:
        """Return whether no micro-step is left in a packed state. A deadline may pass later in the same instant."""
        step = self._steps.first(state, self._requests.in_flight, timer_passed=False)
        if step is not RunTurn.FOLLOW_PLAN:
            return step is None
        return self._plan_step(state, may_change=True) in (PlanStep.AWAIT_ANSWER, PlanStep.AWAIT_CHANGE)

    def _receive_plan(self, answer: PlanAnswered) -> None:
        if answer.ask != self._asked:
            self._effects.append(PlanDropped(self._now_ns, answer.ask))
            return
        self._asked = None
        state = self._state
        if answer.status is PlanStatus.SOLVED:
            self._queue, self._unsolvable_in = self.program.queue(answer.plan), None
            self._last_plan = answer.plan
            state = self._in_plan_state(PlanState.EXECUTING)
        changes = self._set(state)
        self._effects.append(PlanReceived(self._now_ns, answer.ask, answer.status.value, answer.plan, changes))
        if answer.status is PlanStatus.LIMIT_REACHED:
            self._end(End.PLANNER_LIMIT)
        elif answer.status is PlanStatus.NO_PLAN_FOUND:
            self._end(End.NO_PLAN_FOUND)
        elif answer.status is PlanStatus.UNSOLVABLE:
            self._unsolvable_in = self._asked_in

    def _may_still_change(self) -> bool:
        """Return whether a change is pending that needs nothing but time (semantics 5.6)."""
        if self._requests.in_flight or self._held or self.options.awaits_measurements:
            return True
        if self.changes_pending(self._state):
            return True
        return any(armed.acts_later(self._now_ns, self._state) for armed in self._armed)

    def _plan_step(self, state: int, *, may_change: bool) -> PlanStep:
        """Return what the run does in a packed state while no operation is current and its goal does not hold."""
        unsolvable_in = self._unsolvable_in
        return next_in_plan(
            is_queued=self._queue.first is not None,
            is_asking=self._asked is not None,
            # as the planner has answered for a state that is the same to it
            is_unsolvable=unsolvable_in is not None and not (unsolvable_in ^ state) & self._planner_reads,
            may_change=may_change,
        )

    # settling

    def _settle(self) -> None:
        self._cycle = ()
        self._count_anew()
        is_simple = not (self._armed or self._held or self._time_passes or self._requests.in_flight)
        if not (is_simple and self._take_macro_step()):
            self._take_micro_steps()
        while self._goal is not None:
            if self._has_passed(self._goal_deadline_ns):
                self._end(End.TIME_LIMIT)
            elif self._at_once >= self.options.instant_bound:
                self._end(End.LIVELOCK, (NO_TIME_PASSES,))
            else:
                return
            self._take_micro_steps()

    def _count_anew(self) -> None:
        """Begin to count automatic transitions: only those that nothing else is between are a livelock (5.1)."""
        self._taken = []

    def _take_micro_steps(self) -> None:
        """Take micro-steps until none applies; other users of resources act in between, where the runner is settled."""
        while self._micro_step() or ((self._armed or self._held) and self._let_others_act()):
            pass

    def _has_passed(self, deadline_ns: int) -> bool:
        """Return whether a deadline has passed. Other events than `TimePassed` are in time at that moment."""
        return self._time_passes and self._now_ns >= deadline_ns

    def _take_macro_step(self) -> bool:
        """Take the micro-steps that follow from the packed state and the queue alone: at once, if they are known.

        Returns whether the run is settled then; if not, more micro-steps may follow.
        """
        memoized, start = self._steps.macro_steps, (self._state, self._queue)
        known = memoized.get(start)
        if known is None:
            new = self._new_macro_step()
            if len(memoized) < MAX_MACRO_STEPS:
                memoized[start] = new
            return False
        if known.longest > self.options.livelock_bound:
            return False
        self._repeat(known)
        return known.settles and self._goal is not None

    def _new_macro_step(self) -> MacroStep:
        """Take micro-steps one by one, up to the first request, and return what they did."""
        effects, self._effects = self._effects, []
        request, sets_timer, longest = None, False, 0
        while request is None and len(self._taken) < min(MAX_TAKEN, self.options.livelock_bound):
            step = self._steps.first(self._state, (), timer_passed=False)
            if isinstance(step, RequestSending):
                request = self._request_of(step)
            elif step is RunTurn.FOLLOW_PLAN and self._queue.first is not None:
                self._make_current(self._queue)
            elif isinstance(step, AutomaticMove):
                self._take_automatic(step)
                sets_timer = sets_timer or step.failed is not None
            elif isinstance(step, OperationMove) and step.rule.plan is not PlanEffect.MODEL_ERROR:
                self._move_operation(step)
                sets_timer = True
            else:
                break
            longest = max(longest, len(self._taken))
        records = without_time(records_of(self._effects))
        self._effects = effects + self._effects
        if request is not None:
            self._send(request)
        timer_ns = None if self._timer_ns is None else self._timer_ns - self._now_ns
        settles = self._steps.first(self._state, self._requests.in_flight, timer_passed=False) is None
        taken = tuple(self._taken)
        return MacroStep(records, request, self._state, self._queue, sets_timer, timer_ns, taken, longest, settles)

    def _repeat(self, step: MacroStep) -> None:
        now_ns, effects = self._now_ns, self._effects
        for make, fields in step.records:
            effects.append(make(now_ns, *fields))
        self._state, self._queue = step.after, step.queue
        if step.sets_timer:
            self._timer_ns = None if step.timer_ns is None else now_ns + step.timer_ns
        self._taken.extend(step.taken)
        if step.request is not None:
            self._send(step.request)

    def _micro_step(self) -> bool:
        """Take the first micro-step that applies; return `False` if none does, so that the runner is settled."""
        if (self._held and self._put_back()) or (self._armed and self._inject()):
            return True
        timer_passed = self._time_passes and self._timer_ns is not None and self._has_passed(self._timer_ns)
        step = self._steps.first(self._state, self._requests.in_flight, timer_passed=timer_passed)
        if isinstance(step, OperationMove):  # most steps are moves
            self._move_operation(step)
            return True
        if isinstance(step, AutomaticMove) and len(self._taken) >= self.options.livelock_bound:
            if self._goal is not None:
                self._end(End.LIVELOCK, name_cycle(self._taken))
                return True
            self._livelock_at_rest()
            step = None
        return self._start_next_goal() if step is None and self._goal is None else self._follow(step)

    def _follow(self, step: MicroStep | None) -> bool:
        match step:
            case None:
                return False
            case OperationMove():
                self._move_operation(step)
            case AutomaticMove():
                self._take_automatic(step)
            case RequestSending():
                self._cancel(step.line, self._state)
                self._send(self._request_of(step))
            case RequestCancelling(line, after):
                self._cancel(line, after)
            case RunTurn.FOLLOW_PLAN:
                return self._follow_plan()
            case RunTurn.REACH_GOAL:
                self._end(End.REACHED)
            case RunTurn.ABORT:
                self._end(End.ABORTED)
            case _:
                assert_never(step)
        return True

    # 5.0: injections

    def _inject(self) -> bool:
        for index, armed in enumerate(self._armed):
            if armed.occupies is None and armed.acts(self._now_ns, self._state):
                del self._armed[index]
                self._apply(armed)
                return True
        return False

    def _apply(self, armed: _Armed) -> None:
        self._count_anew()
        injection = armed.injection
        before = self._state
        after = armed.step.update(before)
        assert after is not None  # noqa: S101 - constants never leave a domain
        failed, names = None, [name for name, _ in injection.assign]
        if armed.occupies is not None:
            keep, bits = armed.occupies.executing
            after, names = after & keep | bits, [armed.occupies.resource.request_state]
        if armed.step.fails_operation:
            operation, after = self.program.fail_current(after)
            failed, self._timer_ns = operation.name, None
        forced = not self._can_change_to(after)
        changes = self._set(after)
        if changes:
            self._effects.append(InjectionApplied(self._now_ns, injection.name, failed, changes, forced))
        if injection.resource is not None:
            before_it = self._condition_of(injection.resource)
            self._conditions.setdefault(injection.resource, []).append(injection)
            self._change_resource(injection, injection.resource, before_it)
        if injection.hold_ns is not None:
            packing = self.program.packing
            # States of operations and plans are never put back: the runner continues from the injected ones.
            was = {name: packing.value(before, name) for name in names if not packing.space[name].role.is_runner}
            self._held.append(_Held(injection, self._now_ns + injection.hold_ns, was, armed.occupies))

    def _condition_of(self, resource: str) -> Condition:
        """Return the condition of a resource: of the injections that are in force, the last one decides."""
        in_force = self._conditions.get(resource, ())
        return (in_force[-1].condition if in_force else None) or _WELL

    def _change_resource(self, injection: Injection, resource: str, before: Condition) -> None:
        """Record the condition of a resource after an injection if it has changed, and report it to the caller."""
        condition = self._condition_of(resource)
        if condition != before:
            self._effects.append(ResourceChanged(self._now_ns, injection.name, resource, str(condition)))
            self._effects.append(ChangeResource(resource, condition))

    def _put_back(self) -> bool:
        for index, held in enumerate(self._held):
            if held.occupies is None and self._now_ns >= held.until_ns:
                del self._held[index]
                self._release(held)
                return True
        return False

    def _release(self, held: _Held) -> None:
        """Put back the variables of an injection that nothing else has changed since."""
        self._count_anew()
        injection, packing = held.injection, self.program.packing
        if injection.assign or held.occupies is not None:
            keep, bits = packing.assignment(held.before)
            target = self._state & keep | bits
            forced = not self._can_change_to(target)
            self._effects.append(PutBack(self._now_ns, injection.name, self._set(target), forced))
        if injection.resource is not None:
            before = self._condition_of(injection.resource)
            in_force = self._conditions[injection.resource]
            in_force[:] = [other for other in in_force if other is not injection]
            self._change_resource(injection, injection.resource, before)

    # other users of shared resources

    def _let_others_act(self) -> bool:
        """Let another user leave a shared resource, or occupy a free one (semantics 9.5); return whether one does."""
        for index, held in enumerate(self._held):
            if held.occupies is not None and self._now_ns >= held.until_ns:
                del self._held[index]
                self._release(held)
                return True
        for index, armed in enumerate(self._armed):
            is_other = armed.occupies is not None and self._is_free(armed.occupies)
            if is_other and armed.acts(self._now_ns, self._state):
                del self._armed[index]
                self._apply(armed)
                return True
        return False

    def _is_free(self, line: RequestLine | None) -> bool:
        """Return whether a shared resource can be occupied, as nothing uses it; `None` is no such resource."""
        if line is None:
            return True
        keep, bits = line.idle
        return self._state & keep | bits == self._state and line not in self._requests.in_flight

    # 5.1: automatic transitions

    def _livelock_at_rest(self) -> None:
        """Record, once in a settling, that automatic transitions repeat without a goal: no goal can begin then."""
        if not self._cycle:
            self._cycle = name_cycle(self._taken)
            self._effects.append(LivelockedAtRest(self._now_ns, self._cycle))

    def _take_automatic(self, move: AutomaticMove) -> None:
        transition, failed, after = move
        if failed is not None:
            self._timer_ns = None
        changes = self._set(after)
        self._taken.append((transition.name, after))
        name = None if failed is None else failed.name
        self._effects.append(AutomaticTaken(self._now_ns, transition.name, name, changes))

    # 5.3: requests

    def _request_of(self, step: RequestSending) -> TimelessRequest:
        """Set the state in which a request is sent, and return the request."""
        packing, before = self.program.packing, self._state
        payload = tuple((name, packing.value(before, name)) for name in step.line.resource.request)
        return TimelessRequest(step.line, payload, self._set(step.after))

    def _send(self, sent: TimelessRequest) -> None:
        line, payload, changes = sent
        request, name = self._requests.send(line), line.resource.name
        self._effects.append(RequestSent(self._now_ns, request, name, payload, changes))
        self._effects.append(SendRequest(request, name, payload))

    def _cancel(self, line: RequestLine, after: int) -> None:
        """Cancel the request in flight, if there is one, and set the state `after`."""
        request = self._requests.cancel(line)
        if request is None:
            return
        name = line.resource.name
        self._effects.append(RequestCancelled(self._now_ns, request, name, self._set(after)))
        self._effects.append(CancelRequest(request, name))

    # 5.5: the goals, the plan, the operation

    def _start_next_goal(self) -> bool:
        """Begin the next goal, or give it up before it began; return `False` if there is none, or it has to wait."""
        if not self._waiting:
            return False
        goal = self._waiting[0]
        if self._cycle:
            self._give_up_goal(End.LIVELOCK, self._cycle)
            return True
        if goal.when is not None and not self.program.test(goal.when)(self._state):
            return self._give_up_unless_pending(goal.when)
        self._goal = self._waiting.popleft()
        self._wait_deadline_ns = None
        self._count_anew()
        self._steps = self.program.micro_steps(goal.predicate)
        self._planner_reads = self.program.planner_reads(goal.predicate)
        self._goal_deadline_ns = self._now_ns + self.options.time_limit_ns
        before = tuple(self.state.items())
        changes = self._set(self._in_plan_state(PlanState.PLANNING))
        self._effects.append(RunStarted(self._now_ns, goal.name, str(goal.predicate), before, changes))
        return True

    def _give_up_unless_pending(self, when: Predicate) -> bool:
        """Wait for the predicate of a goal while a change is pending, at most for the time limit (semantics 5.7).

        Return whether the goal is given up.
        """
        if self._wait_deadline_ns is None:
            self._wait_deadline_ns = self._now_ns + self.options.time_limit_ns
        if self._may_still_change() and not self._has_passed(self._wait_deadline_ns):
            return False
        self._give_up_goal(End.NOT_STARTED, (str(when),))
        return True

    def _give_up_goal(self, end: End, detail: tuple[str, ...]) -> None:
        """End the next goal before its run has begun."""
        goal = self._waiting.popleft().name
        self._wait_deadline_ns = None
        self._effects.append(RunEnded(self._now_ns, goal, end.value, detail, ()))
        self._effects.append(RunFinished(goal, end))

    def _follow_plan(self) -> bool:
        may_change = self._unsolvable_in is not None and self._may_still_change()
        following = self._plan_step(self._state, may_change=may_change)
        match following:
            case PlanStep.TAKE_NEXT:
                self._make_current(self._queue)
            case PlanStep.REQUEST_PLAN:
                self._ask_plan()
            case PlanStep.END_UNSOLVABLE:
                self._end(End.UNSOLVABLE)
            case PlanStep.AWAIT_CHANGE:
                self._awaits_change = True
                return False
            case PlanStep.AWAIT_ANSWER:
                return False
            case _:
                assert_never(following)
        return True

    def _ask_plan(self) -> None:
        assert self._goal is not None  # noqa: S101 - plans are made for a goal
        if self._awaits_change:  # the plans of a wait do not count (semantics 5.6)
            self._awaits_change = False
        elif self._plans == self.options.plan_limit:
            self._end_without_plans()
            return
        else:
            self._plans += 1
            self._plans_at_once = self._plans_at_once + 1 if self._counted_ns == self._now_ns else 1
            self._counted_ns = self._now_ns
        self._count_anew()
        self._asks += 1
        self._asked = self._asks
        changes = self._set(self._in_plan_state(PlanState.PLANNING))
        self._asked_in = self._state
        self._effects.append(PlanAsked(self._now_ns, self._asked, changes))
        self._effects.append(AskPlan(self._asked, self.state, self._goal.predicate))

    def _end_without_plans(self) -> None:
        """End a run that has used its plans: as a livelock if it asked for many of them in this instant."""
        if self._counted_ns == self._now_ns and self._plans_at_once >= MIN_PLANS_AT_ONCE:
            self._end(End.LIVELOCK, (PLANS_WITHOUT_TIME, *self._last_plan))
        else:
            self._end(End.REPLAN_LIMIT)

    def _make_current(self, queue: PlanQueue) -> None:
        operation, rest = queue.first, queue.rest
        assert operation is not None and rest is not None  # noqa: S101, PT018 - callers have seen that one follows
        self._queue = rest
        self._count_anew()
        keep, bits = operation.take_current
        self._effects.append(BecameCurrent(self._now_ns, operation.name, self._set(self._state & keep | bits)))

    def _move_operation(self, move: OperationMove) -> None:
        operation, rule, transition, after, timer_ns = move
        if rule.plan is PlanEffect.MODEL_ERROR:
            self._end(End.MODEL_ERROR, (f"the `timedout` actions of {operation.name} would leave a domain",))
            return
        changes = self._set(after)
        self._timer_ns = None if timer_ns is None else self._now_ns + timer_ns
        name = transition.name or None
        self._effects.append(OperationStepped(self._now_ns, operation.name, rule.source, rule.target, name, changes))
        if rule.plan is PlanEffect.REPLAN:
            self._queue = self.program.queue()

    # the end

    def _end(self, end: End, detail: tuple[str, ...] = ()) -> None:
        """End the run: cancel its requests, make the operation initial, and drop the plan.

        Automatic transitions are counted anew afterwards, so they follow every kind of end alike.
        """
        assert self._goal is not None  # noqa: S101 - only a run that goes on can end
        for line in list(self._requests.in_flight):
            keep, bits = line.cleared
            self._cancel(line, self._state & keep | bits)
        goal = self._goal.name
        changes = self._set(self.program.end(self._state, end.plan_state))
        self._effects.append(RunEnded(self._now_ns, goal, end.value, detail, changes))
        self._effects.append(RunFinished(goal, end))
        self._count_anew()
        self._rest()

    # the packed state

    def _set(self, state: int) -> Changes:
        """Set the packed state, and return the variables that change."""
        if state == self._state:
            return ()
        changes = self.program.packing.changes(self._state, state)
        self._state = state
        for held in self._held:
            for name, _ in changes:
                held.before.pop(name, None)
        return changes

    def _in_plan_state(self, plan_state: PlanState) -> int:
        keep, bits = self.program.plan_states[plan_state]
        return self._state & keep | bits
