"""What a run visits more and less than the one before."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.reports.terminal.store_report import since_last_run
from support.stores import a_run, cell
from support.wording import Wording

OBLIGATIONS = Obligations.of(cell())
NAMES = [str(o) for o in OBLIGATIONS]
QUEUED = 1 << NAMES.index("scan_box/queued")


@pytest.mark.parametrize(
    ("before", "now", "figures"),
    [
        (0b1, 0b1, "16.67 %"),
        (0b1 | QUEUED, 0b1, "16.67 %"),
        (0b1, 0b1 | QUEUED, "16.67 %"),
        (0b1, 0b11, f"16.67 % → 33.33 %, +1 ({NAMES[1]})"),
        (0b11, 0b1, f"33.33 % → 16.67 %, -1 ({NAMES[1]})"),
        (0b1, 0b10, f"16.67 % → 16.67 %, +1 ({NAMES[1]}), -1 ({NAMES[0]})"),
        (0, 0b111, f"0.00 % → 50.00 %, +3 ({', '.join(NAMES[:3])})"),
        (0, 0b1111, f"0.00 % → 66.67 %, +4 ({', '.join(NAMES[:3])}, …)"),
    ],
)
def test_what_is_gained_and_lost_of_the_figure(before: int, now: int, figures: str, wording: Wording) -> None:
    line = since_last_run(OBLIGATIONS, replace(a_run(1, cell()), visited=before), now)
    assert line.plain.endswith(figures)
    wording(line)
