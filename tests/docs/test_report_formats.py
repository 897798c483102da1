"""The pages about reports have every format of `scbm report`, and no others."""

from __future__ import annotations

import re
from pathlib import Path

from scbm.reports.formats import FORMATS

DOCS = Path(__file__).parents[2] / "docs"


def test_the_table_to_choose_from_has_each_format() -> None:
    page = (DOCS / "how-to/read-reports.md").read_text(encoding="utf-8")
    chapter = page.partition("\n## Choose a format\n")[2].partition("\n## ")[0]
    assert re.findall(r"^\| `--([\w-]+)` \|", chapter, re.MULTILINE) == [*FORMATS, "json"]


def test_each_format_has_a_section() -> None:
    page = (DOCS / "reference/report-formats.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^## .*\n\n`--([\w-]+) FILE`\. ", page, re.MULTILINE)) == sorted(FORMATS)
