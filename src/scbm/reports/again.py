"""The command that shows a stored case again."""

from __future__ import annotations

from shlex import quote
from typing import TYPE_CHECKING

from scbm.model import format_duration
from scbm.storing import Written

if TYPE_CHECKING:
    from scbm.storing import Recipe, StoredCase


def again(stored: StoredCase, model_file: str) -> str:
    """The command line, for a shell; empty for a case that nothing runs again.

    That is one of an earlier version of the model, or one that was lost with a node: its run was none of a simulation.

    Args:
        stored: the case.
        model_file: where the model file is.
    """
    if not stored.is_repeatable:
        return ""
    recipe = stored.recipe
    if isinstance(recipe, Written) and recipe.is_of_test:
        return f"pytest {shown_path(recipe.path)}"
    if isinstance(recipe, Written):
        return f"scbm replay {shown_path(recipe.path)} --model {shown_path(model_file)}{_added(recipe)}"
    network = f" --network {quote(recipe.network)}" if recipe.network else ""
    return f"scbm run {shown_path(model_file)} --seed {recipe.seed} --case {recipe.number}{network}{_added(recipe)}"


def _added(recipe: Recipe) -> str:
    """What the command line said beside the case, with a blank before each option."""
    limit = [] if recipe.time_limit_ns is None else [("--time-limit", format_duration(recipe.time_limit_ns))]
    options = [*limit, *(("--require", sentence) for _, sentence in recipe.requirements)]
    return "".join(f" {option} {quote(value)}" for option, value in options)


def shown_path(path: str) -> str:
    """A path that no shell splits and no command takes for an option."""
    return quote(f"./{path}" if path.startswith("-") else path)
