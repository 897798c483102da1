"""Explanations of decisions: the run that visits an obligation, or the exploration that found no such run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cases.coverage import Obligations, visited_by
from scbm.cases.trace import PlanReceived, RequestSent, fault_in
from scbm.model import InitialStates, Outcome, format_moment
from scbm.proofcheck import RunsArgument

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from scbm.cases.coverage import Obligation
    from scbm.cases.trace import Record
    from scbm.closing.decisions import Closing, Decided, Suggestion
    from scbm.model import BehaviorModel
    from scbm.testing import Execution

_MAX_STATES = 100_000
"""Maximum number of combinations of random values that are enumerated to count the initial states."""


@dataclass(frozen=True, slots=True)
class Visit:
    """The first visit of a run to an obligation.

    Attributes:
        execution: the run.
        record: the index of the record that visits it.
        at_ns: the time of the visit.
        plan: the plan that is carried out at that time.
        wrong: the faults until then, as sentences, in order.
    """

    execution: Execution
    record: int
    at_ns: int
    plan: tuple[str, ...]
    wrong: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SearchedRuns:
    """The exploration behind a proof about all runs.

    Attributes:
        initial_states: the number of allowed initial states; `None` if there are too many to count.
        goals: the number of goals.
        situations: the number of situations that runs can be in between two events.
    """

    initial_states: int | None
    goals: int
    situations: int


@dataclass(frozen=True, slots=True)
class Explanation:
    """Why one obligation was decided as it was.

    Attributes:
        decided: the decision.
        visit: if it is covered, the visit of the first case that covers it.
        searched: if it is proved uncoverable by exploring all runs, the size of that exploration.
        suggestions: the changes that would make it coverable.
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
    about = tuple(each for each in closing.suggestions if decided.obligation in each.obligations)
    if decided.case is not None:
        visit = first_visit(executions[decided.case], decided.obligation, Obligations.of(closing.model))
        return Explanation(decided, visit, suggestions=about)
    return Explanation(decided, searched=_searched_runs(closing, decided), suggestions=about)


def first_visit(execution: Execution, obligation: Obligation, obligations: Obligations) -> Visit | None:
    """Return the first visit of a run to an obligation; `None` if there is none."""
    records = execution.trace.records
    bit = obligations.bit(obligation)
    for index, record in enumerate(records):
        if visited_by((record,), obligations) & bit:
            plans = [found.plan for found in records[: index + 1] if isinstance(found, PlanReceived)]
            wrong = tuple(_what_goes_wrong(execution, records[: index + 1]))
            return Visit(execution, index, record.at_ns, plans[-1] if plans else (), wrong)
    return None


def _what_goes_wrong(execution: Execution, records: Iterable[Record]) -> Iterator[str]:
    """Yield a sentence for each fault in `records`, and for each request without an answer."""
    for record in records:
        fault = fault_in(record)
        if isinstance(record, RequestSent) and not _is_answered(execution, record.request):
            fault = f"{record.resource} leaves request {record.request} unanswered"
        if fault is not None:
            yield f"{fault} ({format_moment(record.at_ns)})"


def _is_answered(execution: Execution, request: int) -> bool:
    """Return whether a resource answers a request, the reply is not lost, and the request is not cancelled before."""
    reactions = execution.reactions[request - 1 : request]
    return all(reaction.outcome is not Outcome.TIMEOUT for reaction in reactions)


def _searched_runs(closing: Closing, decided: Decided) -> SearchedRuns | None:
    """Return the size of the exploration behind the proof of an obligation, if it is a proof about all runs."""
    certificate = dict(closing.certificates).get(decided.certificate or "")
    if certificate is None or not isinstance(certificate.argument, RunsArgument):
        return None
    runs = certificate.argument.runs
    return SearchedRuns(_initial_states(closing.model), len(runs), sum(len(each.situations) for each in runs))


def _initial_states(model: BehaviorModel) -> int | None:
    states = InitialStates(model)
    if states.combinations > _MAX_STATES:
        return None
    allowed = dict.fromkeys(states.allowed(_MAX_STATES))
    if model.initial_states.holds(model.nominal_state):
        allowed[model.nominal_state] = None
    return len(allowed)
