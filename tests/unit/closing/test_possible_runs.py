"""Models for which testing and closing once called different things possible (semantics 5, 7.2, 7.4, 8.5)."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.cases.coverage import Obligations
from scbm.closing import CloseLimits, Closer, Closing, Decision
from scbm.closing.requirements.requirement_closer import RequirementCloser
from scbm.files import load_model, open_case
from scbm.model import BehaviorModel
from scbm.testing import Campaign, Execution, FailureKind, RandomCases, Shrinker, Tester
from support.shared_closings import shared_closing
from support.wording import Wording

MODELS = Path(__file__).parents[2] / "models" / "possible_runs"


def model_of(name: str) -> BehaviorModel:
    return load_model(MODELS / f"{name}.yaml")


def smallest(name: str, cases: int) -> Execution:
    """The smallest case of the first failure among random cases."""
    model = model_of(name)
    tester = Tester(model)
    failed = next(e for e in map(tester.execute, RandomCases(model).first(cases, 1)) if e.verdict.failures)
    shrunk = Shrinker(tester).shrink(failed, failed.verdict.failures[0])
    assert tester.execute(shrunk.execution.case).verdict.failures == shrunk.execution.verdict.failures
    return shrunk.execution


def decisions(closing: Closing) -> dict[str, Decision]:
    return {str(each.obligation): each.decision for each in closing.decided}


@pytest.mark.slow
def test_the_smallest_case_of_a_race_keeps_the_guard_of_the_change() -> None:
    execution = smallest("gate_race", 300)
    (change,) = execution.case.environment or ()
    assert (change.by, str(change.when), change.assign) == ("open_door", "lock_req_state == executing", None)
    assert execution.case.initial["gate"] == "unlocked"
    assert (execution.forced_by, execution.notes) == (None, ())


def test_each_of_several_changes_is_made_from_the_state_before_it() -> None:
    execution = smallest("env_count", 3)
    assert [(each.by, each.assign) for each in execution.case.environment or ()] == [("arrives", None)] * 2
    changed = [dict(record.changes) for record in execution.trace.records if record.kind == "measurement"]
    assert changed == [{"bottles": 1}, {"bottles": 2}]


def test_what_happens_before_a_single_goal_is_covered() -> None:
    model = model_of("idle_single")
    assert decisions(shared_closing(model))["automatic/at_rest"] is Decision.COVERED
    execution = Tester(model).execute(open_case(MODELS / "idle_single_case.yaml").read(model))
    assert "automatic/at_rest" in Obligations.of(model).names(execution.visited_freely)


def test_a_request_that_is_cancelled_before_its_reply_is_due_is_not_at_fault(wording: Wording) -> None:
    model = model_of("recovers_holds")
    verdict = Tester(model).execute(open_case(MODELS / "recovers_holds_case.yaml").read(model)).verdict
    assert [failure.kind for failure in verdict.failures] == [FailureKind.NOT_REACHED]
    wording(verdict.failures)
    found = RequirementCloser(model, CloseLimits(), lambda _: None).decide(
        Campaign.of(model, ()), shared_closing(model)
    )
    assert {each.name: each.status.value for each in found.decided}["recovers"] == "holds"


def test_other_initial_values_of_an_input_cover_what_seemed_to_need_force() -> None:
    closing = Closer(model_of("disabled_deadline")).close()
    assert closing.coverable.percent == 100
    assert Decision.UNDECIDED not in decisions(closing).values()
    with_suite = Closer(model_of("disabled_deadline"))
    case = open_case(MODELS / "disabled_deadline_case.yaml").read(with_suite.model)
    suite = Campaign.of(with_suite.model, Tester(with_suite.model).results([case]))
    assert decisions(with_suite.close(suite)) == decisions(closing)


def test_an_input_changes_while_the_plan_is_awaited() -> None:
    closing = shared_closing(model_of("input_before_start"))
    (decided,) = (each for each in closing.decided if str(each.obligation) == "go/disabled")
    assert (decided.decision, decided.is_forced) == (Decision.COVERED, False)
    case = next(made.case for made in closing.cases if made.case.name == decided.case)
    assert case.planning_ns == 1_000_000_000
    assert case.environment
