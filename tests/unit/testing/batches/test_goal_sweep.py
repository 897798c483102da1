"""Plans for all goals of a model: the same answers on any number of processes."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from scbm.files import load_model, write_model
from scbm.model import PlannerChoice
from scbm.planning import PlanLimits, Planner, Solved
from scbm.testing.batches.goal_sweep import GoalSweep
from support.models import scan_cell
from support.profiles import share
from support.random_models import random_model

BEFORE = Path("examples/robot_in_the_air/before.yaml")


def test_each_goal_has_the_answer_of_a_planner_that_is_asked_alone() -> None:
    model = replace(random_model(5), planner=PlannerChoice("greedy"))
    goals = tuple(goal for _, goal in model.goals) * 3
    answers = list(GoalSweep(model, model.nominal_state, goals, PlanLimits()).answers())
    assert answers == [Planner.of(model).plan(model.nominal_state, goal) for goal in goals]


LIMITS = (PlanLimits(expansions=40), PlanLimits(), PlanLimits(length=5))
"""Limits for planning; the first ones leave two goals without a plan. Each starts processes."""


@pytest.mark.longer
@pytest.mark.parametrize("jobs", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_answers_do_not_depend_on_the_number_of_processes(jobs: int) -> None:
    model = load_model(BEFORE)
    goals = tuple(goal for _, goal in model.goals)
    for limits in LIMITS[: share(len(LIMITS), least=1)]:
        sweep = GoalSweep(model, model.nominal_state, goals, limits)
        assert list(sweep.answers(jobs)) == [
            Planner.of(model).plan(model.nominal_state, goal, limits) for goal in goals
        ]


@pytest.mark.slow
def test_no_worker_stays_behind_a_sweep_that_is_left() -> None:
    model = load_model(BEFORE)
    sweep = GoalSweep(model, model.nominal_state, tuple(goal for _, goal in model.goals), PlanLimits())
    before = len(multiprocessing.active_children())
    answers = sweep.answers(2)
    assert isinstance(next(answers), Solved)
    answers.close()
    assert len(multiprocessing.active_children()) == before


@pytest.mark.slow
def test_a_command_without_a_goal_plans_for_all(scbm: Callable[..., Any]) -> None:
    ran = [scbm("plan", BEFORE, "--json", "--state", "robot_at=home", *jobs) for jobs in ((), ("-j", 1), ("-j", 2))]
    assert len({each.out for each in ran}) == 1
    report = json.loads(ran[0].out)
    for entry in report["goals"]:
        alone = json.loads(scbm("plan", BEFORE, "--goal", entry["name"], "--state", "robot_at=home", "--json").out)
        assert {key: entry[key] for key in ("goal", "status", "plan", "expanded", "limit")}.items() <= alone.items()
    assert [entry["name"] for entry in report["goals"]] == [name for name, _ in load_model(BEFORE).goals]
    assert [line.split()[0] for line in scbm("plan", BEFORE).out.splitlines()] == [e["name"] for e in report["goals"]]


def test_the_exit_code_is_1_if_one_goal_has_no_plan(scbm: Callable[..., Any]) -> None:
    assert scbm("plan", BEFORE).code == 0
    assert scbm("plan", BEFORE, "--max-length", 5).code == 1


def test_wrong_options_are_refused(scbm: Callable[..., Any], tmp_path: Path) -> None:
    one = scbm("plan", BEFORE, "--goal", "item_a_scanned", "-j", 2)
    assert (one.code, "-j: error[bad-option]" in one.err) == (2, True)
    file = tmp_path / "cell.yaml"
    file.write_text(write_model(replace(scan_cell(), goals=(), requirements=())), encoding="utf-8")
    none = scbm("plan", file)
    assert (none.code, "error[no-goals]" in none.err) == (2, True)
