"""A built-in requirement, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from support.recipe_page import followed
from support.wording import Wording


def test_a_new_built_in_requirement_judges_cases_and_can_be_switched_off(
    scbm: Callable[..., Any], tmp_path: Path, wording: Wording
) -> None:
    model = tmp_path / "three_lamps.yaml"
    with followed("A built-in requirement", tmp_path) as recipe:
        test, close = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
        tested = scbm(*test)
        findings = json.loads(tested.out)["findings"]
        assert (tested.code, [(each["kind"], each["subject"]) for each in findings]) == (1, [("built_in", "asks_once")])
        wording(findings[0]["failures"][0])
        closed = json.loads(scbm(*close).out)["requirements"]["decided"]
        assert [(each["name"], each["status"], each.get("case")) for each in closed][-1] == (
            "asks_once",
            "violated",
            "asks_once-1",
        )
        text = model.read_text(encoding="utf-8")
        model.write_text(text.replace("requirements_off: {", "requirements_off: {asks_once: one by one is slow, "))
        assert scbm(*test).code == 0
        closed = json.loads(scbm(*close).out)["requirements"]["decided"]
        assert [(each["name"], each["status"], each["reason"]) for each in closed][-1] == (
            "asks_once",
            "off",
            "one by one is slow",
        )
    unknown = scbm(*test)
    assert (unknown.code, "`asks_once`" in unknown.err) == (2, True)
    wording(unknown.err.splitlines()[0])
