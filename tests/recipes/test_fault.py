"""A fault of resources, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from support.recipe_page import followed


def test_a_new_condition_is_read_and_does_its_work(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed("A fault", tmp_path) as recipe:
        (command,) = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
        sluggish = json.loads(scbm(*command, "--json").out)
        assert "sluggish" in scbm(*command).out
        case = tmp_path / "sluggish.yaml"
        case.write_text(case.read_text(encoding="utf-8").replace("becomes: sluggish", "becomes: well"), "utf-8")
        well = json.loads(scbm(*command, "--json").out)
        assert sluggish["simulated_seconds"] >= well["simulated_seconds"] + 1
        case.write_text(case.read_text(encoding="utf-8").replace("becomes: well", "becomes: sluggsh"), "utf-8")
        assert "`sluggish`" in scbm(*command).err
        case.write_text(recipe.files["sluggish.yaml"].replace("sluggish}", "{late: 2}}"), "utf-8")
        late = json.loads(scbm(*command, "--json").out)
        assert late["simulated_seconds"] >= sluggish["simulated_seconds"] + 1
        assert scbm("schema", "case").out.count('"late"') == 1
        for wrong in ("{late: 2, slower: 3}}", "{}}"):
            case.write_text(recipe.files["sluggish.yaml"].replace("sluggish}", wrong), "utf-8")
            assert scbm(*command, "--json").code == 2
        case.write_text(recipe.files["sluggish.yaml"], "utf-8")
    unknown = scbm(*command)
    assert (unknown.code, "sluggish" in unknown.err) == (2, True)
