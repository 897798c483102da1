"""The state at a moment, from the records alone."""

from __future__ import annotations

from scbm.cases.trace import BecameCurrent, InjectionApplied, RunStarted, state_after

RECORDS = (
    InjectionApplied(0, "early", None, (("count", 1),)),
    RunStarted(0, "goal", "true", (("count", 1), ("light", "green")), (("light", "red"),)),
    BecameCurrent(3, "scan_box", (("count", 2),)),
)


def test_a_state_is_that_of_the_start_and_all_changes_behind_it() -> None:
    assert state_after(RECORDS[:2]) == {"count": 1, "light": "red"}
    assert state_after(RECORDS) == {"count": 2, "light": "red"}


def test_before_a_run_starts_nothing_is_known() -> None:
    assert state_after(RECORDS[:1]) == {}
