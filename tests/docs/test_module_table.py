"""The page of all modules has the first sentence of each docstring; the architecture page names existing modules."""

from __future__ import annotations

import re
from pathlib import Path

from page_parts import SOURCE, complete_page, summary

ARCHITECTURE = Path(__file__).parents[2] / "docs" / "explanation" / "architecture.md"

PATHS = sorted(set(re.findall(r"`([a-z_]+/[a-z_/]*(?:\.py)?)`", ARCHITECTURE.read_text(encoding="utf-8"))))


def test_the_page_lists_every_module() -> None:
    page = complete_page("<!-- generated: modules -->")
    rows = re.findall(r"^\| `(\w+)` \| \S", page, re.MULTILINE)
    assert sorted(rows) == sorted(path.stem for path in SOURCE.glob("*/**/*.py") if path.stem != "__init__")


def test_every_module_has_a_summary() -> None:
    assert [path for path in sorted(SOURCE.rglob("*.py")) if not summary(path)] == []


def test_every_path_that_the_architecture_names_exists() -> None:
    assert len(PATHS) > 20
    assert [name for name in PATHS if not (SOURCE / name).exists()] == []


def test_the_architecture_names_each_module_that_follows_plans() -> None:
    (row,) = (line for line in ARCHITECTURE.read_text(encoding="utf-8").splitlines() if "(`next_in_plan`)" in line)
    calls = [path for path in sorted(SOURCE.rglob("*.py")) if "next_in_plan(" in path.read_text(encoding="utf-8")]
    assert sorted(re.findall(r"`([a-z_/]+\.py)`", row)) == [path.relative_to(SOURCE).as_posix() for path in calls]
