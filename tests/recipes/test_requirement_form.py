"""A form of requirement, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from scbm.testing import requirement_monitors
from support.recipe_page import followed

TITLE = "A form of requirement"


def test_a_new_form_is_parsed_printed_and_watched(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed(TITLE, tmp_path) as recipe:
        kept, broken = recipe.commands
        assert scbm(*kept).code == 0
        ran = scbm(*broken)
        assert ran.code == 1
        (failure,) = json.loads(scbm(*broken, "--json").out)["failures"]
        assert "false" in failure
        wrong = scbm(*kept[:-1], "sometime")
        assert (wrong.code, "requirement-syntax" in wrong.err) == (2, True)
    unknown = scbm(*kept)
    assert (unknown.code, "requirement-syntax" in unknown.err) == (2, True)


def test_a_form_without_a_monitor_is_refused(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed(TITLE, tmp_path) as recipe:
        requirement_monitors.MONITORS.popitem()
        ran = scbm(*recipe.commands[0])
    assert (ran.code, "Sometime to MONITORS" in ran.err) == (3, True)
