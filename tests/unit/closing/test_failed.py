"""New cases that pass, and yet show a fault of the model."""

from __future__ import annotations

import pytest

from scbm.closing.decisions import failed_cases, found_faults
from scbm.files import read_case
from scbm.testing import Campaign
from support.closings import closing_of
from support.models import scan_cell
from support.wording import Wording

AUTOMATIC = "automatic_transitions:\n"
ROUND = """automatic_transitions:
  on: {g: plan.state == executing && box_is_scanned == true && light == green, a: [light <- blue]}
  off: {g: light == blue, a: [light <- green]}
"""


@pytest.mark.parametrize(
    ("old", "new", "more", "end"),
    [
        (AUTOMATIC, ROUND, "", "livelock"),
        ("timedout: [", "timedout: [count += 1, ", "initial: {count: 2}\noutcomes: {scan: [timeout]}\n", "model_error"),
        ("deadline: 10 seconds", "deadline: 2 h", "outcomes: {scan: [timeout]}\n", "time_limit"),
    ],
)
def test_an_end_that_no_good_model_has_is_found(old: str, new: str, more: str, end: str, wording: Wording) -> None:
    model = scan_cell(
        (old, new), ("count: {domain: 0..2, initial: 0}", "count: {domain: 0..2, initial: 0, random: any}")
    )
    case = read_case(f"case: one\ngoal: scanned\n{more}expect: {{verdict: {end}}}\n", model)
    closing = closing_of(model, [case])
    assert failed_cases(Campaign.of(model, ()), closing, str) == ()
    (fault,) = found_faults(closing, lambda name: f"again {name}")
    assert (fault.case, fault.end.value, fault.again) == ("one", end, "again one")
    wording(fault.message)


def test_other_ends_are_no_fault() -> None:
    model = scan_cell()
    assert found_faults(closing_of(model, [read_case("case: one\ngoal: scanned\n", model)]), str) == ()


def test_an_end_by_a_limit_of_the_case_is_chosen() -> None:
    model = scan_cell()
    text = "case: one\ngoal: scanned\noutcomes: {scan: [timeout]}\nlimits: {time: 1 s}\nexpect: {verdict: time_limit}\n"
    assert found_faults(closing_of(model, [read_case(text, model)]), str) == ()
