"""What the templates of the HTML report show: a history, cut into what stands on its pages."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING
from urllib.parse import quote

from markupsafe import Markup, escape

from scbm.cases.coverage import STATE_ASPECTS, Aspect, Obligation, growth
from scbm.reports.causes import causes_of
from scbm.reports.ci.marked_lines import mark_lines
from scbm.reports.html.diagrams import lifecycle_svg
from scbm.reports.missed_reasons import close_command, missed_reasons
from scbm.reports.reproduction import again, durations, place_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases.coverage import Figure, GrowthStep
    from scbm.model import Operation, Transition
    from scbm.reports.ci.marked_lines import MarkedLine
    from scbm.reports.html.case_data import Visitors
    from scbm.reports.missed_reasons import Missed
    from scbm.store import History, StoredRun

_FIRST = 5
"""So many cases are named beside an aspect or a finding; the list of cases has them all."""

_BREAKS = re.compile(r"(?<=[_/.])(?=.)", re.DOTALL)
_COLUMNS = (Aspect.QUEUED, *STATE_ASPECTS)


def fragment(name: str) -> str:
    """A name as part of an address behind its `#`."""
    return quote(name, safe="")


def breakable(name: str) -> Markup:
    """A name as HTML that may go on in the next line behind each `_`, `/` and `.` in it."""
    pieces = _BREAKS.split(name)
    return Markup("<wbr>").join(pieces)


def prose(words: str) -> Markup:
    """A sentence as HTML, with what stands between backticks as code."""
    plain, *rest = words.split("`")
    if len(rest) % 2:
        return escape(words)
    pieces = (Markup("<code>{}</code>").format(p) if i % 2 == 0 else escape(p) for i, p in enumerate(rest))
    return escape(plain) + Markup("").join(pieces)


@dataclass(frozen=True, slots=True)
class MatrixCell:
    """How often an obligation was visited: in how many cases, and in which first, by their labels."""

    obligation: Obligation
    count: int
    first: tuple[str, ...]
    missed: Missed | None


@dataclass(frozen=True, slots=True)
class OperationView:
    """An operation: a cell for each of its obligations, its lifecycle, and the lines that say it."""

    operation: Operation
    cells: tuple[MatrixCell, ...]
    diagram: Markup
    lines: tuple[MarkedLine, ...]

    @property
    def is_covered(self) -> bool:
        """Whether all of it that counts was visited."""
        return all(cell.count for cell in self.cells)


@dataclass(frozen=True, slots=True)
class TransitionView:
    """An automatic transition: its cell, and the line that says it, if there is one."""

    transition: Transition
    cell: MatrixCell
    line: int | None


@dataclass(frozen=True, slots=True)
class StepView:
    """A case that added to the figure: its number, its label, what it added in words, and the figure after it."""

    number: int
    label: str
    count: int
    in_words: tuple[str, ...]
    figure: Figure

    @staticmethod
    def of(step: GrowthStep) -> StepView:
        """A step with what it added, subject by subject."""
        aspects: dict[str, list[str]] = {}
        for obligation in step.added:
            if obligation.aspect is Aspect.TAKEN:
                aspects[str(obligation)] = []
            else:
                aspects.setdefault(obligation.subject, []).append(obligation.aspect)
        words = tuple(f"{subject} {', '.join(told)}".rstrip() for subject, told in aspects.items())
        return StepView(step.number, step.case, len(step.added), words, step.figure)


@dataclass(frozen=True, slots=True)
class FindingView:
    """What fails for one cause.

    Attributes:
        number: that of the cause, from 0.
        kind: the sort of reason.
        subject: what of that sort.
        count: how many cases fail so.
        first: the first of them, each with what it says.
        again: the command that shows the first one again.
        place: where the first one ran, if that was over nodes.
    """

    number: int
    kind: str
    subject: str
    count: int
    first: tuple[tuple[str, str], ...]
    again: str
    place: str


class ReportView:
    """A history as the pages show it."""

    def __init__(self, history: History, visitors: Visitors) -> None:
        self.history = history
        self.model = history.model
        self.columns = _COLUMNS
        self._visitors = visitors

    @cached_property
    def figure(self) -> Figure:
        """The paper's figure."""
        return self.history.coverage.figure

    @cached_property
    def aspects(self) -> tuple[tuple[Aspect, Figure], ...]:
        """Each aspect that the model has, with its figure; *queued*, which is beside the figure, last."""
        coverage = self.history.coverage
        figures = ((aspect, coverage.figure_of(aspect)) for aspect in (*STATE_ASPECTS, Aspect.TAKEN, Aspect.QUEUED))
        return tuple((aspect, figure) for aspect, figure in figures if figure.of)

    @property
    def durations(self) -> str:
        """How long the cases ran, in words."""
        return durations(self.history)

    @property
    def last_run(self) -> StoredRun:
        """The run that began last."""
        return self.history.runs[-1]

    @cached_property
    def missed(self) -> tuple[Missed, ...]:
        """All that is missing and why, what is beside the figure last."""
        history = self.history
        return tuple(missed_reasons(history.model, history.coverage, history.source.path))

    @property
    def missed_count(self) -> int:
        """How many obligations of the figure are missing."""
        return self.figure.of - self.figure.visited

    @property
    def close_command(self) -> str:
        """The command that decides all that is missing."""
        return close_command(self.history.source.path)

    @cached_property
    def lines(self) -> tuple[MarkedLine, ...]:
        """The model file."""
        return mark_lines(self.model, self.history.source, self.history.coverage)

    @cached_property
    def operations(self) -> tuple[OperationView, ...]:
        """All operations, in the order of the model."""
        return tuple(
            OperationView(
                operation,
                tuple(self._cell(Obligation(operation.name, aspect)) for aspect in _COLUMNS),
                Markup(lifecycle_svg(self.history, operation.name)),  # noqa: S704 - made by us, names escaped there
                self._lines_of(operation.name),
            )
            for operation in self.model.operations
        )

    @cached_property
    def transitions(self) -> tuple[TransitionView, ...]:
        """All automatic transitions, in the order of the model."""
        obligations = [Obligation(transition.name, Aspect.TAKEN) for transition in self.model.automatic_transitions]
        return tuple(
            TransitionView(transition, self._cell(obligation), self.line_of(obligation))
            for transition, obligation in zip(self.model.automatic_transitions, obligations, strict=True)
        )

    @cached_property
    def steps(self) -> tuple[StepView, ...]:
        """The cases that added to the figure, in their order."""
        return tuple(StepView.of(step) for step in growth(self.history.coverage))

    @cached_property
    def findings(self) -> tuple[FindingView, ...]:
        """What failed, and why; the numbers are those that the script knows causes by."""
        return tuple(
            FindingView(
                number,
                cause.failure.kind,
                cause.failure.subject,
                len(cause.told),
                cause.told[:_FIRST],
                again(cause.case, self.history.source.path, self.history.runs),
                place_of(cause.case, self.history),
            )
            for number, cause in enumerate(causes_of(self.history))
        )

    def line_of(self, obligation: Obligation) -> int | None:
        """The number of the line that an obligation is a branch of."""
        return self._line_numbers.get(obligation)

    @cached_property
    def _line_numbers(self) -> dict[Obligation, int]:
        return {obligation: line.number for line in self.lines for obligation, _ in line.obligations}

    @cached_property
    def _reasons(self) -> dict[Obligation, Missed]:
        return {missed.obligation: missed for missed in self.missed}

    def _cell(self, obligation: Obligation) -> MatrixCell:
        cases = self._visitors.visiting(obligation)
        first = tuple(self.history.labels[index] for index in cases[:_FIRST])
        return MatrixCell(obligation, len(cases), first, self._reasons.get(obligation))

    def _lines_of(self, operation: str) -> tuple[MarkedLine, ...]:
        """The lines that say an operation: from its own line up to the next that is not further in."""
        numbers = [self._line_numbers.get(Obligation(operation, aspect)) for aspect in STATE_ASPECTS]
        known = [number for number in numbers if number is not None]
        if not known:
            return ()
        first, last = min(known) - 1, max(known)
        return self.lines[first : _end_of_block(self.lines, first, last)]


def _end_of_block(lines: Sequence[MarkedLine], first: int, last: int) -> int:
    """Where the block ends that begins with line `first` and has at least the lines before `last`; blank ones apart."""
    own = _indentation(lines[first].text)
    end = last
    for index in range(last, len(lines)):
        text = lines[index].text
        if text.strip() and _indentation(text) <= own:
            break
        if text.strip():
            end = index + 1
    return end


def _indentation(text: str) -> int:
    return len(text) - len(text.lstrip())
