"""A goal is unreachable only if no plan leads to it after changes that happen without one, as random runs show."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.closing.advice import check_model
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, Slug
from scbm.testing import RandomCases, Tester

VALID = Path(__file__).parents[3] / "models" / "valid"
TEXT = (VALID / "press_start.yaml").read_text(encoding="utf-8")
BEGIN = "begin: {g: button == down && mode == manual, a: [mode <- auto]}"
PUSH = """environment:
  push: {guard: button == up, actions: [button <- down], every: {exponential: 2 s}}
"""
BUTTON = "button: {domain: [up, down], initial: up}"
PRESS = "press: {simulation: {latency: 2 s}}"
MODE = "mode: {domain: [manual, auto], initial: manual, source: state}"
MEASURED = (MODE, "mode: {domain: [manual, auto], initial: manual}")


def _model(*replacements: tuple[str, str]) -> BehaviorModel:
    text = TEXT
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return read_model(text)


def _goals(model: BehaviorModel) -> list[Slug]:
    known = (Slug.GOAL_UNREACHABLE, Slug.GOAL_NOT_ALWAYS_REACHABLE)
    return [doubt.slug for doubt in check_model(model).doubts if doubt.slug in known]


def _reached(model: BehaviorModel, *, moves_inputs: bool = False) -> int:
    cases = RandomCases(model, moves_inputs=moves_inputs).first(20, 1)
    return sum(Tester(model).execute(case).verdict.end.value == "reached" for case in cases)


@pytest.mark.parametrize(
    "replacements",
    [
        pytest.param((), id="an environment transition"),
        pytest.param(((PUSH, ""), (BUTTON, f"{BUTTON[:-1]}, source: input}}")), id="a declared input"),
        pytest.param(((PUSH, ""),), id="an input that an automatic transition reads"),
        pytest.param(((PUSH, ""), ("button == down && ", "")), id="an automatic transition"),
        pytest.param(
            ((PUSH, ""), (PRESS, f"{PRESS}\n  panel: {{publishes: {{button: [down]}}}}")), id="a published value"
        ),
        pytest.param(
            (
                (PUSH, ""),
                ("up, down]", "up, half, down]"),
                (PRESS, f"{PRESS}\n  panel: {{publishes: {{button: [down]}}}}"),
            ),
            id="one of the values",
        ),
        pytest.param(
            (
                (PUSH, ""),
                MEASURED,
                (PRESS, f"{PRESS}\n  panel: {{measures: {{mode: [auto]}}, simulation: {{latency: 1 s}}}}"),
                (BEGIN, "ask: {g: panel_req_state == initial, a: [panel_req_trigger <- true]}"),
            ),
            id="a request of an automatic transition",
        ),
        pytest.param(
            ((BEGIN, "begin: {g: plan.state == planning && button == down, a: [mode <- auto]}"),),
            id="the state of the plan",
        ),
    ],
)
def test_a_goal_that_changes_without_a_plan_lead_to_is_not_doubted(replacements: tuple[tuple[str, str], ...]) -> None:
    model = _model(*replacements)
    assert (_goals(model), _reached(model, moves_inputs=not model.environment)) == ([], 20)


@pytest.mark.parametrize(
    "replacements",
    [
        pytest.param(((BEGIN, "begin: {g: mode == auto, a: [mode <- manual]}"),), id="no transition"),
        pytest.param(((BEGIN, "begin: {g: form.state == executing, a: [mode <- auto]}"),), id="only during operations"),
        pytest.param(
            ((BEGIN, "begin: {g: press_req_state == executing, a: [mode <- auto]}"),), id="only during requests"
        ),
        pytest.param(((BEGIN, "begin: {g: button == down, a: [mode <- auto, plan.state <- aborted]}"),), id="an abort"),
        pytest.param(
            (
                MEASURED,
                (BEGIN, ""),
                ("automatic_transitions:\n  \n", ""),
                (PRESS, f"{PRESS[:-1]}, measures: {{mode: [auto]}}}}"),
            ),
            id="a reply that no plan asks for",
        ),
        pytest.param(
            (("guard: button == up", "guard: part == formed"), ("button <- down", "button <- down")),
            id="a later change",
        ),
        pytest.param(
            (
                (PUSH, ""),
                (BEGIN, "begin: {g: mode == auto, a: [mode <- auto]}"),
                ("guard: mode", "guard: button == down && mode"),
            ),
            id="an operation that reads what nothing assigns",
        ),
    ],
)
def test_a_goal_that_no_run_reaches_is_doubted(replacements: tuple[tuple[str, str], ...]) -> None:
    model = _model(*replacements)
    assert (_goals(model), _reached(model)) == ([Slug.GOAL_UNREACHABLE], 0)


def test_initial_states_from_which_changes_lead_to_the_goal_are_not_lost() -> None:
    random = (MODE, f"{MODE[:-1]}, random: any}}")
    assert _goals(_model(random)) == []
    assert _goals(_model(random, (BEGIN, "begin: {g: mode == auto && part == formed, a: [mode <- manual]}"))) == [
        Slug.GOAL_NOT_ALWAYS_REACHABLE
    ]


def test_the_failure_that_an_operation_takes_for_a_success_is_doubted() -> None:
    (doubt,) = check_model(load_model(VALID / "ward_delivery.yaml")).doubts
    assert (doubt.slug, doubt.path) == (
        Slug.FAILURE_UNNOTICED,
        ("resources", "dispenser", "simulation", "outcomes", "fail"),
    )
