"""The example with two CNC machines: its cases and random cases pass, and closing decides all of its obligations."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from scbm.cases import Case, OutcomeRule
from scbm.cases.trace import End, PlanReceived
from scbm.files import load_model, open_case
from scbm.model import BehaviorModel, Outcome
from scbm.testing import Execution, RandomCases, Tester
from support.profiles import share, slow_where

if TYPE_CHECKING:
    from conftest import Ran

    Scbm = Callable[..., Ran]

EXAMPLE = Path(__file__).parents[3] / "examples" / "dual_cnc"
CELL, BEFORE, LIFTED = EXAMPLE / "cell.yaml", EXAMPLE / "before.yaml", EXAMPLE / "lifted.yaml"
CASES = sorted((EXAMPLE / "cases").glob("*.yaml"))
LIFTED_CASES = sorted((EXAMPLE / "lifted_cases").glob("*.yaml"))


@pytest.fixture(scope="module")
def cell() -> BehaviorModel:
    return load_model(CELL)


@pytest.fixture(scope="module")
def before() -> BehaviorModel:
    return load_model(BEFORE)


def run_case(model: BehaviorModel, path: Path) -> Execution:
    return Tester(model).execute(open_case(path).read(model))


@pytest.mark.longer
@pytest.mark.parametrize(
    "file", slow_where(lambda file: file == BEFORE, [CELL, BEFORE, LIFTED]), ids=lambda file: file.stem
)
def test_the_model_has_no_warnings(file: Path, scbm: Scbm) -> None:
    ran = scbm("check", "--strict", file)
    assert (ran.code, ran.out.splitlines()[0]) == (0, f"{file}: good")
    assert "22 operations" in ran.out


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_a_case_of_the_example_passes(path: Path, cell: BehaviorModel) -> None:
    assert run_case(cell, path).verdict.failures == ()


def test_the_stop_case_finds_the_lost_cut_of_the_first_version(before: BehaviorModel, tmp_path: Path) -> None:
    text = (EXAMPLE / "cases" / "stop_reset_resume.yaml").read_text(encoding="utf-8")
    path = tmp_path / "stop_reset_resume.yaml"
    path.write_text(text.replace(", automatic/cut_1_broken_off", ""), encoding="utf-8")
    failures = [str(failure) for failure in run_case(before, path).verdict.failures]
    assert any("part_1 == cutting" in failure for failure in failures), failures


@pytest.mark.parametrize("start", [{}, {"raw_parts": 0, "finished_parts": 2}], ids=["raw parts", "finished parts"])
def test_runs_without_faults_reach_their_goals(start: dict[str, int], cell: BehaviorModel) -> None:
    for name, goal in cell.goals:
        execution = Tester(cell).execute(Case(name, name, goal, cell.nominal_state.replace(start)))
        assert execution.verdict.end is End.REACHED


@pytest.mark.parametrize("moves_inputs", [False, True], ids=["at the rates of the model", "inputs drawn"])
def test_random_cases_pass_and_never_wait_for_a_plan(moves_inputs: bool, cell: BehaviorModel) -> None:  # noqa: FBT001 - a parameter of the test
    tester = Tester(cell)
    for case in RandomCases(cell, moves_inputs=moves_inputs).first(share(200), 1):
        execution = tester.execute(case)
        assert execution.verdict.failures == (), case.name
        answers = [record for record in execution.trace.records if isinstance(record, PlanReceived)]
        assert {answer.status for answer in answers} <= {"solved"}, case.name


def test_random_cases_find_the_lost_cut_of_the_first_version(before: BehaviorModel) -> None:
    execution = Tester(before).execute(RandomCases(before).case(1, 3))
    assert ["a_stop_ends_cut_2 is violated" in str(failure) for failure in execution.verdict.failures] == [True]


def test_a_broken_tool_ends_the_wait_for_the_cut_at_once(cell: BehaviorModel, before: BehaviorModel) -> None:
    ends = {}
    for name, model in {"cell": cell, "before": before}.items():
        goal = dict(model.goals)["pallet_finished"]
        broken = OutcomeRule("start_cut_1", 1, 1, Outcome.FAIL, latency_ns=30_000_000_000)
        case = Case("broken_tool", "pallet_finished", goal, model.nominal_state, outcomes=(broken,))
        ends[name] = Tester(model).execute(case).result.ended_ns
    assert ends["before"] - ends["cell"] > 60_000_000_000


def test_the_operator_case_finds_a_cut_that_the_planner_cannot_finish(tmp_path: Path) -> None:
    text = CELL.read_text(encoding="utf-8")
    reset = "a: [cnc_1_req_state <- initial, cnc_1_req_trigger <- false, part_1 <- finished]\n    failed"
    assert reset in text
    path = tmp_path / "cell.yaml"
    path.write_text(text.replace(reset, reset.replace("cnc_1_req_state <- initial, ", "")), encoding="utf-8")
    failures = run_case(load_model(path), EXAMPLE / "cases" / "operator_after_two_missed_picks.yaml").verdict.failures
    assert any("expected start_cut_1" in str(failure) for failure in failures)


def in_lifted_names(text: str) -> str:
    """The text with the names of the lifted cell: `cut_done.m1` for `cut_1_done`, `clamp.m1` for `clamp_1`."""
    text = re.sub(r"\bcut_([12])_(done|failed|broken_off)\b", r"cut_\2.m\1", text)
    return re.sub(r"\b(\w+)_([12])\b", r"\1.m\2", text).replace("cell.yaml", "lifted.yaml")


def recorded_in_lifted_names(model: BehaviorModel, path: Path) -> list[tuple[object, ...]]:
    """End, visits, order and time of the runs that a case has recorded."""
    recorded = open_case(path).read(model).recorded
    assert recorded is not None
    return [
        (
            goal.end,
            sorted(map(in_lifted_names, goal.visits or ())),
            [*map(in_lifted_names, goal.order or ())],
            goal.ended_ns,
        )
        for goal in recorded.goals
    ]


def test_the_cases_of_the_lifted_cell_say_the_same(cell: BehaviorModel, scbm: Scbm) -> None:
    lifted = load_model(LIFTED)
    assert [path.name for path in LIFTED_CASES] == [path.name for path in CASES]
    for path, of_lifted in zip(CASES, LIFTED_CASES, strict=True):
        written = [file.read_text(encoding="utf-8").partition("recorded:")[0] for file in (path, of_lifted)]
        assert in_lifted_names(written[0]) == written[1]
        runs = recorded_in_lifted_names(cell, path)
        assert runs
        assert runs == recorded_in_lifted_names(lifted, of_lifted)
    assert scbm("test", LIFTED, *LIFTED_CASES).code == 0


def test_the_lifted_cell_says_the_same_in_at_most_130_lines(cell: BehaviorModel, scbm: Scbm) -> None:
    assert len(LIFTED.read_text(encoding="utf-8").splitlines()) <= 130
    lifted = load_model(LIFTED)
    written = (cell.operations, cell.automatic_transitions, cell.resources, cell.environment)
    assert [
        len(lifted.operations),
        len(lifted.automatic_transitions),
        len(lifted.resources),
        len(lifted.environment),
    ] == [len(part) for part in written]
    for goal, _ in cell.goals:
        lengths = [len(json.loads(scbm("plan", file, "--goal", goal, "--json").out)["plan"]) for file in (CELL, LIFTED)]
        assert lengths[0] == lengths[1], goal
    for case in RandomCases(lifted).first(share(100), 1):
        assert Tester(lifted).execute(case).verdict.failures == (), case.name


@pytest.mark.slow
def test_a_third_machine_needs_one_name_more(scbm: Scbm, tmp_path: Path) -> None:
    text = LIFTED.read_text(encoding="utf-8")
    assert "{machine: [m1, m2]}" in text
    path = tmp_path / "three.yaml"
    path.write_text(text.replace("{machine: [m1, m2]}", "{machine: [m1, m2, m3]}"), encoding="utf-8")
    ran = scbm("check", "--strict", path)
    assert (ran.code, ran.out.splitlines()[0]) == (0, f"{path}: good")
    assert len(load_model(path).operations) == 31


@pytest.mark.slow
def test_closing_decides_the_same_of_the_lifted_cell(scbm: Scbm) -> None:
    closed = [json.loads(scbm("close", file, "--json").out) for file in (CELL, LIFTED)]
    decisions = [sorted(each["decision"] for each in result["obligations"]) for result in closed]
    assert decisions[0] == decisions[1]


@pytest.mark.slow
def test_closing_covers_all_that_can_be_covered(scbm: Scbm, tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    ran = scbm("close", CELL, "--out", closed, "--json")
    assert ran.code == 0
    result = json.loads(ran.out)
    assert (result["failed"], result["found"]) == ([], [])
    statuses = {each["name"]: each["decision"] for each in result["obligations"]}
    assert set(statuses.values()) == {"covered", "uncoverable"}
    assert sorted(name for name, status in statuses.items() if status == "uncoverable") == [
        "automatic/interlock_1",
        "automatic/interlock_2",
        "start_cut_1/failed",
        "start_cut_1/timedout",
        "start_cut_2/failed",
        "start_cut_2/timedout",
    ]
    assert scbm("test", CELL, closed, "--certificates", closed, "--fail-under", "coverable=100").code == 0


@pytest.mark.slow
def test_closing_finds_that_the_first_version_waits_without_end(scbm: Scbm) -> None:
    result = json.loads(scbm("close", BEFORE, "--json").out)
    names = [each["case"] for each in result["found"]]
    cases = {each["name"]: each["adds"] for each in result["cases"]}
    assert [cases[name] for name in names] == [["finish_cut_1/disabled"], ["finish_cut_2/disabled"]]
