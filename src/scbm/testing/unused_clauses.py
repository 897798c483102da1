"""Finds clauses of a case without effect: injections that never acted, outcomes of requests never sent."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases.trace import BecameCurrent, InjectionApplied, OperationStepped, RequestSent, ResourceChanged
from scbm.model import OperationState, format_duration

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases import Case
    from scbm.cases.trace import Record


def find_unused(case: Case, records: Sequence[Record]) -> tuple[str, ...]:
    """Yield a sentence for each injection that never acted, each rule of requests never sent, and each late fault."""
    if not (case.injections or case.outcomes or case.network.partitions or case.network.restarts):
        return ()
    return (*_injections(case, records), *_outcomes(case, records), *_faults(case, records))


def _injections(case: Case, records: Sequence[Record]) -> Iterator[str]:
    acted = [r.injection for r in records if isinstance(r, (InjectionApplied, ResourceChanged))]
    for injection in case.injections:
        if injection.name not in acted:
            yield f"injection {injection.name} never acted"


def _outcomes(case: Case, records: Sequence[Record]) -> Iterator[str]:
    sent = _count(records)
    last_said: dict[str, int] = {}
    for rule in case.outcomes:
        number = rule.first if rule.last is None else rule.last
        last_said[rule.subject] = max(number, last_said.get(rule.subject, 0))
    for subject, number in last_said.items():
        count = sent.get(subject, 0)
        if number > count:
            yield f"the outcome of request {number} of {subject} is said, and there were {count or 'none'}"


def _faults(case: Case, records: Sequence[Record]) -> Iterator[str]:
    """Yield the partitions and restarts that begin after the end of the run; drawn ones do not count."""
    if case.origin is not None:
        return
    ended_ns = records[-1].at_ns
    for partition in case.network.partitions:
        if partition.at_ns > ended_ns:
            yield f"the partition at {format_duration(partition.at_ns)} comes after the end of the run"
    for restart in case.network.restarts:
        if restart.at_ns > ended_ns:
            yield f"the restart at {format_duration(restart.at_ns)} comes after the end of the run"


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
