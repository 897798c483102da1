"""What makes a case fail, and what does not (semantics 7.4)."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.cases import Case, Expectations, Injection, Network, OutcomeRule, Partition, Reaction, Restart
from scbm.cases.trace import (
    End,
    OperationStepped,
    Record,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
)
from scbm.files import read_case
from scbm.model import (
    Always,
    BehaviorModel,
    Constant,
    Equal,
    InputError,
    OperationState,
    Outcome,
    Reference,
    Requirement,
)
from scbm.running import RunnerOptions
from scbm.running.simulation import Simulated
from scbm.testing import CaseResult, Excuse, Execution, FailureKind, Outcomes, Tester, Unjudged, judge
from support.models import scan_cell
from support.wording import Wording

S = 1_000_000_000
OFF = "requirements_off: {ready_again: these tests are about excuses, recovers: these tests are about excuses}\n"
OPTIONS = RunnerOptions(time_limit_ns=60 * S, livelock_bound=20)


def _execute(model: BehaviorModel, *outcomes: Outcome, injections: tuple[Injection, ...] = ()) -> Execution:
    predicate = model.goal("scanned")
    assert predicate is not None
    forced = tuple(OutcomeRule("scan", n, n, outcome, S) for n, outcome in enumerate(outcomes, start=1))
    case = Case("case", "scanned", predicate, model.nominal_state, forced, injections)
    return Tester(model, OPTIONS).execute(case)


def test_a_reached_goal_passes() -> None:
    done = _execute(scan_cell(), Outcome.FAIL, Outcome.TIMEOUT, Outcome.SUCCEED)
    assert (done.verdict.end, done.verdict.passed) == (End.REACHED, True)


STUCK = ("gr: scan_req_state == succeeded", "gr: scan_req_state == succeeded && light == blue")


def test_a_goal_not_reached_fails_if_nothing_was_made_to_go_wrong(wording: Wording) -> None:
    model = scan_cell(STUCK, more=OFF)
    done = _execute(model, *[Outcome.SUCCEED] * 6)
    assert not done.verdict.passed
    (failure,) = done.verdict.failures
    assert failure.kind is FailureKind.NOT_REACHED
    wording(failure)


@pytest.mark.parametrize("wrong", [Outcome.FAIL, Outcome.TIMEOUT])
def test_a_goal_not_reached_after_a_failure_or_a_missing_reply_is_a_verdict_and_no_failure(wrong: Outcome) -> None:
    done = _execute(scan_cell(STUCK, more=OFF), wrong, *[Outcome.SUCCEED] * 9)
    assert done.verdict.end is not End.REACHED
    assert done.verdict.passed


def test_a_goal_not_reached_under_an_injection_is_a_verdict_and_no_failure() -> None:
    red = Injection("red", (("light", "red"),))
    done = _execute(scan_cell(), injections=(red,))
    assert (done.verdict.end, done.verdict.passed) == (End.TIME_LIMIT, True)


def test_a_livelock_fails_whatever_went_wrong(wording: Wording) -> None:
    ring = (
        "automatic_transitions:\n"
        "  up: {g: light == green, a: [light <- red]}\n"
        "  down: {g: light == red, a: [light <- green]}"
    )
    done = _execute(scan_cell(("automatic_transitions:", ring)))
    assert done.verdict.end is End.LIVELOCK
    (failure,) = done.verdict.failures
    wording(failure)


def test_a_fault_of_the_model_fails() -> None:
    model = scan_cell(("timedout: [scan_req_trigger <- false]", "timedout: [scan_req_trigger <- false, count -= 1]"))
    done = _execute(model, Outcome.TIMEOUT)
    assert done.verdict.end is End.MODEL_ERROR
    assert "scan_box" in str(done.verdict.failures[0])


def test_a_violated_requirement_fails_though_the_goal_is_reached(wording: Wording) -> None:
    more = "requirements:\n  never_red: never light == red\n  unscanned: always box_is_scanned == false\n"
    done = _execute(scan_cell(more=more), Outcome.SUCCEED)
    assert done.verdict.end is End.REACHED
    (failure,) = done.verdict.failures
    assert failure.kind is FailureKind.REQUIREMENT
    wording(failure)


@pytest.mark.parametrize(
    ("network", "rules"),
    [
        (Network(partitions=(Partition(50 * S, S),)), ()),
        (Network(restarts=(Restart("scan", 50 * S),)), ()),
        (Network(), (OutcomeRule("scan", 1, 1, Outcome.SUCCEED, 11 * S, cancel=()),)),
        (Network(), (OutcomeRule("scan", 1, 1, request=()),)),
        (Network(), (OutcomeRule("scan", 1, 1, reply=(0, 0)),)),
    ],
)
def test_a_goal_not_reached_on_a_bad_network_is_a_verdict_and_no_failure(
    network: Network, rules: tuple[OutcomeRule, ...]
) -> None:
    model = scan_cell(STUCK, more=OFF)
    case = Case("case", *model.goals[0], model.nominal_state, rules, network=network)
    done = Tester(model, OPTIONS).execute(case)
    assert done.verdict.end is not End.REACHED
    assert done.verdict.passed


def test_that_messages_take_their_time_excuses_nothing() -> None:
    model = scan_cell(STUCK, more=OFF)
    case = Case("case", *model.goals[0], model.nominal_state, network=Network(latency_ns=S))
    assert not Tester(model, OPTIONS).execute(case).verdict.passed


def test_an_expected_verdict_goes_before_the_rule() -> None:
    model = scan_cell(STUCK, more=OFF)
    case = Case("case", *model.goals[0], model.nominal_state, expect=Expectations(End.UNSOLVABLE))
    verdict = Tester(model, OPTIONS).execute(case).verdict
    assert (verdict.passed, verdict.excuses, verdict.is_short) == (True, (Excuse.EXPECTED,), True)
    case = Case("case", *model.goals[0], model.nominal_state, expect=Expectations(End.REACHED))
    failures = Tester(model, OPTIONS).execute(case).verdict.failures
    assert [(f.kind.value, f.subject) for f in failures] == [("expectation", "verdict")]


def test_a_requirement_of_the_case_counts_like_one_of_the_model() -> None:
    model = scan_cell()
    requirement = Requirement("unscanned", Always(Equal(Reference("box_is_scanned"), Constant(False))))
    case = Case("case", *model.goals[0], model.nominal_state, requirements=(requirement,))
    failures = Tester(model).execute(case).verdict.failures
    assert [(f.kind.value, f.subject) for f in failures] == [("requirement", "unscanned")]


# runs that took place elsewhere


def _not_reached(*records: Record, reactions: tuple[Reaction, ...] = ()) -> Execution:
    """A run that came from somewhere, in which the goal was not reached, judged."""
    model = scan_cell(STUCK, more=OFF)
    case = Case("case", *model.goals[0], model.nominal_state)
    tester = Tester(model, OPTIONS)
    simulated = tester.execute(case)
    real = simulated.trace.records
    run = Simulated(End.TIME_LIMIT, real[-1].at_ns, (*real[:-1], *records, real[-1]))
    return tester.judged(case, run, reactions or simulated.reactions)


def test_a_run_from_elsewhere_is_judged_as_a_simulated_one() -> None:
    model = scan_cell()
    case = Case("case", *model.goals[0], model.nominal_state, expect=Expectations(End.REACHED))
    tester = Tester(model)
    simulated = tester.execute(case)
    run = Simulated(simulated.verdict.end, simulated.ended_ns, simulated.trace.records)
    assert tester.judged(case, run, simulated.reactions) == simulated
    assert not tester.judged(case, replace(run, end=End.ABORTED), simulated.reactions).verdict.passed


def test_a_goal_not_reached_when_a_resource_was_lost_is_a_verdict_and_no_failure() -> None:
    assert [failure.kind for failure in _not_reached().verdict.failures] == [FailureKind.NOT_REACHED]
    down = ResourceChanged(60 * S, "network", "scan", "down")
    assert _not_reached(down).verdict.passed
    by_an_injection = ResourceChanged(60 * S, "dead", "scan", "dead")
    assert not _not_reached(by_an_injection).verdict.passed


SENT = RequestSent(0, 1, "scan", (), ())
WRONG: dict[str, tuple[tuple[Record, ...], tuple[Reaction, ...]]] = {
    "failed": ((SENT, ReplyReceived(0, 1, "scan", False, ())), (Reaction("scan", Outcome.FAIL, 0),)),
    "silent": (
        (
            SENT,
            OperationStepped(S, "scan_box", OperationState.EXECUTING, OperationState.TIMEDOUT, None, ()),
            RequestCancelled(S, 1, "scan", ()),
        ),
        (Reaction("scan", Outcome.TIMEOUT, 0),),
    ),
    "lost": ((ResourceChanged(60 * S, "network", "scan", "down"),), ()),
}


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
def test_nobody_makes_a_real_resource_go_wrong(
    wrong: tuple[tuple[Record, ...], tuple[Reaction, ...]], wording: Wording
) -> None:
    records, reactions = wrong
    model = scan_cell()
    case = Case("case", *model.goals[0], model.nominal_state)
    simulated = Outcomes(End.ABORTED, records, reactions, (), ())
    assert judge(case, simulated).passed
    (failure,) = judge(case, replace(simulated, real=("scan",))).failures
    assert failure.kind is FailureKind.NOT_REACHED
    wording(failure.message)
    assert judge(replace(case, expect=Expectations(End.ABORTED)), replace(simulated, real=("scan",))).passed
    assert judge(case, replace(simulated, real=("lamp",))).passed


def test_a_case_that_was_lost_failed_and_nothing_is_known_of_it(wording: Wording) -> None:
    model = scan_cell()
    case = Case("case", *model.goals[0], model.nominal_state, injections=(Injection("red", (("light", "red"),)),))
    lost = Tester(model).lost(case, "the controller was lost")
    (failure,) = lost.verdict.failures
    assert (failure.kind, failure.subject) == (FailureKind.LOST, "lost")
    wording(failure)
    assert (lost.verdict.end, lost.verdict.passed) == (End.LOST, False)
    assert (lost.trace.records, lost.reactions, lost.ended_ns, lost.visited, lost.unused) == ((), (), 0, 0, ())
    assert lost.result == CaseResult(case, 0, lost.verdict, 0, 0, unjudged=Unjudged.NO_RUN)


def test_no_case_can_expect_to_be_lost(wording: Wording) -> None:
    text = "case: lost\ngoal: scanned\nexpect: {verdict: lost}\n"
    with wording.raises(InputError):
        read_case(text, scan_cell())
