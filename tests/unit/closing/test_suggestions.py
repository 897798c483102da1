"""What is suggested for obligations that nothing visits; runs are known from random cases here."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Aspect, Decision, Obligation, Obligations
from scbm.cases.trace import RunnerStarted
from scbm.closing import Closer, Suggestion, SuggestionKind
from scbm.closing.advice.goal_search import GoalSearch
from scbm.closing.advice.suggestions import Oracles, TriedVisits, grouped, suggest
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, Predicate, Value
from scbm.planning import Planner
from scbm.testing import RandomCases, Tester
from support.models import scan_cell
from support.wording import Wording

ROOT = Path(__file__).parents[3]
BEFORE = load_model(ROOT / "examples/robot_in_the_air/before.yaml")


class Runs:
    """What random cases of a model visit, and all states in them."""

    def __init__(self, model: BehaviorModel, cases: int = 40) -> None:
        self.visited = 0
        self.states: list[dict[str, Value]] = []
        for execution in map(Tester(model).execute, RandomCases(model).first(cases, seed=1)):
            self.visited |= execution.visited
            state: dict[str, Value] = {}
            for record in execution.trace.records:
                state |= dict(record.state if isinstance(record, RunnerStarted) else ()) | dict(record.changes)
                self.states.append(dict(state))

    def can_hold(self, predicate: Predicate) -> bool:
        return any(predicate.holds(state) for state in self.states)


def _visits(model: BehaviorModel) -> TriedVisits:
    """Return what random cases for the last goal, which is the one to be verified, visit."""
    visited = Runs(replace(model, goals=model.goals[-1:]), cases=20).visited
    known = Obligations.of(model)
    return TriedVisits(frozenset(each for each in known if visited & known.bit(each)))


_runs_of = cache(Runs)


def _suggest(model: BehaviorModel, *uncoverable: str) -> tuple[Suggestion, ...]:
    """For these obligations, or for all that random cases do not visit."""
    runs = _runs_of(model)
    known = Obligations.of(model)
    missed = [o for o in known if (str(o) in uncoverable if uncoverable else not known.bit(o) & runs.visited)]
    oracles = Oracles(runs.can_hold, lambda each: filter(each.holds, runs.states), _visits)
    return suggest(model, missed, oracles, GoalSearch(model, Planner(model)))


def _parts(suggestions: tuple[Suggestion, ...]) -> list[tuple[str, list[str], tuple[str, ...]]]:
    return [(each.kind.value, [str(o) for o in each.obligations], each.blamed) for each in suggestions]


@pytest.mark.parametrize(
    ("operation", "goal", "start", "plan"),
    [
        ("robot_move_to_home", "robot_at == home", "robot_at == toolbox_gripper", "robot_move_to_home"),
        (
            "robot_unmount_gripper",
            "mounted == none && gripper_act == open",
            "robot_at == toolbox_gripper && gripper_act == closed",
            "robot_mount_gripper -> gripper_open -> robot_unmount_gripper",
        ),
    ],
)
def test_an_operation_that_no_goal_needs_gets_a_goal(
    operation: str, goal: str, start: str, plan: str, wording: Wording
) -> None:
    names = [f"{operation}/{aspect}" for aspect in ("executing", "completed", "queued")]
    (suggestion,) = _suggest(BEFORE, *names)
    assert suggestion.kind is SuggestionKind.GOAL
    assert [str(obligation) for obligation in suggestion.obligations] == names
    assert str(suggestion.goal) == goal
    assert suggestion.name == f"needs_{operation}"
    assert suggestion.text.endswith(f" {start}: {plan}")
    wording(suggestion.text)


def test_a_goal_serves_only_what_was_verified() -> None:
    names = [f"robot_move_to_home/{aspect}" for aspect in ("disabled", "executing", "completed", "queued")]
    (suggestion,) = _suggest(BEFORE, *names)
    assert [str(o) for o in suggestion.obligations] == [names[1], names[2], names[3]]


@pytest.mark.slow
def test_what_only_forced_states_visit_is_not_promised_of_a_goal(wording: Wording) -> None:
    disabled, *others = (
        Obligation("robot_move_to_home", aspect) for aspect in (Aspect.DISABLED, Aspect.EXECUTING, Aspect.QUEUED)
    )
    runs = Runs(BEFORE, cases=5)
    oracles = Oracles(runs.can_hold, None, lambda _: TriedVisits(frozenset(others), frozenset([disabled])))
    (suggestion,) = suggest(BEFORE, (disabled, *others), oracles, GoalSearch(BEFORE, Planner(BEFORE)))
    assert suggestion.obligations == tuple(others)
    assert suggestion.by_force == (disabled,)
    wording(suggestion.text)


def test_no_goal_is_suggested_that_only_forced_states_need() -> None:
    missed = [o for o in Obligations.of(BEFORE) if o.subject == "robot_move_to_home"]
    runs = Runs(BEFORE, cases=5)
    oracles = Oracles(runs.can_hold, None, lambda _: TriedVisits(by_force=frozenset(missed)))
    assert suggest(BEFORE, missed, oracles, GoalSearch(BEFORE, Planner(BEFORE))) == ()


WAYS = """
behavior_model: ways
variables:
  at: {domain: [start, left, right, end], initial: start}
operations:
  go_left: {pre: {g: at == start}, post: {g: true, a: [at <- left]}}
  go_right: {pre: {g: at == start}, post: {g: true, a: [at <- right]}}
  from_left: {pre: {g: at == left}, post: {g: true, a: [at <- end]}}
  from_right: {pre: {g: at == right}, post: {g: true, a: [at <- end]}}
goals:
  end: at == end
"""


def test_a_goal_that_closing_suggests_covers_what_it_promises() -> None:
    closing = Closer(read_model(WAYS)).close()
    (found,) = (each for each in closing.suggestions if each.kind is SuggestionKind.GOAL)
    assert found.name is not None
    assert found.goal is not None
    model = read_model(WAYS)
    extended = Closer(replace(model, goals=(*model.goals, (found.name, found.goal)))).close()
    decisions = {each.obligation: each.decision for each in extended.decided}
    assert {decisions[each] for each in found.obligations} == {Decision.COVERED}
    assert [str(each) for each in found.by_force] == ["go_right/disabled"]
    assert decisions[found.by_force[0]] is not Decision.COVERED


def test_no_goal_is_suggested_that_is_not_verified() -> None:
    runs = Runs(BEFORE, cases=5)
    oracles = Oracles(runs.can_hold, None, lambda _: TriedVisits())
    missed = [o for o in Obligations.of(BEFORE) if o.subject == "robot_move_to_home"]
    assert suggest(BEFORE, missed, oracles, GoalSearch(BEFORE, Planner(BEFORE))) == ()


def test_a_precondition_that_never_holds_is_blamed_for_all_that_follows(wording: Wording) -> None:
    model = scan_cell(("gr: light != red", "gr: light != red && count == 1"))
    names = [f"scan_box/{aspect}" for aspect in ("executing", "failed", "timedout", "completed")]
    (suggestion,) = _suggest(model, *names)
    assert _parts((suggestion,)) == [("guard", names, ("count == 1",))]
    wording(suggestion.text)


def test_a_postcondition_that_never_holds_is_blamed() -> None:
    model = scan_cell(("gr: scan_req_state == succeeded", "gr: scan_req_state == succeeded && light == blue"))
    found = _suggest(model, "scan_box/completed")
    assert _parts(found) == [("guard", ["scan_box/completed"], ("light == blue",))]


def test_conjuncts_that_never_hold_together_are_blamed_together(wording: Wording) -> None:
    redden = "automatic_transitions:\n  redden: {g: scan_req_state == executing, a: [light <- red]}\n"
    model = scan_cell(
        ("gr: scan_req_state == succeeded", "gr: count == 0 && scan_req_state == initial && light == red"),
        ("automatic_transitions:\n", redden),
    )
    (suggestion,) = _suggest(model, "scan_box/completed")
    assert suggestion.blamed == ("scan_req_state == initial", "light == red")
    wording(suggestion.text)


def test_without_a_deadline_or_a_way_to_fail_both_are_suggested(wording: Wording) -> None:
    model = scan_cell(
        ("    deadline: 10 seconds\n", ""),
        ("    timedout: [scan_req_trigger <- false]\n", ""),
        ("a: [current.state <- failed, ", "a: ["),
    )
    found = _suggest(model, "scan_box/failed", "scan_box/timedout")
    assert _parts(found) == [("failure", ["scan_box/failed"], ()), ("deadline", ["scan_box/timedout"], ())]
    failure, deadline = (suggestion.text for suggestion in found)
    wording(failure)
    wording(deadline)


def test_what_would_be_added_to_several_operations_is_reported_once(wording: Wording) -> None:
    other = "operations:\n  other: {pre: {g: true}, post: {g: true, gr: light == blue}}\n"
    model = scan_cell(
        ("operations:\n", other),
        ("    deadline: 10 seconds\n", ""),
        ("    timedout: [scan_req_trigger <- false]\n", ""),
        ("a: [current.state <- failed, ", "a: ["),
    )
    names = [f"{name}/{aspect}" for name in ("other", "scan_box") for aspect in ("failed", "timedout")]
    found = _suggest(model, *names)
    assert len(found) == 4
    failure, deadline = grouped(found)
    assert [*map(str, failure.obligations), *map(str, deadline.obligations)] == sorted(names, key=lambda n: n[-6:])
    assert failure.text.count("{g: scan_req") == 1
    wording(failure.text)
    wording(deadline.text)
    assert grouped(found[:2]) == found[:2], "one alone stays as it is"


def test_a_guard_that_contradicts_itself_is_reported(wording: Wording) -> None:
    model = scan_cell(("gr: light != red", "gr: count == 1 && count == 2"))
    (found,) = _suggest(model, "scan_box/executing")
    assert found.blamed == ("count == 1", "count == 2")
    wording(found.text)


def test_a_way_to_fail_that_never_holds_is_blamed() -> None:
    model = scan_cell(("g: scan_req_state == failed && current", "g: light == red && current"))
    found = _suggest(model, "scan_box/failed", "automatic/scan_failed")
    blamed = ("light == red",)
    assert _parts(found) == [("guard", ["scan_box/failed"], blamed), ("guard", ["automatic/scan_failed"], blamed)]


LAMPS = """
behavior_model: lamps
variables:
  lamp: {domain: [dark, lit, bright], initial: dark}
  done: {domain: bool, initial: false}
operations:
  wait: {pre: {g: done == false}, post: {g: lamp == dark, a: [done <- true]}}
automatic_transitions:
  light: {g: lamp == dark && wait.state == completed, a: [lamp <- lit]}
  also_lights: {g: lamp == dark && wait.state == completed && done == true, a: [lamp <- bright]}
  bright: {g: lamp == bright, a: [lamp <- lit]}
  same: {g: lamp == lit, a: [lamp <- lit]}
goals:
  done: done == true
"""


def test_what_fails_the_requests_of_others_is_not_blamed(wording: Wording) -> None:
    model = read_model("""
behavior_model: cell
variables:
  at: {domain: [home, box], initial: home}
  seen: {domain: bool, initial: false, source: state}
  door: {domain: [open, closed], initial: closed, source: input}
resources: {robot: {}}
operations:
  move: {request: robot, guard: at == home, effects: [at <- box], deadline: 5 s}
  look: {pre: {g: at == box && seen == false}, post: {g: true, gr: door == open, a: [seen <- true]}, deadline: 5 s}
automatic_transitions:
  door_stop: {g: door == open && move.state == executing, a: [current.state <- failed, robot_req_trigger <- false]}
goals: {seen: seen == true}
""")
    (found,) = Closer(model).close().suggestions
    assert (found.kind, [str(each) for each in found.obligations]) == (SuggestionKind.FAILURE, ["look/failed"])
    wording(found.text)


def test_a_transition_that_another_one_always_comes_before_is_shadowed(wording: Wording) -> None:
    model = read_model(LAMPS)
    found = _suggest(model, "automatic/also_lights")
    assert _parts(found) == [("shadowed", ["automatic/also_lights"], ("light",))]
    wording(found[0].text)


def test_a_transition_whose_guard_never_holds_is_reported(wording: Wording) -> None:
    found = _suggest(read_model(LAMPS), "automatic/bright")
    assert _parts(found) == [("guard", ["automatic/bright"], ("lamp == bright",))]
    wording(found[0].text)


def test_nothing_is_invented() -> None:
    assert _suggest(read_model(LAMPS), "automatic/same", "wait/disabled") == ()


def test_suggestions_come_in_the_order_of_the_obligations() -> None:
    found = _suggest(read_model(LAMPS))
    numbers = [Obligations.of(read_model(LAMPS)).all.index(suggestion.obligations[0]) for suggestion in found]
    assert numbers == sorted(numbers)
    assert [suggestion.kind.value for suggestion in found] == ["instant", "shadowed", "guard"]


ROUNDS = """
behavior_model: rounds
types: {place: [a, b, c, d, e, f]}
variables: {at: {domain: [home, place], initial: home}}
operations:
  go[to in place]: {pre: {g: at == home}, post: {g: true, a: [at <- to]}}
goals: {there: at == a}
"""


def test_goals_are_looked_for_for_a_few_instances_of_a_lifted_operation(wording: Wording) -> None:
    closing = Closer(read_model(ROUNDS)).close()
    goals = [each for each in closing.suggestions if each.kind is SuggestionKind.GOAL]
    assert [each.name for each in goals] == ["needs_go.b", "needs_go.c", "needs_go.d"]
    wording(goals[-1].text)
