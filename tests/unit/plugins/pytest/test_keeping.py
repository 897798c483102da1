"""`--scbm-store`: what a session ran is in a coverage store."""

from __future__ import annotations

import pytest

from scbm.store import Drawn, Replays, Written, read_history
from support.cells import FAILS, PASSES, lines_with, write
from support.models import SCAN_CELL
from support.wording import Wording

TESTS = """
def test_it(scbm_model):
    model = scbm_model('cell.yaml')
    model.run(goal='scanned', outcomes={'scan': 'fail'})
    model.random(cases=3, seed=1)
"""


def test_the_cases_of_a_session_are_added_in_order(cell: pytest.Pytester, wording: Wording) -> None:
    write(cell.path, one=PASSES, two=FAILS)
    cell.makepyfile(TESTS)
    result = cell.runpytest("--scbm-store=cov.db", "--tb=no")
    wording((*lines_with(result, "Since"), *lines_with(result, "cov.db: ")))
    history = read_history(cell.path / "cov.db")
    assert [case.position for case in history.cases] == [1, 2, 3, 4, 5, 6]
    assert [type(case.recipe) for case in history.cases].count(Drawn) == 3
    files = [case.recipe.path for case in history.cases if isinstance(case.recipe, Written)]
    assert sorted(files) == ["one.yaml", "test_the_cases_of_a_session_are_added_in_order.py", "two.yaml"]
    assert (history.runs[0].cases, history.runs[0].failed) == (6, 2)
    assert history.runs[0].command.split()[:3] == ["pytest", "--scbm-store=cov.db", "--tb=no"]
    for case in history.cases:
        again = Replays(history).execute(case)
        assert again is not None
        assert (again.visited, again.verdict) == (case.visited, case.verdict)


@pytest.mark.slow
def test_workers_fill_one_store(cell: pytest.Pytester) -> None:
    write(cell.path, one=PASSES, two=FAILS)
    cell.makepyfile(TESTS)
    cell.runpytest("--scbm-store=alone.db", "--tb=no")
    cell.runpytest_subprocess("-n", "2", "--scbm-store=shared.db", "--tb=no")
    alone, shared = read_history(cell.path / "alone.db"), read_history(cell.path / "shared.db")
    assert alone.cases == shared.cases
    assert (shared.runs[0].cases, len(shared.runs)) == (6, 1)


def test_a_session_of_two_models_has_no_store(cell: pytest.Pytester, wording: Wording) -> None:
    write(cell.path, one=PASSES, other__cell=SCAN_CELL, other__two=PASSES)
    result = cell.runpytest("--scbm-store=cov.db")
    (printed,) = lines_with(result, "FAIL cov.db")
    wording(printed)
    assert result.ret is pytest.ExitCode.TESTS_FAILED
    assert not (cell.path / "cov.db").exists()


def test_a_file_that_is_no_store_fails_the_session_and_stays(cell: pytest.Pytester) -> None:
    write(cell.path, one=PASSES)
    (cell.path / "cov.db").write_text("notes", encoding="utf-8")
    result = cell.runpytest("--scbm-store=cov.db")
    result.stdout.fnmatch_lines(["FAIL *cov.db: error?not-a-store?: *"])
    assert result.ret is pytest.ExitCode.TESTS_FAILED
    assert (cell.path / "cov.db").read_text(encoding="utf-8") == "notes"


def test_a_session_without_cases_adds_nothing(cell: pytest.Pytester) -> None:
    cell.makepyfile("def test_it(): pass")
    result = cell.runpytest("--scbm-store=cov.db")
    assert result.ret is pytest.ExitCode.OK
    assert not (cell.path / "cov.db").exists()


def test_the_store_is_seen_from_where_pytest_was_called(cell: pytest.Pytester) -> None:
    write(cell.path, one=PASSES)
    cell.makepyfile("import os\ndef test_it():\n    os.mkdir('below')\n    os.chdir('below')\n")
    result = cell.runpytest("--scbm-store=cov.db")
    assert result.ret is pytest.ExitCode.OK
    assert [file.parent for file in cell.path.rglob("cov.db")] == [cell.path]
    assert len(read_history(cell.path / "cov.db").cases) == 1


@pytest.mark.longer
def test_the_options_for_the_planner_count_for_all_cases(cell: pytest.Pytester) -> None:
    write(cell.path, one=PASSES, two=FAILS)
    cell.makepyfile(TESTS)
    options = ("--scbm-planner=greedy", "--scbm-max-length=7", "--scbm-max-expanded=900")
    result = cell.runpytest("--scbm-store=cov.db", "--tb=short", *options)
    assert [run.planner for run in read_history(cell.path / "cov.db").runs] == [
        "greedy 1, max_length 7, max_expanded 900"
    ]
    (command,) = lines_with(result, "scbm replay")
    assert command.endswith("two.yaml --planner greedy --max-length 7 --max-expanded 900")


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("--scbm-planner=greddy", "*--scbm-planner:1:1: error?unknown-planner?*"),
        ("--scbm-max-length=-1", "*--scbm-max-length: -1 is less than 0*"),
        ("--scbm-max-expanded=0", "*--scbm-max-expanded: 0 is less than 1*"),
    ],
)
def test_options_for_the_planner_that_do_not_fit_are_refused(cell: pytest.Pytester, option: str, message: str) -> None:
    write(cell.path, one=PASSES)
    result = cell.runpytest(option)
    assert result.ret is pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([message])


def test_a_limit_that_another_program_would_ignore_fails_the_cases(cell: pytest.Pytester) -> None:
    write(cell.path, one=PASSES)
    result = cell.runpytest("--scbm-planner=fast-downward", "--scbm-max-expanded=9")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*--scbm-max-expanded: error?bad-option?*"])
