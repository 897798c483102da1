"""The built-in requirements: what runs of each model satisfy unless the model says otherwise (semantics 7.12).

A built-in requirement is a class and an entry in `BUILT_INS`; its name is in `BUILT_IN_NAMES`, too, as model files may
switch it off. It needs no text of the user. It is judged on the records of a run up to the first forced state.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from msgspec import Struct

from scbm.cases.trace import (
    AutomaticTaken,
    BecameCurrent,
    End,
    LivelockedAtRest,
    OperationStepped,
    PlanAsked,
    Record,
    ReplyReceived,
    RequestSent,
    RunEnded,
    RunStarted,
    ends_of,
    ranges_of_goals,
    state_after,
)
from scbm.model import OperationState, Outcome, format_moment, format_value
from scbm.model.requirements import BuiltIn
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE, RequestState
from scbm.running.lifecycle import parts_by_end
from scbm.running.simulation.device_hazards import HazardKind
from scbm.testing.continuations.reachable_goals import LIMIT_ENDS, ReachableGoals, UnknownReachabilityError
from scbm.testing.continuations.unjudged import Unjudged
from scbm.testing.request_moments import RequestMoment, find_moments
from scbm.testing.request_protocol import RequestProtocol
from scbm.testing.requirement_monitors import Violation
from scbm.testing.verdicts import goal_runs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.cases import Case
    from scbm.model import BehaviorModel, LiftedOrigin, Operation, Resource, Value
    from scbm.running import Program
    from scbm.testing.verdicts import ExcuseRules, GoalRun, Outcomes


class JudgedRun(Struct, frozen=True, dict=True):
    """A run as the built-in requirements see it.

    Attributes:
        model: the model.
        protocol: what the model does with requests.
        case: the case that was run.
        outcomes: what came of it.
        rules: the excuses that the model gives for missed goals.
        until: the number of records before the first forced state.
        reachable: answers which goals can be reached after the run.
    """

    model: BehaviorModel
    protocol: RequestProtocol
    case: Case
    outcomes: Outcomes
    rules: ExcuseRules
    until: int
    reachable: ReachableGoals

    @property
    def records(self) -> Sequence[Record]:
        """The records, forced ones included."""
        return self.outcomes.records

    @cached_property
    def moments(self) -> tuple[RequestMoment, ...]:
        """The moments before the first forced state at which requests are judged, as far as one could be violated."""
        return find_moments(self.records[: self.until], self.protocol)

    def state_before(self, index: int) -> dict[str, Value]:
        """Return the values of all variables before a record."""
        return state_after(self.records[:index])

    def violation(self, name: str, index: int, reason: str, reads: Sequence[str], begins: int) -> Violation:
        """Return a violation that a record shows.

        Args:
            name: the requirement.
            index: the index of the record.
            reason: what is wrong, and how to change the model.
            reads: the variables whose values show it.
            begins: the index of the record with which it begins.
        """
        state = self.state_before(index)
        values = tuple((each, state[each]) for each in reads)
        current = str(state.get(CURRENT_NAME, NO_OPERATION))
        at_ns = self.records[index].at_ns
        return Violation(str(name), at_ns, index, begins, reason, current, values, is_built_in=True)


class BuiltInRequirement(ABC):
    """A property of each run of each model that does not switch it off.

    Attributes:
        name: its name.
        violated: when a run violates it, for the documentation.
        is_explained_by_others: whether it is not reported beside a violation of another one, as that is the reason.
        needs_requests: whether it is about models that send requests only.
    """

    name: ClassVar[str]
    violated: ClassVar[str]
    is_explained_by_others: ClassVar[bool] = False
    needs_requests: ClassVar[bool] = True

    @abstractmethod
    def first_violation(self, run: JudgedRun) -> Violation | None:
        """Return the first violation by a run; `None` if the run satisfies the requirement.

        Raises `NotJudgedError`.
        """


class NotJudgedError(Exception):
    """A requirement does not judge a run."""

    def __init__(self, why: Unjudged) -> None:
        super().__init__(why.words)
        self.why = why


class NoOrphan(BuiltInRequirement):
    """No trigger is true while no operation is under way."""

    name = BuiltIn.NO_ORPHAN
    violated = (
        "a trigger is true while no operation is under way: when an operation becomes current, when a plan is asked "
        "for, or when the goal is reached"
    )

    def first_violation(self, run: JudgedRun) -> Violation | None:
        """Return the first moment at which a request has outlived its operation."""
        for moment in run.moments:
            if not _is_between_operations(moment.record):
                continue
            for name, resource in run.protocol.triggers.items():
                if moment.busy.get(name) is True:
                    found = self._violation(run, moment, resource)
                    if found is not None:
                        return found
        return None

    def _violation(self, run: JudgedRun, moment: RequestMoment, resource: Resource) -> Violation | None:
        begins = _last_set(run.records[: moment.at], resource.trigger)
        owner = None if begins is None else _operation_at(run, begins)
        if begins is None or owner is None or not _is_orphan(run, moment, resource):
            return None
        ended = _last_end(run.records[: moment.at], owner.name)
        missing = [f"{ended.as_written(resource.trigger, resource, run.model)} <- false"]
        if moment.busy.get(resource.request_state) in (RequestState.SUCCEEDED, RequestState.FAILED):
            missing.append(f"{ended.as_written(resource.request_state, resource, run.model)} <- initial")
        reason = (
            f"{ended.words}, and {resource.trigger} is still true when {_moment_words(moment.record)}; "
            f"add {_code(missing)} to {ended.transition_in(run.model)}"
        )
        reads = (resource.trigger, resource.request_state)
        return run.violation(self.name, moment.at, reason, reads, begins)


class ReadyAgain(BuiltInRequirement):
    """A resource can be used again by the next plan after an operation failed or timed out."""

    name = BuiltIn.READY_AGAIN
    violated = (
        "a plan is asked for after an operation failed or timed out, and a resource that it uses is in a request state "
        "in which no operation that uses the resource can start"
    )

    def first_violation(self, run: JudgedRun) -> Violation | None:
        """Return the first plan that is asked for while a resource of the failed operation is not ready."""
        for moment in run.moments:
            if isinstance(moment.record, PlanAsked) and any(name in run.protocol.states for name in moment.busy):
                ended = _last_end(run.records[: moment.at])
                if ended.state in (OperationState.FAILED, OperationState.TIMEDOUT):
                    found = self._violation(run, moment, ended)
                    if found is not None:
                        return found
        return None

    def _violation(self, run: JudgedRun, moment: RequestMoment, ended: _OperationEnd) -> Violation | None:
        for resource in run.protocol.uses(run.model.operation(ended.operation)):
            value = moment.busy.get(resource.request_state)
            if value is None or _is_orphan(run, moment, resource):
                continue  # the violation of `no_orphan` names this line, too
            if run.protocol.is_ready(resource, run.state_before(moment.at)):
                continue
            missing = f"{ended.as_written(resource.request_state, resource, run.model)} <- initial"
            reason = (
                f"{ended.words}, and {resource.request_state} is still {value} when a plan is asked for, so nothing "
                f"can use {resource.name} again; add `{missing}` to {ended.transition_in(run.model)}"
            )
            return run.violation(self.name, moment.at, reason, (resource.request_state,), ended.at)
        return None


class Recovers(BuiltInRequirement):
    """A run with one request at fault, and nothing else wrong, reaches its goal."""

    name = BuiltIn.RECOVERS
    violated = (
        "one request of the run is at fault (7.4), nothing else went wrong, and the goal is missed without the "
        "excuses 2 and 3 of 7.4"
    )
    is_explained_by_others = True

    def first_violation(self, run: JudgedRun) -> Violation | None:
        """Return the end of the first goal that one fault made the run miss."""
        for each in goal_runs(run.case, run.outcomes):
            if each.is_missed and each.must_recover(run.case, run.rules) and each.excuse(run.case, run.rules) is None:
                reaction = each.only_fault(run.case)
                return None if reaction is None else self._violation(run, each, reaction)
        return None

    def _violation(self, run: JudgedRun, goal_run: GoalRun, reaction: int) -> Violation:
        resource, outcome = goal_run.run.reactions[reaction].resource, goal_run.run.reactions[reaction].outcome
        begins, what = _fault(run.records, reaction, outcome)
        number = sum(each.resource == resource for each in goal_run.run.reactions[: reaction + 1])
        index = max(i for i, r in enumerate(goal_run.run.records) if isinstance(r, RunEnded))
        operation = _operation_at(run, begins)
        during = "" if operation is None else f", sent by {operation.name},"
        goal = goal_run.words.rstrip(",")
        reason = (
            f"{what} to request {number} of {resource}{during} is the only fault of the run, and {goal} was not "
            f"reached ({goal_run.end.value.replace('_', ' ')}); {self._remedy(run, goal_run, index, outcome, begins)}"
        )
        return run.violation(self.name, index, reason, (PLAN_STATE,), begins)

    @staticmethod
    def _remedy(run: JudgedRun, goal_run: GoalRun, index: int, outcome: Outcome, begins: int) -> str:
        """Return what to change: the operation that waits until the end, what a fault leaves behind, or how to end."""
        state = run.state_before(index)
        if goal_run.end is End.TIME_LIMIT and state[CURRENT_STATE] == OperationState.EXECUTING.value:
            operation = run.model.operation(str(state[CURRENT_NAME]))
            if outcome is Outcome.FAIL and operation.failed is None:
                return f"{operation.name} executes until the end: give it a `failed` transition"
            if operation.deadline_ns is None:
                return f"{operation.name} executes until the end: give it a `deadline`"
        sent_by = _operation_at(run, begins)
        starts = [] if sent_by is None else _starts(run.records[:index], sent_by.name)
        again = sum(start > begins for start in starts)
        if sent_by is not None and again:
            left = _differences(run, starts[0], starts[-1])
            how = f" with {left}, unlike the first time: change that after the fault" if left else " in vain"
            times = "once more" if again == 1 else f"{again} times more"
            return f"{sent_by.name} starts {times}{how}, or write `may_end: [{goal_run.end.value}]`"
        return f"let the model try again, or write `may_end: [{goal_run.end.value}]`"


def _starts(records: Sequence[Record], operation: str) -> list[int]:
    """Return the indices of the records with which an operation starts to execute."""
    return [
        index
        for index, record in enumerate(records)
        if isinstance(record, OperationStepped)
        and record.operation == operation
        and record.target is OperationState.EXECUTING
    ]


def _differences(run: JudgedRun, first: int, last: int) -> str:
    """Return the values of declared variables before a record that are not those before an earlier one, in words."""
    before, after = run.state_before(first), run.state_before(last)
    names = [variable.name for variable in run.model.variables if before[variable.name] != after[variable.name]]
    return " and ".join(f"{name} == {format_value(after[name])}" for name in names)


class Stops(BuiltInRequirement):
    """Nothing is sent after an abort, or after the end of a run."""

    name = BuiltIn.STOPS
    violated = (
        "a request is sent after `plan.state` became `aborted`, or after the end of a run before the next one begins"
    )

    def first_violation(self, run: JudgedRun) -> Violation | None:
        """Return the first request that is sent after an abort, or while no goal is pursued."""
        for moment in run.moments:
            if isinstance(moment.record, RequestSent) and (moment.is_aborted or not moment.is_running):
                when = "after plan.state became aborted" if moment.is_running else "while no goal is pursued"
                reason = (
                    f"request {moment.record.request} is sent to {moment.record.resource} {when}; this is an error of "
                    "the runner, not of the model"
                )
                return run.violation(self.name, moment.at, reason, (PLAN_STATE,), moment.at)
        return None


class NonBlocking(BuiltInRequirement):
    """What plain runs leave open, no run closes."""

    name = BuiltIn.NON_BLOCKING
    violated = (
        "after the run no run can reach a goal any more that can be reached after all plain runs, or that "
        "`reachable_again` lists, whatever changes from outside"
    )
    needs_requests = False

    def first_violation(self, run: JudgedRun) -> Violation | None:
        """Return the end of a run after which goals cannot be reached any more."""
        if not run.model.goals:
            return None
        history = _history(run)
        state = state_after(history)
        try:
            lost = run.reachable.lost_after(state)
        except UnknownReachabilityError as error:
            raise NotJudgedError(Unjudged.TOO_LONG) from error
        if lost is None:
            return None
        goals = f"the goal {lost.goals[0]}" if len(lost.goals) == 1 else f"the goals {_listed(lost.goals)}"
        reason = f"after this run no run can reach {goals} any more, {_latch_words(lost.latch, state)}"
        last = len(history) - 1
        begins = max((_last_change(history, name) for name in lost.latch), default=last)
        return run.violation(self.name, last, reason, lost.latch, begins)


def _history(run: JudgedRun) -> Sequence[Record]:
    """Return the records before the first run that a limit ended: what follows is the work of the limit.

    Raises `NotJudgedError` if they are no history of the model, as force or another goal made it what it is.
    """
    if run.reachable.unjudged is not None:
        raise NotJudgedError(run.reachable.unjudged)
    goals, ends = dict(run.model.goals), [End(end.end) for end in ends_of(run.records)]
    begins = (
        indices.start for indices, end in zip(ranges_of_goals(run.records), ends, strict=False) if end in LIMIT_ENDS
    )
    until = next(begins, len(run.records))
    history = run.records[:until]
    reasons = {
        Unjudged.OTHER_GOALS: any(goals.get(goal.name) != goal.predicate for goal in run.case.goals),
        Unjudged.FORCE: run.until < until,
        Unjudged.LIVELOCK: any(isinstance(record, LivelockedAtRest) for record in history),
        Unjudged.LIMIT: not any(isinstance(record, RunEnded) for record in history),
    }
    why = next((reason for reason, is_true in reasons.items() if is_true), None)
    if why is not None:
        raise NotJudgedError(why)
    return history


def _listed(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _latch_words(latch: Sequence[str], state: Mapping[str, Value]) -> str:
    if not latch:
        return "whatever follows; no variables that keep their values explain it"
    kept = " and ".join(f"{name} == {format_value(state[name])}" for name in latch)
    return f"as nothing that can follow changes {kept}: let a transition reset {' and '.join(latch)}"


def _last_change(records: Sequence[Record], name: str) -> int:
    """Return the index of the last record that changed a variable; 0 if none did."""
    changing = (i for i, record in enumerate(records) if any(name == changed for changed, _ in record.changes))
    return max(changing, default=0)


class OneRequestAtATime(BuiltInRequirement):
    """No simulated device starts a request while it works at another one."""

    name = BuiltIn.ONE_REQUEST_AT_A_TIME
    violated = "a simulated device without `parallel: true` starts a request while it works at another one"

    def first_violation(self, run: JudgedRun) -> Violation | None:
        """Return the first moment at which a device works at two requests."""
        for hazard in run.outcomes.hazards:
            if hazard.kind is HazardKind.OVERLAP:
                index = max(i for i, record in enumerate(run.records) if record.at_ns <= hazard.begin_ns)
                reads = tuple(each.trigger for each in run.model.resources if each.name == hazard.resource)
                return None if index >= run.until else run.violation(self.name, index, str(hazard), reads, index)
        return None


BUILT_INS: dict[str, BuiltInRequirement] = {
    BuiltIn.NO_ORPHAN: NoOrphan(),
    BuiltIn.READY_AGAIN: ReadyAgain(),
    BuiltIn.RECOVERS: Recovers(),
    BuiltIn.STOPS: Stops(),
    BuiltIn.NON_BLOCKING: NonBlocking(),
}
"""The built-in requirements by name. Violations are reported in this order, after those of the model's own."""

OPTIONAL_BUILT_INS: dict[str, BuiltInRequirement] = {BuiltIn.ONE_REQUEST_AT_A_TIME: OneRequestAtATime()}
"""Those that `requirements_on` of a model switches on. Only cases judge them."""


class JudgedBuiltIns(NamedTuple):
    """The judgement of a run by the built-in requirements.

    Attributes:
        violations: the first violation of each requirement that the run violates.
        unjudged: why `non_blocking` does not judge the run; `None` if it does, or is switched off.
    """

    violations: tuple[Violation, ...]
    unjudged: Unjudged | None = None


class BuiltInJudge:
    """Judges runs of one model by the built-in requirements that the model has not switched off."""

    def __init__(self, model: BehaviorModel, rules: ExcuseRules, program: Program | None = None) -> None:
        """`program` is the compiled model, if it is compiled."""
        self._model = model
        self._rules = rules
        self._protocol = RequestProtocol(model)
        off = [name for name, _ in model.requirements_off]
        self._reachable = ReachableGoals(model, program)
        has_requests = bool(model.resources)
        self._judged = [
            each for name, each in BUILT_INS.items() if name not in off and (has_requests or not each.needs_requests)
        ]
        self._judged += [OPTIONAL_BUILT_INS[name] for name in model.requirements_on]
        self._judged.sort(key=lambda each: each.is_explained_by_others)

    def find_violations(self, case: Case, outcomes: Outcomes, forced_by: int | None) -> JudgedBuiltIns:
        """Return the first violation of each requirement that a run violates.

        Args:
            case: what was run.
            outcomes: what came of it.
            forced_by: the index of the first record of a forced state; `None` if there is none.
        """
        until = len(outcomes.records) if forced_by is None else forced_by
        run = JudgedRun(self._model, self._protocol, case, outcomes, self._rules, until, self._reachable)
        found: list[Violation] = []
        unjudged: Unjudged | None = None
        for each in self._judged:
            if found and each.is_explained_by_others:
                continue
            try:
                violation = each.first_violation(run)
            except NotJudgedError as error:
                unjudged = error.why
                continue
            if violation is not None:
                found.append(violation)
        return JudgedBuiltIns(tuple(found), unjudged)


_WRITTEN = ", an instance of "
_TO_CHANGE = re.compile(rf"to (?:`(\w+)` of (\S+?)|the automatic transition (\S+?))(?:{_WRITTEN}`[^`]+`)?\Z")
_SENT_BY = re.compile(r", sent by (\S+), is the only fault")


def part_to_change(message: str) -> tuple[str, ...]:
    """Return the path of keys in the model file to the part that a violation names; empty if it names none.

    Args:
        message: the message of a failure of the kind `built_in`, as stores keep it.
    """
    found, sender = _TO_CHANGE.search(message), _SENT_BY.search(message)
    if found is not None:
        return ("operations", found[2], found[1]) if found[2] else ("automatic_transitions", found[3])
    return () if sender is None else ("operations", sender[1])


def _is_orphan(run: JudgedRun, moment: RequestMoment, resource: Resource) -> bool:
    """Return whether the trigger of a resource is true while no operation is under way, and has to be false."""
    if moment.busy.get(resource.trigger) is not True:
        return False
    begins = _last_set(run.records[: moment.at], resource.trigger)
    owner = None if begins is None else _operation_at(run, begins)
    return owner is not None and not run.protocol.may_outlive(owner, resource, run.state_before(moment.at))


def _is_between_operations(record: Record) -> bool:
    """Return whether no operation is under way at a record, by what it is."""
    return isinstance(record, (PlanAsked, BecameCurrent)) or (
        isinstance(record, RunEnded) and record.end == End.REACHED.value
    )


def _moment_words(record: Record) -> str:
    match record:
        case PlanAsked():
            return "a plan is asked for"
        case BecameCurrent():
            return f"{record.operation} becomes current"
        case _:
            return "the goal is reached"


def _last_set(records: Sequence[Record], trigger: str) -> int | None:
    """Return the index of the last record that made a trigger true; `None` if it was true from the start."""
    for index in range(len(records) - 1, -1, -1):
        if (trigger, True) in records[index].changes:
            return index
    return None


def _operation_at(run: JudgedRun, index: int) -> Operation | None:
    """Return the operation that was under way at a record; `None` if there was none."""
    for record in reversed(run.records[: index + 1]):
        match record:
            case BecameCurrent():
                return run.model.operation(record.operation)
            case OperationStepped():
                return run.model.operation(record.operation)
            case RunStarted() | RunEnded():
                return None
            case _:
                continue
    return None


class _OperationEnd(NamedTuple):
    """How an operation ended.

    Attributes:
        operation: the operation.
        at: the index of the record.
        state: completed, failed or timedout; disabled if it never started.
        transition: the part of the model that ended it, as in "add an action to …".
        path: the section and the name of its entry in the model.
    """

    operation: str
    at: int
    state: OperationState
    transition: str
    path: tuple[str, str]

    def transition_in(self, model: BehaviorModel) -> str:
        """Return the part of the model that ended the operation, with the entry that it is an instance of."""
        origin = self._origin(model)
        written = origin.written if origin is not None else ""
        return f"{self.transition}{_WRITTEN}`{written}`" if written else self.transition

    def as_written(self, variable: str, resource: Resource, model: BehaviorModel) -> str:
        """Return a variable of a resource as the part can use it: `arm_req_state.r` for `arm.r1_req_state`."""
        if resource.lifted is None:
            return variable
        origin = self._origin(model)
        parameters = origin.parameters if origin is not None else {}
        objects = resource.name.removeprefix(f"{resource.lifted}.").split(".")
        suffix = variable.removeprefix(resource.name)
        return ".".join((f"{resource.lifted}{suffix}", *(parameters.get(each, each) for each in objects)))

    def _origin(self, model: BehaviorModel) -> LiftedOrigin | None:
        return next((each for each in model.origins if (each.section, each.name) == self.path), None)

    @property
    def words(self) -> str:
        """A clause such as `scan timed out`."""
        return f"{self.operation} {_ENDED.get(self.state, 'ended')}"


_ENDED = {
    OperationState.COMPLETED: "completed",
    OperationState.FAILED: "failed",
    OperationState.TIMEDOUT: "timed out",
    OperationState.DISABLED: "was given up",
}

_PARTS = {state: part.key for state, part in parts_by_end().items()}
"""The key of the part of an operation that ends it in each of its last states."""


def _last_end(records: Sequence[Record], operation: str | None = None) -> _OperationEnd:
    """Return how the last operation ended, or the last one with a name.

    The records have such an end: an operation that left a state for `initial`.
    """
    for index in range(len(records) - 1, -1, -1):
        record = records[index]
        if isinstance(record, AutomaticTaken) and record.failed is not None and operation in (None, record.failed):
            part = f"the automatic transition {record.transition}"
            path = ("automatic_transitions", record.transition)
            return _OperationEnd(record.failed, index, OperationState.FAILED, part, path)
        if isinstance(record, OperationStepped) and operation in (None, record.operation) and record.target in _PARTS:
            part = f"`{_PARTS[record.target]}` of {record.operation}"
            return _OperationEnd(record.operation, index, record.target, part, ("operations", record.operation))
        if operation is None and isinstance(record, OperationStepped) and _was_given_up(record):
            part = f"`pre` of {record.operation}"
            return _OperationEnd(record.operation, index, record.source, part, ("operations", record.operation))
    name = operation or NO_OPERATION
    return _OperationEnd(name, 0, OperationState.INITIAL, "the model", ("operations", name))


def _was_given_up(record: OperationStepped) -> bool:
    return record.source is OperationState.DISABLED and record.target is OperationState.INITIAL


def _fault(records: Sequence[Record], reaction: int, outcome: Outcome) -> tuple[int, str]:
    """Return the record with which the fault of a reaction begins, and the fault in words."""
    sent = [index for index, record in enumerate(records) if isinstance(record, RequestSent)][reaction]
    request = records[sent]
    if outcome is Outcome.FAIL and isinstance(request, RequestSent):
        for index in range(sent, len(records)):
            record = records[index]
            if isinstance(record, ReplyReceived) and record.request == request.request:
                return index, f"the failed reply at {format_moment(record.at_ns)}"
    return sent, "the missing reply"


def _code(actions: Sequence[str]) -> str:
    return " and ".join(f"`{action}`" for action in actions)
