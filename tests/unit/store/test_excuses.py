"""A store keeps why a case passed short of its goal."""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.store import read_history
from scbm.testing import Excuse, Verdict
from support.stores import results, store


def test_excuses_come_back_from_a_store(tmp_path: Path) -> None:
    verdicts = (
        Verdict(End.ABORTED, (), (Excuse.FAULT, Excuse.EXPECTED)),
        Verdict(End.REACHED),
        Verdict(End.TIME_LIMIT, (), (Excuse.INPUT,)),
    )
    pairs = zip(results(1, 3), verdicts, strict=True)
    kept = [(recipe, replace(result, verdict=verdict)) for (recipe, result), verdict in pairs]
    history = read_history(store(tmp_path / "cov.db", 1, kept))
    assert [case.verdict.excuses for case in history.cases] == [verdict.excuses for verdict in verdicts]
    assert history.short_count == 2
