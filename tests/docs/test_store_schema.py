"""The page of the coverage store has every table and column, as they are."""

from __future__ import annotations

import re
import sqlite3
from pathlib import Path

from page_parts import complete_page

from support.stores import results, store

PAGE = Path(__file__).parents[2] / "docs/reference/coverage-store.md"


def test_every_column_is_reported_with_its_type(tmp_path: Path) -> None:
    documented = {}
    for section in re.split(r"^### ", complete_page(PAGE.read_text(encoding="utf-8")), flags=re.MULTILINE)[1:]:
        name = section.split("\n", 1)[0]
        rows = re.findall(r"^\| `(\w+)` \| (\w+) \|", section, flags=re.MULTILINE)
        documented[name] = [(column, kind.upper()) for column, kind in rows]
    connection = sqlite3.connect(store(tmp_path / "cov.db", 1, results(1, 1)))
    try:
        names = [row[0] for row in connection.execute("SELECT name FROM sqlite_schema WHERE sql IS NOT NULL")]
        tables = {
            name: [(row[1], row[2]) for row in connection.execute(f"PRAGMA table_info({name})")] for name in names
        }
    finally:
        connection.close()
    assert documented == tables
