"""Models that load and then fail: each file has the end and the failures of its first case beside it."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.cases.trace import End
from scbm.files import load_model
from scbm.testing import RandomCases, Tester
from support.wording import Wording

MODELS = sorted((Path(__file__).parents[2] / "models" / "fails_at_run").glob("*.yaml"))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_the_first_case_fails_as_expected(path: Path) -> None:
    model = load_model(path)
    verdict = Tester(model).execute(RandomCases(model).case(0, 1)).verdict
    shown = [f"end: {verdict.end}", *(f"failure: {failure}" for failure in verdict.failures)]
    assert "\n".join(shown) + "\n" == path.with_suffix(".expected").read_text(encoding="utf-8")
    assert not verdict.passed


def test_every_end_that_a_model_can_bring_about_has_a_model() -> None:
    others = (End.PLANNER_LIMIT, End.NO_PLAN_FOUND, End.LOST, End.NOT_STARTED, End.IMPOSSIBLE)
    of_others = {end.value for end in others}
    ends = {path.with_suffix(".expected").read_text(encoding="utf-8").split()[1] for path in MODELS}
    assert ends == {end.value for end in End} - of_others


@pytest.mark.parametrize("name", ["requirement", "aborted"])
def test_a_printed_run_is_a_line_for_each_event(name: str, wording: Wording) -> None:
    (path,) = [path for path in MODELS if path.stem == name]
    model = load_model(path)
    wording(Tester(model).execute(RandomCases(model).case(0, 1)))
