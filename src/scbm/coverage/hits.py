"""From a trace to the obligations that it visits. The one place that says what counts as visited."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.coverage.obligations import Aspect, Obligations
from scbm.model import OperationState
from scbm.trace import AutomaticTaken, InjectionApplied, OperationStepped, PlanReceived, Record

if TYPE_CHECKING:
    from collections.abc import Iterable

_ASPECTS = {state: Aspect(state.value) for state in OperationState if state is not OperationState.INITIAL}


def visited_by(records: Iterable[Record], obligations: Obligations) -> int:
    """The obligations that these records visit, as bits."""
    visited = 0
    bit_of = obligations.bit_of
    for record in records:
        if isinstance(record, OperationStepped):
            if record.target is not OperationState.INITIAL:
                visited |= bit_of(record.operation, _ASPECTS[record.target])
        elif isinstance(record, AutomaticTaken):
            visited |= bit_of(record.transition, Aspect.TAKEN)
            if record.failed is not None:
                visited |= bit_of(record.failed, Aspect.FAILED)
        elif isinstance(record, InjectionApplied):
            if record.failed is not None:
                visited |= bit_of(record.failed, Aspect.FAILED)
        elif isinstance(record, PlanReceived):
            for operation in record.plan:
                visited |= bit_of(operation, Aspect.QUEUED)
    return visited
