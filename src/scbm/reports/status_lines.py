"""The lines about the statuses of obligations in reports for the terminal, and their warnings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import LiftedStatuses, status_counts_in_words
from scbm.reports.figure_table import DEFAULT_COLUMNS, wrapped

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases.coverage import Statuses
    from scbm.model import BehaviorModel, Waiver


def lifted_lines(model: BehaviorModel, statuses: Statuses) -> Iterator[Text]:
    """Yield the figure of lifted obligations; nothing for a model without parameters."""
    lifted = LiftedStatuses.of(model, statuses)
    if lifted is None:
        return
    figure = lifted.figure
    line = Text("  Lifted: ").append(str(figure), style="bold")
    yield line.append(f", {figure.visited} of {figure.of}: an operation with parameters counts once")


def status_lines(statuses: Statuses, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield the figure of what can be covered, the number of obligations of each status, and what does not count."""
    figure = statuses.coverable
    line = Text("  Of what can be covered: ").append(str(figure), style="bold")
    yield line.append(f", {figure.visited} of {figure.of}")
    words = status_counts_in_words(statuses.counts)
    yield from map(Text, wrapped(words, columns, "  Statuses: ", 12))
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
    """Yield a sentence for each waiver of an obligation that cases visit, and for each that is expired."""
    for waiver in visited:
        yield f"Waived, but a case visits it: {waiver.obligation}; remove its waiver: {waiver}"
    for waiver in expired:
        yield f"Expired waiver, which does not count: {waiver.obligation}: {waiver}"
