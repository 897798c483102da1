"""What is missing on the terminal: of hundreds of operations the reasons alone, unless all are asked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.reports.cover_advice import CampaignKind
from scbm.reports.terminal.coverage_report import missing_lines
from scbm.reports.terminal.store_report import stored_report
from scbm.store import History
from support.flat_factory import flat_factory
from support.histories import history_of

MAX_LINES = 80


@pytest.fixture(scope="module")
def factory(tmp_path_factory: pytest.TempPathFactory) -> History:
    """Return ten cases of a factory with 314 operations."""
    model = tmp_path_factory.mktemp("factory") / "factory.yaml"
    model.write_text(flat_factory(), encoding="utf-8")
    return history_of(model, 10)


def _missing(history: History, *, shows_all: bool) -> list[str]:
    return [str(line) for line in missing_lines(history, "m.yaml", CampaignKind(), shows_all=shows_all)]


def test_hundreds_of_operations_take_at_most_80_lines(factory: History) -> None:
    assert len(_missing(factory, shows_all=False)) <= MAX_LINES
    assert len(list(stored_report(factory, "cov.db"))) <= MAX_LINES


def test_all_of_them_are_listed_where_that_is_asked_for(factory: History) -> None:
    stored = [str(line) for line in stored_report(factory, "cov.db", shows_all=True)]
    for text in ("\n".join(_missing(factory, shows_all=True)), "\n".join(stored)):
        assert all(operation.name in text for operation in factory.model.operations)


def test_a_short_list_is_shown_as_it_is() -> None:
    history = history_of(Path(__file__).parents[3] / "tests/models/fails_at_run/requirement.yaml", 7)
    assert _missing(history, shows_all=False) == _missing(history, shows_all=True)
