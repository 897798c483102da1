"""What a case lists under `environment`: when it acts, and what no maker can make (semantics 7.2)."""

from __future__ import annotations

import pytest

from scbm.cases.trace import End, InjectionApplied, MeasurementReceived
from scbm.files import read_case, read_model
from scbm.testing import Execution, FailureKind, Tester
from support.wording import Wording

S = 1_000_000_000
CELL = """
behavior_model: cell
variables:
  gate: {domain: [locked, unlocked], initial: unlocked, source: state}
  door: {domain: [closed, open], initial: closed}
  bottles: {domain: 0..3, initial: 0}
  button: {domain: [up, down], initial: up, source: input}
  lamp: {domain: [dark, lit], initial: dark, source: input}
  seen: {domain: 0..3, initial: 0}
  near: {domain: [a, b, c], initial: a}
  done: {domain: bool, initial: false}
resources:
  robot: {simulation: {latency: 5 s}}
  eye: {publishes: {near: [a, b]}}
environment:
  opens: {guard: gate == unlocked && door == closed, actions: [door <- open]}
  closes: {guard: door == open, actions: [door <- closed]}
  arrives: {guard: bottles < 3, actions: [bottles += 1]}
operations:
  work:
    request: robot
    deadline: 20 s
    guard: done == false && near != c && door != open
    effects: [done <- true, gate <- locked]
automatic_transitions:
  sees: {g: button == down && lamp == lit && seen == 0, a: [seen <- 1]}
  sees_late: {g: button == down && lamp == dark && seen == 0, a: [seen <- 2]}
goals: {done: done == true}
"""
MODEL = read_model(CELL)


def run(environment: str, more: str = "") -> Execution:
    return Tester(MODEL).execute(read_case(f"case: one\ngoal: done\nenvironment:\n{environment}{more}", MODEL))


def changes(execution: Execution) -> list[tuple[float, str, dict[str, object]]]:
    records = (record for record in execution.trace.records if isinstance(record, MeasurementReceived))
    return [(record.at_ns / S, record.by, dict(record.changes)) for record in records]


@pytest.mark.parametrize(
    "entry",
    [
        "{at: 1 s, set: {bottles: 2}}",
        "{at: 1 s, by: arrives, set: {bottles: 3}}",
        "{at: 1 s, by: closes}",
        "{at: 1 s, by: opens, set: {door: closed}}",
        "{at: 1 s, by: opens, set: {door: open, bottles: 1}}",
    ],
)
def test_a_change_without_a_maker_is_impossible_and_the_case_no_run(entry: str, wording: Wording) -> None:
    execution = run(f"  - {entry}\n")
    (failure,) = execution.verdict.failures
    assert (execution.verdict.end, failure.kind) == (End.IMPOSSIBLE, FailureKind.IMPOSSIBLE)
    assert (execution.visited, execution.forced) == (0, 0)
    wording(failure)


def test_an_impossible_change_fails_a_case_that_expects_something_else() -> None:
    for expected in ("reached", "time_limit"):
        verdict = run("  - {at: 1 s, set: {bottles: 2}}\n", f"expect: {{verdict: {expected}}}\n").verdict
        assert [failure.kind for failure in verdict.failures] == [FailureKind.IMPOSSIBLE]


def test_the_same_change_as_an_injection_forces() -> None:
    case = read_case("case: one\ngoal: done\ninjections: [{name: two, at: 1 s, set: {bottles: 2}}]\n", MODEL)
    execution = Tester(MODEL).execute(case)
    forced = [record.forced for record in execution.trace.records if isinstance(record, InjectionApplied)]
    assert (execution.verdict.end, forced) == (End.REACHED, [True])


def test_actions_say_what_a_transition_changes_and_any_maker_will_do() -> None:
    execution = run("  - {at: 1 s, by: arrives}\n  - {at: 2 s, set: {bottles: 2}}\n")
    assert changes(execution) == [(1.0, "arrives", {"bottles": 1}), (2.0, "arrives", {"bottles": 2})]
    assert execution.forced_by is None


@pytest.mark.parametrize(("values", "seen"), [("button: down, lamp: lit", 2), ("lamp: lit, button: down", 1)])
def test_several_inputs_change_in_the_order_written_with_automatic_transitions_between(values: str, seen: int) -> None:
    execution = run(f"  - {{at: 1 s, set: {{{values}}}}}\n")
    assert [at for at, _, _ in changes(execution)] == [1.0, 1.0]
    assert execution.verdict.end is End.REACHED
    taken = {record.kind: dict(record.changes) for record in execution.trace.records if record.kind == "automatic"}
    assert taken["automatic"] == {"seen": seen}


def test_an_entry_that_sets_nothing_is_always_possible_and_keeps_a_run_waiting() -> None:
    ends = []
    for more in ("", "{at: 30 s, set: {}}"):
        text = f"environment: [{{at: 0 s, by: opens}}, {more}]\ngoals: [{{goal: done, when: door == open}}]\n"
        execution = Tester(MODEL).execute(read_case(f"case: one\n{text}", MODEL))
        ends.append((execution.verdict.end, execution.ended_ns / S))
    assert ends == [(End.UNSOLVABLE, 0.0), (End.UNSOLVABLE, 30.0)]


def test_a_predicate_is_tried_once_the_entry_before_has_acted() -> None:
    execution = run(
        "  - {when: robot_req_state == executing, after: 2 s, by: opens}\n"
        "  - {when: door == open, after: 1 s, by: closes}\n"
        "  - {when: door == closed, by: arrives}\n"
    )
    assert changes(execution) == [
        (2.0, "opens", {"door": "open"}),
        (3.0, "closes", {"door": "closed"}),
        (3.0, "arrives", {"bottles": 1}),
    ]


def test_what_is_due_at_once_acts_after_the_goal_is_given_unless_that_waits() -> None:
    kinds = [record.kind for record in run("  - {at: 0 s, by: arrives}\n").trace.records]
    assert kinds.index("measurement") > kinds.index("run_started")
    text = "case: one\ngoals: [{goal: done, when: bottles == 1}]\nenvironment: [{at: 0 s, by: arrives}]\n"
    kinds = [record.kind for record in Tester(MODEL).execute(read_case(text, MODEL)).trace.records]
    assert kinds.index("measurement") < kinds.index("run_started")


def test_a_first_goal_that_never_may_begin_is_not_started() -> None:
    text = "case: one\ngoals: [{goal: done, when: bottles == 2}]\nenvironment: [{at: 1 s, by: arrives}]\n"
    execution = Tester(MODEL).execute(read_case(text, MODEL))
    assert (execution.verdict.end, execution.ended_ns) == (End.NOT_STARTED, 1 * S)


def test_plans_can_take_time_so_that_changes_come_while_one_is_awaited() -> None:
    execution = run("  - {at: 500 ms, by: arrives}\n", "planning: 1 s\n")
    kinds = [(record.kind, record.at_ns / S) for record in execution.trace.records]
    assert kinds.index(("measurement", 0.5)) < kinds.index(("plan_received", 1.0))


def test_a_case_that_lists_changes_fails_by_a_livelock_at_rest() -> None:
    blinks = """automatic_transitions:
  on: {g: plan.state == idle && seen == 0, a: [seen <- 3]}
  off: {g: plan.state == idle && seen == 3, a: [seen <- 0]}
"""
    model = read_model(CELL.replace("automatic_transitions:\n", blinks))
    case = read_case("case: one\ngoal: done\nenvironment: [{at: 0 s, by: arrives}]\n", model)
    kinds = [failure.kind for failure in Tester(model).execute(case).verdict.failures]
    assert FailureKind.LIVELOCK in kinds
