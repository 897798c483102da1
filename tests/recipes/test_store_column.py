"""A column of the store, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from support.recipe_page import followed

TITLE = "A column of the store"


def columns(path: Path) -> list[Any]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute("SELECT passed, failures FROM test_case").fetchall()


@pytest.mark.parametrize("is_old", [False, True], ids=["new store", "store of the version before"])
def test_a_new_column_is_filled_and_older_stores_get_it(
    scbm: Callable[..., Any], tmp_path: Path, *, is_old: bool
) -> None:
    with followed(TITLE, tmp_path) as recipe:
        pass
    fill, report = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
    fill = (*fill, "--failures", str(tmp_path / "failures"))
    if is_old:
        scbm(*fill)
    with followed(TITLE, tmp_path):
        assert json.loads(scbm(*report).out)["cases"] if is_old else True  # read as it is, without an upgrade
        more = ("--seed", "2") if is_old else ()
        scbm(*(word for word in fill if not more or word not in ("--seed", "1")), *more)
        rows = columns(tmp_path / "cases.db")
        assert [passed for passed, _ in rows].count(None) == (5 if is_old else 0)
        assert all(passed == (failures is None) for passed, failures in rows if passed is not None)
        assert len(json.loads(scbm(*report).out)["cases"]) == len(rows)
    newer = scbm(*report)
    assert (newer.code, "store-newer" in newer.err) == (2, True)
