"""A search for canonical plans, added as docs/how-to/recipes.md says."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from support.recipe_page import followed


def test_a_new_search_answers_what_it_suits_and_changes_no_plan(
    scbm: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scbm.planning.plan_search.MAX_PLAIN", 0)  # so that few states are enough for an engine
    with followed("A search for canonical plans", tmp_path) as recipe:
        search = import_module("scbm.planning.searches.counted_search").CountedSearch
        (command,) = recipe.commands
        ran = scbm(*command)
        assert search.answered == 1
    assert ran == scbm(*command)
