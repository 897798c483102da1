"""How far runs over nodes are behind their own time."""

from __future__ import annotations

from fractions import Fraction

import pytest

from scbm.cases.trace import PlanAsked, PlanReceived, Record
from scbm.files import read_case, read_model
from scbm.nodes.cases_over_nodes import slowest_plan_ns, too_late
from scbm.testing import Tester
from support.models import SCAN_CELL
from support.wording import Wording


def test_the_longest_wait_for_a_plan_counts() -> None:
    records: list[Record] = [
        PlanAsked(0, 1, ()),
        PlanReceived(3, 1, "solved", (), ()),
        PlanAsked(10, 2, ()),
        PlanAsked(11, 3, ()),
        PlanReceived(18, 3, "solved", (), ()),
        PlanAsked(20, 4, ()),
        PlanReceived(22, 4, "solved", (), ()),
        PlanAsked(30, 5, ()),
    ]
    assert slowest_plan_ns(records) == 7


def test_in_simulation_nobody_waits_for_a_plan() -> None:
    model = read_model(SCAN_CELL)
    execution = Tester(model).execute(read_case("case: scans\ngoal: scanned\noutcomes: {scan: [timeout]}\n", model))
    assert slowest_plan_ns(execution.trace.records) == 0


LATE: list[Record] = [PlanAsked(0, 1, ()), PlanReceived(5_000_000_000, 1, "solved", (), ())]


def test_a_run_is_too_late_if_a_plan_took_half_of_a_deadline(wording: Wording) -> None:
    model = read_model(SCAN_CELL)  # whose deadline is 10 s
    shown = too_late(LATE, model, Fraction(1000))
    assert shown is not None
    wording(shown)


@pytest.mark.parametrize("scale", ["1", "1/2"])
def test_time_that_is_not_scaled_is_the_models_to_cope_with(scale: str) -> None:
    assert too_late(LATE, read_model(SCAN_CELL), Fraction(scale)) is None


def test_a_plan_that_took_less_does_not_count() -> None:
    records = [LATE[0], PlanReceived(4_999_999_999, 1, "solved", (), ())]
    assert too_late(records, read_model(SCAN_CELL), Fraction(1000)) is None


def test_the_time_that_the_case_gives_to_plans_does_not_count() -> None:
    model = read_model(SCAN_CELL)
    assert too_late(LATE, model, Fraction(1000), planning_ns=1) is None
    assert too_late(LATE, model, Fraction(1000), planning_ns=0) is not None
