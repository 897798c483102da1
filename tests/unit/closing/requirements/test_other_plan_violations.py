"""What only other plans than those of the planner violate: a case with such plans shows it (semantics 7.13)."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Case
from scbm.closing import CloseLimits
from scbm.closing.decisions import DecidedRequirement, RequirementDecisions, RequirementStatus
from scbm.closing.requirements.requirement_closer import RequirementCloser
from scbm.files import load_model, read_case, read_model, write_case
from scbm.model import BehaviorModel, PlannerChoice, RunPlans, State
from scbm.planning import model_with_plans
from scbm.testing import Campaign, Execution, Tester
from support.closings import closing_of

THREE_WAYS = """
behavior_model: three_ways
variables:
  at: {domain: [home, left, right, goal], initial: home}
  door: {domain: [closed, open], initial: closed}
resources:
  robot: {simulation: {latency: 1 s}}
  gate: {simulation: {latency: 2 s}}
operations:
  go_left: {request: robot, deadline: 10 s, guard: at == home, effects: [at <- left]}
  go_right: {request: robot, deadline: 10 s, guard: at == home, effects: [at <- right]}
  left_to_goal: {request: robot, deadline: 10 s, guard: at == left, effects: [at <- goal]}
  right_to_goal: {request: robot, deadline: 10 s, guard: at == right, effects: [at <- goal]}
  open: {request: gate, deadline: 10 s, guard: door == closed, effects: [door <- open]}
  close: {request: gate, deadline: 10 s, guard: door == open, effects: [door <- closed]}
  back: {request: robot, deadline: 10 s, guard: at == goal, effects: [at <- home]}
goals:
  arrived: at == goal
  home: at == home
requirements:
  never_right: never at == right
  left_first: at == left before door == open
  after_goal: after at == goal always door == closed until at == home
  closes: door == open leads to door == closed
  stays: always at == left -> door == closed
  stands: never robot_req_state == executing && gate_req_state == executing
"""

WEARS = """
behavior_model: wears
variables:
  at: {domain: [home, goal], initial: home}
  worn: {domain: bool, initial: false}
resources:
  robot: {simulation: {latency: 1 s}}
  eye: {simulation: {latency: 1 s}}
operations:
  gently: {request: robot, deadline: 10 s, guard: at == home && worn == false, effects: [at <- goal]}
  back: {request: robot, deadline: 10 s, guard: at == goal, effects: [at <- home]}
  roughly: {request: robot, deadline: 10 s, guard: at == home && worn == false, effects: [at <- goal, worn <- true]}
  peek:
    deadline: 3 s
    pre: {g: at == goal && eye_req_state == initial && eye_req_trigger == false, a: [eye_req_trigger <- true]}
    post: {g: true, gr: eye_req_state == succeeded, a: [eye_req_trigger <- false, eye_req_state <- initial, at <- home]}
    failed: {g: eye_req_state == failed, a: [eye_req_trigger <- false, plan.state <- aborted]}
    timedout: []
goals:
  arrived: at == goal
  back: at == home
"""

HOLDS, HOLDS_CANONICAL = RequirementStatus.HOLDS, RequirementStatus.HOLDS_CANONICAL
LIMITS = CloseLimits()


def decide(model: BehaviorModel, limits: CloseLimits = LIMITS, suite: Campaign | None = None) -> RequirementDecisions:
    return RequirementCloser(model, limits, lambda _: None).decide(suite or Campaign.of(model, ()), closing_of(model))


def shown(decisions: RequirementDecisions) -> dict[str, DecidedRequirement]:
    """The decisions with a case that violates the requirement with other plans."""
    return {each.name: each for each in decisions.decided if each.other_plans is not None and each.other_plans.case}


def violated_by(execution: Execution) -> list[tuple[str, bool]]:
    return [(violation.requirement, violation.is_built_in) for violation in execution.violations]


def assert_case_shows_it(found: DecidedRequirement, model: BehaviorModel) -> Execution:
    """The case, written and read, violates the requirement with its plans, and not with those of the planner."""
    assert found.other_execution is not None
    assert found.other_plans is not None
    case = read_case(write_case(found.other_execution.case, model, "model.yaml"), model)
    again, key = Tester(model).execute(case), (found.name, found.is_built_in)
    assert found.other_plans.reason in map(str, again.verdict.failures)
    assert key in violated_by(again)
    assert key not in violated_by(Tester(model).execute(replace(case, plans=())))
    return again


@pytest.mark.parametrize("planner", ["canonical", "greedy"])
def test_a_case_with_its_plans_shows_what_only_other_plans_violate(planner: str) -> None:
    model = replace(read_model(THREE_WAYS), planner=PlannerChoice(planner))
    decisions = decide(model)
    found = shown(decisions)
    assert list(found) == ["never_right", "left_first", "after_goal", "closes", "stays"]
    for each in found.values():
        assert each.status is (HOLDS_CANONICAL if planner == "canonical" else RequirementStatus.HOLDS_PLANNER)
        again = assert_case_shows_it(each, model)
        assert again.case.name == f"{each.name}-other-plans-1"
    assert next(each.status for each in decisions.decided if each.name == "stands") is HOLDS
    runs = {name: each.other_execution for name, each in found.items() if each.other_execution is not None}
    plans = {name: [each.plan for each in run.case.plans] for name, run in runs.items()}
    assert plans["never_right"] == [("go_right", "right_to_goal")]
    assert plans["left_first"] == [("open", "go_left", "left_to_goal")]


def test_built_in_requirements_are_violated_by_other_plans_too() -> None:
    model = read_model(WEARS)
    found = shown(decide(model))
    assert list(found) == ["no_orphan", "recovers", "non_blocking"]
    for each in found.values():
        assert_case_shows_it(each, model)


def test_other_plans_are_not_decided_where_there_are_too_many_runs() -> None:
    decisions = decide(read_model(THREE_WAYS), CloseLimits(situations=300))
    assert not shown(decisions)
    ((reason, names),) = decisions.not_decided_with_other_plans.items()
    assert reason
    assert "never_right" in names


def test_an_endless_run_with_other_plans_is_possible_and_not_called_a_violation() -> None:
    model = load_model(Path(__file__).parents[4] / "examples" / "gripper" / "cell.yaml")
    decisions = decide(model)
    ((reason, names),) = decisions.not_decided_with_other_plans.items()
    assert names == ["recovers"]
    assert "move_to_tray" in reason, "the operations that may be repeated"


def test_a_case_of_the_suite_with_other_plans_violates_nothing_under_canonical_plans() -> None:
    model = read_model(THREE_WAYS)
    made = shown(decide(model))["never_right"].other_execution
    assert made is not None
    case = replace(made.case, name="by_hand")
    found = shown(decide(model, suite=Campaign.of(model, Tester(model).results([case]))))["never_right"]
    assert (found.status, found.other_execution) == (HOLDS_CANONICAL, None)
    assert found.other_plans is not None
    assert found.other_plans.case == "by_hand"


def test_a_case_of_the_suite_with_the_plans_of_the_planner_violates_a_requirement() -> None:
    model = read_model(THREE_WAYS.replace("never at == right", "never at == left"))
    tester = Tester(model)
    goal = model.goal("arrived")
    assert goal is not None
    run = tester.execute(Case("by_hand", "arrived", goal, State(model.space, dict(model.nominal_state))))
    case = replace(run.case, plans=run.answers)
    decisions = decide(model, suite=Campaign.of(model, tester.results([case])))
    found = next(each for each in decisions.decided if each.name == "never_right")
    assert (found.status, found.case) == (RequirementStatus.VIOLATED, "by_hand")


def test_with_drawn_plans_a_shortest_plan_violates_a_requirement_and_a_longer_one_leaves_it_open() -> None:
    model = model_with_plans(RunPlans.DRAWN, read_model(THREE_WAYS))
    decided = {each.name: each for each in decide(model).decided}
    assert decided["never_right"].status is RequirementStatus.VIOLATED
    assert decided["stays"].status is RequirementStatus.UNDECIDED
    assert_case_shows_it(decided["stays"], model)
