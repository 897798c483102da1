"""The page about closing has every search for cases, in its order, with what it finds and its limit."""

from __future__ import annotations

import re
from pathlib import Path

from scbm.closing.case_searches import CASE_SEARCHES

PAGE = Path(__file__).parents[2] / "docs/explanation/closing.md"


def test_the_table_of_searches_has_each_search() -> None:
    chapter = PAGE.read_text(encoding="utf-8").partition("\n### The searches for cases\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `([\w-]+)` \| (.*) \| (.*) \|$", chapter, re.MULTILINE)
    assert [name for name, _, _ in rows] == list(CASE_SEARCHES)
    for (_, finds, limit), entry in zip(rows, CASE_SEARCHES.values(), strict=True):
        assert (finds[: len(entry.finds)], limit) == (entry.finds, entry.limit)
