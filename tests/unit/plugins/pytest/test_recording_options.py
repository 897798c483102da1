"""`--scbm-record` and `--scbm-update`: results in case files that pytest runs."""

from __future__ import annotations

import pytest

from support.cells import FAILS, PASSES, lines_with, write
from support.models import SCAN_CELL
from support.wording import Wording


def recorded(cell: pytest.Pytester, name: str = "one") -> str:
    return (cell.path / f"{name}.yaml").read_text(encoding="utf-8")


def test_results_are_recorded_in_files_of_cases_that_pass(cell: pytest.Pytester) -> None:
    write(cell.path, one=PASSES, two=FAILS)
    result = cell.runpytest("--scbm-record")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["*= recorded results =*", "one.yaml: added"])
    assert recorded(cell).startswith(f"{PASSES}recorded:\n  end: reached\n")
    assert recorded(cell, "two") == FAILS
    again = cell.runpytest("--scbm-record", "--scbm-update")
    again.assert_outcomes(passed=1, failed=1)
    again.stdout.no_fnmatch_line("*recorded results*")


@pytest.mark.longer
def test_a_difference_fails_until_it_is_updated(cell: pytest.Pytester, wording: Wording) -> None:
    write(cell.path, one=PASSES)
    cell.runpytest("--scbm-record")
    before = recorded(cell)
    wrong = before.replace("completed, ", "")
    assert wrong != before
    write(cell.path, one=wrong)
    failed = cell.runpytest()
    failed.assert_outcomes(failed=1)
    wording(lines_with(failed, "the run differs"))
    wording(lines_with(failed, "--scbm-update"))
    assert recorded(cell) == wrong
    updated = cell.runpytest("--scbm-update")
    updated.assert_outcomes(passed=1)
    updated.stdout.fnmatch_lines(["one.yaml: updated", "  visits: * new"])
    assert recorded(cell) == before
    cell.runpytest().assert_outcomes(passed=1)


def test_a_layout_that_cannot_be_edited_fails_the_test(cell: pytest.Pytester, wording: Wording) -> None:
    odd = f"{PASSES}? recorded\n: {{end: reached}}\n"
    write(cell.path, one=odd)
    result = cell.runpytest("--scbm-record")
    result.assert_outcomes(failed=1)
    wording(lines_with(result, "is unchanged"))
    assert recorded(cell) == odd


@pytest.mark.slow
def test_workers_of_xdist_record_as_one_process_does(cell: pytest.Pytester) -> None:
    pytest.importorskip("xdist", reason="pytest-xdist is not installed")
    names = [f"case_{number}" for number in range(4)]
    write(cell.path, cell=SCAN_CELL, **{name: PASSES.replace("scans", name) for name in names})
    result = cell.runpytest_subprocess("-n", "2", "--scbm-record")
    result.assert_outcomes(passed=4)
    assert lines_with(result, ": added") == [f"{name}.yaml: added" for name in names]
