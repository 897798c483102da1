"""Case files are pytest items."""

from __future__ import annotations

import subprocess
import sys

import pytest

from support.cells import FAILS, PASSES, WRONG, lines_with, write
from support.models import SCAN_CELL
from support.wording import Wording


def test_where_there_are_no_cases_the_plugin_does_nothing(cell: pytest.Pytester) -> None:
    write(cell.path, other="lowercase: 1\n", list="- case\n", empty="")
    cell.makepyfile("def test_it(): pass")
    result = cell.runpytest("-v")
    result.assert_outcomes(passed=1)
    result.stdout.no_fnmatch_line("*coverability*")
    result.stdout.no_fnmatch_line("*yaml*")


def test_the_plugin_itself_imports_no_other_package_and_little_of_its_own() -> None:
    code = (
        "import sys, pytest; before = frozenset(sys.modules); import scbm.plugins.pytest\n"
        "print(*sorted(frozenset(sys.modules) - before))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["scbm", "scbm.plugins", "scbm.plugins.pytest", "scbm.plugins.pytest.session_stash"]


@pytest.mark.slow
def test_a_session_without_cases_loads_nothing_more(pytester: pytest.Pytester) -> None:
    write(pytester.path, other="lowercase: 1\n")
    pytester.makepyfile(
        "import sys\n"
        "def test_it(): assert not [name for name in ('pydantic', 'lark', 'scbm.files') if name in sys.modules]\n"
    )
    pytester.runpytest_subprocess().assert_outcomes(passed=1)


def test_a_case_is_an_item_of_its_name(cell: pytest.Pytester) -> None:
    write(cell.path, cases__one=PASSES.replace("cell", "../cell"))
    result = cell.runpytest("-v")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["*cases/one.yaml::scans PASSED*", "*coverability*", "  SCBM-IAS: 33.33 %*"])
    assert result.ret is pytest.ExitCode.OK


def test_both_suffixes_are_those_of_cases(cell: pytest.Pytester) -> None:
    (cell.path / "a.yml").write_text(PASSES)
    (cell.path / "b.json").write_text(PASSES)
    cell.runpytest().assert_outcomes(passed=1)


def test_a_failing_case_says_why_and_shows_it_and_reports_the_command(cell: pytest.Pytester, wording: Wording) -> None:
    write(cell.path, cases__two=FAILS.replace("cell", "../cell"), one=PASSES)
    result = cell.runpytest()
    result.assert_outcomes(failed=1, passed=1)
    assert result.ret is pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(
        [
            "*_ case never_scans _*",
            "never_executing *",
            "    0.000 s  ● goal *",
            "*✗ never_executing: *",
            "*■ reached",
            "again: scbm replay cases/two.yaml",
            "FAILED cases/two.yaml::never_scans - never_executing *",
        ]
    )
    lines = result.stdout.lines
    place = lines.index(lines_with(result, " case never_scans ")[0])
    wording(lines[place + 1 : place + 3])
    wording(lines_with(result, "✗"))
    for word in ("Traceback", "runtest", "items.py", "Error"):
        assert word not in result.stdout.str()


def test_a_failure_is_placed_at_the_case(cell: pytest.Pytester) -> None:
    write(cell.path, two="# a comment\n\n" + FAILS)
    result = cell.runpytest("--tb=line")
    result.stdout.fnmatch_lines(["*two.yaml:3: never_executing *"])


def test_what_is_wrong_fails_its_item_alone_with_its_place(cell: pytest.Pytester) -> None:
    write(
        cell.path,
        a_wrong=WRONG,
        b_syntax="case: syntax\n  goal: [\n",
        c_modelless="case: modelless\ngoal: scanned\n",
        d_lost=PASSES.replace("cell.yaml", "sell.yaml"),
        e_broken_model=PASSES.replace("cell.yaml", "broken.yaml"),
        broken="behavior_model: broken\nvariables: 3\n",
        f_passes=PASSES,
    )
    result = cell.runpytest()
    result.assert_outcomes(failed=5, passed=1)
    result.stdout.fnmatch_lines(
        [
            "a_wrong.yaml:3:7: error[[]unknown-goal[]]: *",
            "a_wrong.yaml:4:18: error[[]value-outside-domain[]]*",
            "b_syntax.yaml:*: error[[]yaml-syntax[]]*",
            "c_modelless.yaml: error[[]model-missing[]]*",
            "d_lost.yaml:3:8: error[[]file-missing[]]: *`sell.yaml`",
            "*`cell.yaml`?",
            "broken.yaml:*: error[[]wrong-shape[]]*",
            "FAILED a_wrong.yaml::wrong - a_wrong.yaml:3:7: error*",
            "FAILED b_syntax.yaml::b_syntax - *",
        ]
    )
    assert "Traceback" not in result.stdout.str()


def test_a_file_that_is_named_and_is_no_case_is_left_alone(cell: pytest.Pytester) -> None:
    result = cell.runpytest("cell.yaml")
    assert result.ret is pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*cell.yaml*"])


def test_a_file_that_cannot_be_read_is_left_alone(cell: pytest.Pytester) -> None:
    (cell.path / "gone.yaml").symlink_to(cell.path / "nowhere.yaml")
    write(cell.path, one=PASSES)
    cell.runpytest().assert_outcomes(passed=1)


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["-k", "second"], ["two.yaml::second"]),
        (["-k", "not second"], ["one.yaml::scans"]),
        (["two.yaml::second"], ["two.yaml::second"]),
        (["one.yaml"], ["one.yaml::scans"]),
    ],
)
def test_cases_are_selected_as_tests_are(cell: pytest.Pytester, arguments: list[str], names: list[str]) -> None:
    write(cell.path, one=PASSES, two=PASSES.replace("scans", "second"))
    result = cell.runpytest("-v", "-p", "no:cacheprovider", *arguments)
    result.assert_outcomes(passed=len(names), deselected=2 - len(names) if "-k" in arguments else 0)
    result.stdout.fnmatch_lines([f"{name} PASSED*" for name in names])


def test_collecting_alone_runs_nothing(cell: pytest.Pytester) -> None:
    write(cell.path, two=FAILS)
    result = cell.runpytest("--collect-only", "-q", "--scbm-fail-under=30")
    assert result.ret is pytest.ExitCode.OK
    result.stdout.fnmatch_lines(["two.yaml::never_scans"])
    result.stdout.no_fnmatch_line("*coverability*")


def test_the_first_failure_stops_if_asked(cell: pytest.Pytester, wording: Wording) -> None:
    write(cell.path, a=FAILS, b=PASSES)
    result = cell.runpytest("-x")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*coverability*"])
    wording(line.partition(", ")[2] for line in lines_with(result, " simulated, "))


def test_the_configuration_turns_collecting_off(cell: pytest.Pytester) -> None:
    write(cell.path, one=PASSES)
    cell.makeini("[pytest]\nscbm_cases = false\n")
    assert cell.runpytest().ret is pytest.ExitCode.NO_TESTS_COLLECTED
    cell.runpytest("-o", "scbm_cases=true").assert_outcomes(passed=1)


def test_the_configuration_supplies_a_model_and_an_option_replaces_it(cell: pytest.Pytester) -> None:
    dull = SCAN_CELL.replace("scan_cell", "dull_cell").replace("initial: false}\n  light", "initial: true}\n  light")
    write(cell.path, models__dull=dull, cases__none="case: none\ngoal: scanned\n", cases__one=PASSES)
    cell.makeini("[pytest]\nscbm_model = models/dull.yaml\n")
    result = cell.runpytest()
    result.assert_outcomes(passed=1, failed=1)  # the configuration does not replace the model that a case names
    result.stdout.fnmatch_lines(["cases/one.yaml:3:8: error[[]file-missing[]]*", "*: dull_cell"])
    result = cell.runpytest("--scbm-model=cell.yaml")
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["*: scan_cell"])


def test_the_command_names_a_model_that_the_case_does_not(cell: pytest.Pytester) -> None:
    write(cell.path, two=FAILS.replace("model: cell.yaml\n", ""))
    result = cell.runpytest("--scbm-model=cell.yaml")
    result.stdout.fnmatch_lines(["again: scbm replay two.yaml --model cell.yaml"])


@pytest.mark.longer
def test_the_command_names_the_planner_where_the_case_records_another_one(cell: pytest.Pytester) -> None:
    recorded = f"recorded: {{end: reached, trace: {'0' * 64}, planner: greedy 1}}\n"
    write(cell.path, two=FAILS + recorded)
    cell.runpytest().stdout.fnmatch_lines(["again: scbm replay two.yaml --planner canonical"])
    cell.runpytest("--scbm-planner=greedy").stdout.fnmatch_lines(["again: scbm replay two.yaml --planner greedy"])
    write(cell.path, two=f"{FAILS}{recorded}plans: [[scan_box]]\n")
    cell.runpytest("--scbm-planner=greedy").stdout.fnmatch_lines(["again: scbm replay two.yaml"])


@pytest.mark.slow
def test_a_model_is_loaded_once(cell: pytest.Pytester) -> None:
    cell.makeconftest("""
        from pathlib import Path
        from scbm.plugins.pytest import session_models

        def load(path, real=session_models.load_model):
            with Path("loaded.txt").open("a") as stream:
                stream.write(f"{path.name}\\n")
            return real(path)

        session_models.load_model = load
    """)
    write(cell.path, one=PASSES, two=PASSES.replace("scans", "second"))
    (cell.path / "link.yaml").symlink_to(cell.path / "cell.yaml")
    write(cell.path, three=PASSES.replace("cell.yaml", "link.yaml"))
    cell.runpytest_subprocess().assert_outcomes(passed=3)
    assert (cell.path / "loaded.txt").read_text() == "cell.yaml\n"
