"""The coverability report of all that a store holds, for the terminal."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.reports.figure_table import (
    DEFAULT_COLUMNS,
    command_text,
    counted,
    figures,
    headline,
    missed_table,
    shown_path,
)
from scbm.reports.missed_reasons import close_command
from scbm.reports.reproduction import again, again_words, durations, place_of, told_places
from scbm.reports.terminal.combined_report import since_last_run

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.store import History

_MAX_FAILED = 10


def stored_report(history: History, store: str, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """The report, line by line.

    Args:
        history: what the store holds.
        store: the store's file, for the commands.
        columns: the width of the report.
    """
    coverage = history.coverage
    yield Text("Coverability report: ", style="bold").append(history.model.name)
    yield Text()
    yield headline(coverage.figure, columns)
    yield Text(f"  Testing duration: {durations(history)}, {_cases(history)}")
    for place in told_places(history):
        yield Text(f"  Over nodes: {place}")
    finished = [run for run in history.runs if run.is_finished]
    if len(finished) > 1:
        *_, before, last = finished
        words = "  Last run against the one before"
        yield since_last_run(history.obligations, before, last.visited, words)
    yield Text()
    yield from figures(coverage, columns)
    yield from _failed(history)
    yield from missed_table(history.model, coverage, columns)
    if coverage.missed():
        yield Text()
        yield Text("How to cover the rest", style="bold")
        yield command_text("  ", f"scbm report {shown_path(store)} --missing", "why each is missing")
        yield command_text("  ", close_command(history.source.path), "the cases for them")


def _cases(history: History) -> str:
    ends: dict[str, int] = {}
    for case in history.cases:
        end = case.verdict.end.replace("_", " ")
        ends[end] = ends.get(end, 0) + 1
    told = ", ".join(f"{count} {end}" for end, count in ends.items())
    earlier = sum(case.is_earlier for case in history.cases)
    before = f", {earlier} of them on an earlier version of the model" if earlier else ""
    failed = f"; {len(history.failed)} failed" if history.failed else ""
    outdated = f"; {counted(history.outdated, 'older version')} of case files left out" if history.outdated else ""
    runs = f"{counted(len(history.cases), 'case')} of {counted(len(history.runs), 'run')}"
    return f"{runs}{before}{': ' + told if told else ''}{failed}{outdated}"


def _failed(history: History) -> Iterator[Text]:
    if not history.failed:
        return
    labels = [label for label, case in zip(history.labels, history.cases, strict=True) if not case.verdict.passed]
    yield Text()
    yield Text(f"Failed: {counted(len(labels), 'case')}", style="bold red")
    runs: dict[str, str] = {}
    for label, case in islice(zip(labels, history.failed, strict=True), _MAX_FAILED):
        yield Text(f"  {label}")
        for failure in case.verdict.failures:
            yield Text(f"    {failure}", style="red")
        command = again(case, history.source.path, history.runs)
        if case.is_over_nodes:
            yield Text(f"    ran {place_of(case, history)}")
        if command in runs:
            yield Text(f"    again, as {runs[command]}")
        elif command:
            yield command_text(f"    {again_words(case)}: ", command)
            runs |= {command: label} if case.is_over_nodes else {}
    if len(labels) > _MAX_FAILED:
        yield Text(f"  and {counted(len(labels) - _MAX_FAILED, 'more')}", style="dim")
