"""The report of `scbm close` for the terminal: figures, new cases, uncoverable obligations, suggestions, commands."""

from __future__ import annotations

from math import floor
from textwrap import wrap
from typing import TYPE_CHECKING, NamedTuple, assert_never

from msgspec import Struct
from msgspec.structs import replace
from rich.text import Text

from scbm.cases.coverage import (
    FORCED_NOTE,
    Aspect,
    InstanceFolds,
    LiftedStatuses,
    ObligationStatus,
    Statuses,
    count_statuses,
    forced_count_in_words,
    status_counts_in_words,
)
from scbm.closing import Decision
from scbm.closing.advice.suggestions import grouped
from scbm.closing.decisions import RequirementStatus
from scbm.closing.summaries import aspects_in_words, in_few_words, reason_about_it
from scbm.model import format_moment
from scbm.reports.figure_table import DEFAULT_COLUMNS, command_text, counted, shown_path, wrapped
from scbm.reports.status_lines import lifted_lines, waiver_warnings
from scbm.reports.terminal.failure_report import finding_lines

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases.coverage import Figure
    from scbm.closing import Closing, ClosingCase, Decided
    from scbm.closing.closing_files import ClosingFiles
    from scbm.closing.decisions import Consequence, DecidedRequirement, FoundFault, StageEnd
    from scbm.testing import Campaign, Finding

_BAR_WIDTH = 50
_MIN_BAR_WIDTH = 10


class _FigureSegment(NamedTuple):
    """A segment of the bar: its character, its style and its meaning."""

    mark: str
    style: str
    name: str


_BEFORE = _FigureSegment("█", "green", "before")
_NEW = _FigureSegment("▓", "bold green", "new cases")
_NEVER = _FigureSegment("░", "dim", "uncoverable")
_EXCLUDED = _FigureSegment("▒", "dim", "excluded")
_WAIVED = _FigureSegment("-", "dim", "waived")
_OPEN = _FigureSegment("?", "bold red", "undecided")
FIGURE_SEGMENTS = (_BEFORE, _NEW, _NEVER, _EXCLUDED, _WAIVED, _OPEN)
"""The segments of the bar, in their order."""


class ClosingSetting(Struct, frozen=True):
    """The settings of the report: commands and files that it shows beside the result.

    Attributes:
        file: the model file, for the commands that are suggested.
        suite: a description of the cases that ran before closing; empty if there were none.
        files: the case files of that suite as arguments, each with a leading blank.
        drawing: the options for its random cases, each with a leading blank.
        planner: the options for the planner, each with a leading blank.
        closing: the options of `scbm close`, each with a leading blank.
        output: the written cases and certificates; `None` if nothing was written.
        failed: the campaign with the failed cases; `None` if all passed.
        findings: the causes of the failures.
        commands: for each finding the command that runs its first case again.
        found: new cases whose runs end in a livelock, a model error or at the time limit.
        consequences: what is wrong in forced states of new cases.
        written: the goals that were written into the model before it was closed.
        already: the goals that were to be written, but are in the model already.
        waivers: the option for the waivers file, with a leading blank.
        columns: the width of the report.
    """

    file: str
    suite: str = ""
    files: str = ""
    drawing: str = ""
    planner: str = ""
    closing: str = ""
    output: ClosingFiles | None = None
    failed: Campaign | None = None
    findings: tuple[Finding, ...] = ()
    commands: tuple[str, ...] = ()
    found: tuple[FoundFault, ...] = ()
    consequences: tuple[Consequence, ...] = ()
    written: tuple[str, ...] = ()
    already: tuple[str, ...] = ()
    waivers: str = ""
    columns: int = DEFAULT_COLUMNS


def closing_report(closing: Closing, setting: ClosingSetting) -> Iterator[Text]:
    """Yield the lines of the report."""
    yield Text("Closing report: ", style="bold").append(closing.model.name)
    yield Text()
    yield from _figures(closing, setting)
    yield from _failed(setting)
    yield from _cases(closing, setting.columns)
    yield from _found(setting)
    yield from _consequences(closing, setting)
    yield from _decisions("Proved uncoverable", closing, Decision.UNCOVERABLE, setting.columns)
    yield from _assumed(closing, setting.columns)
    yield from _decisions("Excluded by the planner", closing, Decision.EXCLUDED, setting.columns)
    yield from _decisions("Waived", closing, Decision.WAIVED, setting.columns)
    yield from _decisions("Undecided", closing, Decision.UNDECIDED, setting.columns)
    yield from _requirements(closing, setting.columns)
    yield from ended_lines(closing.ended)
    yield from _suggestions(closing, setting)
    yield from _commands(closing, setting)


# the figures


def _figures(closing: Closing, setting: ClosingSetting) -> Iterator[Text]:
    before, after = closing.before.figure, closing.after.figure
    line = Text("  SCBM-IAS: ")
    if before.visited != after.visited:
        line.append(f"{before} → ")
    line.append(str(after), style="bold").append("  ")
    counts = closing.counts
    earlier = min(before.visited, counts[Decision.COVERED])
    parts = {
        _BEFORE: earlier,
        _NEW: counts[Decision.COVERED] - earlier,
        _NEVER: counts[Decision.UNCOVERABLE],
        _EXCLUDED: counts[Decision.EXCLUDED],
        _WAIVED: counts[Decision.WAIVED],
        _OPEN: counts[Decision.UNDECIDED],
    }
    legend = "   ".join(f"{part.mark} {part.name}" for part, count in parts.items() if count)
    indentation = " " * line.cell_len
    line.append_text(_bar(parts, max(_MIN_BAR_WIDTH, min(_BAR_WIDTH, setting.columns - line.cell_len))))
    line.rstrip()
    yield line
    if legend:
        yield Text(f"{indentation}{legend}", style="dim")
    yield from lifted_lines(LiftedStatuses.of(closing.model, _statuses(closing)), setting.columns)
    yield from _decision_counts(closing, counts)
    for sentence in waiver_warnings(closing.visited_waivers, closing.expired_waivers):
        yield from (Text(part, style="yellow") for part in wrapped(sentence, setting.columns, "  ", 6))
    yield Text(f"  Before:   {setting.suite or 'no cases'}")
    for goal in setting.written:
        yield Text(f"  Written:  goal {goal}, into {setting.file}", style="green")
    for goal in setting.already:
        yield Text(f"  Written:  goal {goal} is in {setting.file} already")


def _statuses(closing: Closing) -> Statuses:
    """Return the decisions as statuses of obligations."""
    entries = (ObligationStatus(d.obligation, d.decision, is_visited=d.case is not None) for d in closing.decided)
    return Statuses(tuple(entries))


def _bar(parts: dict[_FigureSegment, int], columns: int) -> Text:
    """Return a bar of this width with one segment for each part; a part that is not zero has at least one column."""
    there = {part: count for part, count in parts.items() if count}
    of = sum(there.values())
    widths = {part: max(1, columns * count // of) for part, count in there.items()}
    by_rest = sorted(there, key=lambda part: columns * there[part] % of, reverse=True)
    for part in by_rest[: max(0, columns - sum(widths.values()))]:
        widths[part] += 1
    while sum(widths.values()) > columns:  # the parts of one column each can be too many
        widths[max(widths, key=widths.__getitem__)] -= 1
    bar = Text()
    for part, width in widths.items():
        bar.append(part.mark * width, style=part.style)
    return bar


def _decision_counts(closing: Closing, counts: dict[Decision, int]) -> Iterator[Text]:
    line = Text(f"  Decided:  {status_counts_in_words(counts)}")
    coverable = closing.coverable
    if coverable.percent is not None and coverable.of < sum(counts.values()):
        line.append(f"; {coverable} of what can be covered")
    yield line
    if closing.forced:
        yield Text(f"  Forced:   {forced_count_in_words(closing.forced)}")
    queued = closing.after.figure_of(Aspect.QUEUED)
    others = [each.decision for each in closing.decided if not each.obligation.counts]
    never = [(count, status) for status, count in count_statuses(others).items() if not status.can_be_covered]
    more = "".join(f", {count} {status.words}" for count, status in never if count)
    if queued.of:
        yield Text(f"  Queued:   {queued.visited} of {queued.of} in a plan{more}").append("  (not in SCBM-IAS)", "dim")


# what failed


def _failed(setting: ClosingSetting) -> Iterator[Text]:
    if setting.failed is not None:
        yield from finding_lines(setting.failed, setting.findings, setting.commands)


# the new cases


def _cases(closing: Closing, columns: int) -> Iterator[Text]:
    cases, folds = closing.cases, InstanceFolds.of(closing.model)
    if not cases:
        return
    time = format_moment(sum(made.execution.ended_ns for made in cases))
    yield from _head(f"New cases: {len(cases)}, {time} simulated")
    rows = [("name", "goal", "ends", "after", "adds"), *(_row(made) for made in cases)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    yield _cells(rows[0], widths, "dim")
    for made, row in zip(cases, rows[1:], strict=True):
        yield _cells(row, widths)
        if made.case.later:
            yield from _wrapped(made.case.goal_names, 6, columns)
        for words in in_few_words(made.adds_freely, folds):
            yield from _wrapped(words, 6, columns)
        for note in made.execution.notes:
            yield from _wrapped(note, 6, columns, "dim")
        if made.forcing is not None:
            yield from _wrapped(made.forcing, 6, columns, "yellow")
            for words in in_few_words(made.adds_by_force, folds):
                yield from _wrapped(words, 8, columns)


def _row(made: ClosingCase) -> tuple[str, str, str, str, str]:
    end = made.execution.verdict.end.replace("_", " ")
    adds = sum(obligation.counts for obligation in made.adds)
    goal = f"{len(made.case.goals)} goals" if made.case.later else made.case.goal
    return made.case.name, goal, end, format_moment(made.execution.ended_ns), str(adds)


def _cells(cells: Sequence[str], widths: Sequence[int], style: str = "") -> Text:
    *words, time, number = cells
    *columns, time_width, number_width = widths
    parts = [f"{word:<{width}}" for word, width in zip(words, columns, strict=True)]
    return Text(f"  {'  '.join(parts)}  {time:>{time_width}}  {number:>{number_width}}", style=style)


def _consequences(closing: Closing, setting: ClosingSetting) -> Iterator[Text]:
    """Yield what is wrong in forced states: it does not fail the command."""
    if not setting.consequences:
        return
    yield from _head("Consequences of forced states", "yellow")
    for each in setting.consequences:
        yield from _wrapped(f"{each.name}: {each.message}", 2, setting.columns, "yellow")
        yield from _wrapped(f"its state is {each.forcing}, so {closing.model.name} is not at fault", 6, setting.columns)
        yield command_text("    again: ", each.again)


def _found(setting: ClosingSetting) -> Iterator[Text]:
    if not setting.found:
        return
    yield from _head("Failures found by the search", "bold red")
    for fault in setting.found:
        yield Text(f"  {fault.name} {fault.message}", style="red")
        yield command_text("    again: ", fault.again)


# decisions


def _decisions(title: str, closing: Closing, decision: Decision, columns: int) -> Iterator[Text]:
    """Yield the obligations with this decision by operation, each reason once."""
    found = [decided for decided in closing.decided if decided.decision is decision]
    if not found:
        return
    beside = sum(not decided.obligation.counts for decided in found)
    more = f", and {beside} queued" if beside else ""
    yield from _head(f"{title}: {len(found) - beside}{more}", "bold red" if decision is Decision.UNDECIDED else "bold")
    folds = InstanceFolds.of(closing.model)
    for subjects, groups in _grouped(found, folds).items():
        yield from _group_lines(subjects, groups, folds, columns)


def _assumed(closing: Closing, columns: int) -> Iterator[Text]:
    found = closing.assumptions
    if found:
        yield Text("  These proofs assume:")
    for sentence in found:
        for line in wrap(sentence, columns - 6):
            yield Text(f"      {line}", style="dim")


def ended_lines(ended: Sequence[StageEnd]) -> Iterator[Text]:
    """Yield what ended a stage early, and what lets it go on."""
    if ended:
        yield from _head("Ended early", "bold red")
    for end in ended:
        yield Text(f"  {end.stage}: {end.why}")
        remedy = _remedy_of(end)
        if remedy is not None:
            yield Text(f"      {remedy}", style="dim")


def _remedy_of(end: StageEnd) -> str | None:
    """Return what lets a stage go on that ended early; `None` if nothing is known to help."""
    if end.is_interrupted:
        return "close again; give the cases that --out wrote, if any, as --suite to begin with them"
    if end.option == "--planner":
        return "--planner greedy finds plans in large models"
    return None if end.option is None else f"{end.option} raises this limit"


def _grouped(
    found: Iterable[Decided], folds: InstanceFolds
) -> dict[tuple[tuple[str, bool], ...], tuple[tuple[str, str], ...]]:
    """Return the groups of aspects with their reasons, by the subjects that share them.

    Reasons of instances of one entry that differ only in names of instances are shared.
    """
    by_subject: dict[tuple[str, bool], dict[str, list[Aspect]]] = {}
    for decided in found:
        obligation = decided.obligation
        reasons = by_subject.setdefault((obligation.subject, obligation.aspect is Aspect.TAKEN), {})
        note = f"; {FORCED_NOTE}" if decided.is_forced else ""
        reason = reason_about_it(decided.reason, obligation.subject) + note
        reasons.setdefault(reason, []).append(obligation.aspect)
    alike: dict[tuple[tuple[str, str], ...], list[tuple[str, bool]]] = {}
    exact: dict[tuple[tuple[str, str], ...], tuple[tuple[str, str], ...]] = {}
    for (subject, is_automatic), reasons in by_subject.items():
        groups = tuple((aspects_in_words(aspects), reason) for reason, aspects in reasons.items())
        folded = tuple((aspects, _folded_reason(reason, folds)) for aspects, reason in groups)
        alike.setdefault(folded, []).append((subject, is_automatic))
        exact.setdefault(folded, groups)
    return {tuple(subjects): folded if len(subjects) > 1 else exact[folded] for folded, subjects in alike.items()}


def _folded_reason(reason: str, folds: InstanceFolds) -> str:
    """Return a reason that is the same for instances which differ in objects."""
    return folds.in_entries(reason) if folds.entries else reason


def _group_lines(
    subjects: tuple[tuple[str, bool], ...], groups: tuple[tuple[str, str], ...], folds: InstanceFolds, columns: int
) -> Iterator[Text]:
    operations = folds.folded(name for name, is_automatic in subjects if not is_automatic)
    transitions = folds.folded((name for name, is_automatic in subjects if is_automatic), is_automatic=True)
    parts = ", ".join((*operations, *(f"automatic/{name}" for name in transitions)))
    for aspects, reason in groups:
        is_automatic = aspects == Aspect.TAKEN
        yield from _wrapped(parts if is_automatic else f"{parts}: {aspects}", 2, columns, "")
        yield from _wrapped(reason, 6, columns)


# built-in requirements


_STATUS_STYLES = {
    RequirementStatus.HOLDS: "",
    RequirementStatus.VIOLATED: "red",
    RequirementStatus.UNDECIDED: "bold red",
    RequirementStatus.OFF: "dim",
}


def _requirements(closing: Closing, columns: int) -> Iterator[Text]:
    found = closing.requirements
    if found is None:
        return
    yield from _head("Built-in requirements")
    width = max(len(each.name) for each in found.decided)
    for each in found.decided:
        lines = wrap(_status_words(each), columns - width - 4, break_long_words=False, break_on_hyphens=False)
        for number, line in enumerate(lines):
            yield Text(f"  {'' if number else each.name:<{width}}  {line}", style=_STATUS_STYLES[each.status])
        if each.option is not None:
            yield Text(f"  {'':<{width}}  {each.option} raises this limit", style="dim")
    if found.assumptions:
        followed = f"{counted(found.situations, 'situation')} of runs were followed"
        yield from _wrapped(f"{followed}. Answers `holds` have no certificate, and assume:", 2, columns, "")
    for sentence in found.assumptions:
        for line in wrap(sentence, columns - 6):
            yield Text(f"      {line}", style="dim")


def _status_words(decided: DecidedRequirement) -> str:
    match decided.status:
        case RequirementStatus.HOLDS:
            return f"holds {decided.reason}"
        case RequirementStatus.VIOLATED:
            return f"violated by {decided.case}"
        case RequirementStatus.UNDECIDED | RequirementStatus.OFF:
            return f"{decided.status.value}: {decided.reason}"
        case _:
            assert_never(decided.status)


# suggestions


def _suggestions(closing: Closing, setting: ClosingSetting) -> Iterator[Text]:
    suggestions, folds = closing.suggestions, InstanceFolds.of(closing.model)
    if not suggestions:
        return
    yield from _head("Suggested changes")
    lifted = (replace(each, text=folds.in_entries(each.text)) if each.name is None else each for each in suggestions)
    for suggestion in grouped(lifted):
        for words in in_few_words(suggestion.obligations, folds):
            yield from _wrapped(words, 2, setting.columns, "")
        for clause in suggestion.text.split("; "):
            yield from _wrapped(clause, 6, setting.columns)
        if suggestion.name is not None:
            yield command_text("      ", f"{_close(setting)} --write {suggestion.name}")
    if sum(suggestion.name is not None for suggestion in suggestions) > 1:
        yield Text("  all of these goals")
        yield command_text("      ", f"{_close(setting)} --write all")


def _close(setting: ClosingSetting) -> str:
    return f"scbm close {shown_path(setting.file)}{setting.closing}"


# commands


def _commands(closing: Closing, setting: ClosingSetting) -> Iterator[Text]:
    output = setting.output
    cases = (*closing.cases, *closing.counterexamples)
    if output is None and (cases or closing.certificates):
        yield from _head("Save the result")
        made = [counted(len(cases), "case")] if cases else []
        made += [counted(len(closing.certificates), "certificate")] if closing.certificates else []
        yield command_text("  ", f"{_close(setting)} --out closed", f"writes {' and '.join(made)}")
    elif output is not None:
        yield from _head(f"Written: {_written(output)}")
        yield from _checks(closing, setting, output)


def _written(output: ClosingFiles) -> str:
    parts = [(len(output.cases), "case"), (len(output.certificates), "certificate")]
    made = " and ".join(counted(count, noun) for count, noun in parts if count) or "nothing"
    removed = f"; {counted(len(output.removed), 'file')} of an earlier closing removed" if output.removed else ""
    return f"{made} below {output.directory}{removed}"


def _checks(closing: Closing, setting: ClosingSetting, output: ClosingFiles) -> Iterator[Text]:
    """Yield the commands that run the written cases and check the written certificates."""
    new = f" {shown_path(str(output.directory))}" if output.cases else ""
    suite = f"{setting.files}{new}{setting.drawing}"
    if suite:
        test = (
            f"scbm test {shown_path(setting.file)}{suite}{setting.planner}{_status_options(closing, setting, output)}"
        )
        yield command_text("  ", test, "runs all cases")
    if setting.drawing:
        into = shown_path(str(output.directory / "cases"))
        save = f"scbm test {shown_path(setting.file)}{setting.drawing} --save {into}"
        yield command_text("  ", save, f"adds the random cases before to {output.directory}")
    if output.certificates:
        files = list(output.certificates.values())
        path = files[0] if len(files) == 1 else files[0].parent
        yield command_text("  ", f"scbm close --check {shown_path(str(path))}", "checks the proofs")


def _status_options(closing: Closing, setting: ClosingSetting, output: ClosingFiles) -> str:
    """Return the options for proofs, waivers and the figure that was reached, each with a leading blank."""
    figure, coverable = closing.after.figure, closing.coverable
    certificates = f" --certificates {shown_path(str(output.directory))}" if output.certificates else ""
    if coverable.of and (certificates or coverable.of < figure.of):
        return f"{certificates}{setting.waivers} --fail-under coverable={_reached(coverable)}"
    return f"{setting.waivers} --fail-under {_reached(figure)}" if figure.of else ""


def _reached(figure: Figure) -> str:
    """Return the percentage of a figure, rounded down so that the same cases reach it."""
    return f"{floor(10_000 * figure.visited / figure.of) / 100:g}"


# words


def _head(words: str, style: str = "bold") -> Iterator[Text]:
    yield Text()
    yield Text(words, style=style)


def _wrapped(words: str, indent: int, columns: int, style: str = "dim") -> Iterator[Text]:
    """Yield the words in lines of limited width; names are never broken."""
    yield from (Text(line, style=style) for line in wrapped(words, columns, " " * indent, indent + 2))
