"""What failed, for people: the reason, the smallest case that shows it, what matters in it, and how to see it again."""

from __future__ import annotations

from itertools import islice, zip_longest
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.model import format_duration
from scbm.reports.figure_table import command_text, counted
from scbm.reports.terminal.failure_report import lines_that_show

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.testing import Campaign, Finding, Shrunk

_MAX_NAMED = 3
"""So many cases of one finding are named; the rest is counted."""

_MAX_FINDINGS = 10
_MAX_UNUSED = 10


def told_findings(campaign: Campaign, findings: Sequence[Finding], commands: Sequence[str]) -> Iterator[Text]:
    """All findings of a campaign, each with the command that shows it again; nothing if nothing failed."""
    if not findings:
        return
    yield Text()
    yield Text(f"Failed: {counted(len(campaign.failed), 'case')}", style="bold red")
    for finding, command in islice(zip_longest(findings, commands), _MAX_FINDINGS):
        yield from _finding_lines(finding, campaign.model, command)
    if len(findings) > _MAX_FINDINGS:
        yield Text(f"  and {counted(len(findings) - _MAX_FINDINGS, 'more finding', 'more findings')}")


def told_unused(campaign: Campaign) -> Iterator[Text]:
    """What cases say and nothing came of; nothing if there is none."""
    unused = [(result.case.name, sentence) for result in campaign.results for sentence in result.unused]
    if not unused:
        return
    yield Text()
    yield Text("Without effect", style="bold yellow")
    for name, sentence in unused[:_MAX_UNUSED]:
        yield Text(f"  {name}: {sentence}")
    if len(unused) > _MAX_UNUSED:
        yield Text(f"  and {len(unused) - _MAX_UNUSED} more")


def _finding_lines(finding: Finding, model: BehaviorModel, command: str | None) -> Iterator[Text]:
    yield Text(f"  {_names(finding)}")
    for failure in finding.failures:
        yield Text(f"    {failure}", style="red")
    if finding.shrunk is not None:
        yield from told_shrunk(finding.shrunk, model)
    if command:
        yield command_text("    again: ", command)


def _names(finding: Finding) -> str:
    names = [result.case.name for result in finding.results]
    more = f" and {counted(len(names) - _MAX_NAMED, 'more case')}" if len(names) > _MAX_NAMED else ""
    return f"{', '.join(names[:_MAX_NAMED])}{more}"


def told_shrunk(shrunk: Shrunk, model: BehaviorModel) -> Iterator[Text]:
    """A small case: its size, where it begins, what shows the failure, and what matters."""
    case = shrunk.execution.case
    yield Text("    smallest: ").append(_sizes(shrunk), style="bold")
    if case.limits.time_ns is not None:
        yield Text(f"      within {format_duration(case.limits.time_ns)}", style="dim")
    for line in lines_that_show(model, shrunk.execution, [shrunk.failure]):
        yield Text("    ").append_text(line)
    for choice in shrunk.matters:
        yield Text("    it matters: ").append(str(choice))
    if not shrunk.matters:
        alone = "no choice alone" if shrunk.after.choices else "nothing but the goal"
        yield Text(f"    it matters: {alone}")


def _sizes(shrunk: Shrunk) -> str:
    """How large the case is, and how large it was."""
    after, before = shrunk.after, shrunk.before
    told = f"{counted(after.operations, 'operation')}, {counted(after.choices, 'choice')}"
    return f"{told}; it had {before.operations} and {before.choices} ({counted(shrunk.runs, 'run')})"
