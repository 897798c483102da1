"""The size of a failing case, which shrinking reduces; and each choice of a case, with the case without it."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases import FaultAction, WindowFault
from scbm.cases.trace import OperationStepped, assignments
from scbm.model import OperationState, Outcome, format_duration, format_value
from scbm.testing.verdicts import violation_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases import AnyNetworkFault, Case, EnvironmentChange, OutcomeRule
    from scbm.model import BehaviorModel, Value
    from scbm.testing.tester import Execution
    from scbm.testing.verdicts import Failure


MESSAGES = ("request", "reply", "cancel")
RULE_FIELDS = ("latency_ns", "measured", "reply", "request", "cancel", "outcome")
"""The fields of a rule, the most dispensable first."""


class Size(Struct, frozen=True, order=True):
    """The size of a failing case; compared from the first figure to the last.

    Attributes:
        operations: how many operations start until it fails.
        faults: injections, faults of the network, and changes of the environment.
        outcomes: requests that are made to end otherwise than in a plain success.
        requests: requests with a rule.
        details: the details of the case, and the length of its times.
        differences: variables that differ from the nominal state.
        goal: 0 for one goal of the model. Another predicate counts the variables that it names, a further goal 1 more,
            and its `when` 1 more.
    """

    operations: int
    faults: int
    outcomes: int
    requests: int
    details: int
    differences: int
    goal: int

    @property
    def choices(self) -> int:
        """The number of choices of the case, without its goal."""
        return self.faults + self.requests + self.differences


def size_of(execution: Execution, failure: Failure, model: BehaviorModel) -> Size:
    """Return the size of the case of a failed run."""
    case = execution.case
    outcomes = [rule for rule in case.outcomes if _says_more_than_success(rule)]
    differences = sum(case.initial[v.name] != v.initial for v in model.space)
    return Size(
        _operations(execution, failure),
        len(case.injections) + len(case.environment or ()) + sum(1 for _ in case.network.windows()),
        len(outcomes),
        len(case.outcomes),
        _details(case),
        differences,
        _goals_size(case, model),
    )


def _goals_size(case: Case, model: BehaviorModel) -> int:
    own = (goal.predicate for goal in case.goals if model.goal(goal.name) != goal.predicate)
    waits = sum(goal.when is not None for goal in case.goals)
    return sum(len(predicate.reads()) + 1 for predicate in own) + len(case.later) + waits


def _operations(execution: Execution, failure: Failure) -> int:
    """Return the number of operations that start until the run fails."""
    records: Sequence[object] = execution.trace.records
    violation = violation_of(failure, execution.violations)
    if violation is not None:
        records = records[: violation.record + 1]
    return sum(isinstance(r, OperationStepped) and r.target is OperationState.EXECUTING for r in records)


def _says_more_than_success(rule: OutcomeRule) -> bool:
    deliveries = (rule.request, rule.reply, rule.cancel)
    return rule.outcome not in (None, Outcome.SUCCEED) or any(delivery is not None for delivery in deliveries)


def _details(case: Case) -> int:
    """Return the number of details that could be left out, and roughly the length of the times."""
    size = 0
    for rule in case.outcomes:
        size += 2 * sum(getattr(rule, field) is not None for field in RULE_FIELDS) + _length(rule.latency_ns or 0)
        size += sum(_length(delay_ns) for field in MESSAGES for delay_ns in getattr(rule, field) or ())
    for injection in case.injections:
        size += len(injection.assign) + _length(injection.at_ns or 0) + _length(injection.after_ns or 0)
        times = (injection.at_ns, injection.hold_ns, injection.after_ns)
        size += sum(part is not None for part in (injection.when, *times))
        size += injection.condition is not None and injection.condition.factor != 1
    for change in case.environment or ():
        size += len(change.assign or ()) + _length(change.at_ns or 0) + _length(change.after_ns)
        size += (change.when is not None) + bool(change.after_ns)
    size += sum(_length(window.at_ns) + _length(window.for_ns) for _, _, window in case.network.windows())
    size += 2 * sum(can_be_left_out(fault) for fault, _ in case.network.faults())
    return size + (case.limits.time_ns is not None) + (case.limits.plans is not None) + bool(case.planning_ns)


def can_be_left_out(fault: AnyNetworkFault) -> bool:
    """Return whether a network fault is one detail of a case: it has an effect, and no windows to leave out."""
    return fault.action is not FaultAction.LIMIT and not isinstance(fault, WindowFault)


def _length(time_ns: int) -> int:
    """Return the number of characters of a written time; 0 for no time."""
    return len(format_duration(time_ns)) if time_ns else 0


_Part = TypeVar("_Part")


class Choice(Struct, frozen=True):
    """One choice of a case; without it the case does not fail for the same reason.

    Attributes:
        text: what was chosen.
        otherwise: what was tried in its place.
        at_ns: the moment before which it does nothing; `None` if it names none.
    """

    text: str
    otherwise: str
    at_ns: int | None = None

    def __str__(self) -> str:
        return f"{self.text}; no such failure {self.otherwise}"


def choices_of(case: Case, model: BehaviorModel) -> Iterator[tuple[Choice, Case]]:
    """Yield each choice of a case with the case that lacks it."""
    for variable in model.space:
        value = case.initial[variable.name]
        if value != variable.initial:
            choice = Choice(_set(variable.name, value), f"with {format_value(variable.initial)}")
            yield choice, replace(case, initial=case.initial.replace({variable.name: variable.initial}))
    for index, injection in enumerate(case.injections):
        choice = Choice(f"injection {injection.name}", "without it", injection.at_ns)
        yield choice, replace(case, injections=_without(case.injections, index))
    for index, change in enumerate(case.environment or ()):
        choice = Choice(_change_words(change), "without it", change.at_ns)
        yield choice, replace(case, environment=_without(case.environment or (), index))
    for index, rule in enumerate(case.outcomes):
        yield Choice(_rule_words(rule), "without it"), replace(case, outcomes=_without(case.outcomes, index))
    if case.limits.time_ns is not None:
        choice = Choice(f"limit of {format_duration(case.limits.time_ns)}", "without it")
        yield choice, replace(case, limits=replace(case.limits, time_ns=None))
    if case.limits.plans is not None:
        choice = Choice(f"limit of {case.limits.plans} plans", "without it")
        yield choice, replace(case, limits=replace(case.limits, plans=None))
    network = case.network
    for fault, index, window in network.windows():
        subject = window.resource or "all resources"
        text = f"{fault.window_name} of {subject} at {format_duration(window.at_ns)}"
        choice = Choice(text, "without it", window.at_ns)
        fewer = _without(network.value_of(fault), index)
        yield choice, replace(case, network=network.with_value(fault, fewer))


def _set(name: str, value: Value) -> str:
    return f"{name} = {format_value(value)} at the beginning"


def _change_words(change: EnvironmentChange) -> str:
    """Return a change of the environment in words: what changes, when, and what makes it."""
    what = assignments(change.assign or ()) or "a change without effect"
    moment = f"at {format_duration(change.at_ns or 0)}"
    if change.when is not None:
        moment = f"{format_duration(change.after_ns)} after {change.when}" if change.after_ns else f"when {change.when}"
    if change.assign is None:
        return f"{change.by} {moment}"
    return f"{what} {moment}, by {change.by or 'something outside'}"


def _rule_words(rule: OutcomeRule) -> str:
    """Return a rule of outcomes in words."""
    numbers = f"request {rule.first}" if rule.first == rule.last else f"requests {rule.first} to {rule.last}"
    numbers = f"requests from {rule.first} on" if rule.last is None else numbers
    parts = [str(rule.outcome.value)] if rule.outcome is not None else []
    parts += [f"after {format_duration(rule.latency_ns)}"] if rule.latency_ns is not None else []
    parts += [f"{name} = {format_value(value)} measured" for name, value in rule.measured or ()]
    for name in MESSAGES:
        delivery = getattr(rule, name)
        if delivery is not None:
            copies = ", ".join(format_duration(delay_ns) for delay_ns in delivery)
            parts.append(f"{name} lost" if not delivery else f"{name} under way for {copies}")
    return f"{numbers} of {rule.subject}: {', '.join(parts)}"


def _without(parts: tuple[_Part, ...], index: int) -> tuple[_Part, ...]:
    return (*parts[:index], *parts[index + 1 :])
