"""The figures of the tutorial that no command there prints."""

from __future__ import annotations

import re
from pathlib import Path
from statistics import median

import pytest

from scbm.cases.coverage import STATE_ASPECTS, Aspect
from scbm.files import read_model
from scbm.model import BehaviorModel
from scbm.testing import Campaign, RandomCases, Tester

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "robot_in_the_air"
PAGE = (ROOT / "docs" / "tutorial" / "robot-in-the-air.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """The text of the page's blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)


def model(name: str, *replacements: tuple[str, str], more: str = "") -> BehaviorModel:
    """A model of the example, changed."""
    text = (EXAMPLE / f"{name}.yaml").read_text(encoding="utf-8")
    for pattern, replacement in replacements:
        text = re.sub(pattern, replacement, text)
    return read_model(text + more)


def campaign(of: BehaviorModel, cases: int, seed: int) -> Campaign:
    tester = Tester(of)
    return Campaign.of(tester.model, tester.results(RandomCases(of).first(cases, seed)))


def test_parts_of_the_model_that_the_page_shows_stand_in_the_file() -> None:
    files = ["before", "before"]
    shown = [block for block in blocks("yaml") if block.startswith("  ")]
    for block, name in zip(shown, files, strict=True):
        assert block in (EXAMPLE / f"{name}.yaml").read_text(encoding="utf-8")


def test_the_model_before_the_repair_breaks_the_requirement_as_the_page_says() -> None:
    (requirement,) = [block for block in blocks("yaml") if block.startswith("requirements:")]
    assert requirement in (EXAMPLE / "after.yaml").read_text(encoding="utf-8")
    run = campaign(model("before", more=requirement), 20, 1)
    assert len(run.failed) == 12
    assert "twelve of the same twenty cases" in PAGE
    assert f"{run.failed[0].verdict.failures[0]}\n" in blocks("text")


def test_what_the_page_quotes_of_a_run_is_what_a_command_of_it_prints() -> None:
    quoted, _ = blocks("text")
    assert any(quoted in block for block in blocks("console"))


@pytest.mark.slow
def test_figures_over_many_seeds_are_as_the_page_says() -> None:
    """The page describes a thousand seeds; a hundred of them show the same."""
    before = model("before")
    figures = [campaign(before, 20, seed).coverage.figure.percent or 0 for seed in range(100)]
    assert median(figures) == pytest.approx(46.51)
    assert min(figures) >= 38.37
    assert max(figures) <= 53.49


def test_the_seed_that_the_page_names_gives_the_rows_of_the_paper() -> None:
    coverage = campaign(model("before"), 20, 913).coverage
    assert "Seed 913 " in PAGE
    assert [coverage.figure_of(aspect).visited for aspect in STATE_ASPECTS] == [0, 13, 7, 0, 13]
    assert coverage.figure_of(Aspect.TAKEN).visited == 3
    assert str(coverage.figure) == "41.86 %"


@pytest.mark.parametrize(("seed", "percent"), [(1, 70.93), (2, 77.91), (3, 74.42)])
def test_missing_replies_raise_the_figure_as_the_page_says(seed: int, percent: float) -> None:
    outcomes = "{succeed: 0.8, fail: 0.1, timeout: 0.1}"
    assert f"`{outcomes}`" in PAGE
    with_timeouts = model("after", (r"outcomes: \{.*\}", f"outcomes: {outcomes}"))
    assert campaign(with_timeouts, 30, seed).coverage.figure.percent == percent
    assert f"{percent} %" in PAGE
