"""The checker's runner on named values, one method for each kind of micro-step; read it beside semantics 5 and 6.

It is a second implementation of `scbm.running`, on purpose. The events of a settled run and its steps are here as well.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, assert_never

from msgspec import Struct

from scbm.model import OperationState, PlanState, RequestState, format_value
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE, operation_state_name
from scbm.proofcheck.certificate import ClaimedAspect, ClaimedObligation
from scbm.proofcheck.checker_planner import NoPlanExists, PlanningLimitReached, PlansFound

if TYPE_CHECKING:
    from scbm.model import Predicate, Value
    from scbm.proofcheck.certificate import Queue, Situation
    from scbm.proofcheck.checker_planner import CheckedPlans, Following
    from scbm.proofcheck.guarded_parts import GuardedRule, GuardedRules, OperationRules, Values

_ENDED = (OperationState.COMPLETED, OperationState.FAILED, OperationState.TIMEDOUT)

MAX_AUTOMATIC = 1_000
"""Maximum number of automatic transitions in a row, without another operation or a request for a plan (5.1)."""


class Question(Struct, frozen=True):
    """A request for a plan that the planner has not answered yet.

    Attributes:
        asked_in: the values at the request; `None` if they have changed since.
        answer: the answer that it will have.
    """

    asked_in: Values | None
    answer: PlansFound | NoPlanExists


class MomentKind(Enum):
    """What a requirement may ask about in a run (semantics 7.3, 7.12)."""

    STATE = "a state after a record"
    BECOMES_CURRENT = "an operation becomes current"
    ASKS_PLAN = "a plan is requested"
    REACHES_GOAL = "the goal is reached"
    TRIGGERS = "an operation makes a trigger true"
    ENDS_OPERATION = "an operation completes, fails, times out or is given up"


class CheckedMoment(NamedTuple):
    """A moment of a run.

    Attributes:
        values: those of the state, or before what happens.
        operation: the operation that it is about.
        about: the resource that is triggered, or the state in which the operation ends.
    """

    kind: MomentKind
    values: Values
    operation: str = ""
    about: str = ""


class PossibleEnd(NamedTuple):
    """A moment in which a run may end, beside the one in which it does.

    Attributes:
        values: the values then.
        in_flight: the requests in flight then.
        moments: the number of moments before.
        is_livelock: whether the run repeats automatic transitions there without end; else a limit of plans ends it.
    """

    values: Values
    in_flight: tuple[str, ...]
    moments: int
    is_livelock: bool = False


class UncheckableStepError(Exception):
    """A step cannot be checked within the limits of the checker."""


class CheckedRun:
    """A run for one goal. Its creator sets its situation and passes one event; then the run settles.

    Attributes:
        values: the values of the variables of the certificate, and the states of all operations.
        queue: what is left of the plan after the current operation.
        in_flight: the resources with a pending request, in the order of their requests.
        question: the request for a plan that is open.
        unsolvable_in: the values from which the planner has answered that no plan exists.
        has_ended: whether no goal is pursued.
        is_livelocked: whether automatic transitions repeat without end while no goal is pursued.
        visited: the names of the obligations visited so far.
        may_end: the moments in which the run may end instead: requests for plans, and the states of a livelock.
        moments: what requirements may ask about, in order.
        has_reached: whether the run has ended as its goal was reached.
        must_choose: whether several things can follow in the plan, and it is open which one does.
    """

    def __init__(self, rules: GuardedRules, goal: Predicate, plans: CheckedPlans, values: Values) -> None:
        self.values = values
        self.queue: Queue = None
        self.in_flight: list[str] = []
        self.question: Question | None = None
        self.unsolvable_in: Values | None = None
        self.has_ended = False
        self.is_livelocked = False
        self.visited: dict[str, None] = {}
        self.may_end: list[PossibleEnd] = []
        self.moments: list[CheckedMoment] = []
        self.has_reached = False
        self.must_choose = False
        self._rules = rules
        self._goal = goal
        self._plans = plans
        self._planner_reads = rules.planner_reads(goal)
        self._deadline_has_passed = False
        self._automatic = 0

    # events

    def receive_reply(self, reply: ReplyEvent) -> None:
        """Apply the reply to the request in flight: its measured values, and the request state (6.2, 6.3)."""
        self.in_flight.remove(reply.resource)
        state = RequestState.SUCCEEDED if reply.succeeded else RequestState.FAILED
        self._set(dict(reply.measured))
        self._set({self._rules.resources[reply.resource].request_state: state.value})

    def change(self, changes: tuple[tuple[str, Value], ...]) -> None:
        """Let something outside the model change variables."""
        self._set(dict(changes))

    def receive_answer(self) -> None:
        """Take the answer of the planner: a plan becomes the queue; without one nothing happens before settling."""
        assert self.question is not None  # noqa: S101 - only questions are answered
        question, self.question = self.question, None
        match question.answer:
            case PlansFound(queue):
                self.queue = queue
                self._set({PLAN_STATE: PlanState.EXECUTING.value})
                for operation in self._plans.queued(queue):
                    self._visit(operation, ClaimedAspect.QUEUED)
            case NoPlanExists():
                self.unsolvable_in = question.asked_in
            case _:
                assert_never(question.answer)

    def choose(self, following: Following) -> None:
        """Let an operation become current, or the plan end."""
        operation, self.queue = following
        self._automatic = 0
        if operation is not None:
            self._note(MomentKind.BECOMES_CURRENT)
            self._set({CURRENT_NAME: operation})

    def pass_deadline(self) -> None:
        """Let the timer of the current operation pass."""
        self._deadline_has_passed = True

    def settle(self) -> None:
        """Take micro-steps until none applies."""
        self._automatic = 0
        while self._micro_step():
            pass

    def _micro_step(self) -> bool:
        """Take the first micro-step that applies, in the order of semantics 5; return `False` if none does."""
        self._note(MomentKind.STATE)
        return (
            self._take_automatic()
            or self._abort()
            or self._send_request()
            or self._cancel_request()
            or self._reach_goal()
            or self._go_on()
        )

    # 5.1, 5.2: automatic transitions, livelock, abort

    def _take_automatic(self) -> bool:
        """Take the first automatic transition that changes the values, also after the end of the run."""
        following = self._rules.next_automatic(self.values)
        if following is None:
            return False
        if self._automatic == MAX_AUTOMATIC:
            return self._livelock()
        self._automatic += 1
        rule, self.values = following
        self._visit(rule.name, ClaimedAspect.TAKEN)
        if rule.fails_operation:
            self._become(OperationState.FAILED)
        return True

    def _livelock(self) -> bool:
        if self.has_ended:
            self.is_livelocked = True
            return False
        self._note_cycle()
        self.end(PlanState.ABORTED)
        return True

    def _note_cycle(self) -> None:
        """Note that the run may end in each state that automatic transitions repeat: where they stop is arbitrary."""
        numbers = [number for number, each in enumerate(self.moments) if each.kind is MomentKind.STATE]
        cycle: list[PossibleEnd] = []
        for number in reversed(numbers[-MAX_AUTOMATIC - 1 : -1]):
            values = self.moments[number].values
            cycle.append(PossibleEnd(values, tuple(self.in_flight), number + 1, is_livelock=True))
            if values == self.values:
                self.may_end += cycle
                return

    def _abort(self) -> bool:
        if self.has_ended or self.values[PLAN_STATE] != PlanState.ABORTED:
            return False
        self.end(PlanState.ABORTED)
        return True

    # 5.3: requests

    def _send_request(self) -> bool:
        """Send a request; one in flight to the same resource is cancelled (6.2). After the end nothing is sent."""
        if self.has_ended:
            return False
        for name, resource in self._rules.resources.items():
            if self.values[resource.trigger] and self.values[resource.request_state] == RequestState.INITIAL:
                self.in_flight = [*(other for other in self.in_flight if other != name), name]
                self._set({resource.request_state: RequestState.EXECUTING.value})
                return True
        return False

    def _cancel_request(self) -> bool:
        if self.has_ended:
            return False
        for name in self.in_flight:
            resource = self._rules.resources[name]
            if not self.values[resource.trigger]:
                self.in_flight.remove(name)
                self._set({resource.request_state: RequestState.INITIAL.value})
                return True
        return False

    # 5.4: the goal

    def _reach_goal(self) -> bool:
        if self.has_ended or self.values[CURRENT_STATE] != OperationState.INITIAL or not self._goal.holds(self.values):
            return False
        self._note(MomentKind.REACHES_GOAL)
        self.has_reached = True
        self.end(PlanState.COMPLETED)
        return True

    # 5.5: the operation, the queue, the planner

    def _go_on(self) -> bool:
        if self.has_ended:
            return False
        if self.values[CURRENT_NAME] != NO_OPERATION:
            return self._step_operation(self._rules.operations[str(self.values[CURRENT_NAME])])
        following = self._plans.following(self.queue)
        if len(following) == 1:
            self.choose(following[0])
        self.must_choose = len(following) > 1
        return len(following) == 1 or (not following and self._ask_plan())

    def _step_operation(self, operation: OperationRules) -> bool:
        match self.values[CURRENT_STATE]:
            case OperationState.INITIAL:
                return self._take(operation.pre, OperationState.EXECUTING) or self._become(OperationState.DISABLED)
            case OperationState.DISABLED:
                return self._take(operation.pre, OperationState.EXECUTING) or self._give_up_waiting()
            case OperationState.EXECUTING:
                return (
                    self._take(operation.post, OperationState.COMPLETED)
                    or (operation.failed is not None and self._take(operation.failed, OperationState.FAILED))
                    or self._time_out(operation)
                )
            case OperationState.COMPLETED:
                return self._leave()
            case _:  # failed, timed out
                self.queue = None
                return self._leave()

    def _take(self, rule: GuardedRule, target: OperationState) -> bool:
        after = rule.taken(self.values)
        if after is None:
            return False
        for name, resource in self._rules.resources.items():
            if after[resource.trigger] and not self.values[resource.trigger]:
                self._note(MomentKind.TRIGGERS, name)
        self.values = after
        return self._become(target)

    def _become(self, state: OperationState) -> bool:
        """Set another state of the current operation, in which no time has passed yet.

        No second timer passes in the same settling, not even one of 0 s: after a timer a new plan is requested.
        """
        name = str(self.values[CURRENT_NAME])
        if state in _ENDED:
            self._note(MomentKind.ENDS_OPERATION, state)
        self._set({operation_state_name(name): state.value, CURRENT_STATE: state.value})
        self._deadline_has_passed = False
        self._visit(name, ClaimedAspect(state.value))
        return True

    def _leave(self) -> bool:
        """Set the current operation to initial; no operation is current afterwards."""
        self._set({**self._rules.at_rest, CURRENT_NAME: NO_OPERATION, CURRENT_STATE: OperationState.INITIAL.value})
        return True

    def _give_up_waiting(self) -> bool:
        """Drop the plan if the timer of the disabled operation has passed."""
        if not self._deadline_has_passed:
            return False
        self._note(MomentKind.ENDS_OPERATION, OperationState.DISABLED)
        self.queue = None
        return self._leave()

    def _time_out(self, operation: OperationRules) -> bool:
        """Take the `timedout` actions after the deadline; if they leave a domain, end with a model error (2.4)."""
        if not self._deadline_has_passed:
            return False
        if operation.timedout.taken(self.values) is None:
            self.end(PlanState.ABORTED)
            return True
        return self._take(operation.timedout, OperationState.TIMEDOUT)

    def _ask_plan(self) -> bool:
        """Request a plan, unless a request is open or nothing has changed for a planner that found none (5.6)."""
        if self.question is not None:
            return False
        if self.unsolvable_in is not None and self.is_same_to_planner(self.unsolvable_in):
            if not self.in_flight and not self._rules.outside:
                self.end(PlanState.UNSOLVABLE)
            return self.has_ended
        self._note(MomentKind.ASKS_PLAN)
        self.note_limit()
        self._automatic = 0
        self._set({PLAN_STATE: PlanState.PLANNING.value})
        answer = self._plans.answer(self.values)
        if isinstance(answer, PlanningLimitReached):
            raise UncheckableStepError(
                "a plan is requested, and the states that the checker may visit are too few to find it"
            )
        self.question = Question(self.values, answer)
        return True

    def is_same_to_planner(self, values: Values) -> bool:
        """Return whether the planner reads the same in these values as in the present ones (5.6)."""
        return all(values[name] == self.values[name] for name in self._planner_reads)

    # the end

    def end(self, plan_state: PlanState) -> None:
        """End the run: clear its requests, and make the operation initial (semantics 5, after the ends)."""
        cancelled: Values = {}
        for name in self.in_flight:
            resource = self._rules.resources[name]
            cancelled |= {resource.trigger: False, resource.request_state: RequestState.INITIAL.value}
            self.moments.append(CheckedMoment(MomentKind.STATE, {**self.values, **cancelled}))
        changes: dict[str, Value] = {PLAN_STATE: plan_state.value}
        for name, resource in self._rules.resources.items():
            occupied = self.values[resource.request_state] == RequestState.EXECUTING and name not in self.in_flight
            if not occupied:
                changes[resource.request_state] = RequestState.INITIAL.value
            changes[resource.trigger] = False
        self._set(changes)
        self._leave()
        self.has_ended = True
        self._automatic = 0

    # inside

    def note_limit(self) -> None:
        """Note that the limit of plans may end the run here."""
        self.may_end.append(PossibleEnd(self.values, tuple(self.in_flight), len(self.moments)))

    def _note(self, kind: MomentKind, about: str = "") -> None:
        self.moments.append(CheckedMoment(kind, self.values, str(self.values[CURRENT_NAME]), about))

    def _set(self, changes: Values) -> None:
        self.values = {**self.values, **changes}

    def _visit(self, subject: str, aspect: ClaimedAspect) -> None:
        self.visited[str(ClaimedObligation(subject, aspect))] = None


class ReplyEvent(Struct, frozen=True):
    """A resource replies to the request in flight, with a value for each variable that it measures."""

    resource: str
    succeeded: bool
    measured: tuple[tuple[str, Value], ...] = ()

    def __str__(self) -> str:
        outcome = f"{self.resource} {'succeeds' if self.succeeded else 'fails'}"
        measured = ", ".join(f"{name} = {format_value(value)}" for name, value in self.measured)
        return f"{outcome} with {measured}" if measured else outcome


class OutsideEvent(Struct, frozen=True):
    """Something outside the model changes variables: the environment, or a resource that publishes (9.1)."""

    changes: tuple[tuple[str, Value], ...]

    def __str__(self) -> str:
        return " and ".join(f"{name} becomes {format_value(value)}" for name, value in self.changes)


class GivingUp(Struct, frozen=True):
    """The run ends as unsolvable: no plan exists, and nothing changes from outside any more (5.6)."""

    def __str__(self) -> str:
        return "the run ends as unsolvable"


class DeadlineEvent(Struct, frozen=True):
    """The timer of the current operation passes."""

    def __str__(self) -> str:
        return "the deadline passes"


class PlannerAnswer(Struct, frozen=True):
    """The planner answers."""

    def __str__(self) -> str:
        return "the planner answers"


class NextInPlan(Struct, frozen=True):
    """The plan goes on with an operation, or ends."""

    following: Following

    def __str__(self) -> str:
        operation, _ = self.following
        return "the plan ends" if operation is None else f"{operation} is next in the plan"


Event: TypeAlias = ReplyEvent | DeadlineEvent | PlannerAnswer | OutsideEvent | GivingUp | NextInPlan


class CheckedStep(Struct, frozen=True):
    """The step that an event starts.

    Attributes:
        situation: the situation afterwards; `None` if the run has ended, or repeats itself without an event.
        values: the values of the variables of the certificate, and the states of all operations.
        visited: the names of the obligations that were visited.
        cut_off: those that would have been visited instead if the limit of plans had ended the run on the way.
        rests: the values from which another goal can be pursued then, of all ends, those by a limit included.
        rest: these values after the end of the whole step, if it ends the run.
        moments: the moments of the whole step.
        ends: the other ends that the run may have on the way.
        has_reached: whether the goal is reached.
    """

    situation: Situation | None
    values: dict[str, Value]
    visited: tuple[str, ...]
    cut_off: tuple[str, ...] = ()
    rests: tuple[Values, ...] = ()
    rest: Values | None = None
    moments: tuple[CheckedMoment, ...] = ()
    ends: tuple[StepEnd, ...] = ()
    has_reached: bool = False


class StepEnd(NamedTuple):
    """An end that a run may have on the way.

    Attributes:
        moments: the moments of the run until then, and those after its end.
        rest: the values from which another goal can be pursued then; `None` if automatic transitions never end.
        is_livelock: as in `PossibleEnd`.
    """

    moments: tuple[CheckedMoment, ...]
    rest: Values | None
    is_livelock: bool
