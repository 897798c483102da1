"""A key of case files, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from scbm.files.codec.case_keys import CaseKeys
from support.recipe_page import Recipe, followed
from support.wording import diagnostic_heads


@pytest.fixture
def recipe(tmp_path: Path) -> Iterator[Recipe]:
    keys = vars(CaseKeys)["declared"]
    declared = dict(keys)
    with followed("A key of a file", tmp_path) as recipe:
        yield recipe
    keys.clear()
    keys.update(declared)


def test_a_new_key_is_accepted_checked_and_described(recipe: Recipe, scbm: Callable[..., Any], tmp_path: Path) -> None:
    replay, schema = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
    assert scbm(*replay).code == 0
    properties = json.loads(scbm(*schema).out)["properties"]
    assert properties["author"] == {"description": "The author of the case.", "title": "Author", "type": "string"}
    case = tmp_path / "author.yaml"
    case.write_text(case.read_text(encoding="utf-8").replace("author: ada", "author: [ada]"), "utf-8")
    assert diagnostic_heads(scbm(*replay).err) == [f"{case}:3:1: error[wrong-shape]"]


def test_without_the_recipe_the_key_is_unknown(scbm: Callable[..., Any], tmp_path: Path) -> None:
    case = tmp_path / "author.yaml"
    case.write_text("case: with_author\nauthor: ada\ngoal: item_a_scanned\n", "utf-8")
    replayed = scbm("replay", str(case), "--model", "examples/robot_in_the_air/before.yaml")
    assert (replayed.code, diagnostic_heads(replayed.err)) == (2, [f"{case}:2:1: error[unknown-key]"])
