"""How far runs over nodes are behind their own time."""

from __future__ import annotations

from scbm.notation import read_case, read_model
from scbm.testing import Tester, slowest_plan_ns
from scbm.trace import PlanAsked, PlanReceived, Record
from support.models import SCAN_CELL


def test_the_longest_wait_for_a_plan_counts() -> None:
    records: list[Record] = [
        PlanAsked(0, 1, ()),
        PlanReceived(3, 1, "solved", (), ()),
        PlanAsked(10, 2, ()),
        PlanAsked(11, 3, ()),
        PlanReceived(18, 3, "solved", (), ()),
        PlanAsked(20, 4, ()),
    ]
    assert slowest_plan_ns(records) == 7


def test_in_simulation_nobody_waits_for_a_plan() -> None:
    model = read_model(SCAN_CELL)
    execution = Tester(model).execute(read_case("case: scans\ngoal: scanned\noutcomes: {scan: [timeout]}\n", model))
    assert slowest_plan_ns(execution.trace.records) == 0
