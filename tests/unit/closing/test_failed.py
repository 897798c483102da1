"""New cases that pass, and yet show a fault of the model."""

from __future__ import annotations

import pytest

from scbm.closing.failing_cases import failed_cases, found_faults
from scbm.files import read_case
from scbm.testing import Campaign
from support.closings import closing_of
from support.models import scan_cell

AUTOMATIC = "automatic_transitions:\n"
ROUND = """automatic_transitions:
  on: {g: box_is_scanned == true && light == green, a: [light <- blue]}
  off: {g: light == blue, a: [light <- green]}
"""


@pytest.mark.parametrize(
    ("old", "new", "more", "end", "message"),
    [
        (
            AUTOMATIC,
            ROUND,
            "",
            "livelock",
            "ends in a livelock: automatic transitions go round without end: on -> off -> on",
        ),
        (
            "timedout: [",
            "timedout: [count += 1, ",
            "initial: {count: 2}\noutcomes: {scan: [timeout]}\n",
            "model_error",
            "ends in an error of the model: ",
        ),
        (
            AUTOMATIC,
            AUTOMATIC,
            "outcomes: {scan: [timeout]}\nlimits: {time: 1 s}\n",
            "time_limit",
            "ends at the time limit: ",
        ),
    ],
)
def test_an_end_that_no_good_model_has_is_found(old: str, new: str, more: str, end: str, message: str) -> None:
    model = scan_cell((old, new))
    case = read_case(f"case: one\ngoal: scanned\n{more}expect: {{verdict: {end}}}\n", model)
    closing = closing_of(model, [case])
    assert failed_cases(Campaign.of(model, ()), closing, str) == ()
    (fault,) = found_faults(closing, lambda name: f"again {name}")
    assert (fault.name, fault.end.value, fault.again) == ("one", end, "again one")
    assert fault.message.startswith(message)


def test_other_ends_are_no_fault() -> None:
    model = scan_cell()
    assert found_faults(closing_of(model, [read_case("case: one\ngoal: scanned\n", model)]), str) == ()
