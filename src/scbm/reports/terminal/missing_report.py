"""Only what is missing, for the terminal: each obligation, why, and the commands that close it."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import Aspect
from scbm.reports.figure_table import DEFAULT_COLUMNS, command_text, counted, headline, shown_path
from scbm.reports.missed_reasons import close_command, missed_reasons

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import Coverage
    from scbm.model import BehaviorModel
    from scbm.reports.missed_reasons import Missed


def told_missing(model: BehaviorModel, coverage: Coverage, file: str, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """What no case visits, line by line.

    Args:
        model: the model.
        coverage: what was visited.
        file: the model file, for the commands.
        columns: the width of the report.
    """
    missed = missed_reasons(model, coverage, file)
    figure = coverage.figure
    yield Text("Missing of ").append(model.name, style="bold").append(f": {_count(missed)} of {figure.of}")
    yield Text()
    yield headline(figure, columns)
    if not missed:
        return
    order = {name: index for index, name in enumerate(dict.fromkeys(m.obligation.subject for m in missed))}
    by_subject = sorted(missed, key=lambda m: (m.obligation.aspect is Aspect.TAKEN, order[m.obligation.subject]))
    for _, group in groupby(by_subject, key=lambda m: (m.obligation.aspect is Aspect.TAKEN, m.obligation.subject)):
        yield Text()
        yield from _of_subject(list(group))
    yield Text()
    yield Text("How to cover the rest", style="bold")
    yield command_text("  ", close_command(file), "the cases for all of it, or proofs that there are none")
    yield command_text("  ", missed[0].command, "one of them, and how")
    yield command_text("  ", f"scbm test {shown_path(file)} closed", "what they visit")


def _count(missed: Sequence[Missed]) -> str:
    counting = sum(m.obligation.counts for m in missed)
    beside = len(missed) - counting
    told = counted(counting, "obligation")
    return f"{told}, and {beside} queued," if beside else told


def _of_subject(missed: Sequence[Missed]) -> Iterator[Text]:
    """What is missing of an operation or an automatic transition; aspects that miss for one reason on one line."""
    first = missed[0].obligation
    yield Text("  at: " if first.aspect is Aspect.TAKEN else "  op: ").append(first.subject, style="bold")
    reasons = dict.fromkeys(m.reason for m in missed)
    told = {r: ", ".join(m.obligation.aspect.value for m in missed if m.reason == r) for r in reasons}
    width = max(map(len, told.values()))
    for reason, aspects in told.items():
        yield Text(f"      ○ {aspects:<{width}}  ", style="red").append(reason, style="not red")
