"""Planning on models by hand: what the planner sees, and what it does not."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.files import Scope, parse_predicate
from scbm.model import BehaviorModel
from scbm.planning import Answer, PlanLimits, Planner, Solved, Task, Unsolvable, find_flaw
from support.models import scan_cell
from support.wording import Wording


def _plan(model: BehaviorModel, goal: str, **state: bool | int | str) -> Answer:
    return Planner(model).plan(model.nominal_state.replace(state), parse_predicate(goal, Scope.of(model)))


def test_the_runners_guard_and_actions_are_not_seen() -> None:
    answer = _plan(scan_cell(), "box_is_scanned == true", light="red")
    assert answer == Solved(("scan_box",), 1)
    model = scan_cell(("box_is_scanned <- true]", "box_is_scanned <- true]\n      ar: [light <- blue]"))
    assert isinstance(_plan(model, "light == blue"), Unsolvable)


def test_the_postconditions_guard_is_seen_after_the_actions_of_the_precondition() -> None:
    met = scan_cell(("      g: true\n", "      g: scan_command == scan_box\n"))
    assert isinstance(_plan(met, "box_is_scanned == true"), Solved)
    unmet = scan_cell(("      g: true\n", "      g: scan_command == none\n"))
    assert isinstance(_plan(unmet, "box_is_scanned == true"), Unsolvable)


def test_a_step_that_would_leave_a_domain_cannot_be_taken() -> None:
    model = scan_cell(
        ("&& box_is_scanned == false", ""), ("box_is_scanned <- true]", "box_is_scanned <- true, count += 1]")
    )
    assert _plan(model, "count == 2") == Solved(("scan_box", "scan_box"), 2)
    assert isinstance(_plan(model, "count == 0", count=1), Unsolvable)


def test_the_runners_variables_stand_still_at_rest() -> None:
    model = scan_cell(("&& box_is_scanned == false", "&& plan.state == idle && scan_box.state == initial"))
    assert isinstance(_plan(model, "box_is_scanned == true"), Solved)
    never = scan_cell(("&& box_is_scanned == false", "&& current.state == executing"))
    assert isinstance(_plan(never, "box_is_scanned == true"), Unsolvable)


def test_only_variables_that_planning_can_distinguish_are_packed() -> None:
    model = scan_cell()
    assert Task(model).packing.space.names == ("box_is_scanned", "scan_req_trigger", "scan_req_state")
    goal = parse_predicate("scan_command == scan_box", Scope.of(model))
    assert Planner(model).plan(model.nominal_state, goal) == Solved(("scan_box",), 1)


def test_the_answers_have_names_for_machines() -> None:
    model = scan_cell()
    goal = parse_predicate("box_is_scanned == true", Scope.of(model))
    statuses = [
        Planner(model).plan(model.nominal_state, goal).status,
        Planner(model).plan(model.nominal_state, parse_predicate("light == red", Scope.of(model))).status,
        Planner(model).plan(model.nominal_state, goal, PlanLimits(length=0)).status,
    ]
    assert statuses == ["solved", "unsolvable", "limit_reached"]


def test_a_planner_with_the_goals_of_another_model_plans_as_a_new_one() -> None:
    model = scan_cell()
    goals = [parse_predicate(text, Scope.of(model)) for text in ("box_is_scanned == true", "scan_command == scan_box")]
    planner = Planner.of(model)
    for goal in goals:
        other = replace(model, goals=(("other", goal),))
        shared = planner.with_goals_of(other)
        assert shared.model is other
        assert shared.plan(model.nominal_state, goal) == Planner.of(other).plan(other.nominal_state, goal)
    assert planner.model is model


@pytest.mark.parametrize(("plan", "step"), [(("scan_box", "scan_box"), 1), ((), 0)])
def test_the_validator_finds_the_first_flaw(plan: tuple[str, ...], step: int, wording: Wording) -> None:
    model = scan_cell()
    flaw = find_flaw(model, model.nominal_state, model.goals[0][1], plan)
    assert flaw is not None
    assert flaw.step == step
    wording(flaw.reason)


def test_the_validator_finds_domains_left_and_postconditions_that_do_not_hold(wording: Wording) -> None:
    over = scan_cell(("a: [scan_req_trigger <- true,", "a: [scan_req_trigger <- true, count += 1,"))
    state = over.nominal_state.replace({"count": 2})
    flaw = find_flaw(over, state, over.goals[0][1], ("scan_box",))
    assert flaw is not None
    assert flaw.step == 0
    wording(flaw.reason)
    unmet = scan_cell(("      g: true\n", "      g: light == red\n"))
    flaw = find_flaw(unmet, unmet.nominal_state, unmet.goals[0][1], ("scan_box",))
    assert flaw is not None
    assert flaw.step == 0
    wording(flaw.reason)


def test_a_policy_answers_from_every_state_as_often_as_it_is_asked() -> None:
    model = scan_cell()
    goal = parse_predicate("box_is_scanned == true", Scope.of(model))
    policy = Planner(model).policy(goal)
    scanned = model.nominal_state.replace({"box_is_scanned": True})
    for _ in range(2):
        assert policy.plan(policy.task.pack(model.nominal_state)) == Solved(("scan_box",), 0)
        assert policy.plan(policy.task.pack(scanned)) == Solved((), 0)


def test_a_policy_gives_up_where_a_search_does() -> None:
    counting = ("&& box_is_scanned == false", ""), ("box_is_scanned <- true]", "count += 1]")
    model = scan_cell(*counting)
    goal = parse_predicate("box_is_scanned == true", Scope.of(model))
    for limits in (PlanLimits(length=1), PlanLimits(expansions=2), PlanLimits(length=2), PlanLimits(length=3)):
        planner = Planner(model)
        policy = planner.policy(goal, limits)
        answer = policy.plan(policy.task.pack(model.nominal_state))
        assert answer.status == planner.plan(model.nominal_state, goal, limits).status
