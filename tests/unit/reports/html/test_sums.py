"""The numbers beside the figure add up, for every model of the repository, with forced visits and other statuses."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Decision, Statuses, StatusProof
from scbm.reports.ci.markdown import markdown
from scbm.reports.html.views import ReportView, Visitors
from scbm.store import History
from support.histories import history_of

ROOT = Path(__file__).parents[4]
FILES = sorted([*(ROOT / "tests/models/valid").glob("*.yaml"), *ROOT.glob("examples/*/*.yaml")])
TEXTS = {path: path.read_text(encoding="utf-8") for path in FILES}
WITHOUT_INITIAL_STATE = ("lists",)
MODELS = [
    path
    for path, text in TEXTS.items()
    if "behavior_model:" in text and "\ngoals:" in text and path.stem not in WITHOUT_INITIAL_STATE
]
"""The models with random cases."""
EVERY_OTHER_BIT = int("55" * 200, 16)


def _history(path: Path) -> History:
    """Return three cases that force every other visit, with a proof for every third obligation."""
    history = history_of(path, 3)
    cases = tuple(replace(case, forced=case.visited & EVERY_OTHER_BIT) for case in history.cases)
    history = replace(history, cases=cases)
    names = [str(each) for each in history.obligations][::3]
    proofs = {name: StatusProof(Decision.UNCOVERABLE, "no run does", "c.json") for name in names}
    return replace(history, decided=Statuses.of(history.coverage, proofs, forced=history.forced))


def _numbers(words: str) -> list[int]:
    return list(map(int, re.findall(r"\d+", words)))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_numbers_add_up(path: Path) -> None:
    history = _history(path)
    view = ReportView(history, Visitors.of(history))
    figure = history.coverage.figure
    visited, of, *kinds = _numbers(view.visit_words)
    assert (visited, of) == (figure.visited, figure.of)
    assert sum(kinds) == (visited if kinds else 0)
    assert bool(kinds) is bool(history.statuses.forced)
    total, *statuses = _numbers(view.status_words)
    assert sum(statuses) == total == of
    assert sum(group.count for group in view.undecided_groups) == view.missed_count
    others = [each for group in view.other_groups for each in group.missed]
    assert len(others) == len(view.not_needed)
    assert view.visit_words in markdown(history)
