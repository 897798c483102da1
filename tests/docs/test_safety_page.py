"""The parts of a model that the guide to safety reactions shows stand in the example."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "how-to" / "test-safety-reactions.md").read_text(encoding="utf-8")


def test_parts_of_the_model_that_the_page_shows_stand_in_the_file() -> None:
    shown = re.findall(r"^```yaml\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
    model = (ROOT / "examples" / "dual_cnc" / "cell.yaml").read_text(encoding="utf-8")
    assert len(shown) >= 8
    assert [block for block in shown if block not in model] == []
