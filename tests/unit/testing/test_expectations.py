"""Expectations of a case against what happened."""

from __future__ import annotations

import pytest

from scbm.cases import Case, Expectations, Injection, OutcomeRule
from scbm.cases.coverage import Aspect, Obligation
from scbm.cases.trace import End
from scbm.files import Scope, Where, parse_predicate
from scbm.model import Outcome
from scbm.testing import Tester
from support.models import scan_cell

MODEL = scan_cell(
    ("operations:\n", "operations:\n  rest:\n    pre: {g: light == green, a: [light <- blue]}\n    post: {g: true}\n"),
    ("gr: light != red", "gr: light == blue"),
    ("box_is_scanned == false\n", "box_is_scanned == false && light == blue\n"),
)


def _told(expect: Expectations, *outcomes: Outcome) -> list[str]:
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
    assert _told(expect) == []


def test_another_end_is_told() -> None:
    assert _told(Expectations(End.ABORTED)) == ["expected the run to end `aborted`, and it ended `reached`"]


def test_another_plan_is_told_with_the_first_difference() -> None:
    assert _told(Expectations(plan=("scan_box",))) == [
        "expected the plan scan_box, and the first plan is rest → scan_box: operation 1 should be scan_box and is rest"
    ]
    longer = "expected the plan rest → scan_box → rest, and the first plan is rest → scan_box: "
    told = _told(Expectations(plan=("rest", "scan_box", "rest")))
    assert told == [longer + "operation 3 should be rest and is nothing"]
    assert _told(Expectations(plan=()))[0].startswith("expected the plan with no operations, and the first plan is")


def test_another_order_is_told_with_what_completed() -> None:
    expected = "expected scan_box → rest to complete in this order, and rest does not complete behind scan_box; "
    told = _told(Expectations(order=("scan_box", "rest")), Outcome.FAIL)
    assert told == [expected + "completed: rest at 0.000 s → scan_box at 0.000 s"]


def test_an_operation_expected_twice_must_complete_twice() -> None:
    assert "rest does not complete behind rest" in _told(Expectations(order=("rest", "rest")))[0]


def test_each_final_predicate_that_does_not_hold_is_told_with_its_values() -> None:
    assert _told(_final("light == red", "box_is_scanned == true", "count == 2 && light == blue")) == [
        "expected light == red at the end, and it ends with light == blue",
        "expected count == 2 && light == blue at the end, and it ends with count == 0, light == blue",
    ]


def test_an_obligation_that_is_not_visited_is_told_with_those_that_are() -> None:
    expect = Expectations(visits=(Obligation("scan_box", Aspect.FAILED), Obligation("scan_failed", Aspect.TAKEN)))
    missed = "expected a visit to scan_box/failed, and the run made none; "
    assert _told(expect) == [
        missed + "of scan_box it visited scan_box/executing, scan_box/completed, scan_box/queued",
        "expected a visit to automatic/scan_failed, and the run made none",
    ]
    assert _told(expect, Outcome.FAIL) == []


def test_a_plan_is_not_expected_in_vain_where_there_is_none() -> None:
    goal = parse_predicate("light == red", Scope.of(MODEL))
    case = Case("case", "red", goal, MODEL.nominal_state, expect=Expectations(End.UNSOLVABLE, plan=()))
    told = [str(failure) for failure in Tester(MODEL).execute(case).verdict.failures]
    assert told == ["expected the plan with no operations, and the planner answered `unsolvable`"]


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
