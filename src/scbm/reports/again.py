"""The command that shows a stored case again."""

from __future__ import annotations

from shlex import quote
from typing import TYPE_CHECKING

from scbm.model import format_duration
from scbm.storing import Written

if TYPE_CHECKING:
    from scbm.storing import Drawn, StoredCase


def again(stored: StoredCase, model_file: str) -> str:
    """The command line, for a shell; empty for a case of an earlier version of the model, which nothing runs again.

    Args:
        stored: the case.
        model_file: where the model file is.
    """
    if stored.is_earlier:
        return ""
    if isinstance(stored.recipe, Written):
        return f"scbm replay {_path(stored.recipe.path)} --model {_path(model_file)}"
    return f"scbm run {_path(model_file)} --seed {stored.recipe.seed} --case {stored.recipe.number}" + "".join(
        f" {option} {quote(value)}" for option, value in _options(stored.recipe)
    )


def _options(drawn: Drawn) -> list[tuple[str, str]]:
    """What `scbm run` must be told beside seed and number."""
    network = [("--network", drawn.network)] if drawn.network else []
    limit = [] if drawn.time_limit_ns is None else [("--time-limit", format_duration(drawn.time_limit_ns))]
    return [*network, *limit, *(("--require", sentence) for _, sentence in drawn.requirements)]


def _path(path: str) -> str:
    """A path that no shell splits and no command takes for an option."""
    return quote(f"./{path}" if path.startswith("-") else path)
