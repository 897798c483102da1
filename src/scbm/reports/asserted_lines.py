"""The lines of reports about asserted obligations (decision 52)."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import Aspect, Assertion
from scbm.reports.figure_table import DEFAULT_COLUMNS, command_text, wrapped

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases.coverage import AssertedObligations, AssertionEvidence

MAX_LISTED = 40
"""Maximum number of operations and automatic transitions that the terminal lists; the page and the JSON have all."""

_INDENT = 12
_ASPECTS_INDENT = 4


def asserted_words(found: AssertedObligations) -> str:
    """Return how many visited obligations have each answer."""
    asserted, nothing, unknown = (len(found.with_answer(answer)) for answer in Assertion)
    return f"{asserted} asserted, {nothing} with nothing asserted, {unknown} unknown of {len(found.entries)} visited"


def asserted_line(evidence: AssertionEvidence, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield the figure of asserted obligations, or why it is not known.

    Args:
        evidence: what a store says.
        columns: the width of the report.
    """
    if evidence.found is None:
        yield from map(Text, wrapped(f"not known: {evidence.why_none}", columns, "  Asserted: ", _INDENT))
        return
    first, *others = wrapped(f"{evidence.figure}; {asserted_words(evidence.found)}", columns, "  Asserted: ", _INDENT)
    yield Text(first)
    yield from map(Text, others)


def unasserted_lines(evidence: AssertionEvidence, columns: int = DEFAULT_COLUMNS, command: str = "") -> Iterator[Text]:
    """Yield the obligations that cases visit and nothing asserts; nothing if there are none.

    Args:
        evidence: what a store says.
        columns: the width of the report.
        command: the command that shows the changes which no case notices, or makes results for these cases; empty if
            there is no single one.
    """
    if evidence.found is None:
        if command and evidence.has_results:
            yield Text()
            yield command_text("  ", command, "finds what these cases assert")
        return
    entries = evidence.found.with_answer(Assertion.NOTHING_ASSERTED)
    if not entries:
        return
    yield Text()
    yield Text(f"Visited, but nothing asserted: {len(entries)}", style="bold")
    rows: dict[str, list[str]] = {}
    for entry in entries:
        is_taken = entry.obligation.aspect is Aspect.TAKEN
        name = f"{'at' if is_taken else 'op'}: {entry.obligation.subject}"
        rows.setdefault(name, []).append(entry.obligation.aspect.value)
    width = max(map(len, rows))
    for name, aspects in islice(rows.items(), MAX_LISTED):
        words = ", ".join(aspects)
        if 2 + width + 2 + len(words) <= columns:
            yield Text(f"  {name:<{width}}  {words}", no_wrap=True)
        else:
            yield Text(f"  {name}", no_wrap=True)
            yield from map(Text, wrapped(words, columns, " " * (2 + _ASPECTS_INDENT), 2 + _ASPECTS_INDENT))
    if len(rows) > MAX_LISTED:
        yield Text(f"  and {len(rows) - MAX_LISTED} more: `--json` and the page of `scbm report --html` have all")
    if command:
        yield command_text("  ", command, "shows the changes that no case notices")
