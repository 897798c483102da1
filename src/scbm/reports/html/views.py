"""The values that the templates of the HTML report show, derived from a history."""

from __future__ import annotations

import re
from functools import cached_property
from itertools import groupby, islice
from typing import TYPE_CHECKING
from urllib.parse import quote

from markupsafe import Markup, escape
from msgspec import Struct

from scbm.cases.coverage import (
    STATE_ASPECTS,
    Aspect,
    Assertion,
    Decision,
    InstanceFolds,
    Obligation,
    engine_counts_in_words,
    growth,
    status_counts_in_words,
    visitors_of_each,
    visits_in_words,
)
from scbm.model.visible_text import escaped
from scbm.reports.ci.marked_lines import mark_lines
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.figure_table import FORCED_MARK, STATUS_MARKS, short_of_goal_in_words
from scbm.reports.html.cell_strip import strip_rows, strip_svg
from scbm.reports.html.diagrams import lifecycle_svg
from scbm.reports.html.entries import EntryCell, missed_groups, rows_by_entry
from scbm.reports.missed_groups import ReasonGroup, reason_groups
from scbm.reports.missed_reasons import close_command, missed_reasons
from scbm.reports.pictures import PICTURES, ReportPictures
from scbm.reports.run_changes import change_groups
from scbm.reports.status_lines import asserted_words, status_warnings, united_in_words
from scbm.reports.stored_cases import again, causes_of, durations, place_of
from scbm.testing.batches.batch_summary import MAX_HAZARDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases.coverage import (
        AssertedObligation,
        AssertedObligations,
        AssertionEvidence,
        Figure,
        GrowthStep,
        LiftedStatuses,
        Obligations,
        Statuses,
    )
    from scbm.model import Operation, Transition
    from scbm.reports.ci.marked_lines import MarkedLine
    from scbm.reports.html.entries import MissedGroup
    from scbm.reports.missed_groups import MissedRow
    from scbm.reports.missed_reasons import Missed
    from scbm.reports.pictures import PictureEntry
    from scbm.reports.run_changes import ChangeRow
    from scbm.running.simulation.device_hazards import Hazard
    from scbm.store import History, StoredCase, StoredRun

MAX_NAMED = 5
"""Maximum number of cases listed beside an aspect or a finding; the list of cases has all."""

_UNSCRIPTED = 1000
"""Maximum number of cases that readers without scripts see."""

_BREAKS = re.compile(r"(?<=[_/.])(?=.)", re.DOTALL)
_COLUMNS = (Aspect.QUEUED, *STATE_ASPECTS)


def fragment(name: str) -> str:
    """Return `name` escaped for the fragment of an address."""
    return quote(escaped(name), safe="")


def breakable(name: str) -> Markup:
    """Return `name` as HTML with a possible line break behind each `_`, `/` and `.`."""
    pieces = _BREAKS.split(name)
    return Markup("<wbr>").join(pieces)


def prose(words: str) -> Markup:
    """Return a sentence as HTML, with the text between backticks as code."""
    plain, *rest = words.split("`")
    if len(rest) % 2:
        return escape(words)
    pieces = (Markup("<code>{}</code>").format(p) if i % 2 == 0 else escape(p) for i, p in enumerate(rest))
    return escape(plain) + Markup("").join(pieces)


class MatrixCell(Struct, frozen=True):
    """The visits of one obligation: the number of cases, and the labels of the first ones."""

    obligation: Obligation
    count: int
    first: tuple[str, ...]
    missed: Missed | None


class OperationView(Struct, frozen=True):
    """An operation: a cell for each of its obligations, its lifecycle, and its lines of the model file."""

    operation: Operation
    cells: tuple[MatrixCell, ...]
    diagram: Markup
    lines: tuple[MarkedLine, ...]

    @property
    def is_covered(self) -> bool:
        """Whether each of its obligations was visited."""
        return all(cell.count for cell in self.cells)

    def rows_of(self, cell: MatrixCell) -> int:
        """Return the number of cells from this one on that are missing for one reason; 0 if the one before has it."""
        groups = [tuple(group) for _, group in groupby(self.cells, lambda each: each.missed and each.missed.reason)]
        return next((len(group) for group in groups if group[0] == cell), 0)


class TransitionView(Struct, frozen=True):
    """An automatic transition: its cell, and its line of the model file, if it is known."""

    transition: Transition
    cell: MatrixCell
    line: int | None


class OperationGroup(Struct, frozen=True):
    """The instances of an operation with parameters; or the operations without between two of them, without a name."""

    entry: str | None
    cells: tuple[EntryCell, ...]
    views: tuple[OperationView, ...]

    @property
    def is_covered(self) -> bool:
        """Whether each obligation of each instance was visited."""
        return all(view.is_covered for view in self.views)


class TransitionGroup(Struct, frozen=True):
    """The instances of an automatic transition with parameters; or those without between two of them."""

    entry: str | None
    cells: tuple[EntryCell, ...]
    views: tuple[TransitionView, ...]

    @property
    def is_covered(self) -> bool:
        """Whether each instance was taken."""
        return all(view.cell.count for view in self.views)


class StepView(Struct, frozen=True):
    """A case that increased the figure: its number and label, the obligations it added, and the figure after it."""

    number: int
    label: str
    count: int
    in_words: tuple[str, ...]
    figure: Figure

    @staticmethod
    def of(step: GrowthStep) -> StepView:
        """Return the view of a step, with the added obligations grouped by subject."""
        aspects: dict[str, list[str]] = {}
        for obligation in step.added:
            if obligation.aspect is Aspect.TAKEN:
                aspects[str(obligation)] = []
            else:
                aspects.setdefault(obligation.subject, []).append(obligation.aspect)
        words = tuple(f"{subject} {', '.join(states)}".rstrip() for subject, states in aspects.items())
        return StepView(step.number, step.case, len(step.added), words, step.figure)


class FindingView(Struct, frozen=True):
    """The cases that fail for one cause.

    Attributes:
        number: the number of the cause, from 0.
        kind: the kind of failure.
        subject: the requirement, expectation or end that the failure is about.
        count: the number of cases that fail for this cause.
        first: the first of these cases, each with its message.
        again: the command that reproduces the first case.
        place: where the first case ran, if it ran over nodes.
    """

    number: int
    kind: str
    subject: str
    count: int
    first: tuple[tuple[str, str], ...]
    again: str
    place: str


class Visitors(Struct, frozen=True):
    """The cases that visit each obligation, as ascending indices into `History.cases`."""

    obligations: Obligations
    by_bit: tuple[tuple[int, ...], ...]

    @staticmethod
    def of(history: History) -> Visitors:
        """Return the visitors of all obligations, from one pass over the cases."""
        return Visitors(history.obligations, visitors_of_each(history.coverage))

    def visiting(self, obligation: Obligation) -> tuple[int, ...]:
        """Return the indices of the cases that visit `obligation`."""
        return self.by_bit[self.obligations.bit(obligation).bit_length() - 1]


class ReportView:
    """The parts of a history that the pages show."""

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
        """Each aspect that the model has, with its figure; *queued*, which the figure does not count, is last."""
        coverage = self.history.coverage
        figures = ((aspect, coverage.figure_of(aspect)) for aspect in (*STATE_ASPECTS, Aspect.TAKEN, Aspect.QUEUED))
        return tuple((aspect, figure) for aspect, figure in figures if figure.of)

    @property
    def durations(self) -> str:
        """The duration of the cases in words."""
        return durations(self.history)

    @property
    def short_of_goal(self) -> str:
        """The number of cases that passed although they missed a goal, with the reasons, in words; empty for none."""
        return short_of_goal_in_words(self.history.short_count, self.history.short)

    @property
    def hazards(self) -> tuple[tuple[str, Hazard], ...]:
        """The first hazards at devices, each with the label of its case."""
        return self.history.hazards[:MAX_HAZARDS]

    @property
    def last_run(self) -> StoredRun:
        """The last run of the history."""
        return self.history.runs[-1]

    @cached_property
    def missed(self) -> tuple[Missed, ...]:
        """The missing obligations with reasons; those that the figure does not count are last."""
        history = self.history
        kind = CampaignKind.of_store(history)
        return missed_reasons(history, history.source.path, kind)

    @property
    def undecided(self) -> tuple[Missed, ...]:
        """The missing obligations that a case may visit, or whose status is not known."""
        return tuple(each for each in self.missed if each.status is Decision.UNDECIDED)

    @property
    def not_needed(self) -> tuple[Missed, ...]:
        """The missing obligations that are proved, waived, or excluded by the planner."""
        return tuple(each for each in self.missed if each.status is not Decision.UNDECIDED)

    @cached_property
    def undecided_groups(self) -> tuple[ReasonGroup, ...]:
        """The missing obligations that a case may visit, by their reasons."""
        return reason_groups(self.undecided)

    @cached_property
    def other_groups(self) -> tuple[ReasonGroup, ...]:
        """The missing obligations of another status, by it."""
        return reason_groups(self.not_needed)

    @staticmethod
    def rows(missed: tuple[Missed, ...]) -> tuple[MissedRow, ...]:
        """Return a row for each subject of obligations that are missing for one reason."""
        return ReasonGroup(missed).rows

    @property
    def statuses(self) -> Statuses | None:
        """The statuses of obligations; `None` if visits alone decide them."""
        return self.history.decided

    @property
    def status_words(self) -> str:
        """The number of obligations of each status, in words."""
        return status_counts_in_words(self.history.statuses.counts)

    @property
    def engine_words(self) -> str:
        """The number of obligations that each engine proved something about, in words; empty without proofs."""
        return engine_counts_in_words(self.history.statuses.engines)

    @property
    def status_warnings(self) -> tuple[str, ...]:
        """A sentence for each waiver and each certificate that does not do what its author meant."""
        return tuple(status_warnings(self.history.statuses))

    @cached_property
    def legend(self) -> tuple[Decision, ...]:
        """The statuses that occur beside covered and undecided, in their order."""
        found = {entry.decision for entry in self.history.statuses.entries}
        return tuple(each for each in Decision if each in found and each not in (Decision.COVERED, Decision.UNDECIDED))

    @property
    def evidence(self) -> AssertionEvidence:
        """The answers of the store about asserted obligations, or why there are none."""
        return self.history.evidence

    @cached_property
    def asserted(self) -> AssertedObligations | None:
        """The visited obligations with their answers; `None` if none are known."""
        return self.evidence.found

    @property
    def asserted_words(self) -> str:
        """The number of visited obligations with each answer, in words; empty if none are known."""
        return "" if self.asserted is None else asserted_words(self.asserted)

    @property
    def unasserted(self) -> tuple[AssertedObligation, ...]:
        """The obligations that cases visit and nothing asserts."""
        return () if self.asserted is None else self.asserted.with_answer(Assertion.NOTHING_ASSERTED)

    def answer(self, obligation: Obligation) -> AssertedObligation | None:
        """Return whether an obligation is asserted; `None` if it is not visited, or nothing is known."""
        return None if self.asserted is None else self.asserted.by_obligation.get(obligation)

    def status(self, obligation: Obligation) -> Decision:
        """Return the status of an obligation whose mark is shown."""
        return self.history.statuses.by_obligation[obligation].marked

    def forced_in_words(self, obligation: Obligation) -> str:
        """Return the status of an obligation that only forced states visit, with its reason; empty for others."""
        return self.history.statuses.by_obligation[obligation].forced_in_words

    @property
    def visit_words(self) -> str:
        """The number of visited obligations, freely and in forced states only, in words."""
        return visits_in_words(self.figure, self.history.statuses.forced, FORCED_MARK)

    @property
    def strip(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """The rows of the picture of all obligations, which is empty for a model without any."""
        return strip_rows(self.model)

    @property
    def strip_picture(self) -> Markup:
        """The picture of all obligations."""
        return Markup(strip_svg(self.history))  # noqa: S704 - our own SVG, in which names are escaped

    @property
    def first_cases(self) -> tuple[tuple[str, StoredCase], ...]:
        """The cases that readers without scripts see, with their labels."""
        return tuple(islice(zip(self.history.labels, self.history.cases, strict=True), _UNSCRIPTED))

    @cached_property
    def labels(self) -> frozenset[str]:
        """The names of the cases that have a page."""
        return frozenset(self.history.labels)

    @property
    def changes(self) -> tuple[tuple[str, tuple[ChangeRow, ...]], ...]:
        """What the last run changed since an earlier one, by the kind of change."""
        return () if self.history.since is None else change_groups(self.history.since)

    @property
    def forced_mark(self) -> str:
        """The character for a visit in forced states only."""
        return FORCED_MARK

    @staticmethod
    def mark(status: Decision) -> str:
        """Return the character for a status."""
        return STATUS_MARKS[status]

    @property
    def missed_count(self) -> int:
        """The number of missing obligations in the figure that a case may visit."""
        return sum(each.obligation.counts for each in self.undecided)

    @property
    def close_command(self) -> str:
        """The command that decides all missing obligations."""
        return close_command(self.history.source.path)

    @cached_property
    def lines(self) -> tuple[MarkedLine, ...]:
        """The lines of the model file with their coverage."""
        return mark_lines(self.model, self.history.source, self.history.coverage)

    @cached_property
    def pictures(self) -> tuple[tuple[PictureEntry, ReportPictures], ...]:
        """The pictures that other packages make, those of the model and of its operations."""
        made = ((entry, entry.pictures(self.history)) for entry in PICTURES.values())
        return tuple((entry, found) for entry, found in made if found != ReportPictures())

    @cached_property
    def operations(self) -> tuple[OperationView, ...]:
        """All operations, in the order of the model."""
        return tuple(
            OperationView(
                operation,
                tuple(self._cell(Obligation(operation.name, aspect)) for aspect in _COLUMNS),
                Markup(lifecycle_svg(self.history, operation.name)),  # noqa: S704 - our own SVG, in which names are escaped
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

    @property
    def united(self) -> str:
        """From which objects the lifted figure comes; empty if from those of the model alone."""
        return "" if self.lifted is None else united_in_words(self.lifted)

    @property
    def lifted(self) -> LiftedStatuses | None:
        """The statuses of lifted obligations; `None` for a model without parameters."""
        return self.history.lifted

    @cached_property
    def folds(self) -> InstanceFolds:
        """The entries with parameters, and their instances."""
        return InstanceFolds.of(self.model)

    def grouped(self, missed: Sequence[Missed]) -> tuple[MissedGroup, ...]:
        """Return missed obligations, those of one entry together."""
        return tuple(missed_groups(missed, self.folds))

    @cached_property
    def operation_groups(self) -> tuple[OperationGroup, ...]:
        """All operations, the instances of one entry together."""
        groups = rows_by_entry(self.operations, lambda view: view.cells[0].obligation, self.folds)
        return tuple(
            OperationGroup(
                entry,
                tuple(
                    EntryCell.of(aspect, (self._instance(view.cells[place]) for view in views))
                    for place, aspect in enumerate(_COLUMNS)
                ),
                views,
            )
            for entry, views in groups
        )

    @cached_property
    def transition_groups(self) -> tuple[TransitionGroup, ...]:
        """All automatic transitions, the instances of one entry together."""
        groups = rows_by_entry(self.transitions, lambda view: view.cell.obligation, self.folds)
        return tuple(
            TransitionGroup(entry, (EntryCell.of("taken", (self._instance(view.cell) for view in views)),), views)
            for entry, views in groups
        )

    def _instance(self, cell: MatrixCell) -> tuple[Decision, bool]:
        return self.status(cell.obligation), cell.count > 0

    @cached_property
    def steps(self) -> tuple[StepView, ...]:
        """The cases that increased the figure, in order."""
        return tuple(StepView.of(step) for step in growth(self.history.coverage))

    @cached_property
    def findings(self) -> tuple[FindingView, ...]:
        """The causes of failures, with the numbers that the script uses."""
        return tuple(
            FindingView(
                number,
                cause.failure.kind,
                cause.failure.subject,
                len(cause.messages),
                cause.messages[:MAX_NAMED],
                again(cause.case, self.history.source.path, self.history.runs),
                place_of(cause.case, self.history),
            )
            for number, cause in enumerate(causes_of(self.history))
        )

    def line_of(self, obligation: Obligation) -> int | None:
        """Return the number of the line that has an obligation; `None` if it is unknown."""
        return self._line_numbers.get(obligation)

    @cached_property
    def _line_numbers(self) -> dict[Obligation, int]:
        return {obligation: line.number for line in self.lines for obligation, _ in line.obligations}

    @cached_property
    def _reasons(self) -> dict[Obligation, Missed]:
        return {missed.obligation: missed for missed in self.missed}

    def _cell(self, obligation: Obligation) -> MatrixCell:
        cases = self._visitors.visiting(obligation)
        first = tuple(self.history.labels[index] for index in cases[:MAX_NAMED])
        return MatrixCell(obligation, len(cases), first, self._reasons.get(obligation))

    def _lines_of(self, operation: str) -> tuple[MarkedLine, ...]:
        """Return the lines of an operation: its own line and all lines below it with a larger indentation."""
        numbers = [self._line_numbers.get(Obligation(operation, aspect)) for aspect in STATE_ASPECTS]
        known = [number for number in numbers if number is not None]
        if not known:
            return ()
        first, last = min(known) - 1, max(known)
        return self.lines[first : _end_of_block(self.lines, first, last)]


def _end_of_block(lines: Sequence[MarkedLine], first: int, last: int) -> int:
    """Return the end of the block that begins with line `first` and has at least the lines before `last`."""
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
