"""A model that waits for a person is not blamed where the case lets no person act (semantics 7.12)."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.cases import Case, CaseGoal, OutcomeRule
from scbm.cases.trace import End, state_after
from scbm.files import read_model
from scbm.model import BehaviorModel, Outcome
from scbm.testing import Excuse, RandomCases, Tester
from scbm.testing.continuations import waiting_runs
from scbm.testing.continuations.waiting_runs import OutsideHelp

ACKNOWLEDGED = """
behavior_model: acknowledge
variables:
  fault: {domain: bool, initial: false}
  reset: {domain: [released, pressed], initial: released, source: input}
  done: {domain: bool, initial: false}
resources:
  drill: {simulation: {latency: 1 s, outcomes: {succeed: 0.5, fail: 0.5}}}
operations:
  make_hole:
    deadline: 10 s
    pre:
      g: drill_req_state == initial && drill_req_trigger == false && fault == false && done == false
      a: [drill_req_trigger <- true]
    post:
      g: true
      gr: drill_req_state == succeeded
      a: [drill_req_trigger <- false, drill_req_state <- initial, done <- true]
    failed:
      g: drill_req_state == failed
      a: [drill_req_trigger <- false, drill_req_state <- initial, fault <- true]
    timedout: [drill_req_trigger <- false, fault <- true]
  acknowledge:
    pre: {g: fault == true, gr: reset == pressed}
    post: {g: true, a: [fault <- false]}
goals: {done: done == true}
"""
PERSON = """
environment:
  push: {guard: fault == true && reset == released, actions: [reset <- pressed], after: 5 s}
  let_go: {guard: fault == false && reset == pressed, actions: [reset <- released], after: 5 s}
"""
FAILS_ONCE = (OutcomeRule("drill", 1, 1, Outcome.FAIL),)


def plain(model: BehaviorModel, *goals: str) -> Case:
    """A case in which the first reply fails, and nothing else is drawn."""
    known = dict(model.goals)
    case = next(RandomCases(model).first(1, seed=1))
    case = replace(case, origin=None, outcomes=FAILS_ONCE)
    return case.with_goals([CaseGoal(name, known[name]) for name in goals or known])


def failures(model: BehaviorModel, case: Case) -> list[str]:
    return [failure.subject for failure in Tester(model).execute(case).verdict.failures]


@pytest.mark.parametrize("more", ["", PERSON])
def test_a_person_who_cannot_act_is_no_fault_of_the_model(more: str) -> None:
    model = read_model(ACKNOWLEDGED + more)
    execution = Tester(model).execute(plain(model))
    assert execution.verdict.end.value == "time_limit"
    assert (execution.verdict.passed, execution.verdict.excuses) == (True, (Excuse.WAITS,))


def test_a_model_that_waits_for_what_nothing_outside_brings_has_to_recover() -> None:
    model = read_model(ACKNOWLEDGED.replace("gr: reset == pressed", "gr: done == true"))
    assert failures(model, plain(model)) == ["recovers"]


def test_a_full_counter_that_no_guard_reads_keeps_a_person_from_helping() -> None:
    full = ACKNOWLEDGED.replace("[fault <- false]", "[fault <- false, pushes += 1]")
    for domain, failed in (("0..1", ["recovers"]), ("0..2", [])):
        counter = f"variables:\n  pushes: {{domain: {domain}, initial: 1}}\n"
        model = read_model(full.replace("variables:\n", counter))
        model = replace(model, requirements_off=(("non_blocking", "a full counter"),))
        assert failures(model, plain(model)) == failed


def test_a_person_who_acts_and_does_not_help_changes_nothing() -> None:
    model = read_model(ACKNOWLEDGED.replace("gr: reset == pressed", "gr: done == true") + PERSON)
    drawn = next(case for case in RandomCases(model).first(1, seed=1))
    assert failures(model, replace(drawn, outcomes=FAILS_ONCE)) == []  # the button is away from its nominal value
    model = read_model(ACKNOWLEDGED.replace("gr: reset == pressed", "gr: done == true") + PERSON.replace("5 s", "2 h"))
    drawn = next(case for case in RandomCases(model).first(1, seed=1))
    assert failures(model, replace(drawn, outcomes=FAILS_ONCE)) == ["recovers"]


HOLES = """
behavior_model: holes
variables: {holes: {domain: 0..2, initial: 0}}
resources: {drill: {simulation: {latency: 1 s, outcomes: {succeed: 0.5, fail: 0.5}}}}
operations:
  make_hole:
    deadline: 10 s
    pre: {g: drill_req_state == initial && drill_req_trigger == false && holes < 2, a: [drill_req_trigger <- true]}
    post:
      g: true
      gr: drill_req_state == succeeded
      a: [drill_req_trigger <- false, drill_req_state <- initial, holes += 1]
    failed: {g: drill_req_state == failed, a: [drill_req_trigger <- false, drill_req_state <- initial]}
    timedout: [drill_req_trigger <- false]
goals: {two: holes == 2, one: holes == 1}
"""


def test_where_runs_have_one_goal_a_fault_counts_for_its_own_goal() -> None:
    single = read_model(f"{HOLES}runs: {{goals: single}}\n")
    assert failures(single, plain(single, "two", "one")) == []
    sequence = read_model(HOLES)
    assert failures(sequence, plain(sequence, "two", "one")) == ["recovers"]


UNRELATED = """
behavior_model: unrelated
variables:
  done: {domain: bool, initial: false}
  lamp: {domain: [off, on], initial: off}
resources: {drill: {simulation: {latency: 1 s, outcomes: {succeed: 0.5, timeout: 0.5}}}}
operations:
  work:
    pre: {g: done == false && drill_req_state == initial, a: [drill_req_trigger <- true]}
    post:
      g: true
      gr: drill_req_state == succeeded
      a: [drill_req_trigger <- false, drill_req_state <- initial, done <- true]
    failed: {g: drill_req_state == failed, a: [drill_req_trigger <- false, drill_req_state <- initial]}
environment:
  switch: {guard: lamp == off, actions: [lamp <- on], every: 1 h}
goals: {done: done == true}
"""
MISSING = (OutcomeRule("drill", 1, 1, Outcome.TIMEOUT),)
STOP = ("goals:", "automatic_transitions:\n  stop: {g: lamp == on, a: [plan.state <- aborted]}\ngoals:")
LEAVE = (
    "goals:",
    """automatic_transitions:
  leave:
    g: lamp == on && current.state == executing
    a: [current.state <- failed, drill_req_trigger <- false, drill_req_state <- initial, lamp <- off]
goals:""",
)


@pytest.mark.parametrize("change", [("", ""), STOP])
def test_a_change_that_does_not_lead_to_the_goal_excuses_nothing(change: tuple[str, str]) -> None:
    model = read_model(UNRELATED.replace(*change))
    assert failures(model, replace(plain(model), outcomes=MISSING)) == ["recovers"]


def test_a_change_that_ends_the_operation_that_waits_excuses_it() -> None:
    model = read_model(UNRELATED.replace(*LEAVE))
    verdict = Tester(model).execute(replace(plain(model), outcomes=MISSING)).verdict
    assert (verdict.passed, verdict.excuses) == (True, (Excuse.WAITS,))


def test_a_run_that_gives_up_has_not_waited() -> None:
    gives_up = ("a: [drill_req_trigger <- false, drill_req_state <- initial]}", "a: [plan.state <- aborted]}")
    model = read_model(UNRELATED.replace(*gives_up).replace("on], initial: off", "on], initial: off, random: any"))
    assert failures(model, plain(model)) == ["recovers"]


@pytest.mark.parametrize(("most", "expected"), [(0, OutsideHelp.UNKNOWN), (5_000, OutsideHelp.NONE)])
def test_a_search_that_is_too_long_leaves_the_answer_open(
    most: int, expected: OutsideHelp, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waiting_runs, "MOST_SITUATIONS", most)
    model = read_model(UNRELATED.replace(*STOP))
    done = Tester(model).execute(replace(plain(model), outcomes=MISSING))
    state = state_after(done.trace.records[:-2])
    assert waiting_runs.WaitingRuns(model).help_for(state, ["drill"], model.goals[0][1]) is expected


SHARED = """
behavior_model: shared_lift
variables:
  done: {domain: bool, initial: false}
  weight: {domain: [none, light, heavy], initial: none}
resources:
  drill: {simulation: {latency: 1 s, outcomes: {succeed: 0.5, fail: 0.5}}}
  lift: {shared: true}
  scale: {measures: [weight]}
operations:
  work:
    deadline: 10 s
    pre: {g: done == false && drill_req_state == initial && weight == light, a: [drill_req_trigger <- true]}
    post:
      g: true
      gr: drill_req_state == succeeded
      a: [drill_req_trigger <- false, drill_req_state <- initial, done <- true]
    failed: {g: drill_req_state == failed, a: [drill_req_trigger <- false, drill_req_state <- initial, weight <- none]}
    timedout: [drill_req_trigger <- false]
  weigh:
    deadline: 10 s
    pre: {g: weight == none, gr: lift_req_state == executing, a: [scale_req_trigger <- true]}
    post:
      g: true
      gr: scale_req_state == succeeded && weight == light
      a: [weight <- light, scale_req_trigger <- false, scale_req_state <- initial]
    timedout: [scale_req_trigger <- false]
goals: {done: done == true}
"""


def test_another_user_of_a_shared_resource_is_a_change_from_outside() -> None:
    model = read_model(SHARED)
    case = plain(model)
    case = replace(case, initial=model.nominal_state.replace({"weight": "light"}))
    verdict = Tester(model).execute(case).verdict
    assert (verdict.end, verdict.excuses) == (End.TIME_LIMIT, (Excuse.WAITS,))


def test_a_mutant_without_an_operation_is_judged_in_the_world_of_its_model() -> None:
    model = replace(read_model(ACKNOWLEDGED), requirements_off=(("non_blocking", "the mutant lacks its remedy"),))
    mutant = replace(model, operations=model.operations[:1])
    execution = Tester(model).of_mutant(mutant, plans_alike=False).execute(plain(model))
    assert [failure.subject for failure in execution.verdict.failures] == []
