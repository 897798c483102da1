"""Making a failing case small: what is left fails for the same reason, and each part of it is needed (decision 12).

A case is a list of choices: where it begins, what its goal is, each fault, injection and forced outcome. The shrinker
leaves choices out, all at once, then in halves, then one by one, and puts plainer ones in the place of others. After
each attempt it runs the case. Nothing is drawn, so the same case shrinks to the same case, everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from scbm.cases import Expectations, Network, Partition, Restart
from scbm.model import And, OperationState, Outcome, format_duration, format_value
from scbm.simulating import TooLongError
from scbm.testing.verdicts import Failure, FailureKind
from scbm.trace import OperationStepped, RunStarted

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.cases import Case, Forced, Injection
    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.testing.tester import Execution, Tester

_Part = TypeVar("_Part")

MOST_RUNS = 2_000
"""So many attempts are made at most; the examples need less than a hundred."""

_MOST_SINGLES = 100
"""A rule for more requests than these stays one."""

_MORE_OF_ONE = 5_000
"""An attempt is given up when its trace has four times the records of the original, and so many more."""

MOST_RECORDS = 500_000
"""So many records may the traces of all attempts have; these are five to ten seconds."""


_MESSAGES = ("request", "reply", "cancel")
_SAID = ("latency_ns", "measured", "reply", "request", "cancel", "outcome")
"""What a rule can say of a request, what is easiest to do without first."""


@dataclass(frozen=True, slots=True, order=True)
class Size:
    """How much there is to understand of a failing case; compared from the first figure to the last.

    Attributes:
        operations: how many operations start until it fails.
        faults: injections and faults of the network.
        outcomes: requests that are made to end otherwise than in a plain success.
        requests: requests of which anything is said.
        details: everything that is said, and how long the times are.
        differences: variables that differ from the nominal state.
        goal: 0 for a goal of the model, else the variables that its predicate names.
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
        """How many choices the case is made of, beside its goal."""
        return self.faults + self.requests + self.differences


@dataclass(frozen=True, slots=True)
class Choice:
    """One choice of a case without which it does not fail so.

    Attributes:
        text: what was chosen.
        otherwise: what was tried in its place.
    """

    text: str
    otherwise: str

    def __str__(self) -> str:
        return f"{self.text}; it does not fail {self.otherwise}"


@dataclass(frozen=True, slots=True)
class Shrunk:
    """What shrinking came to.

    Attributes:
        execution: the small case, run.
        failure: why it fails.
        before, after: the sizes, before with all that was drawn.
        runs: how many attempts were made.
        matters: the choices that are left and that matter, each alone.
    """

    execution: Execution
    failure: Failure
    before: Size
    after: Size
    runs: int
    matters: tuple[Choice, ...]


class Shrinker:
    """Makes failing cases of one model small."""

    def __init__(self, tester: Tester, most_runs: int = MOST_RUNS) -> None:
        self._tester = tester
        self._model = tester.model
        self._most_runs = most_runs

    @staticmethod
    def can_shrink(failure: Failure) -> bool:
        """Whether a smaller case can fail for the same reason; what a case expects belongs to that case alone."""
        return failure.kind is not FailureKind.EXPECTATION

    def shrink(self, execution: Execution, failure: Failure, name: str | None = None) -> Shrunk:
        """The smallest case found that fails as `execution` did.

        Args:
            execution: a failed run.
            failure: which of its failures is kept.
            name: the name of the small case.

        Raises:
            ValueError: the run did not fail so, or `can_shrink` says no.
        """
        if not self.can_shrink(failure) or failure not in execution.verdict.failures:
            raise ValueError(f"{execution.case.name} cannot be shrunk by: {failure}")
        search = _Search(self._tester, execution, failure, self._most_runs)
        case = replace(
            _said(execution),
            name=name or f"small-{execution.case.name}",
            origin=None,
            recorded=None,
            expect=Expectations(),
            requirements=tuple(r for r in execution.case.requirements if _is_needed(r.name, failure)),
        )
        best = search.start(case)
        if best is None:
            raise AssertionError(f"{execution.case.name} fails otherwise when everything that was drawn is said")
        before = _size(best, failure, self._model)
        improved = True
        while improved:
            improved = False
            for step in _STEPS:
                found = search.improve(best, step)
                improved = improved or found is not best
                best = found
        kept = next(f for f in best.verdict.failures if f.is_like(failure))
        after = _size(best, kept, self._model)
        return Shrunk(best, kept, before, after, search.runs, tuple(search.what_matters(best)))


def _is_needed(requirement: str, failure: Failure) -> bool:
    return failure.kind is FailureKind.REQUIREMENT and requirement == failure.subject


def _said(execution: Execution) -> Case:
    """The case with everything that was drawn in it, and what is said of several requests said of each of them."""
    case = execution.case
    if case.origin is not None:
        return execution.closed_case
    rules = (single for rule in case.outcomes for single in _singles(rule))
    return replace(case, outcomes=tuple(rules))


def _singles(rule: Forced) -> Iterator[Forced]:
    if rule.last is None or rule.last - rule.first >= _MOST_SINGLES:
        yield rule
    else:
        yield from (replace(rule, first=number, last=number) for number in range(rule.first, rule.last + 1))


_Step: TypeAlias = "Callable[[Case, BehaviorModel], Iterator[Case]]"


class _Search:
    """Runs attempts, keeps those that are smaller and fail alike, and counts."""

    def __init__(self, tester: Tester, original: Execution, failure: Failure, most_runs: int) -> None:
        self._tester = tester
        self._model = tester.model
        self._failure = failure
        self._begins_broken = _begins_broken(original, failure)
        self._most_runs = most_runs
        self._most_of_one = _MORE_OF_ONE + 4 * len(original.trace.records)
        self._tried: dict[Case, None] = {}
        self._records = 0
        self.runs = 0

    def start(self, case: Case) -> Execution | None:
        """The closed case, run, if it still fails so."""
        return self._fails(case)

    def improve(self, best: Execution, step: _Step) -> Execution:
        """The best that a step leads to, taken again from each better one."""
        improved = True
        while improved:
            improved = False
            for case in step(best.case, self._model):
                if self._is_over:
                    return best
                found = self._attempt(case, best)
                if found is not None:
                    best, improved = found, True
                    break
        return best

    def _attempt(self, case: Case, best: Execution) -> Execution | None:
        """The run of a case, if it is better than the best so far."""
        if case in self._tried:
            return None
        self._tried[case] = None
        found = self._fails(case)
        if found is None:
            return None
        sizes = (_size(run, self._failure, self._model) for run in (found, best))
        return found if next(sizes) < next(sizes) else None

    @property
    def _is_over(self) -> bool:
        return self.runs >= self._most_runs or self._records >= MOST_RECORDS

    def _fails(self, case: Case) -> Execution | None:
        if not self._model.initial_states.holds(case.initial):
            return None
        self.runs += 1
        try:
            execution = self._tester.execute(case, self._most_of_one)
        except TooLongError:
            self._records += self._most_of_one
            return None
        self._records += len(execution.trace.records)
        if not any(failure.is_like(self._failure) for failure in execution.verdict.failures):
            return None
        # That a state is bad in which a run may begin is another reason than that a run leads to a bad one.
        return execution if self._begins_broken or not _begins_broken(execution, self._failure) else None

    def what_matters(self, best: Execution) -> Iterator[Choice]:
        """Each choice that is left, if the case does not fail so without it."""
        for choice, case in _choices(best.case, self._model):
            if self._is_over:
                return
            if self._model.initial_states.holds(case.initial) and self._fails(case) is None:
                yield choice


# sizes


def _size(execution: Execution, failure: Failure, model: BehaviorModel) -> Size:
    case = execution.case
    outcomes = [rule for rule in case.outcomes if _says_more_than_success(rule)]
    differences = sum(case.initial[v.name] != v.initial for v in model.space)
    is_named = model.goal(case.goal) == case.predicate
    network = case.network
    return Size(
        _operations(execution, failure),
        len(case.injections) + len(network.partitions) + len(network.restarts),
        len(outcomes),
        len(case.outcomes),
        _details(case),
        differences,
        0 if is_named else len(case.predicate.reads()) + 1,
    )


def _operations(execution: Execution, failure: Failure) -> int:
    """How many operations start until the run fails."""
    records: Sequence[object] = execution.trace.records
    if failure.kind is FailureKind.REQUIREMENT:
        found = (v.record for v in execution.violations if v.requirement == failure.subject)
        records = records[: next(found, len(records)) + 1]
    return sum(isinstance(r, OperationStepped) and r.target is OperationState.EXECUTING for r in records)


def _begins_broken(execution: Execution, failure: Failure) -> bool:
    """Whether the state in which the run begins breaks a requirement already."""
    first = execution.trace.records[0]  # before it, only an injection can have acted, and that is a reason of its own
    found = [v.record for v in execution.violations if v.requirement == failure.subject]
    return isinstance(first, RunStarted) and 0 in found


def _says_more_than_success(rule: Forced) -> bool:
    deliveries = (rule.request, rule.reply, rule.cancel)
    return rule.outcome not in (None, Outcome.SUCCEED) or any(delivery is not None for delivery in deliveries)


def _details(case: Case) -> int:
    """Everything that is said and could be left out, and how long the times are, roughly."""
    said = 0
    for rule in case.outcomes:
        said += 2 * sum(getattr(rule, field) is not None for field in _SAID) + _length(rule.latency_ns or 0)
        said += sum(_length(delay_ns) for field in _MESSAGES for delay_ns in getattr(rule, field) or ())
    for injection in case.injections:
        said += len(injection.assign) + _length(injection.at_ns or 0)
        said += sum(part is not None for part in (injection.when, injection.at_ns, injection.hold_ns))
        said += injection.condition is not None and injection.condition.factor != 1
    said += sum(_length(p.at_ns) + _length(p.for_ns) for p in case.network.partitions)
    said += sum(_length(r.at_ns) + _length(r.for_ns) for r in case.network.restarts)
    said += 2 * bool(case.network.latency_ns) + (case.limits.time_ns is not None) + (case.limits.plans is not None)
    return said


def _length(time_ns: int) -> int:
    """How much there is to read of a time: nothing at 0, else the characters that it is written with."""
    return len(format_duration(time_ns)) if time_ns else 0


# steps


def _plainest(case: Case, _: BehaviorModel) -> Iterator[Case]:
    yield replace(case, outcomes=(), injections=(), network=Network())
    yield replace(case, outcomes=())
    yield replace(case, injections=())
    yield replace(case, network=Network())


def _without_parts(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """Without some of the injections, faults and forced outcomes: first without half of them, in the end one."""
    network = case.network
    for kept in _fewer(case.injections):
        yield replace(case, injections=kept)
    for kept_partitions in _fewer(network.partitions):
        yield replace(case, network=replace(network, partitions=kept_partitions))
    for kept_restarts in _fewer(network.restarts):
        yield replace(case, network=replace(network, restarts=kept_restarts))
    for kept_rules in _fewer(case.outcomes):
        yield replace(case, outcomes=kept_rules)


def _fewer(parts: tuple[_Part, ...]) -> Iterator[tuple[_Part, ...]]:
    """The parts without a stretch of them, long stretches first."""
    length = len(parts)
    while length:
        for begin in range(0, len(parts), length):
            yield parts[:begin] + parts[begin + length :]
        length //= 2


def _plainer_rules(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """With one thing less said of some requests."""
    for index, rule in enumerate(case.outcomes):
        for field in _SAID:
            if getattr(rule, field) is not None:
                left_out: dict[str, Any] = {field: None}
                yield replace(case, outcomes=_replaced(case.outcomes, index, replace(rule, **left_out)))


def _earlier_rules(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """With what is said of one request said of an earlier one, and nothing of those between."""
    for rule in case.outcomes:
        if rule.first != rule.last:
            continue
        for number in dict.fromkeys((1, rule.first // 2, rule.first - 1)):
            if 0 < number < rule.first:
                moved = replace(rule, first=number, last=number)
                kept = [other for other in case.outcomes if not _lies_between(other, number, rule)]
                yield replace(case, outcomes=tuple(sorted((*kept, moved), key=lambda r: (r.subject, r.first))))


def _rounder_latencies(case: Case, _: BehaviorModel) -> Iterator[Case]:
    for index, rule in enumerate(case.outcomes):
        for rounder in _rounder_rule(rule):
            yield replace(case, outcomes=_replaced(case.outcomes, index, rounder))


def _rounder_rule(rule: Forced) -> Iterator[Forced]:
    for latency_ns in _rounder(rule.latency_ns or 0):
        yield replace(rule, latency_ns=latency_ns)
    for field in _MESSAGES:
        for copy, delay_ns in enumerate(getattr(rule, field) or ()):
            for rounded_ns in _rounder(delay_ns):
                changed: dict[str, Any] = {field: _replaced(getattr(rule, field), copy, rounded_ns)}
                yield replace(rule, **changed)


def _lies_between(other: Forced, number: int, rule: Forced) -> bool:
    """Whether a rule speaks of requests from `number` up to that of `rule`."""
    return other.subject == rule.subject and other.first <= rule.first and (other.last or number) >= number


def _plainer_injections(case: Case, _: BehaviorModel) -> Iterator[Case]:
    for index, injection in enumerate(case.injections):
        for plainer in _plainer(injection):
            yield replace(case, injections=_replaced(case.injections, index, plainer))


def _plainer(injection: Injection) -> Iterator[Injection]:
    if injection.hold_ns is not None:
        yield replace(injection, hold_ns=None)
    if injection.at_ns is not None:
        yield replace(injection, at_ns=None)
    if injection.when is not None:
        yield replace(injection, when=None)
    if len(injection.assign) > 1:
        for kept in _fewer(injection.assign):
            if kept:
                yield replace(injection, assign=kept)
    for at_ns in _rounder(injection.at_ns or 0):
        yield replace(injection, at_ns=at_ns or None)


def _plainer_faults(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """With partitions and restarts that begin and end at rounder times."""
    network = case.network
    if network.latency_ns:
        yield replace(case, network=replace(network, latency_ns=0))
    for index, partition in enumerate(network.partitions):
        for rounder in _rounder_fault(partition):
            changed = _replaced(network.partitions, index, rounder)
            yield replace(case, network=replace(network, partitions=changed))
    for index, restart in enumerate(network.restarts):
        for rounder_restart in _rounder_fault(restart):
            changed_restarts = _replaced(network.restarts, index, rounder_restart)
            yield replace(case, network=replace(network, restarts=changed_restarts))


_Fault = TypeVar("_Fault", Partition, Restart)


def _rounder_fault(fault: _Fault) -> Iterator[_Fault]:
    for time_ns in _rounder(fault.at_ns):
        yield replace(fault, at_ns=time_ns)
    for time_ns in _rounder(fault.for_ns):
        yield replace(fault, for_ns=time_ns)


def _rounder(time_ns: int) -> Iterator[int]:
    """Nothing at all, then whole seconds, tenths and thousandths, below the time and above it."""
    if not time_ns:
        return
    yield 0
    for unit_ns in (1_000_000_000, 100_000_000, 1_000_000):
        for rounded_ns in (time_ns // unit_ns * unit_ns, -(-time_ns // unit_ns) * unit_ns):
            if rounded_ns not in (0, time_ns):
                yield rounded_ns


def _plainer_state(case: Case, model: BehaviorModel) -> Iterator[Case]:
    """From the nominal state, or one variable nearer to it; or from another state that the model lists."""
    yield replace(case, initial=model.nominal_state)
    for variable in model.space:
        values = (variable.initial, *(value for value in variable.random if value != variable.initial))
        for value in values:
            if case.initial[variable.name] != value:
                yield replace(case, initial=case.initial.replace({variable.name: value}))


def _other_goals(case: Case, model: BehaviorModel) -> Iterator[Case]:
    """For another goal of the model, or for a part of one."""
    for name, goal in model.goals:
        if goal != case.predicate:
            yield replace(case, goal=name, predicate=goal)
    for goal in dict.fromkeys((case.predicate, *(goal for _, goal in model.goals))):
        for part in goal.operands if isinstance(goal, And) else ():
            yield replace(case, goal=_name(part, model), predicate=part)


def _name(goal: Predicate, model: BehaviorModel) -> str:
    return next((name for name, named in model.goals if named == goal), str(goal))


def _replaced(parts: tuple[_Part, ...], index: int, part: _Part) -> tuple[_Part, ...]:
    return (*parts[:index], part, *parts[index + 1 :])


_STEPS: tuple[_Step, ...] = (
    _plainest,
    _without_parts,
    _plainer_state,
    _other_goals,
    _earlier_rules,
    _plainer_rules,
    _rounder_latencies,
    _plainer_injections,
    _plainer_faults,
)


# what matters


def _choices(case: Case, model: BehaviorModel) -> Iterator[tuple[Choice, Case]]:
    """Each choice of a case, and the case without it."""
    for variable in model.space:
        value = case.initial[variable.name]
        if value != variable.initial:
            choice = Choice(_set(variable.name, value), f"with {format_value(variable.initial)}")
            yield choice, replace(case, initial=case.initial.replace({variable.name: variable.initial}))
    for index, injection in enumerate(case.injections):
        choice = Choice(f"injection {injection.name}", "without it")
        yield choice, replace(case, injections=_without(case.injections, index))
    for index, rule in enumerate(case.outcomes):
        yield Choice(_told(rule), "without it"), replace(case, outcomes=_without(case.outcomes, index))
    if case.limits.time_ns is not None:
        choice = Choice(f"limit of {format_duration(case.limits.time_ns)}", "without it")
        yield choice, replace(case, limits=replace(case.limits, time_ns=None))
    if case.limits.plans is not None:
        choice = Choice(f"limit of {case.limits.plans} plans", "without it")
        yield choice, replace(case, limits=replace(case.limits, plans=None))
    network = case.network
    for index, partition in enumerate(network.partitions):
        cut = partition.resource or "all resources"
        choice = Choice(f"partition of {cut} at {format_duration(partition.at_ns)}", "without it")
        yield choice, replace(case, network=replace(network, partitions=_without(network.partitions, index)))
    for index, restart in enumerate(network.restarts):
        choice = Choice(f"restart of {restart.resource} at {format_duration(restart.at_ns)}", "without it")
        yield choice, replace(case, network=replace(network, restarts=_without(network.restarts, index)))


def _set(name: str, value: Value) -> str:
    return f"{name} = {format_value(value)} at the beginning"


def _told(rule: Forced) -> str:
    """What a rule says, in words."""
    numbers = f"request {rule.first}" if rule.first == rule.last else f"requests {rule.first} to {rule.last}"
    numbers = f"requests from {rule.first} on" if rule.last is None else numbers
    said = [str(rule.outcome.value)] if rule.outcome is not None else []
    said += [f"after {format_duration(rule.latency_ns)}"] if rule.latency_ns is not None else []
    said += [f"{name} = {format_value(value)} measured" for name, value in rule.measured or ()]
    for name in _MESSAGES:
        delivery = getattr(rule, name)
        if delivery is not None:
            copies = ", ".join(format_duration(delay_ns) for delay_ns in delivery)
            said.append(f"{name} lost" if not delivery else f"{name} under way for {copies}")
    return f"{numbers} of {rule.subject}: {', '.join(said)}"


def _without(parts: tuple[_Part, ...], index: int) -> tuple[_Part, ...]:
    return (*parts[:index], *parts[index + 1 :])
