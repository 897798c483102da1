"""Saved and recorded cases of random models: each passes on its own model, and each part that is changed is noticed."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Case, RecordedGoal
from scbm.closing import CloseLimits, Closer
from scbm.closing.closing_files import write_output
from scbm.files import load_model, read_case, write_case, write_model
from scbm.model import BehaviorModel, RunPlans
from scbm.planning import model_with_plans
from scbm.testing import RandomCases, Tester, draw_network, load_suite
from support.opened_models import opened
from support.profiles import share, slow_beyond
from support.random_models import random_model, small_random_model

NUMBERS = (*range(10), *range(11, 120), 10)[: share(120, least=8)]
"""Random models; number 10 is the largest."""

CLOSED = (2, 9, 18, 47, 49, 35, 43, 58, 59, 67)[: share(10, least=2)]
"""Models that are closed in a moment."""


def model_of(number: int) -> BehaviorModel:
    """A random model; every third draws its plans from all shortest ones."""
    model = random_model(number)
    return model if number % 3 else model_with_plans(RunPlans.DRAWN, model)


def saved_cases(model: BehaviorModel) -> list[Case]:
    """Random cases over networks with faults, saved and read again; only those that passed."""
    tester, saved = Tester(model), []
    for case in RandomCases(model, moves_inputs=True).first(4, 1):
        assert case.origin is not None
        execution = tester.execute(replace(case, network=draw_network(model, case.origin)))
        if execution.verdict.passed:
            saved.append(read_case(write_case(execution.recorded_case, model, None), model))
    return saved


def changed_goals(goal: RecordedGoal) -> dict[str, RecordedGoal]:
    """The record of a run with one part changed, by the name of the part."""
    assert goal.visits is not None
    assert goal.order is not None
    assert goal.final is not None
    changes = {
        "end": replace(goal, end="aborted" if goal.end != "aborted" else "reached"),
        "time": replace(goal, ended_ns=(goal.ended_ns or 0) + 1),
        "visits": replace(goal, visits=goal.visits[1:] or ("nothing/failed",)),
        "order": replace(goal, order=(*goal.order, *(goal.order[:1] or ("nothing",)))),
    }
    if goal.final:
        (name, value), *others = goal.final
        changes["final"] = replace(goal, final=((name, f"not {value}"), *others))
    return changes


@pytest.mark.parametrize("number", slow_beyond(4, NUMBERS))
def test_a_saved_case_passes_and_a_changed_part_of_its_record_is_noticed(number: int) -> None:
    model = model_of(number)
    tester = Tester(model)
    for case in saved_cases(model):
        assert case.recorded is not None
        execution = tester.execute(case)
        assert execution.verdict.passed, execution.verdict
        assert execution.recorded == case.recorded
        for part, goal in changed_goals(case.recorded.goals[0]).items():
            wrong = replace(case.recorded, goals=(goal,))
            failures = tester.execute(replace(case, recorded=wrong)).verdict.failures
            assert [failure.subject for failure in failures] == [f"recorded {part}"]


@pytest.mark.slow
def test_most_random_models_have_a_case_that_is_saved_with_its_result() -> None:
    numbers = range(10)
    assert sum(bool(saved_cases(model_of(number))) for number in numbers) > len(numbers) / 2


@pytest.mark.slow
@pytest.mark.parametrize("number", CLOSED)
def test_the_cases_of_closing_that_pass_have_their_results(number: int, tmp_path: Path) -> None:
    model = opened(small_random_model(number), number)
    file = tmp_path / "model.yaml"
    file.write_text(write_model(model), encoding="utf-8")
    closing = Closer(model, CloseLimits(situations=5_000, planning=5_000, random=50, changes=50)).close()
    assert closing.cases
    write_output(closing, tmp_path / "closed", file)
    tester = Tester(load_model(file))
    for written in load_suite([tmp_path / "closed"], tester.model):
        execution, recorded = tester.execute(written.case), written.case.recorded
        assert execution.verdict.passed is (recorded is not None), execution.verdict
        assert recorded is None or replace(execution.recorded, trace=None, planner=recorded.planner) == recorded
