"""A column of the store, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from support.recipe_page import followed

TITLE = "A column of the store"


def columns(path: Path) -> list[Any]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute("SELECT passed, failures FROM test_case").fetchall()


def test_a_new_column_is_filled_and_stores_of_the_version_before_are_refused(
    scbm: Callable[..., Any], tmp_path: Path
) -> None:
    with followed(TITLE, tmp_path) as recipe:
        pass
    fill, report = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
    fill = (*fill, "--failures", str(tmp_path / "failures"))
    scbm(*fill)
    with followed(TITLE, tmp_path):
        for command in (report, fill):
            before = scbm(*command)
            assert (before.code, "cases.db: error[format-version]" in before.err) == (2, True)
        (tmp_path / "cases.db").unlink()
        scbm(*fill)
        rows = columns(tmp_path / "cases.db")
        assert len(rows) == 5
        assert all(passed == (failures is None) for passed, failures in rows)
        assert len(json.loads(scbm(*report).out)["cases"]) == len(rows)
    newer = scbm(*report)
    assert (newer.code, "cases.db: error[format-version]" in newer.err) == (2, True)
