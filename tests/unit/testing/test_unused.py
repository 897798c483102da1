"""What a case says and nothing came of."""

from __future__ import annotations

from dataclasses import replace

from scbm.cases import Case, Condition, ConditionKind, Injection, Network, Origin, OutcomeRule, Partition, Restart
from scbm.model import Constant, Equal, Outcome, Reference
from scbm.testing import Tester
from support.models import scan_cell

MODEL = scan_cell()
RED = Equal(Reference("light"), Constant("red"))


def _unused(outcomes: tuple[OutcomeRule, ...] = (), injections: tuple[Injection, ...] = ()) -> tuple[str, ...]:
    case = Case("case", *MODEL.goals[0], MODEL.nominal_state, outcomes, injections)
    return Tester(MODEL).execute(case).unused


def test_a_case_whose_words_all_count_has_none() -> None:
    acts = Injection("acts", (("count", 1),))
    dies = Injection("dies", hold_ns=1, resource="scan", condition=Condition(ConditionKind.OCCUPIED))
    rules = (
        OutcomeRule("scan", 1, 1, Outcome.FAIL),
        OutcomeRule("scan_box", 2, 2, Outcome.SUCCEED),
        OutcomeRule("scan", 2, None),
    )
    assert _unused(rules, (acts, dies)) == ()


def test_injections_that_never_act_are_told() -> None:
    assert _unused(injections=(Injection("waits", (("count", 1),), RED),)) == ("injection waits never acted",)


def test_outcomes_of_requests_that_are_never_sent_are_told() -> None:
    rules = (OutcomeRule("scan", 1, 4, Outcome.SUCCEED), OutcomeRule("scan_box", 2, None, Outcome.FAIL))
    assert _unused(rules) == (
        "the outcome of request 4 of scan is said, and there were 1",
        "the outcome of request 2 of scan_box is said, and there were 1",
    )
    never = Case("case", "red", RED, MODEL.nominal_state.replace({"light": "red"}), rules[:1])
    assert Tester(MODEL).execute(never).unused == ("the outcome of request 4 of scan is said, and there were none",)


def test_faults_that_come_too_late_are_told() -> None:
    network = Network(partitions=(Partition(3_000_000_000, 1),), restarts=(Restart("scan", 2_500_000_000),))
    case = Case("case", *MODEL.goals[0], MODEL.nominal_state, network=network)
    assert Tester(MODEL).execute(case).unused == (
        "the partition at 3 s comes after the end of the run",
        "the restart at 2500 ms comes after the end of the run",
    )
    assert Tester(MODEL).execute(replace(case, origin=Origin(1))).unused == ()
