"""Closing of models in which only a second goal visits something."""

from __future__ import annotations

from functools import cache

import pytest

from scbm.cases import Case
from scbm.cases.trace import ends_of
from scbm.closing import CloseLimits, Closer, Closing, Decision, case_searches
from scbm.closing.runs.all_runs import AllRuns
from scbm.closing.runs.run_graph import Start
from scbm.closing.runs.walks import PathRun, RunPath
from scbm.closing.scripts.case_scripts import CaseScripts
from scbm.closing.symbolic import decision_diagrams
from scbm.files import read_case, read_model, write_case
from scbm.model import BehaviorModel
from scbm.planning import PlanCache, Planner
from scbm.running import Program
from scbm.running.outside_changes import TransitionMaker
from scbm.running.untimed.situations import ANSWER, DEADLINE, TIME_LIMIT, Happening, HappeningKind
from scbm.testing import Tester

MODEL = """
behavior_model: cell
variables:
  at: {domain: [home, station], initial: home}
  ready: {domain: bool, initial: false, source: state}
  welded: {domain: bool, initial: false}
  key: {domain: [left, right], initial: left}
resources: {robot: {}}
operations:
  move:
    deadline: 5 s
    pre:
      g: robot_req_state == initial && robot_req_trigger == false && at == home
      a: [robot_req_trigger <- true]
    post:
      g: true
      gr: robot_req_state == succeeded
      a: [robot_req_trigger <- false, robot_req_state <- initial, at <- station]
    timedout: [robot_req_trigger <- false]
  weld:
    deadline: 5 s
    pre:
      g: robot_req_state == initial && robot_req_trigger == false && ready == true
      a: [robot_req_trigger <- true]
    post:
      g: true
      gr: robot_req_state == succeeded
      a: [robot_req_trigger <- false, robot_req_state <- initial, welded <- true]
    timedout: [robot_req_trigger <- false]
automatic_transitions:
  becomes_ready: {g: READY, a: [ready <- true]}
  lamp: {g: key == right && plan.state == completed && welded == true, a: [welded <- false]}
environment:
  turn: {guard: at == station, actions: [key <- right]}
goals:
  moved: at == station
  welded: welded == true
"""
AFTER_A_GOAL = "plan.state == completed && at == station && ready == false"
AFTER_AN_END = "plan.state == aborted && ready == false"
AFTER_A_CHANGE = "plan.state == completed && key == right && ready == false"


@cache
def close(ready: str, tail: str = "") -> Closing:
    return Closer(read_model(MODEL.replace("READY", ready) + tail)).close()


def case_for(closing: Closing, obligation: str) -> Case:
    """The case that covers an obligation without force; it passes, and once more when it was written and read."""
    decided = next(d for d in closing.decided if str(d.obligation) == obligation)
    assert decided.decision is Decision.COVERED, decided
    case = next(each.case for each in closing.cases if each.case.name == decided.case)
    again = read_case(write_case(case, closing.model, "cell.yaml"), closing.model)
    for each in (case, again):
        execution = Tester(closing.model).execute(each)
        assert execution.verdict.failures == ()
        assert execution.visited_freely & closing.after.obligations.bit(decided.obligation)
    return case


def test_what_needs_the_end_of_another_goal_gets_a_case_with_both() -> None:
    case = case_for(close(AFTER_A_GOAL), "weld/timedout")
    assert [goal.name for goal in case.goals] == ["moved", "welded"]
    assert case.later[0].when is None


def test_each_goal_expects_the_end_and_the_visits_of_its_own_run() -> None:
    closing = close(AFTER_A_GOAL)
    case = case_for(closing, "weld/completed")
    first, second = (tuple(map(str, goal.expect.visits)) for goal in case.goals)
    assert "automatic/becomes_ready" in first
    assert "weld/completed" in second
    assert [goal.expect.verdict for goal in case.goals] == ["reached", "reached"]
    assert case.name.startswith("moved_then_welded-")


def test_what_changes_between_two_goals_is_awaited() -> None:
    case = case_for(close(AFTER_A_CHANGE), "weld/executing")
    assert [str(goal.when) for goal in case.later] == ["key == right"]
    assert [change.by for change in case.environment or ()] == ["turn"]


def test_what_follows_the_last_goal_is_shown_before_one_more() -> None:
    case = case_for(close(AFTER_A_GOAL), "automatic/lamp")
    assert len(case.goals) > 1
    assert [change.by for change in case.environment or ()] == ["turn"]


def test_a_time_limit_can_end_a_run_before_the_last_one() -> None:
    closing = close(AFTER_AN_END)
    case = case_for(closing, "weld/completed")
    assert case.limits.time_ns is not None
    ends = [ended.end for ended in ends_of(Tester(closing.model).execute(case).trace.records)]
    assert (ends[0], ends[-1]) == ("time_limit", "reached")


@pytest.mark.parametrize("engines", [{}, decision_diagrams.ENGINES], ids=["without sets", "with sets"])
@pytest.mark.parametrize("ready", [AFTER_A_GOAL, AFTER_AN_END, AFTER_A_CHANGE])
@pytest.mark.parametrize("share", [3, 30_000], ids=["any plans", "canonical plans"])
def test_sequences_that_are_explored_in_steps_decide_the_same(
    share: int, ready: str, engines: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = close(ready)
    monkeypatch.setattr(case_searches, "_SHARE_OF_SEQUENCES", share)
    monkeypatch.setattr(decision_diagrams, "ENGINES", engines)
    monkeypatch.setattr(case_searches, "_FEW_SEQUENCES", 10)
    closing = Closer(expected.model).close()
    assert [(each.obligation, each.decision) for each in closing.decided] == [
        (each.obligation, each.decision) for each in expected.decided
    ]
    case_for(closing, "automatic/becomes_ready")


LINE = """
behavior_model: line
variables: {at: {domain: 0..5, initial: 0}}
resources: {robot: {}}
operations:
  move: {request: robot, guard: at < 5, effects: [at += 1], deadline: 5 s}
  return: {request: robot, guard: at == 5, effects: [at <- 0], deadline: 5 s}
goals: {end: at == 5, beginning: at == 0}
"""


def test_where_sequences_are_too_many_random_ones_count() -> None:
    model = read_model(LINE)
    closed = AllRuns(model, CloseLimits(), lambda _: None).situations
    closing = Closer(model, CloseLimits(situations=closed)).close()
    case_for(closing, "return/completed")


@pytest.mark.parametrize(("planner", "decision"), [("canonical", Decision.EXCLUDED), ("greedy", Decision.UNDECIDED)])
def test_no_set_excludes_what_plans_of_another_planner_may_have(
    planner: str, decision: Decision, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(case_searches, "_FEW_SEQUENCES", 4)
    monkeypatch.setattr(case_searches, "_SHARE_OF_SEQUENCES", 100_000)
    slow = "  crawl: {request: robot, guard: at < 5, effects: [at += 1], deadline: 5 s}\ngoals:"
    model = read_model(LINE.replace("goals:", slow) + f"planner: {{name: {planner}}}\n")
    (found,) = [each.decision for each in Closer(model).close().decided if str(each.obligation) == "crawl/executing"]
    assert found is decision


def test_single_goals_get_no_cases_with_several() -> None:
    closing = close(AFTER_A_GOAL, "runs: {goals: single}\n")
    assert not any(each.case.later for each in closing.cases)
    statuses = {str(d.obligation): d.decision for d in closing.decided}
    assert statuses["weld/completed"] is Decision.UNCOVERABLE


def test_reasons_say_where_a_run_comes_nearest() -> None:
    strange = "  strange: {g: ready == true && at == home, a: [welded <- false]}\nenvironment:"
    closing = Closer(read_model(MODEL.replace("READY", AFTER_A_GOAL).replace("environment:", strange))).close()
    decided = next(d for d in closing.decided if str(d.obligation) == "automatic/strange")
    assert decided.decision is Decision.UNCOVERABLE
    assert decided.reason.endswith(
        "it needs ready == true and at == home, which never hold together; "
        "a run comes nearest with ready == true and at == station"
    )


def test_a_time_limit_that_is_too_short_for_an_earlier_run_is_no_fault() -> None:
    back = MODEL[MODEL.index("  move:") : MODEL.index("  weld:")].replace("move:", "go_back:")
    back = back.replace("at == home", "at == station").replace("at <- station", "at <- home")
    moves, welds = MODEL.replace("READY", AFTER_AN_END).split("  weld:")
    text = f"{moves}{back}  weld:{welds.replace('robot_', 'welder_')}"
    model = read_model(text.replace("{robot: {}}", "{robot: {}, welder: {}}") + "  returned: at == home\n")
    moved, welded, returned = model.goals
    reply = Happening(HappeningKind.REPLY, "robot", succeeded=True)
    start = Start(dict(model.nominal_state), 0)
    runs = (PathRun(moved, (DEADLINE, reply)), PathRun(returned, (TIME_LIMIT,)), PathRun(welded, ()))
    planner = PlanCache(Planner(model))
    case = CaseScripts(model, Program(model), planner).case(RunPath(start, runs), "limited")
    assert [goal.name for goal in case.goals] == ["moved", "returned", "welded"]
    assert case.limits.time_ns is not None
    assert Tester(model).execute(case).verdict.passed


TURNED = Happening(HappeningKind.OUTSIDE, "turn", measured=(("key", "right"),), by=TransitionMaker)


def test_a_change_while_the_plan_for_a_later_goal_is_awaited_comes_before_the_plan() -> None:
    model = read_model(MODEL.replace("READY", AFTER_A_GOAL))
    moved, welded = model.goals
    reply = Happening(HappeningKind.REPLY, "robot", succeeded=True)
    runs = (PathRun(moved, (ANSWER, reply)), PathRun(welded, (TURNED, ANSWER)))
    assert order_of(case_of(model, runs), model) == [
        "plan_received",
        "run_ended",
        "measurement",
        "plan_received",
        "run_ended",
    ]


def order_of(case: Case, model: BehaviorModel) -> list[str]:
    """What happens in a case: plans, ends of runs and changes from outside."""
    kinds = [record.kind for record in Tester(model).execute(case).trace.records]
    return [kind for kind in kinds if kind in ("plan_received", "run_ended", "measurement")]


def case_of(model: BehaviorModel, runs: tuple[PathRun, ...]) -> Case:
    path = RunPath(Start(dict(model.nominal_state), 0), runs)
    return CaseScripts(model, Program(model), PlanCache(Planner(model))).case(path, "followed")


def test_a_time_limit_is_chosen_again_where_plans_have_to_take_time() -> None:
    model = read_model(MODEL.replace("READY", AFTER_AN_END).replace("guard: at == station", "guard: at == home"))
    moved, _ = model.goals
    runs = (PathRun(moved, (ANSWER, TIME_LIMIT)), PathRun(moved, (TURNED, ANSWER)))
    case = case_of(model, runs)
    assert 0 < case.planning_ns < (case.limits.time_ns or 0)
    assert order_of(case, model)[:4] == ["plan_received", "run_ended", "measurement", "plan_received"]
