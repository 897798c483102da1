"""Whether a case passed (semantics 7.4): its expectations compared with its run, and clauses without effect.

A clause is without effect if its injection never acted, or if the request of its outcome was never sent.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, assert_never

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases import Network
from scbm.cases.trace import (
    NETWORK,
    BecameCurrent,
    End,
    InjectionApplied,
    LivelockedAtRest,
    OperationStepped,
    PlanReceived,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    assignments,
    ends_of,
    ranges_of_goals,
    run_end,
    state_after,
)
from scbm.model import GoalOrder, OperationState, format_duration, format_moment, format_value
from scbm.model.requirements import BuiltIn
from scbm.model.sources import inputs, published_by
from scbm.running import describe_cycle
from scbm.testing.continuations.waiting_runs import WAITING_ENDS, OutsideHelp, WaitingRuns
from scbm.testing.request_faults import requests_at_fault

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.cases import Case, CaseGoal, EnvironmentChange, Expectations, Reaction
    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.running.simulation.device_hazards import Hazard
    from scbm.running.simulation.impossible_changes import ImpossibleChange
    from scbm.testing.requirement_monitors import Violation


_ARROW = " → "


def find_unmet(
    expect: Expectations,
    end: End,
    records: Sequence[Record],
    visited: Sequence[str],
    until: Sequence[Record] | None = None,
) -> Iterator[tuple[str, str]]:
    """Yield the key of each expectation that is not met, with the difference between expectation and run.

    Args:
        expect: the expectations.
        end: how the run for the goal ended.
        records: the records of that run.
        visited: the names of the obligations that it visited.
        until: these records behind all earlier ones of the case; by default `records`.
    """
    if expect.verdict not in (None, end):
        yield "verdict", f"expected the run to end {_words(expect.verdict)}, but it ended {_words(end)}"
    if expect.plan is not None:
        yield from (("plan", message) for message in _plan(expect.plan, records))
    if expect.order:
        yield from (("order", message) for message in _order(expect.order, records))
    if expect.final:
        state = state_after(records if until is None else until)
        yield from (("final", _final(predicate, state)) for predicate in expect.final if not predicate.holds(state))
    for obligation in expect.visits:
        if str(obligation) not in visited:
            near = [name for name in visited if name.startswith(f"{obligation.subject}/")]
            visited = f"; of {obligation.subject} it visited {', '.join(near)}" if near else ""
            yield "visits", f"expected a visit to {obligation}, and the run made none{visited}"


def _words(end: End | None) -> str:
    return f"`{end}`"


def _plan(expected: tuple[str, ...], records: Sequence[Record]) -> Iterator[str]:
    plans = (record for record in records if isinstance(record, PlanReceived))
    first = next(plans, None)
    if first is None or first.status != "solved":
        found = "none was asked for" if first is None else f"the planner answered `{first.status}`"
        yield f"expected the plan {_listed(expected)}, and {found}"
    elif first.plan != expected:
        yield f"expected the plan {_listed(expected)}, and the first plan is {_listed(first.plan)}: " + _difference(
            expected, first.plan
        )


def _listed(operations: tuple[str, ...]) -> str:
    return _ARROW.join(operations) or "with no operations"


def _difference(expected: tuple[str, ...], found: tuple[str, ...]) -> str:
    """Return the first index at which two lists differ."""
    number = next(
        (n for n, (a, b) in enumerate(zip(expected, found, strict=False)) if a != b), min(len(expected), len(found))
    )
    parts = [plan[number] if number < len(plan) else "nothing" for plan in (expected, found)]
    return f"operation {number + 1} should be {parts[0]} and is {parts[1]}"


def _order(expected: tuple[str, ...], records: Sequence[Record]) -> Iterator[str]:
    """Return the first operation that does not complete behind its predecessors, as a sentence."""
    completed = [r for r in records if isinstance(r, OperationStepped) and r.target is OperationState.COMPLETED]
    position = 0
    for number, name in enumerate(expected):
        found = next((i for i in range(position, len(completed)) if completed[i].operation == name), None)
        if found is None:
            behind = f" behind {expected[number - 1]}" if number else ""
            happened = _ARROW.join(f"{r.operation} at {format_moment(r.at_ns)}" for r in completed) or "none"
            yield (
                f"expected {_ARROW.join(expected)} to complete in this order, and {name} does not complete{behind}; "
                f"completed: {happened}"
            )
            return
        position = found + 1


def _final(predicate: Predicate, state: dict[str, Value]) -> str:
    values = ", ".join(f"{name} == {format_value(state[name])}" for name in predicate.reads())
    return f"expected {predicate} at the end, but it ends with {values or 'something else'}"


class FailureKind(StrEnum):
    """Why a case can fail."""

    REQUIREMENT = "requirement"
    BUILT_IN = "built_in"
    EXPECTATION = "expectation"
    LIVELOCK = "livelock"
    MODEL_ERROR = "model_error"
    NOT_REACHED = "not_reached"
    IMPOSSIBLE = "impossible_change"
    LOST = "lost"


_MISSED_GOAL = (FailureKind.NOT_REACHED, FailureKind.LIVELOCK)
"""The kinds of failures that are about the end of the run for one goal."""


class Failure(Struct, frozen=True):
    """One reason to call a case failed.

    Attributes:
        kind: the sort of reason.
        subject: what of that sort: the requirement, the key of the expectation, or the end of the run.
        message: a sentence.
    """

    kind: FailureKind
    subject: str
    message: str

    def __str__(self) -> str:
        return self.message

    def is_like(self, other: Failure) -> bool:
        """Return whether the reason is the same; time and values may differ."""
        return self.kind is other.kind and self.subject == other.subject


class Excuse(StrEnum):
    """The reason why a missed goal does not fail its case (semantics 7.4)."""

    FAULT = "fault"
    """Something was made to go wrong."""
    WAITS = "waits"
    """One reply failed or was missing, and a change from outside could have led the run to its goal."""
    MAY_END = "may_end"
    """`may_end` of the goal or of the model lists the end."""
    INPUT = "input"
    """An input was away from its nominal value as the run ended."""
    EXPECTED = "expected"
    """The case expects how the run ends."""

    @property
    def words(self) -> str:
        """The excuse behind "by"."""
        match self:
            case Excuse.FAULT:
                return "a fault"
            case Excuse.WAITS:
                return "a wait for a change from outside (`recovers` not judged)"
            case Excuse.MAY_END:
                return "`may_end`"
            case Excuse.INPUT:
                return "an input away from nominal"
            case Excuse.EXPECTED:
                return "the verdict that the case expects"
            case _:
                assert_never(self)


@dataclass(frozen=True, slots=True)
class ExcuseRules:
    """The excuses that a model gives for missed goals.

    Attributes:
        inputs: each variable that changes without a request, an input or a published one, with its nominal value.
        may_end: the ends that excuse missing any goal.
        goals_may_end: by the name of a goal, further ends that excuse missing this goal.
        recovers: whether a single failed or missing reply excuses nothing (semantics 7.12).
        model: the model, which says what runs there are; `None` if any fault excuses only its own goal.
        waiting: what changes from outside could do for a run that waits; `None` if nothing changes from outside.
    """

    inputs: tuple[tuple[str, Value], ...] = ()
    may_end: tuple[str, ...] = ()
    goals_may_end: tuple[tuple[str, tuple[str, ...]], ...] = ()
    recovers: bool = False
    model: BehaviorModel | None = None
    waiting: WaitingRuns | None = field(default=None, compare=False)

    @staticmethod
    def of(model: BehaviorModel) -> ExcuseRules:
        """Return the rules of a model."""
        published = (name for resource in model.resources for name in published_by(resource, model))
        nominal = tuple((name, model.nominal_state[name]) for name in dict.fromkeys((*inputs(model), *published)))
        recovers = BuiltIn.RECOVERS.value not in dict(model.requirements_off)
        return ExcuseRules(nominal, model.may_end, model.goals_may_end, recovers, model, WaitingRuns(model))

    def may_end_of(self, goal: CaseGoal) -> tuple[str, ...]:
        """Return all ends that excuse missing a goal of a case."""
        return (*goal.may_end, *self.may_end, *dict(self.goals_may_end).get(goal.name, ()))

    def outside_help(
        self, end: End, state: Mapping[str, Value], in_flight: Sequence[str], goal: Predicate
    ) -> OutsideHelp:
        """Return whether a run that missed its goal waited for a change from outside (semantics 7.12).

        Args:
            end: how the run ended.
            state: the values of all variables before that, the runner's own included.
            in_flight: the resources with a request in flight.
            goal: the goal.
        """
        if self.waiting is None or end not in WAITING_ENDS:
            return OutsideHelp.NONE
        return self.waiting.help_for(state, in_flight, goal)


_NO_RULES = ExcuseRules()


class Verdict(Struct, frozen=True):
    """How a case ended, and why it failed if it did.

    Attributes:
        end: the end of the run for the last goal.
        failures: the reasons to call the case failed; none if it passed.
        excuses: for each missed goal that does not fail the case the reason, in the order of the goals.
    """

    end: End
    failures: tuple[Failure, ...] = ()
    excuses: tuple[Excuse, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the case passed."""
        return not self.failures

    @property
    def end_in_words(self) -> str:
        """The end of the run for the last goal; if that was reached, also whether an earlier goal was missed."""
        words = self.end.value.replace("_", " ")
        missed = self.excuses or any(failure.kind in _MISSED_GOAL for failure in self.failures)
        return f"{words} with an earlier goal missed" if self.end is End.REACHED and missed else words

    @property
    def is_short(self) -> bool:
        """Whether the case passed although its run missed a goal."""
        return self.passed and bool(self.excuses)


class Outcomes(Struct, frozen=True):
    """The parts of a run that its verdict depends on.

    Attributes:
        end: how the run for the last goal ended.
        records: what happened.
        reactions: what happened to its requests.
        violations: the requirements that were broken.
        visited: the names of the obligations that it visited.
        real: the real resources, whose behaviour the tester did not cause.
        visited_by_goal: of a case with several goals, the names of the obligations that the run for each visited.
        hazards: in a simulation what devices did and the controller did not know.
    """

    end: End
    records: Sequence[Record]
    reactions: Sequence[Reaction]
    violations: Sequence[Violation]
    visited: Sequence[str]
    real: Sequence[str] = ()
    visited_by_goal: Sequence[Sequence[str]] = ()
    hazards: Sequence[Hazard] = ()


def lost(why: str) -> Verdict:
    """Return the verdict on a case whose run was not finished; `why` is a clause."""
    return Verdict(End.LOST, (Failure(FailureKind.LOST, End.LOST.value, f"the run was not finished: {why}"),))


def impossible(change: ImpossibleChange) -> Verdict:
    """Return the verdict on a case that lists a change which no maker could make: it is no run."""
    subject = change.by or ", ".join(name for name, _ in change.changes)
    return Verdict(End.IMPOSSIBLE, (Failure(FailureKind.IMPOSSIBLE, subject, f"{change}; {_REMEDY}"),))


_REMEDY = "list what leads there as changes of their own, or make it an injection, which forces the state"


def judge(case: Case, run: Outcomes, rules: ExcuseRules = _NO_RULES) -> Verdict:
    """Return the verdict on a run, from the ends of its goals, its violations, and the faults that were caused.

    Args:
        case: the case.
        run: what happened.
        rules: the excuses that the model gives.
    """
    failures = [Failure(kind_of(v), v.requirement, str(v)) for v in run.violations]
    excuses: list[Excuse] = []
    for each in goal_runs(case, run):
        failures += each.failures_of_expectations()
        if not each.is_missed:
            if each.end is not End.REACHED and each.end is each.goal.expect.verdict:
                excuses.append(Excuse.EXPECTED)
            continue  # how the run ends is expected, or complained of already
        excuse = each.excuse(case, rules)
        if excuse is not None:
            excuses.append(excuse)
        elif not each.must_recover(case, rules):  # that is a violation of `recovers`
            failures.append(each.failure(case, rules))
    if all(failure.kind is not FailureKind.LIVELOCK for failure in failures):
        failures += _livelocks_at_rest(run.records)
    return Verdict(run.end, tuple(failures), tuple(excuses))


def _livelocks_at_rest(records: Sequence[Record]) -> Iterator[Failure]:
    """Yield the failure of a run whose automatic transitions repeat while no goal is pursued."""
    found = next((record for record in records if isinstance(record, LivelockedAtRest)), None)
    if found is not None:
        message = f"while no goal is pursued, {describe_cycle(found.detail)}"
        yield Failure(FailureKind.LIVELOCK, End.LIVELOCK.value, message)


def kind_of(violation: Violation) -> FailureKind:
    """Return the kind of the failure that a violation is."""
    return FailureKind.BUILT_IN if violation.is_built_in else FailureKind.REQUIREMENT


def violation_of(failure: Failure, violations: Sequence[Violation]) -> Violation | None:
    """Return the violation that a failure reports; `None` if it reports none."""
    found = (v for v in violations if kind_of(v) is failure.kind and v.requirement == failure.subject)
    return next(found, None)


class GoalRun(Struct, frozen=True):
    """The run for one goal of a case.

    Attributes:
        goal: the goal.
        number: its number, from 1; `None` if the case has only one.
        end: how its run ended.
        records: the records of its run.
        run: all that happened up to its end.
        visited: the names of the obligations that its run visited.
    """

    goal: CaseGoal
    number: int | None
    end: End
    records: Sequence[Record]
    run: Outcomes
    visited: Sequence[str]

    @property
    def words(self) -> str:
        """The goal as the subject of a clause."""
        return "the goal" if self.number is None else f"goal {self.number}, {self.goal.name},"

    def failures_of_expectations(self) -> Iterator[Failure]:
        """Yield a failure for each expectation that is not met."""
        where = "" if self.number is None else f"goal {self.number}, {self.goal.name}: "
        for key, message in find_unmet(self.goal.expect, self.end, self.records, self.visited, self.run.records):
            yield Failure(FailureKind.EXPECTATION, key, f"{where}{message}")

    @property
    def is_missed(self) -> bool:
        """Whether the run missed its goal, and the case does not expect how it ends."""
        return self.goal.expect.verdict is None and self.end is not End.REACHED

    def must_recover(self, case: Case, rules: ExcuseRules) -> bool:
        """Return whether one failed or missing reply is all that went wrong, so that it excuses nothing (7.12)."""
        return self._is_judged(case, rules) and not self._waits_for_change(rules)

    def _is_judged(self, case: Case, rules: ExcuseRules) -> bool:
        """Return whether `recovers` is about this run, unless it waits for a change from outside.

        Where each run has one goal, nothing is promised for a goal after the one in whose run the fault was.
        """
        if not rules.recovers or self.end in (*_NEVER_EXCUSED, End.NOT_STARTED) or self._is_failed_by_real(case):
            return False
        is_cut_off = (self.end is End.TIME_LIMIT and case.limits.time_ns is not None) or (
            self.end is End.REPLAN_LIMIT and case.limits.plans is not None
        )
        if is_cut_off or (fault := self.only_fault(case)) is None:
            return False
        before = len(self.run.reactions) - sum(isinstance(record, RequestSent) for record in self.records)
        is_single = rules.model is not None and rules.model.runs.goals is GoalOrder.SINGLE
        return not is_single or fault >= before

    def _waits_for_change(self, rules: ExcuseRules) -> bool:
        """Return whether changes from outside could have led the run to its goal, as far as is known."""
        ended = max(i for i, record in enumerate(self.run.records) if isinstance(record, RunEnded))
        before = self.run.records[:ended]
        found = rules.outside_help(self.end, state_after(before), _in_flight(before), self.goal.predicate)
        return found is not OutsideHelp.NONE

    def only_fault(self, case: Case) -> int | None:
        """Return the index of the only request that went wrong, if it is at fault; `None` if there are others, or none.

        Real resources do not count, since no tester caused their faults.
        """
        if _acts_beside_requests(case, self.run):
            return None
        faulty = [i for i in self._at_fault(case) if self.run.reactions[i].resource not in self.run.real]
        wrong = dict.fromkeys((*faulty, *_with_disturbed_messages(self.run)))
        if len(wrong) != 1 or not faulty:
            return None
        reaction = self.run.reactions[faulty[0]]
        is_other = any(d is not None and len(d) > 1 for d in (reaction.request, reaction.reply)) or (
            reaction.cancel is not None and len(reaction.cancel) != 1
        )
        return None if is_other else faulty[0]

    def _at_fault(self, case: Case) -> tuple[int, ...]:
        """Return the requests up to the end of this run that are at fault, by position."""
        return requests_at_fault(case, self.run.records, self.run.reactions, self.run.real)

    def _is_failed_by_real(self, case: Case) -> bool:
        """Return whether the last request of this run to some real resource is at fault."""
        if not self.run.real:
            return False
        sent = [record for record in self.records if isinstance(record, RequestSent)]
        last = {record.resource: record.request - 1 for record in sent if record.resource in self.run.real}
        faulty = self._at_fault(case)
        return any(position in faulty for position in last.values())

    def excuse(self, case: Case, rules: ExcuseRules) -> Excuse | None:
        """Return why missing the goal does not fail the case; `None` if it does."""
        if self.end in _NEVER_EXCUSED:
            return None
        is_begun = self.end is not End.NOT_STARTED  # else the case has tested nothing, whatever went wrong
        if is_begun and self._is_disturbed(case) and not self._is_failed_by_real(case):
            if not self._is_judged(case, rules):
                return Excuse.FAULT
            if self._waits_for_change(rules):
                return Excuse.WAITS
        if self.end.value in rules.may_end_of(self.goal):
            return Excuse.MAY_END
        return Excuse.INPUT if is_begun and self._is_input_away(rules) else None

    def _is_input_away(self, rules: ExcuseRules) -> bool:
        """Return whether an input was away from its nominal value as the run ended."""
        if not rules.inputs:
            return False
        records = self.run.records
        ended = max((i for i, record in enumerate(records) if isinstance(record, RunEnded)), default=len(records))
        state = state_after(records[: ended + 1])
        return any(state.get(name, nominal) != nominal for name, nominal in rules.inputs)

    def _is_disturbed(self, case: Case) -> bool:
        """Return whether a fault was caused before the run ended (semantics 7.4)."""
        if _acts_beside_requests(case, self.run) or any(True for _ in _with_disturbed_messages(self.run)):
            return True
        return any(self.run.reactions[i].resource not in self.run.real for i in self._at_fault(case))

    def failure(self, case: Case, rules: ExcuseRules) -> Failure:
        """Return the failure of a case that missed this goal without an excuse."""
        if self.end in _NEVER_EXCUSED:
            described = _described(self.end, self.records)
            message = described if self.number is None else f"goal {self.number}, {self.goal.name}: {described}"
            return Failure(FailureKind(self.end.value), self.end.value, message)
        if self.end is End.NOT_STARTED:
            message = f"{self.words} did not begin: {self.goal.when} never held after the run before had ended"
        else:
            ended = self.end.replace("_", " ")
            why = "" if self._is_disturbed(case) else ", and no fault was injected"
            what = f"{self.words} was not reached ({ended}){why}{_but_for_real(case, self.run)}"
            message = f"{what}{self.not_acted(case, rules)}"
        return Failure(FailureKind.NOT_REACHED, self.end.value, message)

    def not_acted(self, case: Case, rules: ExcuseRules) -> str:
        """Return that nothing acts from outside in a case without an environment, if a wait could have ended so."""
        if case.environment is not None or case.origin is not None or self.end not in WAITING_ENDS:
            return ""
        model, state = rules.model, state_after(self.records)
        able = [each.name for each in (() if model is None else model.environment) if each.guard.holds(state)]
        if not able:
            return ""
        return f"; nothing acts from outside in this case, and {' or '.join(able)} could: list it under `environment`"


_NEVER_EXCUSED = (End.LIVELOCK, End.MODEL_ERROR)


def goal_runs(case: Case, run: Outcomes) -> Iterator[GoalRun]:
    """Yield the run for each goal of a case, in order."""
    if not case.later:
        yield GoalRun(case.goals[0], None, run.end, run.records, run, run.visited)
        return
    ranges = ranges_of_goals(run.records)
    ends = ends_of(run.records)
    for number, (goal, indices, ended) in enumerate(zip(case.goals, ranges, ends, strict=True), start=1):
        until = run.records[: indices.stop]
        sent = sum(isinstance(record, RequestSent) for record in until)
        so_far = replace(run, records=until, reactions=run.reactions[:sent])
        records = run.records[indices.start : indices.stop]
        visited = run.visited_by_goal[number - 1] if run.visited_by_goal else run.visited
        yield GoalRun(goal, number, End(ended.end), records, so_far, visited)


def _in_flight(records: Sequence[Record]) -> tuple[str, ...]:
    """Return the resources with a request in flight after some records."""
    found: dict[str, None] = {}
    for record in records:
        match record:
            case RequestSent():
                found[record.resource] = None
            case RequestCancelled() | ReplyReceived():
                found.pop(record.resource, None)
            case _:
                pass
    return tuple(found)


def _acted(case: Case, records: Sequence[Record]) -> frozenset[str]:
    """Return the names of the injections that acted."""
    if not case.injections:
        return frozenset()
    return frozenset(r.injection for r in records if isinstance(r, (InjectionApplied, ResourceChanged))) & frozenset(
        injection.name for injection in case.injections
    )


def _lost_resources(run: Outcomes) -> Iterator[str]:
    """Yield the resources that were lost or came back with their nodes or drivers, or restarted."""
    for record in run.records:
        if isinstance(record, ResourceChanged) and record.injection == NETWORK:
            yield record.resource


def _with_disturbed_messages(run: Outcomes) -> Iterator[int]:
    """Yield the requests to simulated resources of which a message did not arrive exactly once, by position."""
    for position, reaction in enumerate(run.reactions):
        deliveries = (reaction.request, reaction.reply, reaction.cancel)
        if reaction.resource not in run.real and any(d is not None and len(d) != 1 for d in deliveries):
            yield position


def _acts_beside_requests(case: Case, run: Outcomes) -> bool:
    """Return whether an injection acted, a fault of the network came, or a simulated resource was lost.

    Over nodes, one that simulates a resource may be lost and come back, though the case does not say so.
    """
    if case.network.kept != Network() or _acted(case, run.records):
        return True
    return any(name not in run.real for name in _lost_resources(run))


def _but_for_real(case: Case, run: Outcomes) -> str:
    """Return the faults of real resources, as the end of a sentence."""
    faulty = requests_at_fault(case, run.records, run.reactions, run.real) if run.real else ()
    wrong = (*_lost_resources(run), *(run.reactions[position].resource for position in faulty))
    names = [f"`{name}`" for name in dict.fromkeys(wrong) if name in run.real]
    if not names:
        return ""
    was, is_ = ("was", "is") if len(names) == 1 else ("were", "are")
    return f"; {', '.join(names)} failed, did not answer, or {was} lost, and {is_} real"


def _described(end: End, records: Sequence[Record]) -> str:
    last = run_end(records)
    detail = () if last is None else last.detail
    if end is End.LIVELOCK:
        return describe_cycle(detail)
    return f"the model is wrong: {', '.join(detail)}"


def find_unused(case: Case, records: Sequence[Record]) -> tuple[str, ...]:
    """Yield a sentence for each injection that never acted, each rule of requests never sent, and each late fault."""
    if not (case.injections or case.outcomes or any(case.network.windows())):
        return ()
    return (*_injections(case, records), *_outcomes(case, records), *_faults(case, records))


def never_came(change: EnvironmentChange) -> str:
    """Return that the moment of a change from outside never came, as a sentence."""
    what = f"the change by {change.by}" if change.by else f"the change {assignments(change.assign or ())}"
    if change.at_ns is not None:
        return f"{what} at {format_moment(change.at_ns)} never came: the run had ended"
    due = f"{format_duration(change.after_ns)} after" if change.after_ns else "as soon as"
    return f"{what} never came: it is due {due} {change.when} holds, and the run had ended"


def silent_outside(case: Case, run: Outcomes, verdict: Verdict, rules: ExcuseRules) -> Iterator[str]:
    """Yield for each missed goal that fails no case that something outside could have acted, and does not."""
    for goal in goal_runs(case, run):
        clause = goal.not_acted(case, rules) if goal.is_missed else ""
        if clause and not any(clause in failure.message for failure in verdict.failures):
            yield f"{goal.words} was not reached ({goal.end.replace('_', ' ')}){clause}"


def _injections(case: Case, records: Sequence[Record]) -> Iterator[str]:
    acted = _acted(case, records)
    for injection in case.injections:
        if injection.name not in acted:
            yield f"injection {injection.name} never acted, or changed nothing"


def _outcomes(case: Case, records: Sequence[Record]) -> Iterator[str]:
    sent = _count(records)
    last_numbers: dict[str, int] = {}
    for rule in case.outcomes:
        number = rule.first if rule.last is None else rule.last
        last_numbers[rule.subject] = max(number, last_numbers.get(rule.subject, 0))
    for subject, number in last_numbers.items():
        count = sent.get(subject, 0)
        if number > count:
            requests = f"{count} request{'' if count == 1 else 's'}"
            yield f"the outcome of request {number} of {subject} was not used: {requests} sent"


def _faults(case: Case, records: Sequence[Record]) -> Iterator[str]:
    """Yield the network faults that begin after the end of the run; drawn ones do not count."""
    if case.origin is not None:
        return
    ended_ns = records[-1].at_ns
    for fault, _, window in case.network.windows():
        if window.at_ns > ended_ns:
            yield f"the {fault.window_name} at {format_duration(window.at_ns)} comes after the end of the run"


def _count(records: Sequence[Record]) -> dict[str, int]:
    """Return the number of requests to each resource, and of requests during each operation."""
    sent: dict[str, int] = {}
    operation: str | None = None
    for record in records:
        match record:
            case BecameCurrent():
                operation = record.operation
            case OperationStepped(target=OperationState.INITIAL):
                operation = None
            case RequestSent():
                sent[record.resource] = sent.get(record.resource, 0) + 1
                if operation is not None and operation != record.resource:
                    sent[operation] = sent.get(operation, 0) + 1
            case _:
                continue
    return sent
