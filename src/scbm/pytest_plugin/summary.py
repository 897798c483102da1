"""What a session says at its end: the coverability report of each model, and which of them fall short."""

from __future__ import annotations

from io import StringIO
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from scbm.coverage import Threshold
from scbm.pytest_plugin.ledger import Group
from scbm.reports import Setting, counted, coverage_report

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pytest

    from scbm.pytest_plugin.bench import Bench
    from scbm.pytest_plugin.ledger import Part

_PLURALS = {Group.FILE: "case files", Group.TEST: "cases of tests", Group.RANDOM: "random cases"}


def summarize(bench: Bench, terminal: pytest.TerminalReporter, *, judged: bool) -> None:
    """Writes the report, and whether the coverage is good enough."""
    parts = list(bench.ledger.parts())
    style = _style(bench.config, parts)
    if parts and style != "none":
        terminal.write_sep("=", "coverability")
        for number, part in enumerate(parts):
            for text in _full(part, is_first=not number) if style == "full" else _short(part):
                terminal.write_line(_rendered(text, coloured=terminal.hasmarkup))
    if judged:
        wanted = _wanted(bench.config)
        shortfalls = find_shortfalls(bench)
        for line in shortfalls or [f"Required coverability of {wanted:g} % reached."]:
            terminal.write_line(line, bold=True, red=bool(shortfalls), green=not shortfalls)


def _style(config: pytest.Config, parts: list[Part]) -> str:
    asked: str | None = config.getoption("--scbm-report")
    is_brief = len(parts) > 1 or config.get_verbosity() < 0
    return asked or ("short" if is_brief else "full")


def _full(part: Part, *, is_first: bool) -> Iterator[Text]:
    if not is_first:
        yield Text()
    groups = tuple(counted(count, group.value, _PLURALS[group]) for group, count in part.groups.items())
    yield from coverage_report(part.campaign, Setting(part.file, groups=groups))


def _short(part: Part) -> Iterator[Text]:
    """The figure, and what it is made of, on one line."""
    figure, campaign = part.campaign.coverage.figure, part.campaign
    line = Text(f"{part.file}: SCBM-IAS ").append(str(figure), style="bold")
    line.append(f", {figure.visited} of {counted(figure.of, 'obligation')}, {counted(len(campaign.results), 'case')}")
    yield line.append(f", {len(campaign.failed)} failed", style="red") if campaign.failed else line


def _rendered(text: Text, *, coloured: bool) -> str:
    """One line for a terminal, however long it is."""
    if not coloured:
        return text.plain
    stream = StringIO()
    console = Console(file=stream, force_terminal=True, color_system="standard", legacy_windows=False)
    console.print(text, soft_wrap=True, highlight=False, markup=False, end="")
    return stream.getvalue()


def find_shortfalls(bench: Bench) -> list[str]:
    """Why the coverage is not good enough, a sentence for each model; none if it is."""
    wanted = _wanted(bench.config)
    parts = list(bench.ledger.parts())
    if not parts:
        return [f"FAIL Required coverability of {wanted:g} % not reached: no case was run."]
    return [sentence for part in parts for sentence in _shortfall(part, wanted)]


def _shortfall(part: Part, wanted: float) -> Iterator[str]:
    figure = part.campaign.coverage.figure
    failed = f"FAIL Required coverability of {wanted:g} % not reached: {part.file}"
    if figure.percent is None:
        yield f"{failed} has no obligations, so it is not measurable."
    elif not Threshold(wanted).is_met(part.campaign.coverage):
        yield f"{failed} is at {figure}."


def _wanted(config: pytest.Config) -> float:
    percent: float = config.getoption("--scbm-fail-under")
    return percent
