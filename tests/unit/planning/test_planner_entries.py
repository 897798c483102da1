"""What `Planner` does with the answer of an entry of `PLANNERS`, whichever it is."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from scbm.model import InputError, Slug
from scbm.planning import (
    PLANNERS,
    Answer,
    NoPlanFound,
    PlanCache,
    PlanLimits,
    Planner,
    PlannerEntry,
    PlanProblem,
    Solved,
)
from support.models import scan_cell
from support.wording import Wording

BEFORE = "examples/robot_in_the_air/before.yaml"


@pytest.fixture
def answering(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[int]]:
    """Enter a planner `fixed` that gives one answer to all problems; the result has the states it was asked for."""

    def enter(answer: Answer, *, is_external: bool = False) -> list[int]:
        asked: list[int] = []

        def search(problem: PlanProblem, limits: PlanLimits) -> Answer:  # noqa: ARG001 - a planner takes limits
            asked.append(problem.start)
            return answer

        entry = PlannerEntry("7", search, "the same answer to all problems", is_external=is_external)
        monkeypatch.setitem(PLANNERS, "fixed", entry)
        return asked

    return enter


@pytest.mark.parametrize("plan", [("scan_box", "scan_box"), (), ("unheard_of",)])
def test_a_flawed_plan_of_a_built_in_planner_is_a_fault_that_names_the_planner(
    plan: tuple[str, ...], answering: Callable[..., list[int]], wording: Wording
) -> None:
    answering(Solved(plan, 1))
    model = scan_cell()
    planner = Planner(model, "fixed")
    for plans in (planner, PlanCache(planner)):
        with wording.raises(AssertionError):
            plans.plan(model.nominal_state, model.goals[0][1])


def test_a_flawed_plan_of_an_external_planner_is_an_error_that_names_the_planner(
    answering: Callable[..., list[int]],
    wording: Wording,
) -> None:
    answering(Solved(("scan_box", "scan_box"), 1), is_external=True)
    model = scan_cell()
    with pytest.raises(InputError) as raised:
        Planner(model, "fixed").plan(model.nominal_state, model.goals[0][1])
    (found,) = raised.value.diagnostics
    assert (found.slug, found.place.file) == (Slug.PLANNER_FAILED, "planner fixed")
    wording(found.message)


def test_a_cache_asks_any_planner_once_for_a_state(answering: Callable[..., list[int]]) -> None:
    asked = answering(Solved(("scan_box",), 1_000_000))
    model = scan_cell()
    cache = PlanCache(Planner(model, "fixed"))
    plans = [cache.plan(model.nominal_state, model.goals[0][1]) for _ in range(3)]
    assert [plan.status for plan in plans] == ["solved"] * 3
    assert len(asked) == 1


def test_a_command_distinguishes_an_incomplete_search_from_a_proof(
    answering: Callable[..., list[int]], scbm: Callable[..., Any], wording: Wording
) -> None:
    answering(NoPlanFound(12))
    command = ("plan", BEFORE, "--goal", "item_a_scanned", "--planner", "fixed")
    ran = scbm(*command, "--json")
    found = json.loads(ran.out)
    assert (ran.code, found["status"], found["plan"], found["limit"]) == (1, "no_plan_found", None, None)
    assert found["planner"] == {"name": "fixed", "version": "7"}
    shown = scbm(*command)
    assert shown.code == 1
    wording(shown.out)


def test_a_flawed_plan_of_a_built_in_planner_ends_a_command_as_a_fault_of_scbm(
    answering: Callable[..., list[int]], scbm: Callable[..., Any], wording: Wording
) -> None:
    answering(Solved(("pick_item_a",), 1))
    ran = scbm("plan", BEFORE, "--goal", "item_a_scanned", "--planner", "fixed")
    assert ran.code == 3
    wording([line for line in ran.err.splitlines() if "fixed" in line][-1])
