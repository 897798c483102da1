"""Reports of failures for the terminal: those of one run, and the findings of a campaign.

A failed run has its reasons, and the parts of its log that show them. A finding has its reason, its smallest case, the
choices that the failure depends on, and the command that reproduces it.
"""

from __future__ import annotations

from itertools import islice, zip_longest
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.model import format_duration
from scbm.model.visible_text import counted
from scbm.reports.figure_table import command_text
from scbm.reports.run.event_lines import story_lines
from scbm.reports.terminal.timeline import TIME_WIDTH, draw_line
from scbm.testing.verdicts import violation_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.reports.run.event_lines import EventLine
    from scbm.testing import Campaign, Execution, Failure, Finding, Shrunk


_FEWEST_LINES = 12
"""Minimum number of log lines that are shown for a failure, if the log has so many."""

_MAX_LINES = 40
"""Maximum number of log lines for a failure; of a longer part, the last lines are shown."""


def failure_lines(model: BehaviorModel, execution: Execution) -> Iterator[Text]:
    """Yield the reasons why a run failed, then the parts of its log that show them."""
    failures = execution.verdict.failures
    for failure in failures:
        yield Text(str(failure), style="red")
    yield from lines_that_show(model, execution, failures)


def lines_that_show(model: BehaviorModel, execution: Execution, failures: Sequence[Failure]) -> Iterator[Text]:
    """Yield the parts of a run's log that show some of its failures, and a few lines before each part."""
    lines = list(story_lines(model, execution))
    windows = sorted(_window(lines, _extent(execution, failure)) for failure in failures)
    shown = 0
    for first, end in windows:
        if first > shown:
            yield Text("…".rjust(TIME_WIDTH + 3), style="dim")
        begin = max(first, shown)
        for number in range(begin, end):
            yield draw_line(lines[number], with_time=number == begin > shown)
        shown = max(shown, end)


def _window(lines: Sequence[EventLine], extent: tuple[int, int]) -> tuple[int, int]:
    """Return the first line of the log that shows the records of an extent, or some lines before it, and the end."""
    begin, end = extent
    count = sum(line.index < end for line in lines)
    own = sum(begin <= line.index < end for line in lines)
    return max(0, count - min(max(_FEWEST_LINES, own), _MAX_LINES)), count


def _extent(execution: Execution, failure: Failure) -> tuple[int, int]:
    """Return the range of records that shows a failure: that of the violation, else the end of the run.

    If the violation is in a turn that the story leaves out, the range ends with the last turn, where turns are counted.
    """
    violation = violation_of(failure, execution.violations)
    if violation is not None:
        found = execution.repetition
        is_counted = found is not None and found.hides(violation.record)
        return violation.begins, found.end if found is not None and is_counted else violation.record + 1
    return len(execution.trace.records), len(execution.trace.records)


_MAX_NAMED = 3
"""Maximum number of cases of a finding that are named; the others are counted."""

_MAX_FINDINGS = 10


def finding_lines(campaign: Campaign, findings: Sequence[Finding], commands: Sequence[str]) -> Iterator[Text]:
    """Yield the findings of a campaign, each with its command to reproduce it; nothing if all cases passed."""
    if not findings:
        return
    yield Text()
    yield Text(f"Failed: {counted(campaign.failed_count, 'case')}", style="bold red")
    shown: dict[str, None] = {}
    for finding, command in islice(zip_longest(findings, commands), _MAX_FINDINGS):
        yield from _finding_lines(finding, campaign.model, command, shown)
    if len(findings) > _MAX_FINDINGS:
        yield Text(f"  and {counted(len(findings) - _MAX_FINDINGS, 'more finding', 'more findings')}")


def unused_lines(campaign: Campaign) -> Iterator[Text]:
    """Yield the clauses of cases that had no effect; nothing if there are none."""
    summary = campaign.summary
    if not summary.unused_count:
        return
    yield Text()
    yield Text("Without effect", style="bold yellow")
    for position, sentence in summary.unused:
        yield Text(f"  {campaign.source.name(position)}: {sentence}")
    if summary.unused_count > len(summary.unused):
        yield Text(f"  and {summary.unused_count - len(summary.unused)} more")


def _finding_lines(
    finding: Finding, model: BehaviorModel, command: str | None, shown: dict[str, None]
) -> Iterator[Text]:
    yield Text(f"  {_names(finding)}")
    for failure in finding.failures:
        yield Text(f"    {failure}", style="red")
    if finding.shrunk is not None:
        name = finding.shrunk.execution.case.name
        yield from shrunk_lines(finding.shrunk, model, is_known=name in shown)
        shown[name] = None
    if command:
        yield command_text("    again: ", command)


def _names(finding: Finding) -> str:
    more = f" and {counted(finding.count - _MAX_NAMED, 'more case')}" if finding.count > _MAX_NAMED else ""
    return f"{', '.join(finding.names[:_MAX_NAMED])}{more}"


def shrunk_lines(shrunk: Shrunk, model: BehaviorModel, *, is_known: bool = False) -> Iterator[Text]:
    """Yield a small case: its size, its time limit, the log that shows the failure, and the choices that matter.

    Of a case that is shown above, only the name and the log of another violation are shown.
    """
    case = shrunk.execution.case
    excerpt = [Text("    ").append_text(line) for line in lines_that_show(model, shrunk.execution, [shrunk.failure])]
    if is_known:
        yield Text("    smallest: the same case as above, ").append(case.name, style="bold")
        yield from excerpt if violation_of(shrunk.failure, shrunk.execution.violations) is not None else ()
        return
    yield Text("    smallest: ").append(_sizes(shrunk), style="bold")
    if case.limits.time_ns is not None:
        yield Text(f"      within {format_duration(case.limits.time_ns)}", style="dim")
    yield from excerpt
    for note in shrunk.execution.notes:
        yield Text(f"    note: {note}")
    for choice in shrunk.matters:
        yield Text("    it matters: ").append(str(choice))
    if not shrunk.matters:
        alone = "no choice alone" if shrunk.after.choices else "nothing but the goal"
        yield Text(f"    it matters: {alone}")


def _sizes(shrunk: Shrunk) -> str:
    """Return the size of the small case and that of the original case in words."""
    after, before = shrunk.after, shrunk.before
    size = f"{counted(after.operations, 'operation')}, {counted(after.choices, 'choice')}"
    return f"{size}; it had {before.operations} and {before.choices} ({counted(shrunk.runs, 'run')})"
