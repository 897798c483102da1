"""How coverage grew."""

from __future__ import annotations

from scbm.cases.coverage import Aspect, Coverage, Figure, Obligation, Obligations, growth
from support.models import scan_cell

OBLIGATIONS = Obligations.of(scan_cell())


def _bits(*names: str) -> int:
    return sum(OBLIGATIONS.bit(o) for o in OBLIGATIONS if str(o) in names)


def test_only_cases_that_add_to_the_figure_are_steps() -> None:
    cases = (
        ("nothing", 0),
        ("planned", _bits("scan_box/queued")),
        ("first", _bits("scan_box/executing", "scan_box/completed")),
        ("same", _bits("scan_box/completed", "scan_box/queued")),
        ("second", _bits("scan_box/executing", "automatic/scan_failed")),
    )
    steps = list(growth(Coverage(OBLIGATIONS, cases)))
    assert [(step.number, step.case, step.figure) for step in steps] == [
        (3, "first", Figure(2, 6)),
        (5, "second", Figure(3, 6)),
    ]
    assert steps[0].added == (Obligation("scan_box", Aspect.EXECUTING), Obligation("scan_box", Aspect.COMPLETED))
    assert steps[1].added == (Obligation("scan_failed", Aspect.TAKEN),)
