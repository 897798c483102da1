"""Missed obligations in groups: each stands in one, and a sentence gives the reason of all."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Decision, Statuses, StatusProof
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.missed_groups import ReasonGroup, reason_groups
from scbm.reports.missed_reasons import Missed, missed_reasons
from scbm.store import History
from support.flat_factory import flat_factory
from support.histories import EXAMPLE, history_of
from support.wording import Wording


def _missed(history: History, statuses: Statuses | None = None) -> tuple[Missed, ...]:
    kind = CampaignKind.of_store(history)
    return missed_reasons(replace(history, decided=statuses), "m.yaml", kind)


def _groups(missed: tuple[Missed, ...]) -> tuple[ReasonGroup, ...]:
    groups = reason_groups(missed)
    found = [str(each.obligation) for group in groups for each in group.missed]
    assert sorted(found) == sorted(str(each.obligation) for each in missed)
    assert [row.obligation for g in groups for row in g.rows if len(row.missed) > 6] == []
    return groups


def test_the_example_has_one_sentence_for_each_reason(wording: Wording) -> None:
    groups = _groups(_missed(history_of(EXAMPLE / "before.yaml", 20)))
    wording([f"{group.count}: {group.sentence} ({group.aspects})" for group in groups])
    assert sum(group.count for group in groups) == 46


def test_hundreds_of_operations_have_few_reasons(tmp_path: Path) -> None:
    model = tmp_path / "factory.yaml"
    model.write_text(flat_factory(), encoding="utf-8")
    groups = _groups(_missed(history_of(model, 10)))
    assert len(groups) <= 8
    assert len(groups[0].subjects) > 250


def test_other_statuses_have_groups_of_their_own_behind_the_others() -> None:
    history = history_of(EXAMPLE / "before.yaml", 20)
    names = [str(each) for each in history.coverage.missed()][:4]
    proofs = {name: StatusProof(Decision.UNCOVERABLE, f"reason {name}", "c.json") for name in names}
    groups = _groups(_missed(history, Statuses.of(history.coverage, proofs)))
    assert [group.status for group in groups][-2:] == [Decision.UNDECIDED, Decision.UNCOVERABLE]
    assert [row.detail for row in groups[-1].rows] == ["; ".join(f"reason {name}" for name in names)]


def test_reasons_that_differ_stand_beside_their_operations() -> None:
    groups = _groups(_missed(history_of(EXAMPLE / "before.yaml", 20)))
    details = {group.aspects: [row.detail for row in group.rows] for group in groups}
    assert set(details["14 disabled"]) == {""}
    assert len(set(details["14 timedout"])) > 3


@pytest.mark.parametrize("count", [1, 2])
def test_one_operation_is_named_and_several_are_counted(count: int) -> None:
    missed = [each for each in _missed(history_of(EXAMPLE / "before.yaml", 20)) if each.obligation.aspect == "disabled"]
    (group,) = _groups(tuple(missed[2 : 2 + count]))
    first = group.subjects[0] if count == 1 else "2 operations"
    assert group.sentence.startswith(first)
