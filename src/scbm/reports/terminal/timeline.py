"""The timeline of a run in the terminal: its log line by line, and its operations as bars over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.trace import (
    AutomaticTaken,
    InjectionApplied,
    OperationSpan,
    OperationStepped,
    PlanReceived,
    Record,
    RecordSeverity,
    ReplyReceived,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunStarted,
    spans_of,
)
from scbm.model import OperationState, format_moment
from scbm.reports.figure_table import DEFAULT_COLUMNS
from scbm.reports.run.event_lines import story_lines
from scbm.running.simulation.excluded_values import EXCLUDED

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import BehaviorModel
    from scbm.reports.run.event_lines import EventLine
    from scbm.running.simulation.excluded_values import ExcludedValue
    from scbm.testing import Execution

TIME_WIDTH = 11
"""Width of the time column; it is blank where the time equals that of the line above."""

_LONGEST_BAR, _SHORTEST_BAR = 60, 20
"""The width of the picture of a run: as wide as the report allows, within these bounds."""

_STATE_STYLES = {
    OperationState.COMPLETED: "green",
    OperationState.FAILED: "red",
    OperationState.TIMEDOUT: "magenta",
    OperationState.DISABLED: "yellow",
}
_SEVERITY_STYLES = {RecordSeverity.INFO: "", RecordSeverity.WARNING: "yellow", RecordSeverity.ERROR: "bold red"}
_LABEL_STYLES: dict[type[Record], str] = {
    RunStarted: "bold",
    PlanReceived: "bold blue",
    AutomaticTaken: "magenta",
    RequestSent: "",
    ReplyReceived: "",
    InjectionApplied: "bold yellow",
    ResourceChanged: "bold yellow",
}
_BAR_MARKS = {OperationState.COMPLETED: "█", OperationState.FAILED: "x", OperationState.TIMEDOUT: "!"}


def timeline(
    model: BehaviorModel, execution: Execution, *, every: bool, columns: int = DEFAULT_COLUMNS
) -> Iterator[Text]:
    """Yield the timeline of a run, line by line.

    Args:
        model: the model of the run.
        execution: the run.
        every: whether the variables of resources and of the runner are shown too.
        columns: the width of the report.
    """
    yield from map(draw_line, story_lines(model, execution, every=every))
    bars = list(_bars(execution, columns))
    yield from [Text(), *bars] if bars else []
    verdict = (execution.verdict.failures, execution.unused, execution.notes, execution.excluded, execution.hazards)
    shown = any(verdict)
    if execution.trace.records and shown:
        yield Text()
    yield from _excluded(execution)
    for hazard in execution.hazards:
        yield Text("HAZARD  ", style="bold red").append(str(hazard))
    for note in execution.notes:
        yield Text("NOTE  ", style="bold").append(note)
    for unused in execution.unused:
        yield Text("NO EFFECT  ", style="bold yellow").append(unused)
    for failure in execution.verdict.failures:
        yield Text("FAILED  ", style="bold red").append(str(failure))


def _excluded(execution: Execution) -> Iterator[Text]:
    """Yield that drivers sent what the model excludes, with the first value of each variable."""
    firsts: dict[str, ExcludedValue] = {}
    for each in execution.excluded:
        firsts.setdefault(each.variable, each)
    if firsts:
        yield Text("EXCLUDED  ", style="bold red").append(EXCLUDED)
    yield from (Text(f"          {first}") for first in firsts.values())


def draw_line(line: EventLine, *, with_time: bool = False) -> Text:
    """Return a line of the log of a run in colour, behind its time; `with_time` repeats the time of the line above."""
    time = f"{line.at_ns / 1e9:9.3f} s" if with_time or line.begins_moment else " " * TIME_WIDTH
    label = _label_style(line)
    text = Text(time, style="cyan").append("  ").append(line.mark, style=label).append(line.label, style=label)
    if line.outcome:
        text.append("  ").append(line.outcome, style=_outcome_style(line))
    if line.changes:
        text.append("   ").append(line.changes)
    return text


def _label_style(line: EventLine) -> str:
    """Return the style of what happened; a kind of record without a style of its own has that of its severity."""
    record = line.record
    if line.severity is RecordSeverity.ERROR:
        return _SEVERITY_STYLES[line.severity]
    if isinstance(record, OperationStepped):
        return _STATE_STYLES.get(record.target, "bold")
    if isinstance(record, RunEnded):
        return "bold green" if line.severity is RecordSeverity.INFO else "bold red"
    return _LABEL_STYLES.get(type(record), _SEVERITY_STYLES[line.severity])


def _outcome_style(line: EventLine) -> str:
    if isinstance(line.record, RequestSent):
        return "dim"
    if isinstance(line.record, ReplyReceived):
        return "green" if line.record.succeeded else "red"
    return _SEVERITY_STYLES[line.severity]


def _bars(execution: Execution, columns: int) -> Iterator[Text]:
    """Yield a row for each operation that executed, with a bar for each time, and a legend."""
    spans = [span for span in _operations(execution) if span.state is OperationState.EXECUTING]
    if not spans or not execution.ended_ns:
        return
    names = list(dict.fromkeys(span.operation for span in spans))
    width = max(map(len, names))
    bar_width = min(_LONGEST_BAR, max(_SHORTEST_BAR, columns - width - 2))
    end = format_moment(execution.ended_ns)
    yield Text(f"{'operation':<{width}}  0 s{end:>{bar_width - 3}}", style="dim", no_wrap=True)
    for name in names:
        row = Text(f"{name:<{width}}  ", no_wrap=True)
        _add_bars(row, [span for span in spans if span.operation == name], bar_width, execution.ended_ns)
        yield row
    marks = [f"{mark} {state.value}" for state, mark in _BAR_MARKS.items() if any(s.outcome is state for s in spans)]
    if marks:
        yield Text(f"{'':<{width}}  {'   '.join(marks)}", style="dim")


def _operations(execution: Execution) -> tuple[OperationSpan, ...]:
    return spans_of(execution.trace.records, execution.ended_ns).operations


def _add_bars(row: Text, spans: Iterable[OperationSpan], width: int, ended_ns: int) -> None:
    """Add the bars of one operation to its row; the whole run is `width` columns and `ended_ns` long."""
    scale, column = width / ended_ns, 0
    for span in spans:
        begin = max(column, min(int(span.begin_ns * scale), width - 1))
        length = max(1, round(span.duration_ns * scale))
        outcome = span.outcome or OperationState.INITIAL
        bar = _BAR_MARKS.get(outcome, "░") * min(length, width - begin)
        row.append(" " * (begin - column)).append(bar, style=_STATE_STYLES.get(outcome, ""))
        column = begin + len(bar)
