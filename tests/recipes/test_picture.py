"""A picture in reports, added as docs/how-to/recipes.md says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from support.recipe_page import followed


def test_a_new_picture_stands_on_the_page_of_the_model_and_beside_operations(
    scbm: Callable[..., Any], tmp_path: Path
) -> None:
    with followed("A picture", tmp_path) as recipe:
        fill, write = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
        scbm(*fill)
        assert scbm(*write).code == 0
        page = (tmp_path / "report.html").read_text(encoding="utf-8")
        assert page.count("<h2>Guards by size</h2>") == 17
        assert page.count('class="clauses"') == 17
        assert (
            (tmp_path / "report.md").read_text(encoding="utf-8").endswith("The longest precondition has 7 clauses.\n")
        )
