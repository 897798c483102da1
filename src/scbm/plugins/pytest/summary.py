"""The summary of a session: the coverability report of each model, and missed thresholds.

`--scbm-store`: what a session ran, added to a coverage store.
"""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from scbm.files import read_file
from scbm.model import InputError
from scbm.model.visible_text import counted, in_one_line
from scbm.plugins.pytest.session_models import ModelResults
from scbm.plugins.pytest.session_statuses import shortfalls, statuses_of, thresholds_of, words_of
from scbm.reports import coverage_report
from scbm.reports.terminal.store_report import clock_warning, in_all, since_last_run, united_lines
from scbm.reports.terminal.visible_lines import visible_line
from scbm.store import Recipe, begin_run, drawn_recipe, sayable, write_store, written_recipe
from scbm.testing import CampaignResult
from scbm.testing.suite import Suite

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import pytest

    from scbm.cases.coverage import Statuses
    from scbm.plugins.pytest.session_models import SessionModels, SessionPart, TestResult


def keep(config: pytest.Config, parts: Sequence[SessionPart], file: str) -> tuple[list[str], bool]:
    """Add all cases of the session to a store; return the messages, and whether it succeeded."""
    if not parts:
        return [f"{file}: no case was run, so nothing was added."], True
    if len(parts) > 1:
        names = ", ".join(part.file for part in parts)
        return [f"FAIL {file}: a coverage store is of one model, and cases of {len(parts)} were run: {names}."], False
    (part,) = parts
    try:
        return _kept(config, part, file), True
    except InputError as error:
        return [f"FAIL {line}" for diagnostic in error.diagnostics for line in str(diagnostic).splitlines()], False


def _kept(config: pytest.Config, part: SessionPart, file: str) -> list[str]:
    command = ["pytest", *config.invocation_params.args]
    run = begin_run(command, part.file, read_file(part.path), waivers=part.campaign.model.waivers)
    coverage = part.campaign.coverage
    with write_store(config.invocation_params.dir / file, part.campaign.model, run) as writer:
        for position, entry in enumerate(part.entries, start=1):
            writer.add(position, _recipe(part, entry), entry.result)
        later = writer.later_start
        clock = [] if later is None else [clock_warning(later, file).plain]
        totals = writer.totals()
        united = [line.plain for line in united_lines(totals.lifted)]
        since = since_last_run(coverage.obligations, writer.before, coverage.visited, is_united=bool(united))
        return [since.plain, in_all(totals.cases, totals.figure, file).plain, *united, *clock]


def _recipe(part: SessionPart, entry: TestResult) -> Recipe:
    case = entry.result.case
    if entry.group is ModelResults.RANDOM:
        return drawn_recipe(case, "")
    return written_recipe(case, part.campaign.model, sayable(str(Path(entry.test.partition("::")[0]))))


_PLURALS = {ModelResults.FILE: "case files", ModelResults.TEST: "cases of tests", ModelResults.RANDOM: "random cases"}


def summarize(models: SessionModels, terminal: pytest.TerminalReporter, *, judged: bool) -> None:
    """Write the report, and whether the thresholds are met."""
    parts = list(models.results.parts())
    style = _style(models.config, parts)
    if parts and style != "none":
        terminal.write_sep("=", "coverability")
        for number, part in enumerate(parts):
            statuses = statuses_of(models.config).of(part)
            for text in _full(part, statuses, is_first=not number) if style == "full" else _short(part, statuses):
                terminal.write_line(_rendered(visible_line(text), coloured=terminal.hasmarkup))
    recordings = list(models.results.recordings())
    if recordings:
        terminal.write_sep("=", "recorded results")
        for line in recordings:
            terminal.write_line(in_one_line(line))
    if judged:
        found = find_shortfalls(models)
        reached = [f"Required coverability of {words_of(each)} reached." for each in thresholds_of(models.config)]
        for line in found or reached:
            terminal.write_line(line, bold=True, red=bool(found), green=not found)


def _style(config: pytest.Config, parts: list[SessionPart]) -> str:
    asked: str | None = config.getoption("--scbm-report")
    is_brief = len(parts) > 1 or config.get_verbosity() < 0
    return asked or ("short" if is_brief else "full")


def _full(part: SessionPart, statuses: Statuses | None, *, is_first: bool) -> Iterator[Text]:
    if not is_first:
        yield Text()
    groups = tuple(counted(count, group.value, _PLURALS[group]) for group, count in part.groups.items())
    suite = Suite(part.campaign.model, Path(part.file))
    yield from coverage_report(CampaignResult(part.campaign, suite, decided=statuses, groups=groups))


def _short(part: SessionPart, statuses: Statuses | None) -> Iterator[Text]:
    """Return the figure and its parts on one line."""
    figure, campaign = part.campaign.coverage.figure, part.campaign
    line = Text(f"{part.file}: SCBM-IAS ").append(str(figure), style="bold")
    line.append(f", {figure.visited} of {counted(figure.of, 'obligation')}")
    if statuses is not None:
        line.append(f", {statuses.coverable} of what can be covered")
    line.append(f", {counted(campaign.count, 'case')}")
    yield line.append(f", {campaign.failed_count} failed", style="red") if campaign.failed_count else line


def _rendered(text: Text, *, coloured: bool) -> str:
    """Return one line for a terminal, however long it is."""
    if not coloured:
        return text.plain
    stream = StringIO()
    console = Console(file=stream, force_terminal=True, color_system="standard", legacy_windows=False)
    console.print(text, soft_wrap=True, highlight=False, markup=False, end="")
    return stream.getvalue()


def find_shortfalls(models: SessionModels) -> list[str]:
    """Return a sentence for each model and each threshold that it misses."""
    wanted, parts = thresholds_of(models.config), list(models.results.parts())
    if not parts:
        listed = ", ".join(map(words_of, wanted))
        return [f"FAIL Required coverability of {listed} not reached: no case was run."]
    statuses = statuses_of(models.config)
    return [line for part in parts for each in wanted for line in shortfalls(part, each, statuses.of(part))]
