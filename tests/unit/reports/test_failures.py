"""Why a run failed: the reasons, and the parts of the run that show them."""

from __future__ import annotations

from pathlib import Path

from scbm.files import load_model, read_case
from scbm.reports import failure_lines
from scbm.testing import Tester
from support.wording import Wording

BEFORE = load_model(Path(__file__).parents[3] / "examples" / "robot_in_the_air" / "before.yaml")
CASE = "case: one\ngoal: item_a_scanned\n"
HOME = "  home: always gantry_req_state == executing -> robot_at == home\n"


def _failure_lines(more: str) -> list[str]:
    execution = Tester(BEFORE).execute(read_case(CASE + more, BEFORE))
    return [line.plain for line in failure_lines(BEFORE, execution)]


def test_a_run_that_passed_has_nothing_to_report() -> None:
    assert _failure_lines("") == []


def test_what_led_to_a_violation_is_shown_from_a_line_with_its_time(wording: Wording) -> None:
    reason, dots, first, *_, last = lines = _failure_lines(f"requirements:\n{HOME}")
    assert reason.startswith("home ")
    wording(reason)
    assert dots.strip() == "…"
    assert first.split()[:4] == ["0.000", "s", "plan", "5:"]
    assert last.strip().startswith("✗ home: ")
    assert len(lines) == 14


def test_the_end_shows_that_something_else_was_expected(wording: Wording) -> None:
    lines = _failure_lines("expect: {final: robot_at == home}\n")
    wording(lines[0])
    assert lines[-1].strip() == "■ reached"


def test_what_shows_two_reasons_is_shown_once(wording: Wording) -> None:
    shown = _failure_lines(f"requirements:\n{HOME}expect: {{final: robot_at == home}}\n")
    reasons, lines = shown[:2], shown[2:]
    wording(reasons)
    assert [line.strip() for line in lines].count("┌ gantry_move_to_box_a") == 1
    assert sum("✗ home" in line for line in lines) == 1
    assert lines[-1].strip() == "■ reached"


def test_a_long_stretch_is_shown_from_its_beginning() -> None:
    late_home = "requirements:\n  late_home: robot_at == toolbox_scanner leads to scan_timeouts == 1 within 2 s\n"
    lines = _failure_lines(late_home)
    assert any("completed   robot_at = toolbox_scanner" in line for line in lines)
    assert any("✗ late_home" in line for line in lines)
