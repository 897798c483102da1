"""Reports about stores for the terminal: the coverability of a whole store, and the result of combining stores.

One line compares the visits of a run with those of the run before. The result of combining is also available as JSON.
"""

from __future__ import annotations

from itertools import groupby, islice
from typing import TYPE_CHECKING, Any

from rich.text import Text

from scbm.cases.coverage import Decision
from scbm.model.visible_text import counted, shown_path
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.figure_table import (
    DEFAULT_COLUMNS,
    command_text,
    figures,
    hazard_lines,
    missed_table,
    requirement_lines,
    short_of_goal_in_words,
    verdict_lines,
    wrapped,
)
from scbm.reports.missed_reasons import close_command, missed_reasons
from scbm.reports.run_changes import change_groups, run_in_words
from scbm.reports.status_lines import asserted_line, figure_lines, lifted_lines, unasserted_lines
from scbm.reports.stored_cases import again, again_words, durations, place_counts, place_of
from scbm.reports.terminal.missed_listing import is_too_long, reason_lines
from scbm.running.simulation.excluded_values import EXCLUDED
from scbm.testing.batches.batch_summary import MAX_HAZARDS
from scbm.testing.campaign_results_json import coverage_json, lifted_json

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import Figure, LiftedStatuses, Obligations
    from scbm.store import Combined, Dropped, History, StoredRun


_MAX_NAMED = 3


def since_last_run(
    obligations: Obligations,
    before: StoredRun | None,
    visited: int,
    words: str = "Since the last run",
    *,
    is_united: bool = False,
) -> Text:
    """Return the difference between two runs of a store, in figures and in names.

    Args:
        obligations: the obligations of the model.
        before: the run before this one; `None` if there is none.
        visited: the visits of this run, as bits.
        words: the beginning of the line.
        is_united: whether the store has runs with other objects, which are not compared.
    """
    if before is None:
        return Text(f"{words}: this store has no earlier finished run{' with these objects' if is_united else ''}")
    counted_ones = obligations.counted
    gained = visited & ~before.visited & counted_ones
    lost = before.visited & ~visited & counted_ones
    line = Text(f"{words}: ")
    if not gained and not lost:
        return line.append(f"the same, {obligations.figure(visited)}")
    line.append(f"{obligations.figure(before.visited)} → {obligations.figure(visited)}")
    if gained:
        line.append(f", +{_named(obligations, gained)}", style="green")
    if lost:
        line.append(f", -{_named(obligations, lost)}", style="red")
    return line


def in_all(cases: int, figure: Figure, store: str) -> Text:
    """Return the figure of all cases of a store."""
    return Text(f"{store}: {counted(cases, 'case')} in all, {figure}")


def united_lines(lifted: LiftedStatuses | None, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield the lifted figure of a store that has cases of the same lifted model under other objects."""
    if lifted is not None and lifted.others:
        yield from lifted_lines(lifted, columns)


def _named(obligations: Obligations, bits: int) -> str:
    return _first(obligations.names(bits))


def _first(names: Sequence[str]) -> str:
    """Return the number of names, and the first of them."""
    more = ", …" if len(names) > _MAX_NAMED else ""
    return f"{len(names)} ({', '.join(names[:_MAX_NAMED])}{more})"


FORMAT_VERSION = 1


def combined_report(combined: Combined, target: str) -> Iterator[Text]:
    """Yield the visits that were dropped as the model has changed, then the contents of the new store."""
    for path, dropped in combined.dropped:
        if dropped:
            yield Text(f"{path}: from an earlier version of the model; dropped, as their meaning has changed:")
            yield from _dropped_lines(dropped)
        else:
            yield Text(f"{path}: of an earlier version of the model; all that it visited is unchanged")
    for path, count in combined.left_out:
        yield Text(f"{path}: left out: {counted(count, 'case')} with other objects, of an earlier version of the model")
    for path in combined.apart:
        yield Text(f"{path}: the same lifted model with other objects; its ground visits count for these objects")
    totals = combined.totals
    yield in_all(totals.cases, totals.coverage.figure, target).append(f", {counted(totals.runs, 'run')}")
    yield from united_lines(totals.lifted)


def _dropped_lines(dropped: Sequence[Dropped]) -> Iterator[Text]:
    for subject, group in groupby(dropped, key=lambda d: d.obligation.subject):
        of_subject = list(group)
        aspects = ", ".join(d.obligation.aspect.value for d in of_subject)
        yield Text(f"  {subject}: {aspects}").append(
            "   it is gone" if of_subject[0].is_gone else "   it was edited", "dim"
        )


def combined_json(combined: Combined, target: str) -> dict[str, Any]:
    """Return the same as data for `json`."""
    totals = combined.totals
    return {
        "format_version": FORMAT_VERSION,
        "model": totals.model.name,
        "store": target,
        "cases": totals.cases,
        "runs": totals.runs,
        "coverage": coverage_json(totals.coverage),
        **lifted_json(totals.lifted),
        "dropped": [
            {"store": str(path), "obligation": str(d.obligation), "reason": "gone" if d.is_gone else "edited"}
            for path, dropped in combined.dropped
            for d in dropped
        ],
        "left_out": [{"store": str(path), "cases": count} for path, count in combined.left_out],
    }


_MAX_FAILED = 10


def stored_report(
    history: History, store: str, columns: int = DEFAULT_COLUMNS, *, shows_all: bool = False
) -> Iterator[Text]:
    """Yield the report of a store.

    Args:
        history: the contents of the store.
        store: the store's file, for the commands.
        columns: the width of the report.
        shows_all: whether a long table of what is missing is shown, instead of the reasons alone.
    """
    coverage = history.coverage
    yield Text("Coverability report: ", style="bold").append(history.model.name)
    yield Text()
    yield from figure_lines(history, columns)
    yield from asserted_line(history.evidence, columns)
    yield Text(f"  Testing duration: {durations(history)}, {_cases(history)}")
    yield from verdict_lines(len(history.cases), len(history.failed))
    short = short_of_goal_in_words(history.short_count, history.short)
    if short:
        yield Text(f"  Passed short of the goal: {short}")
    yield from requirement_lines(history.requirements, columns)
    for place in place_counts(history):
        yield Text(f"  Over nodes: {place}")
    yield from _excluded(history, columns)
    yield from _compared(history)
    yield Text()
    yield from figures(coverage, columns)
    yield from _failed(history)
    yield from hazard_lines(history.hazards[:MAX_HAZARDS], len(history.hazards), columns)
    table = list(missed_table(history.model, history.statuses, columns))
    if is_too_long(table, shows_all=shows_all):
        missed = missed_reasons(history, history.source.path, CampaignKind.of_store(history))
        yield from reason_lines(history.model, missed, columns)
    else:
        yield from table
    yield from unasserted_lines(history.evidence, columns)
    if any(history.statuses.decision(missed) is Decision.UNDECIDED for missed in coverage.missed()):
        yield Text()
        yield Text("How to cover the rest", style="bold")
        yield command_text("  ", f"scbm report {shown_path(store)} --missing", "shows why each is missing")
        yield command_text("  ", close_command(history.source.path), "writes cases for them")


def _compared(history: History) -> Iterator[Text]:
    """Yield the difference between the last run and an earlier one; that before it, unless another was asked for."""
    since = history.since
    if since is not None:
        words = "  Since the last run" if since.then is None else f"  Since the run {run_in_words(since.then)}"
        yield since_last_run(history.obligations, since.then, since.now.visited, words)
        for change, rows in change_groups(since):
            if rows[0].is_case:
                yield Text(f"    {change}: {_first([str(row.subject) for row in rows])}")
        return
    finished = [run for run in history.runs if run.is_finished]
    if len(finished) > 1:
        *_, before, last = finished
        yield since_last_run(history.obligations, before, last.visited, "  Last run against the one before")


def _excluded(history: History, columns: int) -> Iterator[Text]:
    """Yield how many values drivers sent that the model excludes, if they did."""
    counts = [case.excluded for case in history.cases if case.excluded]
    if counts:
        words = f"{EXCLUDED}: {counted(sum(counts), 'value')} in {counted(len(counts), 'case')}"
        yield from (Text(line, style="bold red") for line in wrapped(words, columns, "  Over nodes: ", 14))


def clock_warning(later_start: str, store: str) -> Text:
    """Return the warning that a store has a run which began later than now, by the clock."""
    words = f"the clock went back: {store} has a run that began at {later_start}; this run counts as the latest"
    return Text(words, style="yellow")


def _cases(history: History) -> str:
    ends: dict[str, int] = {}
    for case in history.cases:
        end = case.verdict.end_in_words
        ends[end] = ends.get(end, 0) + 1
    parts = ", ".join(f"{count} {end}" for end, count in ends.items())
    earlier = sum(case.is_earlier for case in history.cases)
    before = f", {earlier} of them on an earlier version of the model" if earlier else ""
    outdated = f"; {counted(history.outdated, 'older version')} of case files left out" if history.outdated else ""
    runs = f"{counted(len(history.cases), 'case')} of {counted(len(history.runs), 'run')}"
    return f"{runs}{before}{': ' + parts if parts else ''}{outdated}"


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
        yield Text(f"  and {len(labels) - _MAX_FAILED} more", style="dim")
