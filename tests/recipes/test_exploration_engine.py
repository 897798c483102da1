"""An exploration engine, added as docs/how-to/recipes.md says."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from support.recipe_page import followed


@pytest.mark.longer
def test_a_new_engine_explores_what_it_suits_and_changes_no_answer(
    scbm: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scbm.planning.policy._MAX_ON_DEMAND", 0)  # so that few states are enough for an engine
    with followed("An exploration engine", tmp_path) as recipe:
        engine = import_module("scbm.planning.engines.counting_engine").CountingEngine
        (command,) = recipe.commands
        ran = scbm(*command)
        assert engine.explored > 0
    assert ran == scbm(*command)
