"""Which requests of a run are at fault: the one definition for verdicts, shrinking and closing (semantics 7.4).

A request is at fault if its reply failed, if its reply was overdue, or if no reply comes and its operation times out.
A request that is cancelled before is not at fault, whatever would have become of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.cases import Intake
from scbm.cases.trace import End, RequestOutcome, ResourceChanged, RunEnded, spans_of
from scbm.model import Outcome

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases import Case, Condition, Reaction
    from scbm.cases.trace import Record, RequestSpan


class RequestFate(NamedTuple):
    """What became of a request until it ended.

    Attributes:
        has_failed: whether a reply came, and it said that the request failed.
        is_overdue: whether the moment at which its reply was due passed while it was in flight.
        is_unanswered: whether its outcome is that no reply comes.
        has_timed_out: whether the deadline of its operation passed while it was in flight. Without a deadline the time
            limit of the run stands for it.
    """

    has_failed: bool = False
    is_overdue: bool = False
    is_unanswered: bool = False
    has_timed_out: bool = False


def is_at_fault(fate: RequestFate) -> bool:
    """Return whether a request is at fault."""
    return fate.has_failed or fate.is_overdue or (fate.is_unanswered and fate.has_timed_out)


def requests_at_fault(
    case: Case, records: Sequence[Record], reactions: Sequence[Reaction], real: Sequence[str]
) -> tuple[int, ...]:
    """Return the requests of a run that are at fault, by their positions from 0.

    Args:
        case: the case.
        records: the trace.
        reactions: what happened to its requests, in order.
        real: the real resources; when their replies are due is not known.
    """
    conditions = _Conditions(case, records)
    ends = [record.at_ns for record in records if isinstance(record, RunEnded) and record.end == End.TIME_LIMIT.value]
    found = []
    for span in sorted(spans_of(records).requests, key=lambda span: span.request):
        reaction = reactions[span.request - 1]
        due_ns = None if span.resource in real else conditions.due_ns(span, reaction)
        fate = RequestFate(
            has_failed=span.outcome is RequestOutcome.FAILED,
            is_overdue=due_ns is not None and _is_overdue(span, due_ns),
            is_unanswered=reaction.outcome is Outcome.TIMEOUT and not _is_answered(span),
            has_timed_out=span.missed_deadline or span.end_ns in ends,
        )
        if is_at_fault(fate):
            found.append(span.request - 1)
    return tuple(found)


def _is_answered(span: RequestSpan) -> bool:
    return span.outcome in (RequestOutcome.SUCCEEDED, RequestOutcome.FAILED)


def _is_overdue(span: RequestSpan, due_ns: int) -> bool:
    """Return whether the moment of the reply passed; a request that ends at this moment has seen it if time passed."""
    if _is_answered(span):
        return False
    return due_ns < span.end_ns or due_ns == span.end_ns > span.begin_ns


class _Conditions:
    """The conditions of resources in the course of a run."""

    def __init__(self, case: Case, records: Sequence[Record]) -> None:
        known = [each.condition for each in case.injections if each.condition is not None]
        self._changes: dict[str, list[tuple[int, Condition | None]]] = {}
        for record in records:
            if isinstance(record, ResourceChanged):
                condition = next(
                    (each for each in known if str(each) == record.condition), None
                )  # `None`: well, or down
                self._changes.setdefault(record.resource, []).append((record.at_ns, condition))

    def due_ns(self, span: RequestSpan, reaction: Reaction) -> int | None:
        """Return when the reply to a request is due; `None` if it never is.

        A request or a reply that is lost, or that a dead resource forgets, is due when it would have come.
        """
        if reaction.outcome is Outcome.TIMEOUT:
            return None
        arrives_ns = span.begin_ns + min(reaction.request or (0,))
        begun = next(self._starts(span.resource, arrives_ns), None)
        if begun is None:
            return None
        begin_ns, condition = begun
        latency_ns = reaction.latency_ns
        if condition is not None:
            latency_ns = condition.kind.time(latency_ns, condition.factor)
        return begin_ns + latency_ns + min(reaction.reply or (0,))

    def _starts(self, resource: str, arrives_ns: int) -> Iterator[tuple[int, Condition | None]]:
        """Yield the first moment from an arrival on at which the resource starts requests, with its condition then."""
        changes = self._changes.get(resource, ())
        before = [condition for at_ns, condition in changes if at_ns <= arrives_ns]
        moments = [(arrives_ns, before[-1] if before else None)]
        moments += [(at_ns, condition) for at_ns, condition in changes if at_ns > arrives_ns]
        yield from ((at, each) for at, each in moments if each is None or each.kind.intake is not Intake.WAIT)
