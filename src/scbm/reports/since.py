"""What a run visits more, and less, than the last one: one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from scbm.reports.words import counted

if TYPE_CHECKING:
    from scbm.coverage import Figure, Obligations
    from scbm.storing import Run

_MOST_NAMED = 3


def since_last_run(
    obligations: Obligations, before: Run | None, visited: int, words: str = "Since the last run"
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
    more = ", …" if len(names) > _MOST_NAMED else ""
    return f"{len(names)} ({', '.join(names[:_MOST_NAMED])}{more})"
