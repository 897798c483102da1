"""The report of `scbm close` for the terminal: figures, new cases, uncoverable obligations, suggestions, commands."""

from __future__ import annotations

from math import floor
from textwrap import wrap
from typing import TYPE_CHECKING, NamedTuple, assert_never

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
    engine_counts_in_words,
    forced_count_in_words,
    status_counts_in_words,
)
from scbm.closing import Decision
from scbm.closing.advice.suggestions import grouped
from scbm.closing.decisions import RequirementStatus, SuggestionKind
from scbm.closing.summaries import aspects_in_words, in_few_words, reason_about_it
from scbm.model import format_moment
from scbm.model.requirements import BUILT_IN_NAMES
from scbm.model.visible_text import counted, shown_path
from scbm.reports.figure_table import DEFAULT_COLUMNS, command_text, wrapped
from scbm.reports.status_lines import lifted_lines, waiver_warnings
from scbm.reports.terminal.failure_report import finding_lines
from scbm.testing.decided_requirements import words_of_undeclared

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases.coverage import Figure
    from scbm.closing import Closing, ClosingCase, Decided
    from scbm.closing.closing_files import ClosingFiles
    from scbm.closing.closing_result import ClosingResult
    from scbm.closing.decisions import DecidedRequirement, RequirementDecisions, StageEnd

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


def closing_report(result: ClosingResult, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield the lines of the report."""
    closing, failed = result.closing, result.with_new_cases
    yield Text("Closing report: ", style="bold").append(closing.model.name)
    yield Text()
    yield from _figures(result, columns)
    yield from finding_lines(failed.campaign, failed.findings, failed.commands)
    yield from _cases(closing, columns)
    yield from _found(result)
    yield from _consequences(result, columns)
    yield from _decisions("Proved uncoverable", closing, Decision.UNCOVERABLE, columns)
    yield from _assumed(closing, columns)
    yield from _decisions("Excluded by the planner", closing, Decision.EXCLUDED, columns)
    yield from _decisions("Waived", closing, Decision.WAIVED, columns)
    yield from _decisions("Undecided", closing, Decision.UNDECIDED, columns)
    yield from _requirements(closing, columns)
    yield from ended_lines(closing.ended)
    yield from _suggestions(result, columns)
    yield from _commands(result)


# the figures


def _figures(result: ClosingResult, columns: int) -> Iterator[Text]:
    closing = result.closing
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
    line.append_text(_bar(parts, max(_MIN_BAR_WIDTH, min(_BAR_WIDTH, columns - line.cell_len))))
    line.rstrip()
    yield line
    if legend:
        yield Text(f"{indentation}{legend}", style="dim")
    yield from lifted_lines(LiftedStatuses.of(closing.model, _statuses(closing)), columns)
    yield from _decision_counts(closing, counts)
    for sentence in waiver_warnings(closing.visited_waivers, closing.expired_waivers):
        yield from (Text(part, style="yellow") for part in wrapped(sentence, columns, "  ", 6))
    yield Text(f"  Before:   {result.suite.words or 'no cases'}")
    for name, goal in result.written.items():
        yield Text(f"  Written:  goal {name}: {goal}, into {result.suite.file}", style="green")
    for name, goal in result.already.items():
        yield Text(f"  Written:  goal {name}: {goal} is in {result.suite.file} already")


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
    if closing.engines:
        yield Text(f"  Proofs:   {engine_counts_in_words(closing.engines)}")
    if closing.forced:
        yield Text(f"  Forced:   {forced_count_in_words(closing.forced)}")
    queued = closing.after.figure_of(Aspect.QUEUED)
    others = [each.decision for each in closing.decided if not each.obligation.counts]
    never = [(count, status) for status, count in count_statuses(others).items() if not status.can_be_covered]
    more = "".join(f", {count} {status.words}" for count, status in never if count)
    if queued.of:
        yield Text(f"  Queued:   {queued.visited} of {queued.of} in a plan{more}").append("  (not in SCBM-IAS)", "dim")


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


def _consequences(result: ClosingResult, columns: int) -> Iterator[Text]:
    """Yield what is wrong in forced states: it does not fail the command."""
    consequences, name = result.consequences, result.closing.model.name
    if not consequences:
        return
    yield from _head("Consequences of forced states", "yellow")
    for each in consequences:
        yield from _wrapped(f"{each.name}: {each.message}", 2, columns, "yellow")
        yield from _wrapped(f"its state is {each.forcing}, so {name} is not at fault", 6, columns)
        yield command_text("    again: ", each.again)


def _found(result: ClosingResult) -> Iterator[Text]:
    found = result.found
    if not found:
        return
    yield from _head("Failures found by the search", "bold red")
    for fault in found:
        yield Text(f"  {fault.case} {fault.message}", style="red")
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
    RequirementStatus.HOLDS_CANONICAL: "",
    RequirementStatus.HOLDS_PLANNER: "",
    RequirementStatus.CASES_ONLY: "yellow",
    RequirementStatus.VIOLATED: "red",
    RequirementStatus.UNDECIDED: "bold red",
    RequirementStatus.OFF: "dim",
}


def _requirements(closing: Closing, columns: int) -> Iterator[Text]:
    found = closing.requirements
    if found is None:
        return
    yield from _head("Requirements" if len(found.decided) > len(BUILT_IN_NAMES) else "Built-in requirements")
    width = max(len(each.name) for each in found.decided)
    for each in found.decided:
        words = f"{each.asked}: {status_words(each)}" if each.asked else status_words(each)
        lines = wrap(words, columns - width - 4, break_long_words=False, break_on_hyphens=False)
        for number, line in enumerate(lines):
            yield Text(f"  {'' if number else each.name:<{width}}  {line}", style=_STATUS_STYLES[each.status])
        if each.option is not None:
            yield Text(f"  {'':<{width}}  {each.option} raises this limit", style="dim")
    if found.left_to_cases:
        noun = counted(found.left_to_cases, "requirement")
        yield from _wrapped(f"{noun} judged by cases alone: the exit code does not depend on it", 2, columns, "")
    for reason, names in found.not_decided_with_other_plans.items():
        words = f"Not decided with other plans: {', '.join(names)}, as {reason}"
        yield from _wrapped(words, 2, columns, "")
    if found.assumptions:
        followed = f"{counted(found.situations, 'situation')} of runs were followed"
        yield from _wrapped(f"{followed}. Answers `holds` {_certified(found)}assume:", 2, columns, "")
    for sentence in found.assumptions:
        for line in wrap(sentence, columns - 6):
            yield Text(f"      {line}", style="dim")


def _certified(found: RequirementDecisions) -> str:
    """Return which answers that hold have no certificate, as the beginning of a sentence about all of them."""
    without = [each.name for each in found.decided if each.holds and each.certificate is None]
    if len(without) == sum(each.holds for each in found.decided):
        return "have no certificate, and "
    return f"have certificates, but for {', '.join(without)}; they " if without else "have certificates, and "


def status_words(decided: DecidedRequirement) -> str:
    """Return a decision in words."""
    where = f"{decided.reason}{words_of_undeclared(decided.undeclared)}"
    others = "" if decided.other_plans is None else decided.other_plans.words
    match decided.status:
        case RequirementStatus.HOLDS:
            return f"holds {where}"
        case RequirementStatus.HOLDS_CANONICAL:
            return f"holds under canonical plans {where}{others}"
        case RequirementStatus.HOLDS_PLANNER:
            return f"holds under the plans of this planner {where}{others}"
        case RequirementStatus.CASES_ONLY:
            return f"judged by cases: {decided.reason}"
        case RequirementStatus.VIOLATED:
            return f"violated by {decided.case}"
        case RequirementStatus.UNDECIDED | RequirementStatus.OFF:
            return f"{decided.status.value}: {decided.reason}{others}"
        case _:
            assert_never(decided.status)


# suggestions


def _suggestions(result: ClosingResult, columns: int) -> Iterator[Text]:
    closing = result.closing
    suggestions, folds = closing.suggestions, InstanceFolds.of(closing.model)
    if not suggestions:
        return
    yield from _head("Suggested changes")
    specific = (SuggestionKind.GOAL, SuggestionKind.PLANS)  # their plans say which instances
    lifted = (
        each if each.kind in specific else replace(each, text=folds.in_entries(each.text)) for each in suggestions
    )
    for suggestion in grouped(lifted):
        for words in in_few_words(suggestion.obligations, folds):
            yield from _wrapped(words, 2, columns, "")
        for clause in suggestion.text.split("; "):
            yield from _wrapped(clause, 6, columns)
        if suggestion.name is not None:
            yield command_text("      ", f"{result.close_command} --write {suggestion.name}")
    if sum(suggestion.name is not None for suggestion in suggestions) > 1:
        yield Text("  all of these goals")
        yield command_text("      ", f"{result.close_command} --write all")


# commands


def _commands(result: ClosingResult) -> Iterator[Text]:
    closing, output = result.closing, result.output
    cases = (*closing.cases, *closing.counterexamples, *closing.cases_with_other_plans)
    if output is None and (cases or closing.certificates):
        yield from _head("Save the result")
        made = [counted(len(cases), "case")] if cases else []
        made += [counted(len(closing.certificates), "certificate")] if closing.certificates else []
        yield command_text("  ", f"{result.close_command} --out closed", f"writes {' and '.join(made)}")
    elif output is not None:
        yield from _head(f"Written: {_written(output)}")
        yield from _checks(result, output)


def _written(output: ClosingFiles) -> str:
    cases = len(output.cases) + len(output.other_plans)
    parts = [(cases, "case"), (len(output.certificates), "certificate")]
    made = " and ".join(counted(count, noun) for count, noun in parts if count) or "nothing"
    removed = f"; {counted(len(output.removed), 'file')} of an earlier closing removed" if output.removed else ""
    return f"{made} below {output.directory}{removed}"


def _checks(result: ClosingResult, output: ClosingFiles) -> Iterator[Text]:
    """Yield the commands that run the written cases and check the written certificates."""
    new = f" {shown_path(str(output.suite))}" if output.cases else ""
    suite = result.suite
    test, cases = f"scbm test {shown_path(str(suite.file))}", f"{suite.arguments}{new}{suite.drawing}"
    if cases:
        yield command_text(
            "  ", f"{test}{cases}{suite.planner_option}{_status_options(result, output)}", "runs all cases"
        )
    if suite.drawing:
        save = f"{test}{suite.drawing} --save {shown_path(str(output.directory / 'cases'))}"
        yield command_text("  ", save, f"adds the random cases before to {output.directory}")
    if output.other_plans:
        others = shown_path(str(next(iter(output.other_plans.values())).parent))
        yield command_text("  ", f"{test} {others}", "shows what other plans violate")
    if output.certificates:
        files = list(output.certificates.values())
        path = files[0] if len(files) == 1 else files[0].parent
        yield command_text("  ", f"scbm close --check {shown_path(str(path))}", "checks the proofs")


def _status_options(result: ClosingResult, output: ClosingFiles) -> str:
    """Return the options for proofs, waivers and the figure that was reached, each with a leading blank."""
    figure, coverable = result.closing.after.figure, result.closing.coverable
    certificates = f" --certificates {shown_path(str(output.directory))}" if output.certificates else ""
    if coverable.of and (certificates or coverable.of < figure.of):
        return f"{certificates}{result.waived} --fail-under coverable={_reached(coverable)}"
    return f"{result.waived} --fail-under {_reached(figure)}" if figure.of else ""


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
