"""The coverability report at the end of a session, and what it decides."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from conftest import Ran
from support.cells import FAILS, PASSES, lines_with, write
from support.models import SCAN_CELL
from support.wording import Wording

NOTHING = "behavior_model: nothing\nvariables: {a: {domain: bool, initial: true}}\noperations: {}\n"


def _report(result: pytest.RunResult) -> list[str]:
    """What the session prints between the head of the report and the next one."""
    lines = result.stdout.lines
    begin = next(number for number, line in enumerate(lines) if " coverability " in line)
    end = next(number for number in range(begin + 1, len(lines)) if re.search(r"passed.* in \d", lines[number]))
    return lines[begin + 1 : end]


def test_the_report_is_that_of_the_command(cell: pytest.Pytester, wording: Wording) -> None:
    write(cell.path, one=PASSES)
    cell.makepyfile("def test_it(scbm_model): scbm_model('cell.yaml').run(goal='scanned', outcomes={'scan': 'fail'})")
    report = _report(cell.runpytest())
    wording(report)
    assert all("\x1b" not in line for line in report)


def test_the_report_has_the_colours_of_the_terminal(cell: pytest.Pytester) -> None:
    write(cell.path, one=PASSES)
    assert any("\x1b[1m" in line for line in _report(cell.runpytest("--color=yes")))
    assert any("\x1b[1m" in line for line in _report(cell.runpytest("--color=yes", "--scbm-report=short")))


@pytest.mark.longer
def test_a_report_is_as_long_as_asked(cell: pytest.Pytester, wording: Wording) -> None:
    write(cell.path, one=PASSES, two=FAILS)
    (short,) = _report(cell.runpytest("--scbm-report=short", "-rN"))
    assert short.startswith("cell.yaml: ")
    wording(short)
    full = _report(cell.runpytest("-q", "-rN", "--tb=no", "--scbm-report=full"))
    assert len(full) > 10
    wording(full[0])
    cell.runpytest("--scbm-report=none").stdout.no_fnmatch_line("*coverability*")
    assert cell.runpytest("--scbm-report=long").ret is pytest.ExitCode.USAGE_ERROR


@pytest.mark.slow
def test_a_report_of_several_models_or_a_quiet_one_is_short(cell: pytest.Pytester, wording: Wording) -> None:
    write(cell.path, one=PASSES)
    (quiet,) = lines_with(cell.runpytest("-q"), "cell.yaml: ")
    wording(quiet)
    write(cell.path, other__cell=SCAN_CELL, other__two=PASSES)
    assert _report(cell.runpytest()) == [quiet, f"other/{quiet}"]
    full = _report(cell.runpytest("--scbm-report=full"))
    assert [line.partition(": ")[2] for line in full if line.startswith("Coverability")] == ["scan_cell"] * 2


@pytest.mark.parametrize(("wanted", "code"), [("33.33", 0), ("33.34", 1), ("0", 0), ("100%", 1)])
def test_coverage_under_what_is_wanted_fails_the_session(
    cell: pytest.Pytester, wanted: str, code: int, wording: Wording
) -> None:
    write(cell.path, one=PASSES)
    result = cell.runpytest(f"--scbm-fail-under={wanted}")
    result.assert_outcomes(passed=1)
    assert result.ret == code
    (printed,) = lines_with(result, "Required")
    assert (printed.startswith("FAIL "), f" {wanted.removesuffix('%')} % " in printed) == (bool(code), True)
    wording(printed)


def test_every_model_has_to_reach_it(cell: pytest.Pytester, wording: Wording) -> None:
    covered = "def test_it(scbm_model): scbm_model('other.yaml').run(goal='a == true')"
    write(cell.path, one=PASSES, other=NOTHING)
    cell.makepyfile(covered)
    result = cell.runpytest("--scbm-fail-under=30", "--scbm-report=none")
    assert result.ret == 1
    (printed,) = lines_with(result, "Required")
    assert ("other.yaml" in printed, "cell.yaml" in printed) == (True, False)
    wording(printed)


def test_nothing_run_reaches_nothing(cell: pytest.Pytester, wording: Wording) -> None:
    result = cell.runpytest("--scbm-fail-under=1")
    assert result.ret == 1
    (printed,) = lines_with(result, "Required")
    wording(printed)
    cell.makepyfile("def test_it(): pass")
    result = cell.runpytest("--scbm-fail-under=1")
    result.assert_outcomes(passed=1)
    assert result.ret == 1
    assert lines_with(result, "Required") == [printed]


@pytest.mark.slow
def test_what_failed_otherwise_keeps_its_exit_code(cell: pytest.Pytester) -> None:
    cell.makepyfile("def test_it(): raise KeyboardInterrupt")
    assert cell.runpytest_subprocess("--scbm-fail-under=1").ret == pytest.ExitCode.INTERRUPTED


CLOSED = """
behavior_model: lamp
variables: {on: {domain: bool, initial: false}}
operations:
  switch: {pre: {g: on == false}, post: {g: true, a: [on <- true]}}
goals: {lit: on == true}
"""
LIT = "case: lit\nmodel: lamp.yaml\ngoal: lit\n"


@pytest.fixture
def lamp(pytester: pytest.Pytester, scbm: Callable[..., Ran], monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A directory with a model, one case, and the certificates of closing in `proofs`."""
    monkeypatch.chdir(pytester.path)  # `scbm` leaves it
    write(pytester.path, lamp=CLOSED, lit=LIT)
    assert scbm("close", pytester.path / "lamp.yaml", "--out", pytester.path / "proofs").code == 0
    for case in (pytester.path / "proofs").rglob("*.yaml"):
        case.unlink()
    return pytester


@pytest.mark.longer
@pytest.mark.parametrize(("options", "code"), [(["--scbm-certificates=proofs"], 0), ([], 1)], ids=["proved", "plain"])
def test_proofs_count_in_what_can_be_covered(
    lamp: pytest.Pytester, options: list[str], code: int, wording: Wording
) -> None:
    result = lamp.runpytest("--scbm-fail-under=coverable=100", "--scbm-fail-under=40", *options)
    result.assert_outcomes(passed=1)
    assert result.ret == code
    wording(lines_with(result, "Required"))
    figure = "100.00 %, 2 of 2" if options else "40.00 %, 2 of 5"
    result.stdout.fnmatch_lines([f"  Of what can be covered: {figure}"])
    (short,) = lines_with(lamp.runpytest("-q", *options), "lamp.yaml: ")
    assert ("100.00 % of what" in short) == bool(options)
    wording(short)


def test_a_certificate_of_another_version_does_not_count(lamp: pytest.Pytester, wording: Wording) -> None:
    write(lamp.path, lamp=CLOSED.replace("a: [on <- true]", "a: [on <- true], gr: on == false"))
    result = lamp.runpytest("--scbm-fail-under=coverable=100", "--scbm-certificates=proofs")
    assert result.ret == 1
    (first, *_) = lines_with(result, "Certificate that")
    assert "proofs/certificates/runs.json" in first
    wording(first)


def test_a_certificate_that_cannot_be_read_is_refused(lamp: pytest.Pytester) -> None:
    for name in ("lamp.yaml", "missing.json"):
        result = lamp.runpytest(f"--scbm-certificates={name}")
        assert result.ret is pytest.ExitCode.USAGE_ERROR
        result.stderr.fnmatch_lines([f"*--scbm-certificates: *{name}*"])


def test_thresholds_are_of_one_kind_each(cell: pytest.Pytester, wording: Wording) -> None:
    write(cell.path, one=PASSES)
    result = cell.runpytest("--scbm-fail-under=executing=100", "--scbm-fail-under=failed=1", "--scbm-report=none")
    assert result.ret == 1
    wording(lines_with(result, "Required"))
    result = cell.runpytest("--scbm-fail-under=faild=1")
    assert result.ret is pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*there is no kind `faild`; the kinds are all, *coverable"])


@pytest.mark.parametrize("wanted", ["101", "-1", "much", "nan", ""])
def test_what_is_no_percentage_is_refused(cell: pytest.Pytester, wanted: str, wording: Wording) -> None:
    write(cell.path, one=PASSES)
    result = cell.runpytest(f"--scbm-fail-under={wanted}")
    assert result.ret is pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"*--scbm-fail-under*`{wanted}`*"])
    wording(line for line in result.stderr.lines if "--scbm-fail-under" in line and f"`{wanted}`" in line)


def _furnish(cell: pytest.Pytester) -> None:
    for number in range(6):
        write(cell.path, **{f"case_{number}": PASSES.replace("scans", f"scans_{number}")})
    write(cell.path, other__cell=SCAN_CELL, other__two=FAILS)
    cell.makepyfile("""
        import pytest

        @pytest.mark.parametrize("seed", range(4))
        def test_it(scbm_model, seed):
            model = scbm_model("cell.yaml")
            model.random(seed, cases=2)
            model.run(goal="scanned", outcomes={"scan": ["fail"] * seed})
    """)


@pytest.mark.slow
def test_workers_report_together_what_one_process_reports(cell: pytest.Pytester) -> None:
    pytest.importorskip("xdist", reason="pytest-xdist is not installed")
    _furnish(cell)
    options = ("--scbm-report=full", "--scbm-fail-under=60", "--tb=no", "-rN")
    alone, together = (cell.runpytest_subprocess(*options, *spread) for spread in ((), ("-n", "2")))
    assert alone.ret == together.ret == 1
    together.assert_outcomes(passed=10, failed=1)
    assert _report(alone) == _report(together)
    assert len(lines_with(together, "Coverability")) == 2


@pytest.mark.slow
def test_workers_that_run_no_case_report_nothing(cell: pytest.Pytester) -> None:
    pytest.importorskip("xdist", reason="pytest-xdist is not installed")
    cell.makepyfile("def test_it(): pass")
    result = cell.runpytest_subprocess("-n", "2")
    assert result.ret == 0
    result.stdout.no_fnmatch_line("*coverability*")
    assert cell.runpytest_subprocess("-n", "2", "--scbm-fail-under=1").ret == 1
