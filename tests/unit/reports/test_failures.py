"""Why a run failed: the reasons, and the parts of the run that show them."""

from __future__ import annotations

from pathlib import Path

from scbm.files import load_model, read_case
from scbm.reports import told_failures
from scbm.testing import Tester

BEFORE = load_model(Path(__file__).parents[3] / "examples" / "robot_in_the_air" / "before.yaml")
CASE = "case: one\ngoal: item_a_scanned\n"
HOME = "  home: always gantry_req_state == executing -> robot_at == home\n"


def _told(more: str) -> list[str]:
    execution = Tester(BEFORE).execute(read_case(CASE + more, BEFORE))
    return [line.plain for line in told_failures(BEFORE, execution)]


def test_a_run_that_passed_has_nothing_to_tell() -> None:
    assert _told("") == []


def test_what_led_to_a_violation_is_shown_from_a_line_with_its_time() -> None:
    reason, dots, first, *_, last = told = _told(f"requirements:\n{HOME}")
    assert reason.startswith("home is violated at 1.700 s")
    assert dots.strip() == "…"
    assert first.startswith("    0.000 s    plan  5: ")
    assert last.strip().startswith("✗ home: ")
    assert len(told) == 14


def test_the_end_shows_that_something_else_was_expected() -> None:
    told = _told("expect: {final: robot_at == home}\n")
    assert told[0].startswith("expected robot_at == home at the end")
    assert told[-1].strip() == "■ reached"


def test_what_shows_two_reasons_is_shown_once() -> None:
    told = _told(f"requirements:\n{HOME}expect: {{final: robot_at == home}}\n")
    reasons, lines = told[:2], told[2:]
    assert [reason.split()[0] for reason in reasons] == ["home", "expected"]
    assert [line.strip() for line in lines].count("┌ gantry_move_to_box_a") == 1
    assert sum("✗ home" in line for line in lines) == 1
    assert lines[-1].strip() == "■ reached"


def test_a_long_stretch_is_shown_from_its_beginning() -> None:
    owed = "requirements:\n  owed: robot_at == toolbox_scanner leads to scan_timeouts == 1 within 2 s\n"
    told = _told(owed)
    assert any("completed   robot_at = toolbox_scanner" in line for line in told)
    assert any("✗ owed" in line for line in told)
