"""Decisions about requirements of the user and `non_blocking`, beside a second interpreter of random models."""

from __future__ import annotations

from random import Random

import pytest
from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.closing import CloseLimits, Closer
from scbm.closing.decisions import DecidedRequirement, RequirementStatus
from scbm.closing.requirements.requirement_closer import RequirementCloser
from scbm.files import read_case, write_case
from scbm.model import (
    And,
    BehaviorModel,
    Constant,
    Equal,
    GoalOrder,
    Not,
    Or,
    Predicate,
    Reference,
    Requirement,
    RunPlans,
    RunsDeclaration,
    Variable,
)
from scbm.model.requirements import AfterAlways, Always, Before, LeadsTo, Never, RequirementForm
from scbm.planning import model_with_plans
from scbm.testing import Campaign, Tester
from support.closings import closing_of
from support.opened_models import opened
from support.profiles import share, slow_beyond
from support.random_models import small_random_model
from support.reference_requirements import blocked_goals, violated_by_some_run

SENTENCES = 10
MOST = 6_000
LIMITS = CloseLimits(situations=3_000, candidates=20)
VIOLATED = RequirementStatus.VIOLATED


def model_of(number: int) -> BehaviorModel:
    """Every third model is opened, every fourth has single goals; each has sentences about any of its variables."""
    model = small_random_model(number)
    if number % 3 == 1:
        model = opened(model, number)
    goals = GoalOrder.SINGLE if number % 4 == 3 else GoalOrder.SEQUENCE
    random = Random(f"req {number}")
    sentences = [Requirement(f"r{index}", _sentence(index, random, model)) for index in range(SENTENCES)]
    return replace(model, runs=RunsDeclaration(goals), requirements=tuple(sentences), requirements_off=())


def _sentence(index: int, random: Random, model: BehaviorModel) -> RequirementForm:
    space = list(model.running_space)
    p, q, r = (_predicate(random, space) for _ in range(3))
    return (Always(p), Never(p), Before(p, q), AfterAlways(p, q, r), LeadsTo(p, q))[index % 5]


def _predicate(random: Random, space: list[Variable]) -> Predicate:
    first, choice = _comparison(random, space), random.random()
    if choice >= 0.5:
        return first
    return (And if choice < 0.35 else Or)((first, _comparison(random, space)))


def _comparison(random: Random, space: list[Variable]) -> Predicate:
    variable = space[int(random.random() * len(space))]
    values = variable.domain.values
    equal = Equal(Reference(variable.name), Constant(values[int(random.random() * len(values))]))
    return Not(equal) if random.random() < 0.4 else equal


@pytest.mark.longer
@pytest.mark.parametrize("number", slow_beyond(1, range(share(60))))
def test_decisions_agree_with_the_second_interpreter(number: int) -> None:
    model = model_of(number)
    closer = RequirementCloser(model, LIMITS, lambda _: None)
    decided = closer.decide(Campaign.of(model, ()), closing_of(model)).decided
    for each in decided:
        if each.status is VIOLATED or each.holds:
            expected = _violated(model, each)
            assert expected in {None, each.status is VIOLATED}, each
        if each.execution is not None:
            again = Tester(model).execute(each.execution.case)
            assert (each.name, each.is_built_in) in [(v.requirement, v.is_built_in) for v in again.violations]


@pytest.mark.longer
@pytest.mark.parametrize("number", slow_beyond(1, (5, 2, 16, 22, 27)))
def test_a_written_case_with_other_plans_shows_each_violation_that_they_have(number: int) -> None:
    model = model_of(number)
    decided = (
        RequirementCloser(model, CloseLimits(), lambda _: None)
        .decide(Campaign.of(model, ()), closing_of(model))
        .decided
    )
    found = [each for each in decided if each.other_execution is not None]
    assert found
    for each in found:
        assert each.other_execution is not None
        assert each.status in (RequirementStatus.HOLDS_CANONICAL, RequirementStatus.UNDECIDED)
        again = Tester(model).execute(read_case(write_case(each.other_execution.case, model, None), model))
        assert (each.name, each.is_built_in) in [(v.requirement, v.is_built_in) for v in again.violations]


@pytest.mark.slow
@pytest.mark.parametrize("number", [23, 56])
def test_models_with_drawn_plans_are_closed_and_written_cases_repeat_violations(number: int) -> None:
    model = model_with_plans(RunPlans.DRAWN, model_of(number))
    model = replace(model, requirements=model.requirements[:5])
    limits = CloseLimits(situations=1_500, candidates=10)
    closing = Closer(model, limits).close(Campaign.of(model, ()))
    for each in RequirementCloser(model, limits, lambda _: None).decide(Campaign.of(model, ()), closing).decided:
        if each.execution is not None:
            written = write_case(each.execution.case, model, None)
            again = Tester(model).execute(read_case(written, model))
            assert (each.name, each.is_built_in) in [(v.requirement, v.is_built_in) for v in again.violations]


def _violated(model: BehaviorModel, decided: DecidedRequirement) -> bool | None:
    """Whether some run violates a requirement; `None` if the second interpreter does not say it."""
    if decided.execution is not None and decided.execution.verdict.end is End.LIVELOCK:
        return None  # it does not count the plans of one instant
    if decided.is_built_in:
        blocked = blocked_goals(model, MOST) if decided.name == "non_blocking" else None
        return None if blocked is None else bool(blocked)
    sentence = next(each.sentence for each in model.requirements if each.name == decided.name)
    return violated_by_some_run(model, sentence, MOST)
