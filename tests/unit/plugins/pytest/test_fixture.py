"""The fixture `scbm_model`: cases in Python tests."""

from __future__ import annotations

import pytest

from support.cells import lines_with, write
from support.models import SCAN_CELL
from support.wording import Wording


def _passes(cell: pytest.Pytester, source: str, *, count: int = 1) -> list[str]:
    """Run a passing module of tests; return the lines of the reports that say which cases were run."""
    cell.makepyfile(source)
    result = cell.runpytest()
    result.assert_outcomes(passed=count)
    return lines_with(result, " simulated, ")


def test_a_model_is_found_beside_the_test_and_runs_cases(cell: pytest.Pytester, wording: Wording) -> None:
    source = """
        def test_it(scbm_model):
            model = scbm_model("cell.yaml")
            assert model.behavior.name == "scan_cell"
            plain = model.run(goal="scanned")
            assert plain.verdict.passed and plain.verdict.end == "reached"
            assert plain.trace.case == plain.case.name == "test_it"
            late = model.run(goal="scanned", outcomes={"scan": ["timeout"]}, limits={"time": "1 min"})
            assert late.ended_ns == 10_000_000_000 and late.case.name == "test_it-2"
            injected = model.run(
                goal=model.behavior.goals[0][1],
                injections=[{"at": "0 s", "set": {"light": "red"}, "hold": "2 s"}],
                network={"loss": "10 %"},
                drawn={"seed": 1},
            )
            assert injected.case.injections and injected.case.origin.seed == 1
            assert model.run(goal="scanned", requirements={"never": "never light == green"}).violations
    """
    write(cell.path, cells__cell=SCAN_CELL)
    (cell.path / "cell.yaml").unlink()
    cell.makepyfile(**{"cells/test_it": source})
    result = cell.runpytest()
    result.assert_outcomes(passed=1)
    (printed,) = lines_with(result, " simulated, ")
    wording(printed.partition(", ")[2])


def test_a_case_of_a_test_has_several_goals(cell: pytest.Pytester) -> None:
    cell.makepyfile("""
        def test_goals(scbm_model):
            goals = [{"goal": "scanned"}, {"goal": "scanned", "when": "light == green", "expect": {"plan": []}}]
            execution = scbm_model("cell.yaml").run(goals=goals)
            assert len(execution.case.goals) == 2
            assert [failure.subject for failure in execution.verdict.failures] == ["plan"]
    """)
    cell.runpytest().assert_outcomes(passed=1)


@pytest.mark.longer
def test_a_run_does_not_raise_and_a_check_does(cell: pytest.Pytester, wording: Wording) -> None:
    cell.makepyfile("""
        def test_check(scbm_model):
            model = scbm_model("cell.yaml")
            assert not model.run(goal="scanned", expect={"verdict": "aborted"}).verdict.passed
            assert model.check(goal="scanned").verdict.passed
            model.check(case="mine", goal="scanned", expect={"verdict": "aborted"})
    """)
    result = cell.runpytest()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            '*model.check(case="mine", goal="scanned", expect={"verdict": "aborted"})',
            "E       AssertionError: * mine *",
            "E *■ reached",
            "test_a_run_does_not_raise_and_a_check_does.py:5: AssertionError",
        ]
    )
    lines = result.stdout.lines
    place = lines.index(lines_with(result, "AssertionError: ")[0])
    wording(lines[place : place + 2])
    assert "fixture.py" not in result.stdout.str()


def test_wrong_keys_are_reported_as_those_of_a_file(cell: pytest.Pytester) -> None:
    cell.makepyfile("""
        def test_wrong(scbm_model):
            scbm_model("cell.yaml").run(goal="scanned", initial={"light": "pink"}, outcoms="fail")

        def test_lost(scbm_model):
            scbm_model("sell.yaml")

        def test_none(scbm_model):
            scbm_model()
    """)
    result = cell.runpytest()
    result.assert_outcomes(failed=3)
    result.stdout.fnmatch_lines(
        [
            "E *InputError: model.run(…):3:20: error[[]value-outside-domain[]]: *",
            'E *initial: {"light": "pink"}',
            "E *model.run(…):4:1: error[[]unknown-key[]]: *",
            "E *= *`outcomes`?",
            "E *sell.yaml: error[[]file-missing[]]*",
            "E *scbm_model(): error[[]model-missing[]]*",
        ]
    )
    assert "fixture.py" not in result.stdout.str()


def test_without_a_path_the_model_is_that_of_the_configuration(cell: pytest.Pytester) -> None:
    cell.makeini("[pytest]\nscbm_model = cell.yaml\n")
    _passes(cell, "def test_it(scbm_model): assert scbm_model().run(goal='scanned').verdict.passed")


def test_random_cases_are_those_of_the_command(cell: pytest.Pytester, wording: Wording) -> None:
    source = """
        def test_it(scbm_model):
            model = scbm_model("cell.yaml")
            executions = model.random(seed=3, cases=7)
            assert [e.case.name for e in executions] == [f"seed-3-case-{n}" for n in range(1, 8)]
            model.run(goal="scanned")
    """
    (printed,) = _passes(cell, source)
    wording(printed.partition(", ")[2])


def test_random_cases_that_fail_show_each_cause_with_its_smallest_run_and_a_command(
    cell: pytest.Pytester, wording: Wording
) -> None:
    strict = f"{SCAN_CELL}requirements: {{never_lit: never light == green, never_done: never box_is_scanned == true}}\n"
    (cell.path / "strict.yaml").write_text(strict, encoding="utf-8")
    cell.makepyfile("""
        def test_it(scbm_model):
            assert len(scbm_model("cell.yaml").check_random(seed=3, cases=4)) == 4
            scbm_model("strict.yaml").check_random(seed=3, cases=4)
    """)
    result = cell.runpytest("--scbm-planner", "greedy")
    result.assert_outcomes(failed=1)
    wording(line.removeprefix("E       ") for line in result.stdout.lines if line.startswith("E "))
    assert "fixture.py" not in result.stdout.str()


def test_a_case_can_be_given_as_a_whole(cell: pytest.Pytester, wording: Wording) -> None:
    source = """
        import pytest

        def test_it(scbm_model):
            model = scbm_model("cell.yaml")
            case = model.run(goal="scanned").closed_case
            assert model.check(case).case is case
            with pytest.raises(TypeError):
                model.run(case, goal="scanned")
    """
    (printed,) = _passes(cell, source)
    wording(printed.partition(", ")[2])


def test_the_fixture_goes_with_hypothesis(cell: pytest.Pytester) -> None:
    source = """
        from hypothesis import given, settings, strategies as st
        from scbm.plugins.hypothesis import cases

        @given(st.data())
        @settings(max_examples=5, derandomize=True, deadline=None, database=None)
        def test_it(scbm_model, data):
            model = scbm_model("cell.yaml")
            model.check(data.draw(cases(model.behavior, outcomes=False)))
    """
    _passes(cell, source)


def test_names_of_tests_become_names_of_cases(cell: pytest.Pytester) -> None:
    source = """
        import pytest

        @pytest.mark.parametrize("word", ["a b/c", "ü"])
        def test_it(scbm_model, word):
            assert scbm_model("cell.yaml").run(goal="scanned").case.name.startswith("test_it")

        class TestMore:
            def test_it(self, scbm_model):
                assert scbm_model("cell.yaml").run(goal="scanned").case.name == "test_it"
    """
    _passes(cell, source, count=3)
