"""Why an obligation ended as it did: the run that visits it, or what was looked at in vain."""

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
"""So many combinations of random values are gone through to count the initial states."""


@dataclass(frozen=True, slots=True)
class Visit:
    """The first visit of a run to an obligation.

    Attributes:
        execution: the run.
        record: the index of the record that visits it.
        at_ns: when.
        plan: the plan that is carried out then.
        wrong: what went wrong until then, in words, in order.
    """

    execution: Execution
    record: int
    at_ns: int
    plan: tuple[str, ...]
    wrong: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SearchedRuns:
    """What a proof about all runs looked at.

    Attributes:
        initial_states: how many initial states are allowed; `None` if there are too many to count.
        goals: how many goals there are.
        situations: how many situations runs can be in between two events.
    """

    initial_states: int | None
    goals: int
    situations: int


@dataclass(frozen=True, slots=True)
class Explanation:
    """Why one obligation ended as it did.

    Attributes:
        decided: how it ended.
        visit: if it is covered, the visit of the first case that covers it.
        looked_at: if all runs had to be looked at to prove it uncoverable, what that was.
        suggestions: what would change it.
    """

    decided: Decided
    visit: Visit | None = None
    looked_at: SearchedRuns | None = None
    suggestions: tuple[Suggestion, ...] = ()


def explain(
    closing: Closing, asked: Iterable[Obligation], executions: Mapping[str, Execution]
) -> tuple[Explanation, ...]:
    """An explanation for each obligation that is asked for, in the order of `Closing.decided`.

    Args:
        closing: what closing came to.
        asked: obligations of its model.
        executions: the runs of the cases that cover them, by name.
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
    return Explanation(decided, looked_at=_looked_at(closing, decided), suggestions=about)


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
    """Whether a resource answers a request, if the answer is not lost and nobody gives up waiting for it."""
    reactions = execution.reactions[request - 1 : request]
    return all(reaction.outcome is not Outcome.TIMEOUT for reaction in reactions)


def _looked_at(closing: Closing, decided: Decided) -> SearchedRuns | None:
    """What the proof of an obligation looked at, if it is one about all runs."""
    certificate = dict(closing.certificates).get(decided.certificate or "")
    if certificate is None or not isinstance(certificate.argument, RunsArgument):
        return None
    runs = certificate.argument.runs
    return SearchedRuns(_initial_states(closing.model), len(runs), sum(len(situations) for _, situations in runs))


def _initial_states(model: BehaviorModel) -> int | None:
    states = InitialStates(model)
    if states.combinations > _MAX_STATES:
        return None
    return sum(1 for _ in states.allowed(_MAX_STATES))
