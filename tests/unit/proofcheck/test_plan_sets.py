"""Certificates about each set of plans and each order of goals, compared with what runs of a small model visit."""

from __future__ import annotations

from functools import cache
from itertools import product

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.cases.trace import End
from scbm.files import read_case, read_model
from scbm.model import BehaviorModel, GoalOrder, PlanSet
from scbm.proofcheck import (
    Certificate,
    CertificateFlaw,
    RunsArgument,
    certificate_text,
    check_certificate,
    read_certificate,
)
from scbm.testing import Tester
from support.certificates import certificate_of, without_situation

CRANE = """
behavior_model: crane
variables:
  at: {domain: [a, b, c], initial: a}
  marked: {domain: bool, initial: false, source: state}
resources: {arm: {}}
operations:
  direct:
    deadline: 5 s
    pre: {g: at == a, a: [arm_req_trigger <- true]}
    post: {g: true, gr: arm_req_state == succeeded, a: [at <- c, arm_req_trigger <- false, arm_req_state <- initial]}
    timedout: [arm_req_trigger <- false]
  other: {pre: {g: at == a}, post: {g: true, a: [at <- c]}}
  half: {pre: {g: at == a}, post: {g: true, a: [at <- b]}}
  rest: {pre: {g: at == b}, post: {g: true, a: [at <- c]}}
  back: {pre: {g: at == c && marked == true}, post: {g: true, a: [at <- a]}}
automatic_transitions:
  mark: {g: plan.state == completed && at == c, a: [marked <- true]}
goals:
  there: at == c
  home: at == a
"""
"""The canonical plan to `c` is `direct`. `other` is as short, and `half` and `rest` together are longer. Only a second
goal needs `back`, as `marked` is still false in each run that starts in the initial state. In the open model `marked`
is an input."""

KINDS = [pytest.param(*kind, id="-".join(kind)) for kind in product(GoalOrder, PlanSet)]


@cache
def crane(goals: GoalOrder, *, is_open: bool = False) -> BehaviorModel:
    text = CRANE.replace("source: state", "source: input") if is_open else CRANE
    return read_model(f"{text}runs: {{goals: {goals}}}\n")


@cache
def certified(goals: GoalOrder, plans: PlanSet, *, is_open: bool = False) -> Certificate:
    return certificate_of(crane(goals, is_open=is_open), goals, plans)


def claimed_anew(certificate: Certificate, *claims: str) -> Certificate:
    return replace(certificate, claims=claims)


def is_proof(certificate: Certificate, *, is_open: bool = False) -> bool:
    return not check_certificate(certificate, crane(certificate.goals, is_open=is_open))


@pytest.mark.parametrize(("goals", "plans"), KINDS)
@pytest.mark.parametrize("is_open", [False, True], ids=["closed", "open"])
def test_what_no_run_visits_is_proved_and_nothing_else(goals: GoalOrder, plans: PlanSet, is_open: bool) -> None:  # noqa: FBT001 - a parameter of the test
    certificate = certified(goals, plans, is_open=is_open)
    assert is_proof(certificate, is_open=is_open)
    names = [str(obligation) for obligation in Obligations.of(crane(goals))]
    others = [name for name in names if name not in certificate.claims]
    refused = [name for name in others if not is_proof(claimed_anew(certificate, name), is_open=is_open)]
    assert refused == others


@pytest.mark.parametrize(
    ("goals", "plans", "never_queued"),
    [
        ("single", "canonical", ["other", "half", "rest", "back"]),
        ("single", "any", ["back"]),
        ("sequence", "canonical", ["other", "half", "rest"]),
        ("sequence", "any", []),
    ],
)
def test_the_plans_and_the_order_of_goals_decide_which_operations_are_never_planned(
    goals: str, plans: str, never_queued: list[str]
) -> None:
    certificate = certified(GoalOrder(goals), PlanSet(plans))
    queued = [f"{name}/queued" for name in ("direct", "other", "half", "rest", "back")]
    never = [name for name in queued if is_proof(claimed_anew(certificate, name))]
    assert never == [f"{name}/queued" for name in never_queued]


@pytest.mark.parametrize(("goals", "plans"), KINDS)
@pytest.mark.parametrize("is_open", [False, True], ids=["closed", "open"])
def test_a_certificate_is_read_as_it_was_written(goals: GoalOrder, plans: PlanSet, is_open: bool) -> None:  # noqa: FBT001 - a parameter of the test
    certificate = certified(goals, plans, is_open=is_open)
    assert read_certificate(certificate_text(certificate)) == certificate


def test_a_single_goal_can_follow_itself() -> None:
    """The operation `back` is never planned: the goal that is given again holds at once."""
    model = read_model(CRANE.replace("  home: at == a\n", ""))
    certificate = certificate_of(model, GoalOrder.SEQUENCE, PlanSet.ANY)
    assert "back/queued" in certificate.claims
    assert check_certificate(certificate, model) == ()


@pytest.mark.parametrize(("goals", "plans"), KINDS)
def test_no_situation_can_be_left_out(goals: GoalOrder, plans: PlanSet) -> None:
    smaller = list(without_situation(certified(goals, plans)))
    assert smaller
    assert not any(map(is_proof, smaller))


def test_queues_are_states_of_the_variables_on_which_plans_depend() -> None:
    certificate = certified(GoalOrder.SINGLE, PlanSet.ANY)
    argument = certificate.argument
    assert isinstance(argument, RunsArgument)
    first, *others = argument.runs
    for queue in (("d", True), ("a", 1), ("a",)):
        situation = next(each for each in first.situations if each.queue is not None)
        longer = replace(first, situations=(*first.situations, replace(situation, queue=queue)))
        (flaw,) = flaws_of(certificate, replace(argument, runs=(longer, *others)))
        assert flaw.where == f"goal there, situation {len(longer.situations)}"
    other = replace(first, planned=first.planned[:1])
    assert flaws_of(certificate, replace(argument, runs=(other, *others)))[0].where == "goal there"


def flaws_of(certificate: Certificate, argument: RunsArgument) -> tuple[CertificateFlaw, ...]:
    return check_certificate(replace(certificate, argument=argument), crane(argument.goals))


TOGGLES = """
behavior_model: toggles
variables:
  x: {domain: bool, initial: false}
  copy: {domain: bool, initial: false, source: state}
  second_copy: {domain: bool, initial: false, source: state}
  done: {domain: bool, initial: false}
operations:
  set: {pre: {g: x == false}, post: {g: true, a: [x <- true]}}
  clear: {pre: {g: x == true}, post: {g: true, a: [x <- false]}}
  finish: {pre: {g: x == false}, post: {g: true, a: [done <- true]}}
automatic_transitions:
  ends_between: {g: plan.state == aborted && x != copy, a: [copy <- x]}
  follow: {g: copy != x, a: [copy <- x]}
  follow_too: {g: second_copy != copy, a: [second_copy <- copy]}
goals: {done: done == true}
runs: {goals: single}
"""


def test_a_plan_with_more_than_a_thousand_automatic_transitions_visits_nothing_that_is_proved_of_any_plan() -> None:
    model = read_model(TOGGLES)
    certificate = certificate_of(model, GoalOrder.SINGLE, PlanSet.ANY)
    assert "automatic/ends_between" in certificate.claims
    assert check_certificate(certificate, model) == ()
    plan = ", ".join(["set", "clear"] * 300 + ["finish"])
    case = read_case(f"case: long\nmodel: toggles\ngoal: done\nplans: [[{plan}]]\n", model)
    execution = Tester(model).execute(case)
    assert execution.verdict.end is End.REACHED
    assert not [name for name in Obligations.of(model).names(execution.visited) if name in certificate.claims]
