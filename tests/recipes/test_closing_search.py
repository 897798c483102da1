"""A search of closing, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from support.recipe_page import followed


@pytest.mark.usefixtures("own_closings")
def test_a_new_search_covers_what_the_others_leave_open(scbm: Callable[..., Any], tmp_path: Path) -> None:
    def covered() -> set[str]:
        report = json.loads(scbm(*command).out)
        return {each["name"] for each in report["obligations"] if each["decision"] == "covered"}

    with followed("A search of closing", tmp_path) as recipe:
        (command,) = recipe.commands
        after = covered()
    before = covered()
    assert before < after
    assert {name.rpartition("/")[2] for name in after - before} >= {"failed", "robot_failed"}
