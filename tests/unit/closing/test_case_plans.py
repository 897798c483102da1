"""The plans of cases that closing tries: their budgets, and the runs that end where a plan is refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from msgspec.structs import replace
from published import PROBLEMS, independent

from scbm.cases import Case
from scbm.cases.trace import End
from scbm.closing import CloseLimits, Closer
from scbm.closing.scripts import case_plans
from scbm.closing.scripts.case_plans import CasePlans, PlanEffort
from scbm.closing.scripts.case_search import bounded
from scbm.files import load_model
from scbm.model import BehaviorModel, PlannerChoice, Predicate, State, Value
from scbm.planning import Answer, PlanCache, PlanLimits, Planner, PlanRefusedError, Solved
from scbm.testing import RandomCases, Tester

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air" / "before.yaml"
MUCH = 10_000_000


def blocks() -> BehaviorModel:
    """A model whose plan takes more than the first part of the search."""
    return PROBLEMS["blocks-8-0"]()


def _ask(plans: CasePlans, model: BehaviorModel) -> Answer:
    return plans.plan(model.nominal_state, model.goals[0][1], PlanLimits())


@pytest.mark.longer
def test_a_long_search_is_refused_and_not_begun_again() -> None:
    model = blocks()
    plans = CasePlans(model)
    with plans.effort(PlanEffort.BRIEF, MUCH):
        for _ in range(3):
            with pytest.raises(PlanRefusedError):
                _ask(plans, model)
            assert plans.refused == 1
            assert 0 < plans.expanded < 50_000, "later questions expand nothing"


@pytest.mark.slow
def test_a_refused_plan_is_searched_for_with_more_effort_and_then_known() -> None:
    model = blocks()
    plans = CasePlans(model)
    with plans.effort(PlanEffort.BRIEF, MUCH), pytest.raises(PlanRefusedError):
        _ask(plans, model)
    with plans.effort(PlanEffort.WHOLE):
        whole = _ask(plans, model)
    assert isinstance(whole, Solved)
    with plans.effort(PlanEffort.BRIEF, 0):
        assert _ask(plans, model) == whole


@pytest.mark.longer
def test_whole_searches_have_a_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(case_plans, "_WHOLE_STATES", 0)
    model = blocks()
    plans = CasePlans(model)
    with plans.effort(PlanEffort.WHOLE, MUCH), pytest.raises(PlanRefusedError):
        _ask(plans, model)


def test_without_budget_a_plan_is_refused_until_there_is_one() -> None:
    model = load_model(EXAMPLE)
    plans = CasePlans(model)
    with plans.effort(PlanEffort.BRIEF, 0), pytest.raises(PlanRefusedError):
        _ask(plans, model)
    with plans.effort(PlanEffort.BRIEF, 1):
        assert _ask(plans, model) == Planner(model).plan(model.nominal_state, model.goals[0][1])


def test_a_planner_without_a_brief_search_is_asked_whatever_the_effort() -> None:
    model = replace(load_model(EXAMPLE), planner=PlannerChoice("greedy"))
    plans = CasePlans(model)
    assert not plans.are_limited
    with plans.effort(PlanEffort.BRIEF, 0):
        assert isinstance(_ask(plans, model), Solved)


class _FewPlans:
    """Answers the first questions only."""

    def __init__(self, model: BehaviorModel, count: int) -> None:
        self._cache = PlanCache(Planner.of(model))
        self._left = count

    def plan(self, state: Mapping[str, Value], goal: Predicate, limits: PlanLimits) -> Answer:
        if not self._left:
            raise PlanRefusedError
        self._left -= 1
        return self._cache.plan(state, goal, limits)


def _asked(tester: Tester, case: Case) -> int:
    return sum(record.kind == "plan_asked" for record in tester.execute(case).trace.records)


def _replanning_case(model: BehaviorModel) -> Case:
    """A case whose run asks for several plans."""
    tester = Tester(model)
    return next(case for case in RandomCases(model).first(50, 0) if _asked(tester, case) > 2)


def test_a_run_ends_where_a_plan_is_refused_and_its_case_says_so() -> None:
    model = load_model(EXAMPLE)
    case = _replanning_case(model)

    class _Again(_FewPlans):
        """The same answers for the second run, which `bounded` begins."""

        def plan(self, state: Mapping[str, Value], goal: Predicate, limits: PlanLimits) -> Answer:
            try:
                return super().plan(state, goal, limits)
            except PlanRefusedError:
                self._left = 2
                raise

    cut = bounded(Tester(model, plans=_Again(model, 2)), case)
    assert cut is not None
    assert (cut.case.limits.plans, cut.verdict.end) == (2, End.REPLAN_LIMIT)
    assert Tester(model).execute(cut.case).digest == cut.digest
    whole = Tester(model).execute(case)
    shared = sum(1 for a, b in zip(cut.trace.records, whole.trace.records, strict=False) if a == b)
    assert shared >= len(cut.trace.records) - 1, "up to its end the run is the same"


def test_a_goal_whose_plan_is_refused_is_left_out_with_those_after_it() -> None:
    model = load_model(EXAMPLE)
    tester = Tester(model)
    case = next(
        case
        for case in RandomCases(model, goals=3).first(50, 0)
        if len(case.goals) == 3 and _asked(tester, case.with_goals(case.goals[:1])) == 1 < _asked(tester, case)
    )

    class _First(_FewPlans):
        def plan(self, state: Mapping[str, Value], goal: Predicate, limits: PlanLimits) -> Answer:
            try:
                return super().plan(state, goal, limits)
            except PlanRefusedError:
                self._left = 1
                raise

    cut = bounded(Tester(model, plans=_First(model, 1)), case)
    assert cut is not None
    assert cut.case.goals == case.goals[:1]


def test_a_run_without_any_plan_is_none() -> None:
    model = load_model(EXAMPLE)
    case = Case("case", *model.goals[0], State(model.space, dict(model.nominal_state)))
    assert bounded(Tester(model, plans=_FewPlans(model, 0)), case) is None


@pytest.mark.slow
@pytest.mark.parametrize("planning", [1, 40, 400])
def test_cases_under_a_small_budget_run_alike_without_it(planning: int) -> None:
    model = independent(3, 4)
    limits = CloseLimits(situations=2, beyond=0, planning=planning, random=30, changes=100)
    closing = Closer(model, limits).close()
    assert closing.cases
    for made in closing.cases:
        assert Tester(model).execute(made.case).digest == made.execution.digest
        assert made.execution.verdict.passed
    again = Closer(model, limits).close()
    assert [made.case for made in again.cases] == [made.case for made in closing.cases]
