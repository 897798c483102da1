"""*Show me* of a console: one search for each page, and not more than the computer bears."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from scbm.web.obligation_search import MOST_SEARCHES, ObligationSearches
from support.consoles import CELL

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow


def test_one_search_too_many_ends_the_oldest(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(CELL, encoding="utf-8")
    searches = ObligationSearches(tmp_path / "cell.yaml")
    pages = [f"page {number}" for number in range(MOST_SEARCHES + 1)]
    try:
        for page in pages:
            searches.begin("grip/completed", page)
            searches.begin("grip/failed", page)  # instead of the one before: it does not count
        assert [page for page in pages if searches.state(page)["state"] == "none"] == pages[:1]
    finally:
        searches.end()
