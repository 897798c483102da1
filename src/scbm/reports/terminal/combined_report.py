"""What came of uniting stores, for people and for machines.

What a run visits more, and less, than the last one: one line.
"""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

from rich.text import Text

from scbm.reports.figure_table import counted
from scbm.testing import coverage_json

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import Figure, Obligations
    from scbm.store import Combined, Dropped, StoredRun

_MAX_NAMED = 3


def since_last_run(
    obligations: Obligations, before: StoredRun | None, visited: int, words: str = "Since the last run"
) -> Text:
    """The difference between two runs of a store, in figures and in names.

    Args:
        obligations: what there is to visit.
        before: the run before this one, if there is one.
        visited: what this one visited, as bits.
        words: how the line begins.
    """
    if before is None:
        return Text(f"{words}: none was finished in this store before")
    counted_ones = obligations.counted
    gained = visited & ~before.visited & counted_ones
    lost = before.visited & ~visited & counted_ones
    line = Text(f"{words}: ")
    if not gained and not lost:
        return line.append(f"the same, {obligations.figure(visited)}")
    line.append(f"{obligations.figure(before.visited)} → {obligations.figure(visited)}")
    if gained:
        line.append(f", +{_named(obligations, gained)}", style="green")
    if lost:
        line.append(f", -{_named(obligations, lost)}", style="red")
    return line


def in_all(cases: int, figure: Figure, store: str) -> Text:
    """What all cases of a store visit."""
    return Text(f"{store}: {counted(cases, 'case')} together, {figure}")


def _named(obligations: Obligations, bits: int) -> str:
    names = obligations.names(bits)
    more = ", …" if len(names) > _MAX_NAMED else ""
    return f"{len(names)} ({', '.join(names[:_MAX_NAMED])}{more})"


FORMAT_VERSION = 1


def combined_report(combined: Combined, target: str) -> Iterator[Text]:
    """What the new store holds; before that, what of earlier versions of the model does not count any more."""
    for path, dropped in combined.dropped:
        if dropped:
            yield Text(f"{path}: of an earlier version of the model; dropped what means something else now")
            yield from _dropped_lines(dropped)
        else:
            yield Text(f"{path}: of an earlier version of the model; all that it visited is unchanged")
    history = combined.history
    yield in_all(len(history.cases), history.coverage.figure, target).append(f", {counted(len(history.runs), 'run')}")


def _dropped_lines(dropped: Sequence[Dropped]) -> Iterator[Text]:
    for subject, group in groupby(dropped, key=lambda d: d.obligation.subject):
        of_subject = list(group)
        aspects = ", ".join(d.obligation.aspect.value for d in of_subject)
        yield Text(f"  {subject}: {aspects}").append(
            "   it is gone" if of_subject[0].is_gone else "   it was edited", "dim"
        )


def combined_json(combined: Combined, target: str) -> dict[str, Any]:
    """The same as data that `json` can write."""
    history = combined.history
    return {
        "format_version": FORMAT_VERSION,
        "model": history.model.name,
        "store": target,
        "cases": len(history.cases),
        "runs": len(history.runs),
        "coverage": coverage_json(history.coverage),
        "dropped": [
            {"store": str(path), "obligation": str(d.obligation), "reason": "gone" if d.is_gone else "edited"}
            for path, dropped in combined.dropped
            for d in dropped
        ],
    }
