"""What the results of mutants say about the obligations that cases visit (decision 52)."""

from __future__ import annotations

import pytest

from scbm.cases.coverage import (
    Aspect,
    AssertedObligations,
    Assertion,
    Figure,
    MutantNotice,
    MutantStatus,
    Obligations,
)
from scbm.files import read_model
from support.models import SCAN_CELL

OBLIGATIONS = Obligations.of(read_model(SCAN_CELL))
BIT = OBLIGATIONS.bit_of("scan_box", Aspect.TIMEDOUT)
OTHER = OBLIGATIONS.bit_of("scan_box", Aspect.FAILED)


@pytest.mark.parametrize(
    ("notices", "answer", "figure"),
    [
        ([(BIT, BIT, "killed"), (BIT, 0, "survived")], Assertion.ASSERTED, (1, 1)),
        ([(BIT, 0, "survived")], Assertion.NOTHING_ASSERTED, (0, 1)),
        ([(BIT | OTHER, OTHER, "killed")], Assertion.NOTHING_ASSERTED, (0, 1)),
        ([(BIT, 0, "undecided"), (BIT, 0, "equivalent")], Assertion.UNKNOWN, (0, 1)),
        ([(BIT, 0, "equivalent")], Assertion.UNKNOWN, (0, 0)),
        ([(OTHER, OTHER, "killed")], Assertion.UNKNOWN, (0, 0)),
    ],
)
def test_three_answers(notices: list[tuple[int, int, str]], answer: Assertion, figure: tuple[int, int]) -> None:
    read = [MutantNotice(belongs, noticed, MutantStatus(status)) for belongs, noticed, status in notices]
    found = AssertedObligations.of(OBLIGATIONS, BIT, read)
    assert [entry.answer for entry in found.entries] == [answer]
    assert found.figure == Figure(*figure)


def test_obligations_that_no_case_visits_have_no_answer() -> None:
    found = AssertedObligations.of(OBLIGATIONS, BIT, [MutantNotice(OTHER, OTHER, MutantStatus.KILLED)])
    assert [str(entry.obligation) for entry in found.entries] == ["scan_box/timedout"]
