"""The pages have a place for each table of keys, and the table that is generated there has all keys."""

from __future__ import annotations

import re
from pathlib import Path

from page_parts import MAPPINGS, complete_page

DOCS = Path(__file__).parents[2] / "docs"


def test_every_mapping_of_a_file_has_one_table() -> None:
    pages = [path.read_text(encoding="utf-8") for path in sorted(DOCS.glob("**/*.md"))]
    named = [name for page in pages for name in re.findall(r"<!-- generated: keys (\w+) -->", page)]
    assert sorted(named) == sorted(MAPPINGS)


def test_a_table_has_the_keys_of_its_mapping() -> None:
    table = complete_page("<!-- generated: keys GoalFile -->")
    rows = re.findall(r"^\| `(\w+)`", table, re.MULTILINE)
    assert rows == list(MAPPINGS["GoalFile"].declared)
