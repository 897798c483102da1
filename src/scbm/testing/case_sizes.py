"""The size of a failing case: how much a reader has to understand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cases.trace import OperationStepped
from scbm.model import OperationState, Outcome, format_duration
from scbm.testing.verdicts import FailureKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases import Case, OutcomeRule
    from scbm.model import BehaviorModel
    from scbm.testing.tester import Execution
    from scbm.testing.verdicts import Failure

MESSAGES = ("request", "reply", "cancel")
SAID = ("latency_ns", "measured", "reply", "request", "cancel", "outcome")
"""The fields of a rule, the most dispensable first."""


@dataclass(frozen=True, slots=True, order=True)
class Size:
    """The size of a failing case; compared from the first figure to the last.

    Attributes:
        operations: how many operations start until it fails.
        faults: injections and faults of the network.
        outcomes: requests that are made to end otherwise than in a plain success.
        requests: requests with a rule.
        details: the details of the case, and the length of its times.
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
        """The number of choices of the case, without its goal."""
        return self.faults + self.requests + self.differences


def size_of(execution: Execution, failure: Failure, model: BehaviorModel) -> Size:
    """Return the size of the case of a failed run."""
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
    """Return the number of operations that start until the run fails."""
    records: Sequence[object] = execution.trace.records
    if failure.kind is FailureKind.REQUIREMENT:
        found = (v.record for v in execution.violations if v.requirement == failure.subject)
        records = records[: next(found, len(records)) + 1]
    return sum(isinstance(r, OperationStepped) and r.target is OperationState.EXECUTING for r in records)


def _says_more_than_success(rule: OutcomeRule) -> bool:
    deliveries = (rule.request, rule.reply, rule.cancel)
    return rule.outcome not in (None, Outcome.SUCCEED) or any(delivery is not None for delivery in deliveries)


def _details(case: Case) -> int:
    """Return the number of details that could be left out, and roughly the length of the times."""
    said = 0
    for rule in case.outcomes:
        said += 2 * sum(getattr(rule, field) is not None for field in SAID) + _length(rule.latency_ns or 0)
        said += sum(_length(delay_ns) for field in MESSAGES for delay_ns in getattr(rule, field) or ())
    for injection in case.injections:
        said += len(injection.assign) + _length(injection.at_ns or 0)
        said += sum(part is not None for part in (injection.when, injection.at_ns, injection.hold_ns))
        said += injection.condition is not None and injection.condition.factor != 1
    said += sum(_length(p.at_ns) + _length(p.for_ns) for p in case.network.partitions)
    said += sum(_length(r.at_ns) + _length(r.for_ns) for r in case.network.restarts)
    said += 2 * bool(case.network.latency_ns) + (case.limits.time_ns is not None) + (case.limits.plans is not None)
    return said


def _length(time_ns: int) -> int:
    """Return the number of characters of a written time; 0 for no time."""
    return len(format_duration(time_ns)) if time_ns else 0
