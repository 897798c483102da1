"""A planner, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from scbm.planning import DEFAULT_PLANNER, PLANNERS, Answer, PlanLimits, PlanProblem
from support.recipe_page import followed

BEFORE = "examples/robot_in_the_air/before.yaml"


def test_a_new_planner_is_chosen_by_its_name(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed("A planner", tmp_path) as recipe:
        (command,) = recipe.commands
        ran = scbm(*command, "--json")
        assert (ran.code, json.loads(ran.out)["status"]) == (0, "solved")
        found, canonical = (json.loads(scbm(*words, "--json").out)["plan"] for words in (command, command[:-2]))
        assert len(found) >= len(canonical)
        limited = json.loads(scbm(*command, "--json", "--max-expanded", "1").out)
        assert (limited["status"], limited["limit"]) == ("limit_reached", "expanded states")
        stopped = json.loads(scbm(*command, "--json", "--max-time", "1 ns").out)
        assert (stopped["status"], stopped["limit"]) == ("limit_reached", "time")
        assert "depth-first" in " ".join(scbm("plan", "--help").out.split())
    unknown = scbm(*command)
    assert (unknown.code, "depth-first" in unknown.err) == (2, True)


@pytest.mark.parametrize(
    "command",
    [
        ("run", BEFORE, "--goal", "item_a_delivered"),
        ("test", BEFORE, "--cases", "3", "--no-shrink"),
        pytest.param(("close", BEFORE), marks=pytest.mark.slow),
    ],
    ids=lambda command: command[0],
)
def test_runs_tests_and_proofs_plan_by_the_default_entry(
    command: tuple[str, ...], scbm: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked = []
    with followed("A planner", tmp_path):
        default = PLANNERS[DEFAULT_PLANNER]

        def noted(problem: PlanProblem, limits: PlanLimits) -> Answer:
            asked.append(problem.start)
            return default.search(problem, limits)

        monkeypatch.setitem(PLANNERS, DEFAULT_PLANNER, replace(default, search=noted))
        scbm(*command, *(("--failures", tmp_path) if command[0] == "test" else ()))
    assert asked
