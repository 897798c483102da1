"""Explanations of decisions: the run that visits an obligation, or the exploration that found no such run."""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases import ConditionKind
from scbm.cases.coverage import Obligations, visited_by
from scbm.cases.trace import (
    InjectionApplied,
    MeasurementReceived,
    PlanReceived,
    PutBack,
    RequestSent,
    ResourceChanged,
    assignments,
    fault_in,
)
from scbm.model import InitialStates, Outcome, format_moment
from scbm.proofcheck import RunsArgument
from scbm.testing.request_faults import requests_at_fault

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.cases.coverage import Obligation
    from scbm.cases.trace import Record
    from scbm.closing.decisions import Closing, Decided, Suggestion
    from scbm.model import BehaviorModel
    from scbm.testing import Execution

_MAX_STATES = 100_000
"""Maximum number of combinations of random values that are enumerated to count the initial states."""


class Visit(Struct, frozen=True):
    """The first visit of a run to an obligation.

    Attributes:
        execution: the run.
        record: the index of the record that visits it.
        at_ns: the time of the visit.
        plan: the plan that is carried out at that time.
        wrong: the faults until then, as sentences, in order.
        outside: what changed from outside until then, by the case or by the environment, as sentences, in order.
    """

    execution: Execution
    record: int
    at_ns: int
    plan: tuple[str, ...]
    wrong: tuple[str, ...]
    outside: tuple[str, ...]


class SearchedRuns(Struct, frozen=True):
    """The exploration behind a proof about all runs.

    Attributes:
        initial_states: the number of allowed initial states; `None` if there are too many to count.
        goals: the number of goals.
        situations: the number of situations that runs can be in between two events.
    """

    initial_states: int | None
    goals: int
    situations: int


class Explanation(Struct, frozen=True):
    """Why one obligation was decided as it was.

    Attributes:
        decided: the decision.
        visit: if it is covered, the visit of the first case that covers it.
        searched: if it is proved uncoverable by exploring all runs, the size of that exploration.
        suggestions: the changes that would make it coverable, or by which forced states would visit it.
    """

    decided: Decided
    visit: Visit | None = None
    searched: SearchedRuns | None = None
    suggestions: tuple[Suggestion, ...] = ()


def explain(
    closing: Closing, asked: Iterable[Obligation], executions: Mapping[str, Execution]
) -> tuple[Explanation, ...]:
    """Return an explanation for each requested obligation, in the order of `Closing.decided`.

    Args:
        closing: the result of closing.
        asked: obligations of its model.
        executions: the runs of the covering cases, by name.
    """
    wanted = frozenset(asked)
    return tuple(
        _explained(closing, decided, executions) for decided in closing.decided if decided.obligation in wanted
    )


def _explained(closing: Closing, decided: Decided, executions: Mapping[str, Execution]) -> Explanation:
    about = tuple(each for each in closing.suggestions if decided.obligation in (*each.obligations, *each.by_force))
    if decided.case is not None:
        visit = first_visit(executions[decided.case], decided.obligation, closing.model)
        return Explanation(decided, visit, _searched_runs(closing, decided), about)
    return Explanation(decided, None, _searched_runs(closing, decided), about)


def first_visit(execution: Execution, obligation: Obligation, model: BehaviorModel) -> Visit | None:
    """Return the first visit of a run of a model to an obligation; `None` if there is none."""
    obligations, records = Obligations.of(model), execution.trace.records
    bit = obligations.bit(obligation)
    for index, record in enumerate(records):
        if visited_by((record,), obligations) & bit:
            plans = [found.plan for found in records[: index + 1] if isinstance(found, PlanReceived)]
            events = _Events(execution, model, index + 1)
            return Visit(execution, index, record.at_ns, plans[-1] if plans else (), events.wrong, events.outside)
    return None


class _Events:
    """The faults in the beginning of a run, and the changes from outside, as sentences with times."""

    def __init__(self, execution: Execution, model: BehaviorModel, end: int) -> None:
        self._execution = execution
        self._shared = [resource.name for resource in model.resources if resource.shared]
        real = () if execution.log is None else execution.log.real
        self._at_fault = requests_at_fault(execution.case, execution.trace.records, execution.reactions, real)
        self._other_users: list[str] = []
        wrong: list[str] = []
        outside: list[str] = []
        for index, record in enumerate(execution.trace.records[:end]):
            change = self._outside(index, record)
            sentence = self._fault(record) if change is None else change
            if sentence is not None:
                (wrong if change is None else outside).append(f"{sentence} ({format_moment(record.at_ns)})")
        self.wrong, self.outside = tuple(wrong), tuple(outside)

    def _outside(self, index: int, record: Record) -> str | None:
        """Return a sentence for a change that the world outside the model could have made (semantics 9.10)."""
        forced_by = self._execution.forced_by
        if forced_by is not None and index >= forced_by:
            return None
        match record:
            case MeasurementReceived(changes=changes, by=by) if changes:
                return f"environment {by} sets {assignments(changes)}" if by else assignments(changes)
            case InjectionApplied(changes=changes, injection=name, forced=False) if changes:
                return f"injection {name} sets {assignments(changes)}"
            case PutBack(changes=changes, injection=name, forced=False) if changes:
                return f"injection {name} puts back {assignments(changes)}"
            case ResourceChanged() if self._is_other_user(record):
                return fault_in(record)
            case _:
                return None

    def _is_other_user(self, record: ResourceChanged) -> bool:
        """Return whether another user occupies a shared resource, or leaves it."""
        if record.resource in self._shared and record.condition == ConditionKind.OCCUPIED.value:
            self._other_users.append(record.injection)
        return record.injection in self._other_users

    def _fault(self, record: Record) -> str | None:
        """Return a sentence for a fault, or for a request that is at fault without an answer."""
        if isinstance(record, RequestSent) and record.request - 1 in self._at_fault:
            outcome = self._execution.reactions[record.request - 1].outcome
            return (
                f"{record.resource} leaves request {record.request} unanswered" if outcome is Outcome.TIMEOUT else None
            )
        return fault_in(record)


def _searched_runs(closing: Closing, decided: Decided) -> SearchedRuns | None:
    """Return the size of the exploration behind the proof of an obligation, if it is a proof about all runs."""
    certificate = dict(closing.certificates).get(decided.certificate or "")
    if certificate is None or not isinstance(certificate.argument, RunsArgument):
        return None
    runs = certificate.argument.runs
    return SearchedRuns(_initial_states(closing.model), len(runs), sum(len(each.situations) for each in runs))


def _initial_states(model: BehaviorModel) -> int | None:
    beginnings = InitialStates(model).beginnings(is_open=True)
    if sum(prod(map(len, each.values())) for each in beginnings) > _MAX_STATES:
        return None
    states = (dict(zip(each, values, strict=True)) for each in beginnings for values in product(*each.values()))
    return len(dict.fromkeys(tuple(state.values()) for state in states if model.initial_states.holds(state)))
