"""Why something is missing: one reason for each way in which it can be."""

from __future__ import annotations

import pytest

from scbm.cases.coverage import Aspect, Obligation
from scbm.model import BehaviorModel
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.missed_reasons import close_command, missed_reasons
from support.campaigns import visiting
from support.models import scan_cell
from support.wording import Wording

TIMELESS = (("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))


def _reason_lines(visited: str, model: BehaviorModel | None = None, file: str = "cell.yaml") -> dict[str, str]:
    result = visiting(model or scan_cell(), visited.split())
    return {str(m.obligation): m.reason for m in missed_reasons(result, file, CampaignKind())}


@pytest.mark.parametrize(
    ("visited", "missed"),
    [
        ("", "failed"),
        ("", "queued"),
        ("scan_box/queued", "failed"),
        ("scan_box/queued", "executing"),
        ("scan_box/queued scan_box/executing", "failed"),
        ("scan_box/queued scan_box/executing", "completed"),
        ("scan_box/queued scan_box/executing", "timedout"),
        ("scan_box/queued", "disabled"),
    ],
)
def test_each_way_of_missing_has_its_words(visited: str, missed: str, wording: Wording) -> None:
    wording(_reason_lines(visited)[f"scan_box/{missed}"])


def test_what_has_no_deadline_never_times_out(wording: Wording) -> None:
    lines = _reason_lines("scan_box/queued scan_box/executing", scan_cell(*TIMELESS))
    wording(lines["scan_box/timedout"])


def test_the_guard_is_that_of_the_transition(wording: Wording) -> None:
    more = "automatic_transitions:\n  other:\n    g: count == 2\n    a: [count <- 0]\n"
    lines = _reason_lines("", scan_cell(("automatic_transitions:\n", more)))
    wording(lines["automatic/other"])
    assert lines["automatic/scan_failed"] != lines["automatic/other"]


def test_commands_are_for_a_shell() -> None:
    missed = missed_reasons(visiting(scan_cell(), []), "my cell.yaml", CampaignKind())
    assert missed[0].command == f"scbm explain 'my cell.yaml' {missed[0].obligation}"
    assert missed[-1].obligation == Obligation("scan_box", Aspect.QUEUED)
    assert close_command("my cell.yaml") == "scbm close 'my cell.yaml' --out closed"
