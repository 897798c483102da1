"""docs/reference/command-line.md tells of every verb and every option, and of no others."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from scbm.cli.main import VERBS

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8")


def test_every_verb_has_a_section() -> None:
    assert tuple(re.findall(r"^## scbm ([\w ]+)$", PAGE, flags=re.MULTILINE)) == tuple(VERBS)


@pytest.mark.parametrize("verb", VERBS)
def test_the_options_of_a_verb_are_those_of_its_help(verb: str) -> None:
    section = PAGE.partition(f"\n## scbm {verb}\n")[2].partition("\n## ")[0]
    told = re.findall(r"^\| `(--[\w-]+)`", section, flags=re.MULTILINE)
    words = [sys.executable, "-m", "scbm", *verb.split(), "--help"]
    printed = subprocess.run(words, capture_output=True, encoding="utf-8", check=True).stdout
    options = re.findall(r"^  (?:-\w, )?(--[\w-]+)", printed.partition("\nOptions:\n")[2], flags=re.MULTILINE)
    assert [*told, "--help"] == options
