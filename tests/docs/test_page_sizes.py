"""Pages stay short enough to be read: decisions, the tutorial of the paper, and the text of all pages together."""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
DECISIONS = sorted((DOCS / "decisions").rglob("0*.md"))
OUTPUT = re.compile(r"^```console\n.*?^```$", re.MULTILINE | re.DOTALL)


def test_a_decision_has_at_most_three_kilobytes() -> None:
    assert [path.stem for path in DECISIONS if path.stat().st_size > 3 * 1024] == []


def test_the_tutorial_of_the_paper_has_at_most_fifteen_kilobytes() -> None:
    assert (DOCS / "tutorial" / "robot-in-the-air.md").stat().st_size <= 15 * 1024


def test_what_people_wrote_can_be_read() -> None:
    """The limit leaves out what commands print. What the code knows belongs into `page_parts` instead of a page."""
    texts = [OUTPUT.sub("", path.read_text(encoding="utf-8")) for path in sorted(DOCS.rglob("*.md"))]
    assert sum(len(text.encode()) for text in texts) <= 520_000
