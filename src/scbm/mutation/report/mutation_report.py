"""The report about mutants for the terminal."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import MutantStatus
from scbm.model.visible_text import counted
from scbm.mutation.report.mutation_summary import BENIGN, change_in_words
from scbm.reports.figure_table import DEFAULT_COLUMNS, bar_of, wrapped

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.mutation.mutant_results import MutantCounts, MutantResult
    from scbm.mutation.report.mutation_summary import MutationSummary

MAX_LISTED = 40
"""Maximum number of mutants that the terminal lists; the files and the JSON have all."""

_MAX_NAMED = 3
"""Maximum number of cases that are named."""

_BAR = 40
_INDENT = 11
_HEADS = ("mutants", "killed", "survived", "equivalent", "undecided")
_SHORT_HEADS = ("all", "kill.", "surv.", "equiv.", "undec.")
_SHORT_CELL = 7
_STATUSES = (MutantStatus.KILLED, MutantStatus.SURVIVED, MutantStatus.EQUIVALENT, MutantStatus.UNDECIDED)
"""The statuses in the order of the columns of tables."""

_STYLES = {
    MutantStatus.KILLED: "green",
    MutantStatus.EQUIVALENT: "dim",
    MutantStatus.SURVIVED: "red",
    MutantStatus.UNDECIDED: "yellow",
}


def mutation_report(summary: MutationSummary, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield the lines of the report: the score, the tables, and the mutants that no case killed.

    Args:
        summary: the results.
        columns: the width of the report.
    """
    yield Text("Mutation report: ").append(summary.model.name, style="bold")
    yield Text()
    yield from _head(summary, columns)
    if not summary.results:
        return
    yield Text()
    yield from _table("operator", summary.by_operator(), columns)
    yield Text()
    yield from _table("operation", summary.by_entry(), columns)
    if summary.not_killed:
        yield Text()
        yield from _missed(summary, columns)


def _head(summary: MutationSummary, columns: int) -> Iterator[Text]:
    counts = summary.counts
    yield from _row("Suite:", summary.suite, columns)
    if summary.failing:
        more = ", …" if len(summary.failing) > _MAX_NAMED else ""
        names = ", ".join(summary.failing[:_MAX_NAMED]) + more
        fail = "fails" if len(summary.failing) == 1 else "fail"
        clause = f"{counted(len(summary.failing), 'case')} left out that {fail} on the model itself: {names}"
        yield from _row("", clause, columns)
    parts = (f"{counts.of_status(status)} {status}" for status in _STATUSES)
    yield from _row("Mutants:", f"{counts.total}: {', '.join(parts)}", columns)
    if summary.ended_early:
        yield from _row("", summary.ended_early, columns)
    if summary.benign:
        words = f"{summary.benign} of those that survived {'breaks' if summary.benign == 1 else 'break'} no requirement"
        yield from _row("", words, columns)
    yield from _row("Runs:", f"{summary.runs}; {summary.skipped} left out that cannot differ", columns)
    score = Text(f"  {'Score:':<{_INDENT - 2}}").append(str(counts.score), style="bold")
    if counts.score.percent is not None:
        score.append("  ").append_text(bar_of(counts.score, max(10, min(_BAR, columns - len(score) - 2))))
    yield score
    if counts.total:
        words = "killed of those that are not equivalent; undecided ones count as not killed"
        yield from _row("", words, columns)
    if summary.assumptions:
        yield from _row("Assumed:", " ".join(summary.assumptions), columns)


def _row(head: str, words: str, columns: int) -> Iterator[Text]:
    yield from map(Text, wrapped(words, columns, f"  {head:<{_INDENT - 2}}", _INDENT))


def _table(title: str, rows: Mapping[str, MutantCounts], columns: int) -> Iterator[Text]:
    """Yield a table of counts; its heads are short where the width needs that, and long names stand alone."""
    width = max(map(len, (*rows, f"By {title}")))
    cells = [len(head) + 2 for head in _HEADS]
    heads: Sequence[str] = _HEADS
    if 2 + width + sum(cells) > columns:
        cells, heads = [_SHORT_CELL] * len(_HEADS), _SHORT_HEADS
        width = min(width, columns - 2 - sum(cells))
    fitting = "".join(f"{head:>{cell}}" for head, cell in zip(heads, cells, strict=True))
    yield Text(f"By {title}".ljust(width + 2), style="bold", no_wrap=True).append(fitting, style="not bold dim")
    for name, counts in rows.items():
        row = Text(f"  {name:<{width}}", no_wrap=True)
        if len(name) > width:
            yield row
            row = Text(" " * (width + 2), no_wrap=True)
        numbers = (counts.total, *(counts.of_status(status) for status in _STATUSES))
        for number, cell in zip(numbers, cells, strict=True):
            row.append(f"{number or '·':>{cell}}")
        yield row


def _missed(summary: MutationSummary, columns: int) -> Iterator[Text]:
    missed = summary.not_killed
    yield Text(f"Not killed: {len(missed)}", style="bold")
    for owner, group in groupby(missed[:MAX_LISTED], key=lambda result: result.mutant.owner):
        yield Text(f"  {owner}")
        for result in group:
            yield from _of_mutant(result, summary.line(result), columns)
    more = len(missed) - MAX_LISTED
    if more > 0:
        words = f"and {more} more: `--json` and `--html` list all, and `--operators` selects"
        yield from map(Text, wrapped(words, columns, "  ", 2))


def _of_mutant(result: MutantResult, line: int, columns: int) -> Iterator[Text]:
    """Yield the line of the file, the operator and what changed."""
    mutant = result.mutant
    first, *rest = wrapped(change_in_words(mutant), columns, f"    line {line}  ", 8)
    yield Text(first)
    yield from map(Text, rest)
    style = _STYLES[result.status]
    yield from (Text(text, style=style) for text in wrapped(_status_in_words(result), columns, " " * 8, 10))


def _status_in_words(result: MutantResult) -> str:
    operator = result.mutant.operator
    if result.witness is None:
        because = f": {result.reason}" if result.reason else ""
        return f"{result.status}  {operator}{because}"
    benign = f", {BENIGN}" if result.is_benign else ""
    how = f"{result.witness.name} kills it" if result.is_killable else result.reason
    return f"{result.status}{benign}  {operator}: {how}"
