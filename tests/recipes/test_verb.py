"""A verb, added as docs/how-to/recipes.md says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from support.recipe_page import followed


def test_a_new_verb_is_run_and_shown_in_the_help(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed("A verb", tmp_path) as recipe:
        (command,) = recipe.commands
        ran = scbm(*command)
        assert (ran.code, ran.out.splitlines()[0]) == (0, "robot_move_to_home")
        assert "List the operations of a model." in scbm("--help").out
    assert scbm(*command).code == 2
