"""Where stored cases ran: in simulation, or over nodes, of which reports say which, and what was real."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.reports.words import counted

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.storing import History, StoredCase

_MOST_PLACES = 5


def place_of(case: StoredCase, history: History) -> str:
    """Where a case ran and what was real, such as `over DDS domain 0; real: scan`; empty for simulation."""
    if case.recipe.real is None:
        return ""
    real = f"real: {', '.join(case.recipe.real)}" if case.recipe.real else "all resources simulated"
    return f"{history.where(case)}; {real}"


def sort_of_place(case: StoredCase) -> str:
    """The same in few words: not which nodes."""
    if case.recipe.real is None:
        return "in simulation"
    return f"over nodes, real: {', '.join(case.recipe.real)}" if case.recipe.real else "over nodes"


def durations(history: History) -> str:
    """How long the cases ran, in time of their runs: `12.30 s simulated, 5.60 s over nodes`."""
    over_nodes = sum(case.is_over_nodes for case in history.cases)
    is_simulated = over_nodes < len(history.cases) or not over_nodes
    told = [f"{(history.ended_ns - history.over_nodes_ns) / 1e9:.2f} s simulated"] if is_simulated else []
    told += [f"{history.over_nodes_ns / 1e9:.2f} s over nodes"] if over_nodes else []
    return ", ".join(told)


def told_places(history: History) -> Iterator[str]:
    """For each place over nodes how many cases ran there; nothing if all were simulated."""
    counts: dict[str, int] = {}
    for case in history.cases:
        place = place_of(case, history)
        counts[place] = counts.get(place, 0) + 1
    counts.pop("", None)
    for place, count in list(counts.items())[:_MOST_PLACES]:
        yield f"{counted(count, 'case')} {place}"
    if len(counts) > _MOST_PLACES:
        yield f"{sum(list(counts.values())[_MOST_PLACES:])} more at {len(counts) - _MOST_PLACES} other places"
