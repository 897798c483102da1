"""Expectations of a case against what happened."""

from __future__ import annotations

import pytest

from scbm.cases import Case, Expectations, Injection, OutcomeRule
from scbm.cases.coverage import Aspect, Obligation
from scbm.cases.trace import End
from scbm.files import Scope, Where, parse_predicate
from scbm.model import Outcome
from scbm.testing import FailureKind, Tester
from support.models import scan_cell
from support.wording import Wording

MODEL = scan_cell(
    ("operations:\n", "operations:\n  rest:\n    pre: {g: light == green, a: [light <- blue]}\n    post: {g: true}\n"),
    ("gr: light != red", "gr: light == blue"),
    ("box_is_scanned == false\n", "box_is_scanned == false && light == blue\n"),
)


def _failures(expect: Expectations, *outcomes: Outcome) -> list[str]:
    forced = tuple(OutcomeRule("scan", n, n, outcome) for n, outcome in enumerate(outcomes, start=1))
    case = Case("case", *MODEL.goals[0], MODEL.nominal_state, forced, expect=expect)
    return [str(failure) for failure in Tester(MODEL).execute(case).verdict.failures]


def _final(*texts: str) -> Expectations:
    scope = Scope.of(MODEL)
    return Expectations(final=tuple(parse_predicate(text, scope, Where.REQUIREMENT) for text in texts))


@pytest.mark.parametrize(
    "expect",
    [
        Expectations(End.REACHED),
        Expectations(plan=("rest", "scan_box")),
        Expectations(order=("rest", "scan_box")),
        Expectations(order=("scan_box",)),
        _final("box_is_scanned == true", "light == blue && plan.state == completed"),
        Expectations(visits=(Obligation("scan_box", Aspect.COMPLETED), Obligation("rest", Aspect.QUEUED))),
    ],
)
def test_what_happens_as_expected_is_not_complained_of(expect: Expectations) -> None:
    assert _failures(expect) == []


def test_another_end_is_reported(wording: Wording) -> None:
    (failure,) = _failures(Expectations(End.ABORTED))
    wording(failure)


def test_another_plan_is_reported_with_the_first_difference(wording: Wording) -> None:
    plans: list[tuple[str, ...]] = [("scan_box",), ("rest", "scan_box", "rest"), ()]
    for plan in plans:
        (failure,) = _failures(Expectations(plan=plan))
        wording(failure)


def test_another_order_is_reported_with_what_completed(wording: Wording) -> None:
    (failure,) = _failures(Expectations(order=("scan_box", "rest")), Outcome.FAIL)
    wording(failure)


def test_an_operation_expected_twice_must_complete_twice(wording: Wording) -> None:
    (failure,) = _failures(Expectations(order=("rest", "rest")))
    wording(failure)


def test_each_final_predicate_that_does_not_hold_is_reported_with_its_values(wording: Wording) -> None:
    one, two = _failures(_final("light == red", "box_is_scanned == true", "count == 2 && light == blue"))
    wording((one, two))


def test_an_obligation_that_is_not_visited_is_reported_with_those_that_are(wording: Wording) -> None:
    expect = Expectations(visits=(Obligation("scan_box", Aspect.FAILED), Obligation("scan_failed", Aspect.TAKEN)))
    one, two = _failures(expect)
    assert ("scan_box/failed" in one, "automatic/scan_failed" in two) == (True, True)
    wording((one, two))
    assert _failures(expect, Outcome.FAIL) == []


def test_a_plan_is_not_expected_in_vain_where_there_is_none(wording: Wording) -> None:
    goal = parse_predicate("light == red", Scope.of(MODEL))
    case = Case("case", "red", goal, MODEL.nominal_state, expect=Expectations(End.UNSOLVABLE, plan=()))
    (failure,) = Tester(MODEL).execute(case).verdict.failures
    assert failure.kind is FailureKind.EXPECTATION
    wording(failure)


def test_only_what_completes_counts_for_the_order() -> None:
    case = Case(
        "case",
        *MODEL.goals[0],
        MODEL.nominal_state,
        expect=Expectations(order=("scan_box", "scan_box")),
        outcomes=(OutcomeRule("scan", 1, 1, Outcome.TIMEOUT),),
    )
    assert not Tester(MODEL).execute(case).verdict.passed


def test_what_an_injection_did_before_the_run_began_is_in_its_final_state() -> None:
    red = Injection("counted", (("count", 2),))
    case = Case("case", *MODEL.goals[0], MODEL.nominal_state, injections=(red,), expect=_final("count == 2"))
    assert Tester(MODEL).execute(case).verdict.passed
