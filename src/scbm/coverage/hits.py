"""From a trace to the obligations that it visits. The one place that says what counts as visited."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.coverage.obligations import Aspect, Obligation, Obligations
from scbm.model import OperationState
from scbm.trace import AutomaticTaken, OperationStepped, PlanReceived, Record

if TYPE_CHECKING:
    from collections.abc import Iterable

_ASPECTS = {state: Aspect(state.value) for state in OperationState if state is not OperationState.INITIAL}


def visited_by(records: Iterable[Record], obligations: Obligations) -> int:
    """The obligations that these records visit, as bits."""
    visited = 0
    for obligation in dict.fromkeys(_obligations(records)):
        visited |= obligations.bit(obligation)
    return visited


def _obligations(records: Iterable[Record]) -> Iterable[Obligation]:
    for record in records:
        if isinstance(record, OperationStepped):
            if record.target is not OperationState.INITIAL:
                yield Obligation(record.operation, _ASPECTS[record.target])
        elif isinstance(record, AutomaticTaken):
            yield Obligation(record.transition, Aspect.TAKEN)
            if record.failed is not None:
                yield Obligation(record.failed, Aspect.FAILED)
        elif isinstance(record, PlanReceived):
            for operation in record.plan:
                yield Obligation(operation, Aspect.QUEUED)
