"""What makes a case fail, and what does not (semantics 7.4)."""

from __future__ import annotations

import pytest

from scbm.model import BehaviorModel, Outcome
from scbm.running import End, Injection, RunnerOptions
from scbm.simulating import Reaction
from scbm.testing import Case, Execution, Tester
from support.models import scan_cell

S = 1_000_000_000
OPTIONS = RunnerOptions(time_limit_ns=60 * S, livelock_bound=20)


def _execute(model: BehaviorModel, *outcomes: Outcome, injections: tuple[Injection, ...] = ()) -> Execution:
    predicate = model.goal("scanned")
    assert predicate is not None
    reactions = tuple(Reaction("scan", outcome, S) for outcome in outcomes)
    case = Case("case", "scanned", predicate, model.nominal_state, reactions, injections)
    return Tester(model, OPTIONS).execute(case)


def test_a_reached_goal_passes() -> None:
    done = _execute(scan_cell(), Outcome.FAIL, Outcome.TIMEOUT, Outcome.SUCCEED)
    assert (done.verdict.end, done.verdict.passed) == (End.REACHED, True)


STUCK = ("gr: scan_req_state == succeeded", "gr: scan_req_state == succeeded && light == blue")


def test_a_goal_not_reached_fails_if_nothing_was_made_to_go_wrong() -> None:
    model = scan_cell(STUCK)
    done = _execute(model, *[Outcome.SUCCEED] * 6)
    assert not done.verdict.passed
    assert "nothing was made to go wrong" in done.verdict.failures[0]


@pytest.mark.parametrize("wrong", [Outcome.FAIL, Outcome.TIMEOUT])
def test_a_goal_not_reached_after_a_failure_or_a_missing_reply_is_a_verdict_and_no_failure(wrong: Outcome) -> None:
    done = _execute(scan_cell(STUCK), wrong, *[Outcome.SUCCEED] * 9)
    assert done.verdict.end is not End.REACHED
    assert done.verdict.passed


def test_a_goal_not_reached_under_an_injection_is_a_verdict_and_no_failure() -> None:
    red = Injection("red", (("light", "red"),))
    done = _execute(scan_cell(), injections=(red,))
    assert (done.verdict.end, done.verdict.passed) == (End.TIME_LIMIT, True)


def test_a_livelock_fails_whatever_went_wrong() -> None:
    ring = (
        "automatic_transitions:\n"
        "  up: {g: light == green, a: [light <- red]}\n"
        "  down: {g: light == red, a: [light <- green]}"
    )
    done = _execute(scan_cell(("automatic_transitions:", ring)))
    assert done.verdict.end is End.LIVELOCK
    assert done.verdict.failures == ("automatic transitions go round without end: up -> down -> up",)


def test_a_fault_of_the_model_fails() -> None:
    model = scan_cell(("timedout: [scan_req_trigger <- false]", "timedout: [scan_req_trigger <- false, count -= 1]"))
    done = _execute(model, Outcome.TIMEOUT)
    assert done.verdict.end is End.MODEL_ERROR
    assert "scan_box" in done.verdict.failures[0]


def test_a_violated_requirement_fails_though_the_goal_is_reached() -> None:
    more = "requirements:\n  never_red: never light == red\n  unscanned: always box_is_scanned == false\n"
    done = _execute(scan_cell(more=more), Outcome.SUCCEED)
    assert done.verdict.end is End.REACHED
    assert len(done.verdict.failures) == 1
    assert done.verdict.failures[0].startswith("unscanned is violated at 1.000 s, scan_box being current")


def test_a_case_without_reactions_and_origin_cannot_be_run() -> None:
    model = scan_cell()
    case = Case("case", "scanned", model.goals[0][1], model.nominal_state)
    with pytest.raises(ValueError, match="neither reactions nor an origin"):
        Tester(model).execute(case)
