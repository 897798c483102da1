"""Each recipe of docs/how-to/recipes.md leaves a source that keeps the layout rules which the page prescribes."""

from __future__ import annotations

import pytest

from support.layout_rules import full_folders, repeated_classes, repeated_modules, source_texts
from support.recipe_page import read_recipe, source_after, titles_with_code


@pytest.mark.parametrize("title", titles_with_code())
def test_a_followed_recipe_keeps_folders_small_and_names_unique(title: str) -> None:
    after, before = source_after(read_recipe(title)), source_texts()
    for rule in (full_folders, repeated_modules, repeated_classes):
        assert rule(after) == rule(before)
