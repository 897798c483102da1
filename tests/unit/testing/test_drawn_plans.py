"""Random cases of models that draw plans: both of two equal robots are tested, and each run can be repeated."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.cases import Case
from scbm.cases.trace import BecameCurrent, write_trace
from scbm.files import Scope, Where, parse_predicate, read_case, write_case
from scbm.model import Always, BehaviorModel, InputError, Not, Requirement, RunPlans, Slug
from scbm.planning import model_planned_by, model_with_plans
from scbm.testing import Execution, FailureKind, RandomCases, Shrinker, Tester
from support.two_robots import two_robots

DRAWN = two_robots()
"""Random cases of this model draw their plans."""

CANONICAL = two_robots("canonical")


def _executions(model: BehaviorModel, count: int = 10, seed: int = 0) -> list[Execution]:
    tester = Tester(model)
    return [tester.execute(case) for case in RandomCases(model).first(count, seed)]


def _current(executions: list[Execution]) -> list[str]:
    records = (record for execution in executions for record in execution.trace.records)
    return sorted({record.operation for record in records if isinstance(record, BecameCurrent)})


def test_canonical_plans_never_use_the_second_robot_and_drawn_plans_do() -> None:
    assert _current(_executions(CANONICAL)) == ["pick_1", "place_1"]
    assert _current(_executions(DRAWN)) == ["pick_1", "pick_2", "place_1", "place_2"]


def test_draws_of_plans_shift_no_other_draws() -> None:
    for drawn, canonical in zip(_executions(DRAWN), _executions(CANONICAL), strict=True):
        assert [each.latency_ns for each in drawn.reactions] == [each.latency_ns for each in canonical.reactions]


def test_the_same_seed_gives_the_same_bytes_whatever_ran_before() -> None:
    in_order = _executions(DRAWN)
    tester, cases = Tester(DRAWN), list(RandomCases(DRAWN).first(10, 0))
    backwards = [tester.execute(case) for case in reversed(cases)][::-1]
    assert [write_trace(each.trace) for each in in_order] == [write_trace(each.trace) for each in backwards]


def test_traces_and_cases_name_the_planner() -> None:
    execution = _executions(DRAWN, 1)[0]
    assert str(execution.trace.planner) == "drawn 1"
    assert str(execution.recorded.planner) == "drawn 1"
    assert str(_executions(CANONICAL, 1)[0].trace.planner) == "canonical 1"


def test_a_saved_case_has_its_plans_and_a_replay_draws_nothing() -> None:
    for execution in _executions(DRAWN):
        saved = read_case(write_case(execution.recorded_case, DRAWN, None), DRAWN)
        assert len(saved.plans) == 1
        for model in (DRAWN, CANONICAL):
            again = Tester(model).execute(saved)
            assert (again.digest, again.recorded) == (execution.digest, execution.recorded)
            assert again.recorded_case == saved


def test_a_case_without_its_plans_draws_them_again_from_its_seed() -> None:
    for execution in _executions(DRAWN):
        open_case = replace(execution.recorded_case, plans=())
        model = model_planned_by(execution.recorded.planner, CANONICAL)
        assert model.runs.plans is RunPlans.DRAWN
        assert Tester(model).execute(open_case).digest == execution.digest


def test_a_run_that_was_recorded_with_canonical_plans_is_replayed_with_these() -> None:
    execution = _executions(CANONICAL, 1)[0]
    assert model_planned_by(execution.recorded.planner, DRAWN).runs.plans is RunPlans.CANONICAL


def test_a_case_without_a_seed_has_canonical_plans() -> None:
    goal, predicate = DRAWN.goals[0]
    execution = Tester(DRAWN).execute(Case("plain", goal, predicate, DRAWN.nominal_state))
    assert _current([execution]) == ["pick_1", "place_1"]
    assert (str(execution.trace.planner), execution.plans_to_keep) == ("canonical 1", ())


def test_a_plan_of_another_model_is_refused_with_its_place() -> None:
    saved = _executions(DRAWN, 1)[0].recorded_case
    smaller = replace(DRAWN, operations=DRAWN.operations[:0])
    with pytest.raises(InputError) as raised:
        Tester(smaller).execute(saved)
    assert raised.value.diagnostics[0].slug is Slug.REPLAY_DIFFERS


# shrinking


def _never(text: str, model: BehaviorModel) -> BehaviorModel:
    predicate = parse_predicate(text, Scope.of(model), Where.WORLD)
    return replace(model, requirements=(Requirement("unused", Always(Not(predicate))),))


def _failed(model: BehaviorModel) -> Execution:
    return next(each for each in _executions(model) if not each.verdict.passed)


def test_a_failure_of_the_second_robot_shrinks_to_a_case_with_its_plan() -> None:
    model = _never("box == held_2", DRAWN)
    execution = _failed(model)
    shrunk = Shrinker(Tester(model)).shrink(execution, execution.verdict.failures[0])
    assert shrunk.failure.kind is FailureKind.REQUIREMENT
    assert shrunk.after.choices < shrunk.before.choices
    small = replace(shrunk.execution.case, recorded=shrunk.execution.recorded, plans=shrunk.execution.plans_to_keep)
    assert [answer.plan for answer in small.plans] == [("pick_2", "place_2")]
    assert small.origin is None
    again = Tester(model).execute(read_case(write_case(small, model, None), model))
    assert (again.digest, again.verdict.failures) == (shrunk.execution.digest, shrunk.execution.verdict.failures)


def test_a_failure_that_canonical_plans_show_as_well_shrinks_to_a_case_without_plans() -> None:
    model = _never("box == table", DRAWN)
    execution = next(each for each in _executions(model) if _current([each]) == ["pick_2", "place_2"])
    shrunk = Shrinker(Tester(model)).shrink(execution, execution.verdict.failures[0])
    assert shrunk.execution.plans_to_keep == ()
    assert str(shrunk.execution.trace.planner) == "canonical 1"


def test_models_with_other_plans_are_equal_but_for_these() -> None:
    assert model_with_plans(RunPlans.CANONICAL, DRAWN).runs == CANONICAL.runs
