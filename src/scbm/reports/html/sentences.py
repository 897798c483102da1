"""What a record says, as one sentence each, in the words that the timeline in text has."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases.trace import (
    AutomaticTaken,
    BecameCurrent,
    InjectionApplied,
    MeasurementReceived,
    MeasurementRefused,
    MessageDisturbed,
    OperationStepped,
    PlanAsked,
    PlanDropped,
    PlanReceived,
    PutBack,
    Record,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunStarted,
)
from scbm.model import OperationState, format_value

if TYPE_CHECKING:
    from scbm.cases.trace import Changes
    from scbm.model import BehaviorModel

NUMBER = "{}"
"""Stands in a sentence for the number of the request, so that the sentence is the same for all requests."""


def sentence_of(record: Record, model: BehaviorModel) -> str:  # noqa: C901, PLR0911, PLR0912 - one case for each record
    """What a record says, but for its time and for what it changed; `{}` where the number of its request stands."""
    match record:
        case RunStarted():
            return _start(record, model)
        case PlanAsked():
            return "a plan is asked for"
        case PlanReceived(status="solved", plan=plan):
            return f"plan of {len(plan)}: {' → '.join(plan)}" if plan else "plan: nothing to do"
        case PlanReceived(status=status):
            return f"plan: {status.replace('_', ' ')}"
        case PlanDropped():
            return f"plan {NUMBER} dropped: nobody asks for it any more"
        case BecameCurrent(operation=operation):
            return f"{operation} becomes current"
        case OperationStepped():
            return _step(record)
        case AutomaticTaken(transition=name, failed=failed):
            return f"automatic {name}" + _failing(failed)
        case RequestSent(resource=resource, payload=payload):
            return f"request {NUMBER} → {resource}" + (f": {_all(payload)}" if payload else "")
        case RequestCancelled(resource=resource):
            return f"request {NUMBER} → {resource} cancelled"
        case ReplyReceived(resource=resource, succeeded=succeeded):
            return f"reply {NUMBER} ← {resource}: {'succeeded' if succeeded else 'failed'}"
        case ReplyDropped(why=why):
            return f"reply {NUMBER} dropped: {why}"
        case MeasurementReceived():
            return "measured"
        case MeasurementRefused(variable=variable, value=value):
            return f"measured value refused: {variable} = {format_value(value)}"
        case InjectionApplied(injection=name, failed=failed):
            return f"injection {name}" + _failing(failed)
        case PutBack(injection=name):
            return f"injection {name} put back"
        case ResourceChanged(injection=name, resource=resource, condition=condition):
            return f"{name}: {resource} is {condition}"
        case MessageDisturbed(resource=resource, message=message, copies=copies):
            told = f"arrives {copies} times" if copies else "is lost on the way"
            return f"{message} {NUMBER} of {resource} {told}"
        case RunEnded(end=end, detail=detail):
            return end.replace("_", " ") + (f": {', '.join(detail)}" if detail else "")


def _start(record: RunStarted, model: BehaviorModel) -> str:
    name = "" if record.goal == record.predicate else f" ({record.goal})"
    nominal = model.nominal_state
    differing = tuple((name, value) for name, value in record.state if nominal.get(name, value) != value)
    return f"goal {record.predicate}{name}, from {_all(differing) or 'the nominal state'}"


def _step(record: OperationStepped) -> str:
    by = f", by {record.transition}" if record.transition else ""
    match record.source, record.target:
        case OperationState.DISABLED, OperationState.INITIAL:
            return f"{record.operation} given up, a new plan is needed"
        case OperationState.COMPLETED, OperationState.INITIAL:
            return f"{record.operation} done, back to initial"
        case ((OperationState.FAILED | OperationState.TIMEDOUT), OperationState.INITIAL):
            return f"{record.operation} back to initial, a new plan is needed"
        case _, OperationState.TIMEDOUT:
            return f"{record.operation} timed out"
        case _, OperationState.DISABLED:
            return f"{record.operation} disabled, its precondition does not hold"
    return f"{record.operation} {record.target.value}{by}"


def _failing(operation: str | None) -> str:
    return "" if operation is None else f", which fails {operation}"


def _all(values: Changes) -> str:
    return ", ".join(f"{name} = {format_value(value)}" for name, value in values)
