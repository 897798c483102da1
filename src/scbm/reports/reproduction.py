"""The command that shows a stored case again; of one that ran over nodes, the command that all of its run was.

Where stored cases ran: in simulation, or over nodes, of which reports say which, and what was real.
"""

from __future__ import annotations

from shlex import quote
from typing import TYPE_CHECKING

from scbm.model import format_duration
from scbm.reports.figure_table import counted, shown_path
from scbm.store import Written

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.store import History, Recipe, StoredCase, StoredRun


def again(stored: StoredCase, model_file: str, runs: Sequence[StoredRun]) -> str:
    """The command line, for a shell; empty for a case that nothing runs again.

    That is one of an earlier version of the model, or one that was lost with a node. One that ran over nodes has the
    command of its run, as that is what led to it; it may come out differently.

    Args:
        stored: the case.
        model_file: where the model file is.
        runs: those of its history.
    """
    if not stored.is_shown_again:
        return ""
    if stored.is_over_nodes:
        return runs[stored.run].command
    recipe = stored.recipe
    if isinstance(recipe, Written) and recipe.is_of_test:
        return f"pytest {shown_path(recipe.path)}"
    if isinstance(recipe, Written):
        return f"scbm replay {shown_path(recipe.path)} --model {shown_path(model_file)}{_added(recipe)}"
    network = f" --network {quote(recipe.network)}" if recipe.network else ""
    return f"scbm run {shown_path(model_file)} --seed {recipe.seed} --case {recipe.number}{network}{_added(recipe)}"


def again_words(stored: StoredCase) -> str:
    """What the command does, to be said before it."""
    return "again, with all of its run" if stored.is_over_nodes else "again"


def _added(recipe: Recipe) -> str:
    """What the command line said beside the case, with a blank before each option."""
    limit = [] if recipe.time_limit_ns is None else [("--time-limit", format_duration(recipe.time_limit_ns))]
    options = [*limit, *(("--require", sentence) for _, sentence in recipe.requirements)]
    return "".join(f" {option} {quote(value)}" for option, value in options)


_MAX_PLACES = 5


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
    for place, count in list(counts.items())[:_MAX_PLACES]:
        yield f"{counted(count, 'case')} {place}"
    if len(counts) > _MAX_PLACES:
        yield f"{sum(list(counts.values())[_MAX_PLACES:])} more at {len(counts) - _MAX_PLACES} other places"
