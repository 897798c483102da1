"""The page of the command line has a section with a table of options for each verb, as its help prints them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from page_parts import complete_page

from scbm.cli.verb_registry import VERBS

PAGE = complete_page((Path(__file__).parents[2] / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8"))


def test_every_verb_has_a_section() -> None:
    assert tuple(re.findall(r"^## scbm ([\w ]+)$", PAGE, flags=re.MULTILINE)) == tuple(VERBS)


@pytest.mark.parametrize("verb", VERBS)
def test_the_options_of_a_verb_are_those_of_its_help(verb: str, scbm: Callable[..., Any]) -> None:
    section = PAGE.partition(f"\n## scbm {verb}\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (`-.*?) \|", section, flags=re.MULTILINE)
    printed = scbm(*verb.split(), "--help").out
    options = re.findall(r"^  (?:-\w, )?(-[\w-]+)", printed, flags=re.MULTILINE)
    assert len(rows) == len(options) - 1
    assert [option for option in options if not any(f"`{option}`" in row for row in rows)] == ["--help"]
