"""The planner of the checker finds what the planner of runs finds, though they share no code."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.cases.coverage import Obligations
from scbm.files import read_model
from scbm.model import FIRST_PLANNER, BehaviorModel, Role
from scbm.planning import Planner, Solved
from scbm.proofcheck import Certificate, GoalRuns, RunsArgument, check_certificate, checker_planner
from scbm.proofcheck.certificate import claimable_obligations
from scbm.proofcheck.checker_planner import CanonicalPlanner, NoPlanExists, PlanFound, PlanningLimitReached
from support.random_models import random_model
from support.strategies import running_models
from support.wording import Wording

THREE_PLACES = """
behavior_model: three_places
variables:
  at: {domain: [a, b, c], initial: a}
operations:
  to_b: {pre: {g: at == a}, post: {g: true, a: [at <- b]}}
  to_c: {pre: {g: at == b}, post: {g: true, a: [at <- c]}}
goals:
  at_c: at == c
"""


@pytest.mark.slow
@given(st.one_of(running_models(), st.integers(0, 199).map(random_model)), st.data())
def test_the_planner_of_the_checker_finds_the_canonical_plan(model: BehaviorModel, data: st.DataObject) -> None:
    _, goal = data.draw(st.sampled_from(model.goals))
    checker, planner = CanonicalPlanner(model, goal), Planner(model)
    for _ in range(5):
        state = {v.name: data.draw(st.sampled_from(v.domain.values)) for v in model.space}
        expected = planner.plan(state, goal)
        assert checker.plan(state) == (PlanFound(expected.plan) if isinstance(expected, Solved) else NoPlanExists())


def test_the_limit_of_planning_is_an_answer_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    model = read_model(THREE_PLACES)
    _, goal = model.goals[0]
    assert CanonicalPlanner(model, goal).plan({"at": "a"}) == PlanFound(("to_b", "to_c"))
    assert CanonicalPlanner(model, goal).plan({"at": "c"}) == PlanFound(())
    monkeypatch.setattr(checker_planner, "MAX_PLANNING_STATES", 1)
    assert CanonicalPlanner(model, goal).plan({"at": "a"}) == PlanningLimitReached()
    assert CanonicalPlanner(model, goal).plan({"at": "b"}) == PlanFound(("to_c",))


def test_a_step_that_needs_a_plan_beyond_the_limit_is_a_flaw(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    """Nothing is known of the plan that the runner gets, so nothing is proved."""
    model = read_model(THREE_PLACES + "runs: {goals: single}\n")
    variables = tuple(v.name for v in model.running_space if v.role is not Role.OPERATION_STATE)
    claims = ("to_b/failed",)
    argument = RunsArgument(variables, (GoalRuns("at_c", ()),))
    certificate = Certificate(model.name, "0" * 64, claims, argument, FIRST_PLANNER)
    assert check_certificate(certificate, model) == ()  # all is done at one moment
    monkeypatch.setattr(checker_planner, "MAX_PLANNING_STATES", 1)
    (flaw,) = check_certificate(certificate, model)
    assert "at_c" in flaw.where
    assert "at=a" in flaw.where
    wording((flaw.where, flaw.reason))


@given(running_models())
def test_the_checker_names_obligations_as_coverage_does(model: BehaviorModel) -> None:
    assert {str(o) for o in claimable_obligations(model)} == {str(o) for o in Obligations.of(model)}
