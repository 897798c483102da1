"""The command that shows a stored case again; of one that ran over nodes, the command that all of its run was."""

from __future__ import annotations

from shlex import quote
from typing import TYPE_CHECKING

from scbm.model import format_duration
from scbm.storing import Written

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.storing import Recipe, Run, StoredCase


def again(stored: StoredCase, model_file: str, runs: Sequence[Run]) -> str:
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


def shown_path(path: str) -> str:
    """A path that no shell splits and no command takes for an option."""
    return quote(f"./{path}" if path.startswith("-") else path)
