"""The figures in sentences of README.md, which no command block there prints."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Ran

README = Path(__file__).parents[2] / "README.md"
BEFORE = "examples/robot_in_the_air/before.yaml"


def test_the_readme_has_at_most_120_lines() -> None:
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 120


@pytest.mark.parametrize("page", ["docs/index.md", "docs/tutorial/first-model.md", "docs/tutorial/robot-in-the-air.md"])
def test_a_first_page_has_the_command_that_installs(page: str) -> None:
    command = re.search(r"^python3 -m venv .*?install --quiet \. &&", README.read_text(encoding="utf-8"), re.MULTILINE)
    assert command
    lines = (README.parent / page).read_text(encoding="utf-8").splitlines()[:40]
    assert f"{command[0]} . .venv/bin/activate" in lines


@pytest.mark.slow
@pytest.mark.usefixtures("shared_closings")
def test_the_figures_of_closing_are_those_of_the_command(scbm: Callable[..., Ran]) -> None:
    text = README.read_text(encoding="utf-8").replace("\n", " ")
    match = re.search(r"it generates (\d+) cases that reach ([\d.]+) %", text)
    assert match
    result = json.loads(scbm("close", BEFORE, "--json").out)
    reached = f"{result['after']['percent']:.2f}"
    assert (str(len(result["cases"])), reached) == match.groups()
