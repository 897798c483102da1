"""Decisions about built-in requirements of random models and their mutants, beside random runs of the tester."""

from __future__ import annotations

from contextlib import suppress
from random import Random

import pytest
from msgspec.structs import replace

from scbm.cases import Case
from scbm.closing import CloseLimits
from scbm.closing.decisions import RequirementStatus
from scbm.closing.requirements.requirement_closer import RequirementCloser
from scbm.model import BehaviorModel, GoalOrder, InputError, RunsDeclaration
from scbm.mutation import mutants_of
from scbm.testing import Campaign, Execution, FailureKind, RandomCases, Tester
from support.closings import closing_of
from support.opened_models import opened
from support.profiles import share, slow_beyond
from support.random_models import small_random_model

NUMBERS = [7, 2, *(number for number in range(30) if number not in (2, 4, 7, 10))]
"""Models 4 and 10 take seconds each."""

USUAL = 1
MUTANTS = 2
LIMITS = CloseLimits(situations=3_000, candidates=20)
VIOLATED = RequirementStatus.VIOLATED


def model_of(number: int) -> BehaviorModel:
    """Every third model is opened, so that something changes from outside; every second has single goals."""
    model = small_random_model(number)
    if number % 3 == 1:
        model = opened(model, number)
    return replace(model, runs=RunsDeclaration(GoalOrder.SINGLE if number % 2 else GoalOrder.SEQUENCE))


def runs_of(model: BehaviorModel) -> list[Execution]:
    """Random runs, and the same for two goals after each other where the model has such runs."""
    tester, random = Tester(model), RandomCases(model)
    found: list[Execution] = []
    with suppress(InputError):  # no combination of random values is allowed
        for number in range(1, share(100, usual=5) + 1):
            case = random.case(7, number)
            found.append(tester.execute(case))
            if model.runs.goals is GoalOrder.SEQUENCE:
                found.append(tester.execute(_with_two_goals(case, model, number)))
    return found


def _with_two_goals(case: Case, model: BehaviorModel, number: int) -> Case:
    name, predicate = model.goals[number % len(model.goals)]
    first = case.goals[0]
    return case.with_goals([first, replace(first, name=name, predicate=predicate)])


def violated_in(execution: Execution) -> list[str]:
    """The built-in requirements that a run violates; `recovers` only if nothing has changed from outside in it."""
    names = [violation.requirement for violation in execution.violations if violation.is_built_in]
    return [name for name in names if name != "recovers" or not execution.moves]


@pytest.mark.longer
@pytest.mark.parametrize("number", slow_beyond(USUAL, NUMBERS))
def test_what_holds_is_violated_by_no_run_and_what_is_violated_has_a_case(number: int) -> None:
    original = model_of(number)
    mutants = list(mutants_of(original))
    few = Random(f"requirements {number}").sample(mutants, min(MUTANTS, len(mutants)))
    for model in (original, *(mutant.model for mutant in few)):
        closer = RequirementCloser(model, LIMITS, lambda _: None)
        decisions = closer.decide(Campaign.of(model, ()), closing_of(model))
        holds = [each.name for each in decisions.decided if each.holds]
        for execution in runs_of(model):
            assert not [name for name in violated_in(execution) if name in holds], execution.case
        for each in decisions.decided:
            assert (each.execution is not None) == (each.status is VIOLATED)
            if each.execution is not None:
                again = Tester(model).execute(each.execution.case)
                built_in = [f.subject for f in again.verdict.failures if f.kind is FailureKind.BUILT_IN]
                assert each.name in built_in
