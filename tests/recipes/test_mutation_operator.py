"""A mutation operator, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from support.recipe_page import followed
from support.wording import Wording


def test_a_new_operator_makes_mutants_that_run(scbm: Callable[..., Any], tmp_path: Path, wording: Wording) -> None:
    with followed("A mutation operator", tmp_path) as recipe:
        (command,) = recipe.commands
        report = json.loads(scbm(*command).out)
        assert set(report["operators"]) == {"deadline-half"}
        assert report["all"] == 16
        assert {mutant["after"] for mutant in report["mutants"]} == {"deadline: 5 s"}
        grouped = json.loads(scbm(*(word.replace("deadline-half", "deadlines") for word in command)).out)
        assert "deadline-half" in grouped["operators"]
    unknown = scbm(*command)
    assert (unknown.code, "`deadline-half`" in unknown.err) == (2, True)
    wording(unknown.err.splitlines()[0])
