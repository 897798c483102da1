"""What the cases of the example cells notice, as the page on mutants has it."""

from __future__ import annotations

from pathlib import Path

import pytest
from shipped_examples import EXAMPLES, example_counts, row

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "how-to" / "mutate-models.md"


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_page_has_each_example(name: str) -> None:
    assert (ROOT / "examples" / f"{name}.yaml").exists()
    assert any(line.startswith(f"| {EXAMPLES[name]} | ") for line in PAGE.read_text().splitlines())


@pytest.mark.slow
def test_the_page_has_the_figures_of_the_gripper() -> None:
    counts = example_counts(ROOT / "examples" / "gripper" / "cell.yaml")
    assert counts.required <= counts.built_in <= counts.recorded <= counts.differing <= counts.mutants
    assert row("gripper", counts) in PAGE.read_text().splitlines()
