"""Sentences about records: the words that every view of a run uses.

A view adds marks, columns and colours; the words for a record come from `sentence_of` alone, and how serious a record
is from its `severity`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, assert_never

from scbm.cases.trace.records import (
    SENT,
    AutomaticTaken,
    BecameCurrent,
    End,
    InjectionApplied,
    LivelockedAtRest,
    MeasurementReceived,
    MeasurementRefused,
    MessageDisturbed,
    OperationStepped,
    PlanAsked,
    PlanDropped,
    PlanReceived,
    PutBack,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
    RunStarted,
)
from scbm.model import OperationState, format_value

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.cases.trace.records import Changes, Record
    from scbm.model import Value

NUMBER = "{}"
"""The placeholder for the number of a request or a question, so that the words are the same for all of them."""


class Sentence(NamedTuple):
    """The words for a record, in a long and in a short form, without its time and the variables that it changed.

    Attributes:
        text: the whole sentence; `{}` stands for the number.
        label: the short form for a line below the operation or the request that it belongs to; empty if a timeline has
            no line for the record. `{}` stands for the number.
        outcome: the part of the short form behind the label.
        number: the number of the request, or of the question that a plan answers; `None` if the record has none.
    """

    text: str
    label: str = ""
    outcome: str = ""
    number: int | None = None

    @property
    def numbered_label(self) -> str:
        """The label with the number in place of `{}`."""
        return self.label if self.number is None else self.label.replace(NUMBER, str(self.number), 1)

    @property
    def numbered_text(self) -> str:
        """The whole sentence with the number in place of `{}`."""
        return self.text if self.number is None else self.text.replace(NUMBER, str(self.number), 1)


def sentence_of(record: Record, nominal: Mapping[str, Value]) -> Sentence:  # noqa: C901, PLR0911, PLR0912 - one case for each kind of record
    """Return the sentence for `record`; `nominal` is the nominal state of the model."""
    match record:
        case RunnerStarted():
            return Sentence(f"the runner starts from {_values(record, nominal)}")
        case RunStarted():
            return _start(record, nominal)
        case PlanAsked():
            return Sentence("a plan is asked for")
        case PlanReceived():
            return _plan(record)
        case PlanDropped(ask=ask):
            return Sentence(f"plan {NUMBER} dropped: it answers an outdated question", number=ask)
        case BecameCurrent(operation=operation):
            return Sentence(f"{operation} becomes current")
        case OperationStepped():
            return _step(record)
        case AutomaticTaken(transition=name, failed=failed):
            return Sentence(f"automatic {name}{_failing(failed)}", "automatic", name)
        case RequestSent(resource=resource, payload=payload):
            request = f"request {NUMBER} → {resource}"
            text = f"{request}: {assignments(payload)}" if payload else request
            return Sentence(text, request, ", ".join(format_value(value) for _, value in payload), record.request)
        case RequestCancelled(resource=resource):
            return _same(f"request {NUMBER} → {resource} cancelled", record.request)
        case ReplyReceived(resource=resource):
            reply, outcome = f"reply {NUMBER} ← {resource}", "succeeded" if record.succeeded else "failed"
            return Sentence(f"{reply}: {outcome}", reply, outcome, record.request)
        case ReplyDropped(why=why):
            return _same(f"reply {NUMBER} dropped: {why}", record.request)
        case MeasurementReceived(by=by, changes=changes):
            label = f"environment {by}" if by else "from outside"
            return Sentence(label, label) if changes else Sentence(f"{label}: no change", label, "no change")
        case MeasurementRefused(variable=variable, value=value):
            return _same(f"measured value refused: {variable} = {format_value(value)}")
        case InjectionApplied(injection=injection) if injection == SENT:
            return _same("sent though the model excludes it")
        case InjectionApplied(injection=name, failed=failed):
            return Sentence(f"injection {name}{_failing(failed)}", f"injection {name}")
        case PutBack(injection=name):
            return _same(f"injection {name} put back")
        case ResourceChanged(injection=name, resource=resource, condition=condition):
            return _same(f"{name}: {resource} is {condition}")
        case MessageDisturbed(resource=resource, message=message, copies=copies):
            fate = f"arrives {copies} times" if copies else "is lost on the way"
            return _same(f"{message} {NUMBER} of {resource} {fate}", record.request)
        case RunEnded(end=End.NOT_STARTED.value, goal=goal, detail=detail):
            return Sentence(f"goal {goal} does not begin: {', '.join(detail)} never held", "not started", goal)
        case RunEnded(end=end, detail=detail):
            words = end.replace("_", " ")
            return Sentence(f"{words}: {', '.join(detail)}" if detail else words, words)
        case LivelockedAtRest(detail=detail):
            return Sentence(f"livelock while no goal is pursued: {', '.join(detail)}", "livelock at rest")
        case _:
            assert_never(record)


def fate_of(record: MessageDisturbed | ReplyDropped | MeasurementRefused) -> str:
    """Return in a few words what became of a message that did not take effect once."""
    match record:
        case MessageDisturbed(copies=copies):
            return f"delivered {copies} times" if copies else "lost"
        case ReplyDropped(why=why):
            return f"dropped: {why}"
        case MeasurementRefused():
            return "refused"
        case _:
            assert_never(record)


def connection_sentence(record: ResourceChanged) -> Sentence:
    """Return the sentence for a resource that was lost, or came back, with its node or driver, or keeps on moving."""
    if record.condition == "down":
        return _same(f"{record.resource} is not reached: its node or driver is not there")
    if record.condition == "well":
        return _same(f"{record.resource} is reached now: its node or driver is there")
    return _same(f"{record.resource} is {record.condition}")


def fault_in(record: Record) -> str | None:
    """Return a sentence about the fault that `record` shows, of a resource, the network or the tester; else `None`."""
    match record:
        case ReplyReceived(succeeded=False, resource=resource, request=request):
            return f"{resource} fails request {request}"
        case InjectionApplied(injection=injection, changes=changes) if injection == SENT:
            return f"a driver sends {assignments(changes)}, which the model excludes"
        case InjectionApplied(injection=injection, changes=changes):
            return f"injection {injection} sets {assignments(changes)}"
        case ResourceChanged(resource=resource, condition=condition, injection=injection):
            return f"{resource} is {condition}, by {injection}"
        case MessageDisturbed(message=message, request=request, resource=resource, copies=copies):
            return f"{message} {request} of {resource} {f'arrives {copies} times' if copies else 'is lost'}"
        case (
            (RunnerStarted() | RunStarted() | RunEnded() | PlanAsked() | PlanReceived() | PlanDropped())
            | (BecameCurrent() | LivelockedAtRest())
            | (OperationStepped() | AutomaticTaken() | RequestSent() | RequestCancelled() | ReplyReceived())
            | (ReplyDropped() | MeasurementReceived() | MeasurementRefused() | PutBack())
        ):
            return None
        case _:
            assert_never(record)


def differing(record: RunnerStarted | RunStarted, nominal: Mapping[str, Value]) -> Changes:
    """Return the variables whose values at the start of a run are not nominal, with these values."""
    return tuple((name, value) for name, value in record.state if nominal.get(name, value) != value)


def _values(record: RunnerStarted | RunStarted, nominal: Mapping[str, Value]) -> str:
    return assignments(differing(record, nominal)) or "the nominal state"


def assignments(values: Changes) -> str:
    """Return variables and their values as `a = 1, b = true`."""
    return ", ".join(f"{name} = {format_value(value)}" for name, value in values)


def _same(words: str, number: int | None = None) -> Sentence:
    """Return a sentence whose short form is its long form."""
    return Sentence(words, words, number=number)


def _start(record: RunStarted, nominal: Mapping[str, Value]) -> Sentence:
    is_named = record.goal != record.predicate
    text = f"goal {record.predicate}{f' ({record.goal})' if is_named else ''}, from {_values(record, nominal)}"
    return Sentence(text, "goal", f"{record.predicate}{f'  ({record.goal})' if is_named else ''}")


def _plan(record: PlanReceived) -> Sentence:
    if record.status != "solved":
        status = record.status.replace("_", " ")
        return Sentence(f"plan: {status}", "plan", status)
    count, operations = len(record.plan), " → ".join(record.plan)
    text = f"plan of {count}: {operations}" if count else "plan: nothing to do"
    return Sentence(text, "plan", f"{count}: {operations or 'nothing to do'}")


def _step(record: OperationStepped) -> Sentence:
    name = record.operation
    by = f", by {record.transition}" if record.transition else ""
    match record.source, record.target:
        case source, OperationState.INITIAL:
            return _back_to_initial(name, source)
        case _, OperationState.EXECUTING:
            return Sentence(f"{name} executing{by}", name)
        case _, OperationState.DISABLED:
            return Sentence(f"{name} disabled, its precondition does not hold", name, "disabled")
        case _, OperationState.TIMEDOUT:
            return Sentence(f"{name} timed out", record.target.value)
    return Sentence(f"{name} {record.target.value}{by}", record.target.value)


def _back_to_initial(operation: str, source: OperationState) -> Sentence:
    match source:
        case OperationState.DISABLED:
            return Sentence(f"{operation} given up, a new plan is needed", "given up, a new plan is asked for")
        case OperationState.COMPLETED:
            return Sentence(f"{operation} done, back to initial")
        case _:
            return Sentence(f"{operation} back to initial, a new plan is needed")


def _failing(operation: str | None) -> str:
    return "" if operation is None else f", which fails {operation}"
