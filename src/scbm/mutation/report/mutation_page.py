"""The results of mutants as one HTML file: the score, the tables, and the model with the mutants of each line."""

from __future__ import annotations

import re
from importlib.resources import files
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import MutantStatus
from scbm.model.visible_text import escaped
from scbm.mutation.report.mutation_summary import BENIGN, change_in_words
from scbm.reports.html.page import page_environment, verbatim

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.mutation.mutant_results import MutantResult
    from scbm.mutation.report.mutation_summary import MutationSummary

_LINE_END = re.compile(r"\r\n|\r|\n")
_MISSED = (MutantStatus.SURVIVED, MutantStatus.UNDECIDED)


class MutantRow(Struct, frozen=True):
    """A mutant as the page shows it.

    Attributes:
        status: its status.
        change: what it changes.
        operator: the operator that made it.
        words: what else is known of it.
    """

    status: str
    change: str
    operator: str
    words: str


class MutantLine(Struct, frozen=True):
    """A line of the model with its mutants.

    Attributes:
        number: counted from 1.
        text: the line.
        killed: the number of its mutants that a case killed.
        rows: all of its mutants, those that no case killed first.
    """

    number: int
    text: str
    killed: int
    rows: tuple[MutantRow, ...]

    @property
    def counting(self) -> int:
        """The number of its mutants that are not equivalent."""
        return sum(row.status != MutantStatus.EQUIVALENT for row in self.rows)

    @property
    def state(self) -> str:
        """The class of the line in the style sheet; empty without mutants that count."""
        if not self.counting:
            return ""
        return "visited" if self.killed == self.counting else "partly" if self.killed else "missed"


def mutation_page(summary: MutationSummary, text: str) -> str:
    """Return the complete HTML file as text; equal results give equal files.

    Args:
        summary: the results.
        text: the model file.
    """
    environment = page_environment()
    template = files(__package__).joinpath("mutants.html.j2").read_text("utf-8")
    page = environment.from_string(template).render(
        summary=summary,
        counts=summary.counts,
        tables=(("operator", summary.by_operator()), ("operation", summary.by_entry())),
        statuses=tuple(MutantStatus),
        lines=_lines(summary, text),
        style=verbatim(environment, "page.css"),
    )
    return escaped(page)


def _lines(summary: MutationSummary, text: str) -> tuple[MutantLine, ...]:
    by_line: dict[int, list[MutantResult]] = {}
    for result in summary.results:
        by_line.setdefault(max(1, summary.line(result)), []).append(result)
    written = _LINE_END.split(text)
    return tuple(_line(number, line, by_line.get(number, ())) for number, line in enumerate(written, start=1))


def _line(number: int, text: str, results: Sequence[MutantResult]) -> MutantLine:
    ordered = sorted(results, key=lambda result: result.status not in _MISSED)
    killed = sum(result.status is MutantStatus.KILLED for result in results)
    return MutantLine(number, text, killed, tuple(map(_row, ordered)))


def _row(result: MutantResult) -> MutantRow:
    mutant = result.mutant
    return MutantRow(result.status.value, change_in_words(mutant), mutant.operator, _words(result))


def _words(result: MutantResult) -> str:
    """Return what is known of a mutant beside its status."""
    if result.status is MutantStatus.KILLED:
        return f"by {result.case}: {result.reason}"
    how = f"{result.witness.name} kills it" if result.witness is not None and result.is_killable else result.reason
    return ", ".join(filter(None, (BENIGN if result.is_benign else "", how)))
