"""A run as a picture in text: what happened, line by line under its time, and the operations as bars over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.trace import (
    AutomaticTaken,
    BecameCurrent,
    End,
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
from scbm.model import OperationState, format_moment, format_value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases.trace import Changes
    from scbm.model import BehaviorModel
    from scbm.testing import Execution

_BAR_WIDTH = 60

_MAX_IN_A_ROW = 20
"""So many automatic transitions in a row are shown; more of them are one line, as in a livelock."""

_STATE_STYLES = {
    OperationState.COMPLETED: "green",
    OperationState.FAILED: "red",
    OperationState.TIMEDOUT: "magenta",
    OperationState.DISABLED: "yellow",
}
_BAR_MARKS = {OperationState.COMPLETED: "█", OperationState.FAILED: "x", OperationState.TIMEDOUT: "!"}


def timeline(model: BehaviorModel, execution: Execution, *, every: bool) -> Iterator[Text]:
    """A run, line by line. `every` also shows the variables of resources and of the runner."""
    yield from stretch(model, execution, 0, len(execution.trace.records), every=every)
    bars = list(_bars(execution))
    yield from [Text(), *bars] if bars else []
    if execution.trace.records and (execution.verdict.failures or execution.unused):
        yield Text()
    for unused in execution.unused:
        yield Text("NO EFFECT  ", style="bold yellow").append(unused)
    for failure in execution.verdict.failures:
        yield Text("FAILED  ", style="bold red").append(str(failure))


def stretch(model: BehaviorModel, execution: Execution, begin: int, end: int, *, every: bool = False) -> Iterator[Text]:
    """The records `begin..end` of a run, each under its time."""
    commands = frozenset(name for resource in model.resources for name in resource.request) - _read(model)
    told = [variable.name for variable in model.variables if variable.name not in commands]
    shown = frozenset(model.running_space.names if every else told)
    last_ns = -1
    in_a_row = 0
    for index, record in enumerate(execution.trace.records[begin:end], start=begin):
        in_a_row = in_a_row + 1 if isinstance(record, AutomaticTaken) and record.failed is None else 0
        lines = list(_lines(record, shown, model)) if in_a_row <= _MAX_IN_A_ROW else []
        if isinstance(record, ResourceChanged) and _is_of_a_node(record, execution):
            lines = [_reached(record)]
        if in_a_row == _MAX_IN_A_ROW + 1:
            lines = [Text("│ automatic  … and more, without a pause", style="magenta")]
        broken = [violation for violation in execution.violations if violation.record == index]
        lines += [Text(f"✗ {violation.requirement}: {violation.reason}", style="bold red") for violation in broken]
        for line in lines:
            time = f"{record.at_ns / 1e9:9.3f} s" if record.at_ns != last_ns else " " * 11
            last_ns = record.at_ns
            yield Text(time, style="cyan").append("  ").append_text(line)


def _is_of_a_node(record: ResourceChanged, execution: Execution) -> bool:
    """Whether a resource came or was lost with its node or driver, and not as the case says."""
    case = execution.case
    said = [injection.name for injection in case.injections]
    restarted = [restart.resource for restart in case.network.restarts]
    return execution.log is not None and record.injection not in said and record.resource not in restarted


def _reached(record: ResourceChanged) -> Text:
    if record.condition == "down":
        return Text(f"⚡ {record.resource} is not reached: its node or driver is not there", style="bold red")
    return Text(f"⚡ {record.resource} is reached now: its node or driver is there", style="bold yellow")


def _read(model: BehaviorModel) -> frozenset[str]:
    """The variables that a guard or a goal reads: what requests only carry is shown with the request."""
    transitions = [t for operation in model.operations for t in (operation.pre, operation.post)]
    guards = [transition.running_guard for transition in (*transitions, *model.automatic_transitions)]
    return frozenset(name for part in (*guards, *(goal for _, goal in model.goals)) for name in part.reads())


def _lines(record: Record, shown: frozenset[str], model: BehaviorModel) -> Iterator[Text]:  # noqa: C901, PLR0912, PLR0915 - one case for each record
    """What a record says; nothing for the steps that only lead to the next one."""
    changes = _changes(record.changes, shown)
    match record:
        case RunStarted():
            name = "" if record.goal == record.predicate else f"  ({record.goal})"
            yield Text("● goal  ", style="bold").append(record.predicate).append(name, style="dim")
            nominal = model.nominal_state
            differing = tuple((name, value) for name, value in record.state if nominal.get(name, value) != value)
            values = _all(differing) or "the nominal state"
            yield Text("  from  ", style="dim").append(values, style="dim")
        case PlanReceived(status="solved", plan=plan):
            yield Text(f"  plan  {len(plan)}: ", style="bold blue").append(" → ".join(plan) or "nothing to do")
        case PlanReceived(status=status):
            yield Text(f"  plan  {status.replace('_', ' ')}", style="bold blue")
        case OperationStepped(target=OperationState.EXECUTING):
            yield Text("┌ ").append(record.operation, style="bold").append(_tail(changes), style="dim")
        case OperationStepped(target=OperationState.DISABLED):
            yield Text("┆ ").append(record.operation, style="bold").append("  disabled", style="yellow")
        case OperationStepped(target=OperationState.INITIAL, source=OperationState.DISABLED):
            yield Text("┆ given up, a new plan is asked for", style="yellow")
        case OperationStepped(target=target) if target is not OperationState.INITIAL:
            yield Text("└ ").append(target.value, style=_STATE_STYLES.get(target, "")).append(_tail(changes))
        case AutomaticTaken():
            yield Text("│ automatic  ", style="magenta").append(record.transition).append(_tail(changes))
            if record.failed is not None:
                yield Text("└ ").append("failed", style="red")
        case RequestSent():
            values = ", ".join(format_value(value) for _, value in record.payload)
            yield Text(f"│ request {record.request} → {record.resource}").append(f"  {values}".rstrip(), style="dim")
        case RequestCancelled():
            yield Text(f"│ request {record.request} → {record.resource} cancelled", style="yellow")
        case ReplyReceived():
            result = Text("succeeded", style="green") if record.succeeded else Text("failed", style="red")
            reply = Text(f"│ reply {record.request} ← {record.resource}  ").append_text(result)
            yield reply.append(_tail(changes))
        case ReplyDropped():
            yield Text(f"│ reply {record.request} dropped: {record.why}", style="yellow")
        case MeasurementReceived():
            yield Text("│ measured").append(_tail(changes))
        case MeasurementRefused():
            value = format_value(record.value)
            yield Text(f"│ measured value refused: {record.variable} = {value}", style="yellow")
        case InjectionApplied():
            told = _tail(_all(record.changes))
            yield Text(f"⚡ injection {record.injection}", style="bold yellow").append(told)
            if record.failed is not None:
                yield Text("└ ").append("failed", style="red")
        case PutBack():
            told = _tail(_all(record.changes))
            yield Text(f"⚡ injection {record.injection} put back", style="yellow").append(told)
        case ResourceChanged():
            yield Text(f"⚡ {record.injection}: {record.resource} is {record.condition}", style="bold yellow")
        case MessageDisturbed(copies=0):
            yield Text(f"│ {record.message} {record.request} of {record.resource} is lost on the way", style="yellow")
        case MessageDisturbed():
            copies = f"arrives {record.copies} times"
            yield Text(f"│ {record.message} {record.request} of {record.resource} {copies}", style="yellow")
        case RunEnded():
            style = "bold green" if record.end == End.REACHED else "bold red"
            yield Text(f"■ {record.end.replace('_', ' ')}", style=style)
        case PlanAsked() | PlanDropped() | BecameCurrent() | OperationStepped():
            return


def _changes(changes: Changes, shown: frozenset[str]) -> str:
    return ", ".join(f"{name} = {format_value(value)}" for name, value in changes if name in shown)


def _all(changes: Changes) -> str:
    """Changes of every variable: what a tester does is never left out."""
    return ", ".join(f"{name} = {format_value(value)}" for name, value in changes)


def _tail(text: str) -> str:
    return f"   {text}" if text else ""


def _bars(execution: Execution) -> Iterator[Text]:
    """For each operation that executed a row, with a bar from each start to its end."""
    spans = list(_spans(execution.trace.records))
    if not spans or not execution.ended_ns:
        return
    names = list(dict.fromkeys(name for name, _, _, _ in spans))
    width = max(map(len, names))
    scale = _BAR_WIDTH / execution.ended_ns
    end = format_moment(execution.ended_ns)
    yield Text(f"{'operation':<{width}}  0 s{end:>{_BAR_WIDTH - 3}}", style="dim")
    for name in names:
        row = Text(f"{name:<{width}}  ")
        column = 0
        for other, begin_ns, end_ns, state in spans:
            if other == name:
                begin = max(column, min(int(begin_ns * scale), _BAR_WIDTH - 1))
                length = max(1, round((end_ns - begin_ns) * scale))
                mark = _BAR_MARKS.get(state, "░")
                bar = mark * min(length, _BAR_WIDTH - begin)
                row.append(" " * (begin - column)).append(bar, style=_STATE_STYLES.get(state, ""))
                column = begin + len(bar)
        yield row
    marks = [f"{mark} {state.value}" for state, mark in _BAR_MARKS.items() if any(s is state for *_, s in spans)]
    yield Text(f"{'':<{width}}  {'   '.join(marks)}", style="dim")


def _spans(records: tuple[Record, ...]) -> Iterator[tuple[str, int, int, OperationState]]:
    """Each execution of an operation: its name, begin, end, and the state that it ended in."""
    current: tuple[str, int] | None = None
    for record in records:
        if isinstance(record, OperationStepped) and record.target is OperationState.EXECUTING:
            current = (record.operation, record.at_ns)
        elif current is not None:
            state = _ended_in(record)
            if state is not None:
                yield (*current, record.at_ns, state)
                current = None


def _ended_in(record: Record) -> OperationState | None:
    """The state in which this record leaves the operation that executes, if it ends its execution."""
    if isinstance(record, OperationStepped):
        return record.target
    if isinstance(record, RunEnded):
        return OperationState.INITIAL
    failing = isinstance(record, (AutomaticTaken, InjectionApplied)) and record.failed is not None
    return OperationState.FAILED if failing else None
