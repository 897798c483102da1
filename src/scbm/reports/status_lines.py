"""The lines of reports about the statuses of obligations, and about what cases assert (decision 52)."""

from __future__ import annotations

from itertools import chain, islice
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import (
    Aspect,
    Assertion,
    engine_counts_in_words,
    forced_count_in_words,
    status_counts_in_words,
)
from scbm.model.visible_text import counted
from scbm.reports.figure_table import DEFAULT_COLUMNS, command_text, headline, wrapped

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.cases.coverage import AssertedObligations, AssertionEvidence, LiftedStatuses, Statuses
    from scbm.model import Waiver
    from scbm.store import History
    from scbm.testing import CampaignResult


_MAX_LISTS = 3
_MAX_WAIVED = 3
_MAX_OBJECTS = 6


def figure_lines(result: CampaignResult | History, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield the figures of all obligations: of the paper, of lifted ones, of statuses, and of forced states."""
    yield headline(result.coverage.figure, columns)
    yield from lifted_lines(result.lifted, columns)
    if result.decided is not None:
        yield from status_lines(result.decided, columns)
    if result.statuses.forced:
        yield Text(f"  Forced: {forced_count_in_words(result.statuses.forced)}")


def lifted_lines(lifted: LiftedStatuses | None, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield the figure of lifted obligations, and the objects that it comes from; nothing for `None`."""
    if lifted is None:
        return
    figure = lifted.figure
    line = Text("  Lifted: ").append(str(figure), style="bold")
    yield line.append(f", {figure.visited} of {figure.of}: an operation with parameters counts once")
    if lifted.others:
        yield from (Text(part, style="dim") for part in wrapped(united_in_words(lifted), columns, "    ", 6))


def united_in_words(lifted: LiftedStatuses) -> str:
    """Return from which objects a lifted figure comes, one sentence; empty if it comes from one model alone."""
    if not lifted.others:
        return ""
    own = {} if lifted.objects is None else dict(lifted.objects.types)
    others = [dict(each.objects.types) for each in lifted.others]
    different = [
        name
        for name in dict.fromkeys((*own, *chain(*others)))
        if any(own.get(name) != each.get(name) for each in others)
    ]
    alone = lifted.alone.figure
    named = [
        f"{counted(each.cases, 'case')} for {_objects(types, different) if types != own else 'other tables'}"
        for each, types in zip(lifted.others[:_MAX_LISTS], others, strict=False)
    ]
    more = len(others) - _MAX_LISTS
    named += [f"those for {counted(more, 'other list')} of objects"] if more > 0 else []
    here = _objects(own, different) or "these tables"
    return f"for {here} alone {alone}, {alone.visited} of {alone.of}; united with {' and '.join(named)}"


def _objects(types: Mapping[str, tuple[str, ...]], names: Sequence[str]) -> str:
    """Return the objects of some types, as model files list them."""
    return ", ".join(f"{name}: {_listed(types.get(name, ()))}" for name in names)


def _listed(objects: tuple[str, ...]) -> str:
    shown = [*objects[:_MAX_OBJECTS], *(["…"] if len(objects) > _MAX_OBJECTS else [])]
    return f"[{', '.join(shown)}]"


def status_lines(statuses: Statuses, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield the figure of what can be covered, the number of obligations of each status, and what does not count."""
    figure = statuses.coverable
    line = Text("  Of what can be covered: ").append(str(figure), style="bold")
    yield line.append(f", {figure.visited} of {figure.of}")
    words = status_counts_in_words(statuses.counts)
    yield from map(Text, wrapped(words, columns, "  Statuses: ", 12))
    if statuses.engines:
        yield from map(Text, wrapped(engine_counts_in_words(statuses.engines), columns, "  Proofs: ", 12))
    if statuses.assumptions:
        yield from (
            Text(part, style="dim") for part in wrapped(" ".join(statuses.assumptions), columns, "  Assumed: ", 12)
        )
    for sentence in status_warnings(statuses):
        yield from (Text(part, style="yellow") for part in wrapped(sentence, columns, "  ", 6))


def status_warnings(statuses: Statuses) -> Iterator[str]:
    """Yield a sentence for each waiver and certificate that does not do what its author meant, and what proofs omit."""
    for name, proof in statuses.contradicted:
        yield f"Proved never to happen, but a case visits it: {name}; {proof.certificate} is not true of these runs"
    yield from statuses.outside
    yield from waiver_warnings(statuses.visited_waivers, statuses.expired_waivers)
    yield from (f"Certificate that does not count: {sentence}" for sentence in statuses.ignored)


def waiver_warnings(visited: Iterable[Waiver], expired: Iterable[Waiver]) -> Iterator[str]:
    """Yield a sentence for each waiver of an obligation that cases visit, and for each that is expired.

    A waiver of an entry with parameters has one sentence for all of its instances.
    """
    for waivers in _by_entry(visited):
        first = waivers[0]
        if first.lifted:
            named = ", ".join(waiver.obligation for waiver in waivers[:_MAX_WAIVED])
            more = f" and {len(waivers) - _MAX_WAIVED} more" if len(waivers) > _MAX_WAIVED else ""
            yield f"Waived by {first.lifted}, but cases visit {named}{more}; narrow or remove the waiver: {first}"
        else:
            yield f"Waived, but a case visits it: {first.obligation}; remove its waiver: {first}"
    for waivers in _by_entry(expired):
        first = waivers[0]
        yield f"Expired waiver, which does not count: {first.lifted or first.obligation}: {first}"


def _by_entry(waivers: Iterable[Waiver]) -> list[list[Waiver]]:
    """Return waivers in groups: those that one waiver with parameters stands for are together."""
    found: dict[tuple[str, str], list[Waiver]] = {}
    for waiver in waivers:
        found.setdefault((waiver.lifted or waiver.obligation, str(waiver)), []).append(waiver)
    return list(found.values())


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
