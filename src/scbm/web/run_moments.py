"""What holds and what can happen at one record of a run: clauses of guards, and changes from outside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scbm.cases.trace import BecameCurrent, OperationStepped, PlanReceived, RunEnded, state_after
from scbm.model import OperationState, format_value
from scbm.model.predicates import conjuncts
from scbm.model.variables import CURRENT_NAME
from scbm.running.outside_changes import FreeMaker, TransitionMaker

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.cases.trace import Changes, Record
    from scbm.model import BehaviorModel, Operation, Value
    from scbm.running.program import Program
    from scbm.testing import Execution

_MAX_OFFERS = 200
"""Maximum number of changes from outside that the page lists; all others can be typed."""


def moment_json(
    model: BehaviorModel, program: Program, execution: Execution, record: int, chosen: str
) -> dict[str, Any]:
    """Return what holds after a record, and what can happen from outside at the end of its instant.

    Args:
        model: the model.
        program: the compiled model.
        execution: the run.
        record: the index of the record.
        chosen: an operation whose guard is wanted beside those of the current and the next one.
    """
    records = execution.trace.records
    state = state_after(records[: record + 1])
    asked = {"current": state.get(CURRENT_NAME), "next": _following_operation(records[: record + 1]), "chosen": chosen}
    by_name = {operation.name: operation for operation in model.operations}
    return {
        "record": record,
        "guards": [_guard(by_name[name], role, state) for role, name in asked.items() if state and name in by_name],
        "offers": list(_offers(program, execution, record)),
    }


def _following_operation(records: Sequence[Record]) -> str | None:
    """Return the operation that follows the current one in the plan."""
    queue: tuple[str, ...] = ()
    for record in records:
        if isinstance(record, PlanReceived):
            queue = record.plan
        elif isinstance(record, BecameCurrent):
            queue = queue[1:]
        elif isinstance(record, RunEnded):
            queue = ()
        elif isinstance(record, OperationStepped) and record.target is OperationState.INITIAL:
            queue = queue if record.source is OperationState.COMPLETED else ()  # else a new plan is needed
    return queue[0] if queue else None


def _guard(operation: Operation, role: str, state: Mapping[str, Value]) -> dict[str, Any]:
    """Return the guard that an operation waits for: to start, or to complete if it is executing."""
    is_executing = state[f"{operation.name}.state"] == OperationState.EXECUTING.value
    guard = (operation.post if is_executing else operation.pre).running_guard
    clauses = [[str(each), each.holds(state), _values(each.reads(), state)] for each in conjuncts(guard)]
    return {
        "role": role,
        "operation": operation.name,
        "part": "complete" if is_executing else "start",
        "clauses": clauses,
    }


def _values(names: Sequence[str], state: Mapping[str, Value]) -> str:
    return ", ".join(f"{name} = {format_value(state[name])}" for name in names)


def _offers(program: Program, execution: Execution, record: int) -> Iterator[dict[str, str]]:
    """Yield the changes from outside that are possible once everything else of the instant has happened."""
    records = execution.trace.records
    last = record
    while last + 1 < len(records) and records[last + 1].at_ns == records[record].at_ns:
        last += 1
    state = state_after(records[: last + 1])
    if not state or (last + 1 == len(records) and isinstance(records[last], RunEnded)):
        return
    packed, numbers = program.packing.pack(state), {each.name: n for n, each in enumerate(program.model.resources)}
    spans = execution.spans.requests
    in_flight = [numbers[each.resource] for each in spans if each.begin_record <= last < each.end_record]
    count = 0
    for maker in program.outside.makers:
        if isinstance(maker, FreeMaker):
            changes: list[Changes] = [
                ((name, value),) for name, values in maker.values for value in values if state[name] != value
            ]
        else:
            changes = [program.packing.changes(packed, after) for after in maker.following(packed, in_flight)]
        for change in filter(None, changes):
            words = ", ".join(f"{name}={format_value(value)}" for name, value in change)
            is_named = isinstance(maker, TransitionMaker)
            target, label = (f"{maker.name}:", f"{maker.name}: {words}") if is_named else (f":{words}", words)
            count += 1
            if count > _MAX_OFFERS:
                return
            yield {"target": target, "label": label}
