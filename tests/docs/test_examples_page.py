"""The figures of the examples page are those of the models."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from scbm.cases.coverage import Obligations
from scbm.cli.verbs.init import EXAMPLES
from scbm.files import load_model

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "examples" / "index.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_has_the_figures_of_the_page(name: str) -> None:
    row = re.search(rf"^\| `{name}` \|.*\| (\d+) \| (\d+) \| (\d+)\b", PAGE, re.MULTILINE)
    assert row is not None
    path = ROOT / "examples" / EXAMPLES[name].model
    model = load_model(path)
    lines = len(path.read_text(encoding="utf-8").splitlines())
    assert tuple(map(int, row.groups())) == (len(model.operations), Obligations.of(model).counted.bit_count(), lines)
