"""Models as PDDL, and Fast Downward on what was exported."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from scbm.cases import Case, RecordedPlan
from scbm.files import load_model, read_case, read_model, write_case
from scbm.model import InputError, PlannerChoice, PlannerIdentity, Slug
from scbm.planning import PLANNERS, Planner, PlannerEntry, PlanProblem, Solved, Unsolvable, find_flaw
from scbm.planning.pddl_export import PddlDomain
from scbm.planning.plan_answers import Answer, PlanLimits
from scbm.testing import Tester
from support.models import SCAN_CELL, scan_cell
from support.random_models import random_model

EXAMPLE = Path("examples/robot_in_the_air/after.yaml")

COUNTER = """
behavior_model: Counter
variables:
  n: {domain: 0..3, initial: 0}
  m: {domain: 0..3, initial: 1}
  Light: {domain: [on, off], initial: off}
  light: {domain: [on, off], initial: off}
operations:
  count: {pre: {g: n < m || light == on}, post: {g: true, a: [n += 1]}}
  copy: {pre: {g: n != m}, post: {g: true, a: [m <- n, Light <- on]}}
goals:
  far: n == 3 && Light == on
  nowhere: n == 1 && n == 2
"""

needs_fast_downward = [
    pytest.mark.peer,
    pytest.mark.skipif(
        find_spec("up_fast_downward") is None and os.environ.get("SCBM_ALL_TOOLS") != "1",
        reason="not installed: up-fast-downward",
    ),
    pytest.mark.filterwarnings("ignore"),  # those of libraries of others
]


def test_operations_with_counters_become_actions_for_each_value() -> None:
    model = read_model(COUNTER)
    domain = PddlDomain(model, [goal for _, goal in model.goals])
    counting = [action for action, operation in domain.operations.items() if operation == "count"]
    assert len(counting) > 1
    names = re.findall(r"\(:action (\S+)", domain.text)
    assert names == list(domain.operations)
    facts = re.findall(r"^    \(([^)\s]+)\)", domain.text, re.MULTILINE)
    assert len({fact.casefold() for fact in facts}) == len(facts)
    assert {"light-on", "light-on_2"} <= {*facts}
    text = domain.problem("nowhere", model.nominal_state, model.goals[1][1])
    assert "(:goal (never))" in text


def test_a_goal_named_domain_does_not_replace_the_domain(scbm: Callable[..., Any], tmp_path: Path) -> None:
    model = tmp_path / "cell.yaml"
    model.write_text(SCAN_CELL.replace("goals:\n", "goals:\n  domain: box_is_scanned == true\n"), encoding="utf-8")
    ran = scbm("export", "pddl", model, "--out", tmp_path / "out")
    texts = {Path(line).name: Path(line).read_text(encoding="utf-8") for line in ran.out.splitlines()}
    assert list(texts) == ["domain.pddl", "domain-problem.pddl", "scanned.pddl"]
    second_lines = {name: text.splitlines()[1] for name, text in texts.items()}
    assert second_lines["domain.pddl"].startswith("(define (domain ")
    assert second_lines["domain-problem.pddl"].startswith("(define (problem ")


def test_the_command_writes_a_domain_and_a_problem_for_each_goal(scbm: Callable[..., Any], tmp_path: Path) -> None:
    assert scbm("export", "pddl", EXAMPLE, "--out", tmp_path).code == 0
    model = load_model(EXAMPLE)
    assert {path.stem for path in tmp_path.glob("*.pddl")} == {"domain", *(name for name, _ in model.goals)}
    one = scbm("export", "pddl", EXAMPLE, "--goal", "robot_at == agv", "--out", tmp_path / "one")
    assert one.out.splitlines() == [str(tmp_path / "one" / name) for name in ("domain.pddl", "goal-1.pddl")]


def test_a_missing_extra_is_named_with_the_command_that_installs_it(
    scbm: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(_: str) -> str:
        raise metadata.PackageNotFoundError

    monkeypatch.setattr(metadata, "version", missing)
    ran = scbm("plan", EXAMPLE, "--goal", "item_a_scanned", "--planner", "fast-downward")
    assert (ran.code, "error[planner-missing]" in ran.err) == (2, True)
    assert "pip install 'scbm[fast-downward]'" in ran.err


# plans in cases


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """An external planner `outside`, which plans as the canonical one; the result has the states that it was asked."""
    starts: list[int] = []

    def search(problem: PlanProblem, limits: PlanLimits) -> Answer:
        starts.append(problem.start)
        return PLANNERS["canonical"].search(problem, limits)

    monkeypatch.setitem(PLANNERS, "outside", PlannerEntry("9", search, "", is_external=True))
    return starts


def test_a_replay_takes_the_plans_of_another_program_from_the_case(asked: list[int]) -> None:
    model = replace(scan_cell(), planner=PlannerChoice("outside"))
    name, goal = model.goals[0]
    first = Tester(model).execute(Case("case", name, goal, model.nominal_state))
    assert asked
    assert first.trace.planner == PlannerIdentity("outside", "9")
    case = first.recorded_case
    assert case.plans == (RecordedPlan("solved", ("scan_box",)),)
    assert read_case(write_case(case, model, None), model) == case
    asked.clear()
    again = Tester(model).execute(case)
    assert (asked, again.digest, again.trace.planner) == ([], first.digest, first.trace.planner)


@pytest.mark.parametrize("plans", [(RecordedPlan("solved", ()),), (RecordedPlan("solved", ("scan_box", "scan_box")),)])
def test_a_recorded_plan_that_does_not_fit_is_an_error(plans: tuple[RecordedPlan, ...]) -> None:
    model = scan_cell()
    name, goal = model.goals[0]
    with pytest.raises(InputError) as raised:
        Tester(model).execute(Case("case", name, goal, model.nominal_state, plans=plans))
    assert [found.slug for found in raised.value.diagnostics] == [Slug.REPLAY_DIFFERS]


def test_a_recorded_answer_without_a_plan_ends_the_run() -> None:
    model = scan_cell()
    name, goal = model.goals[0]
    case = Case("case", name, goal, model.nominal_state, plans=(RecordedPlan("no_plan_found"),))
    assert Tester(model).execute(case).verdict.end == "no_plan_found"


# Fast Downward


@pytest.mark.parametrize("number", range(1, 13))
@pytest.mark.parametrize("planner", ["fast-downward", "fast-downward-optimal"])
class TestFastDownward:
    pytestmark = needs_fast_downward

    def test_plans_for_exported_random_models_are_valid(self, number: int, planner: str) -> None:
        model = random_model(number)
        for _, goal in model.goals[:2]:
            expected = Planner(model).plan(model.nominal_state, goal)
            found = Planner(model, planner).plan(model.nominal_state, goal)
            if isinstance(found, Solved):
                assert find_flaw(model, model.nominal_state, goal, found.plan) is None
                assert isinstance(expected, Solved)
                if planner == "fast-downward-optimal":
                    assert len(found.plan) == len(expected.plan)
            else:
                assert isinstance(expected, Unsolvable)


@pytest.mark.parametrize("goal", ["far", "nowhere"])
class TestCounter:
    pytestmark = needs_fast_downward

    def test_comparisons_and_counters_are_exported(self, goal: str, scbm: Callable[..., Any], tmp_path: Path) -> None:
        file = tmp_path / "counter.yaml"
        file.write_text(COUNTER, encoding="utf-8")
        found = json.loads(scbm("plan", file, "--goal", goal, "--planner", "fast-downward", "--json").out)
        expected = json.loads(scbm("plan", file, "--goal", goal, "--json").out)
        assert (found["plan"] is None) == (expected["plan"] is None)
        assert found["planner"]["version"].startswith("2/")


RESET = """
behavior_model: reset
variables:
  a: {domain: [one, two, three, four], initial: one}
  b: {domain: [one, two, three, four], initial: one}
  c: {domain: [one, two, three, four], initial: one}
  done: {domain: bool, initial: false}
operations:
  reset: {pre: {g: done == false, a: [a <- two, b <- three, c <- four, done <- true]}, post: {g: true}}
goals: {set: a == two && b == three && c == four}
"""


class TestManyOldValues:
    pytestmark = needs_fast_downward

    def test_an_operation_that_sets_many_variables_has_no_conditional_effects_for_lm_cut(
        self, scbm: Callable[..., Any], tmp_path: Path
    ) -> None:
        file = tmp_path / "reset.yaml"
        file.write_text(RESET, encoding="utf-8")
        found = json.loads(scbm("plan", file, "--goal", "set", "--planner", "fast-downward-optimal", "--json").out)
        assert found["plan"] == ["reset"]


class TestLimitsAndGoals:
    pytestmark = needs_fast_downward

    def test_a_search_ends_at_its_time_limit(self, scbm: Callable[..., Any], tmp_path: Path) -> None:
        file = tmp_path / "reset.yaml"
        file.write_text(RESET, encoding="utf-8")
        arguments = ("--goal", "set", "--planner", "fast-downward", "--max-time", "1 us", "--json")
        found = json.loads(scbm("plan", file, *arguments).out)
        assert (found["status"], found["plan"]) == ("limit_reached", None)

    def test_an_optimal_plan_to_one_of_two_goals_is_found(self, scbm: Callable[..., Any], tmp_path: Path) -> None:
        file = tmp_path / "reset.yaml"
        file.write_text(RESET, encoding="utf-8")
        goal = "(a == two && b == one) || (b == three && c == four)"
        found = json.loads(scbm("plan", file, "--goal", goal, "--planner", "fast-downward-optimal", "--json").out)
        assert found["plan"] == ["reset"]
