"""What a case says and nothing came of."""

from __future__ import annotations

from msgspec.structs import replace

from scbm.cases import Case, Condition, ConditionKind, Injection, Network, Origin, OutcomeRule, Partition, Restart
from scbm.model import Constant, Equal, Outcome, Reference
from scbm.testing import Tester
from support.models import scan_cell
from support.wording import Wording

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


def test_injections_that_never_act_are_reported(wording: Wording) -> None:
    (shown,) = _unused(injections=(Injection("waits", (("count", 1),), RED),))
    wording(shown)


def test_outcomes_of_requests_that_are_never_sent_are_reported(wording: Wording) -> None:
    rules = (OutcomeRule("scan", 1, 4, Outcome.SUCCEED), OutcomeRule("scan_box", 2, None, Outcome.FAIL))
    one, two = _unused(rules)
    wording((one, two))
    never = Case("case", "red", RED, MODEL.nominal_state.replace({"light": "red"}), rules[:1])
    (shown,) = Tester(MODEL).execute(never).unused
    wording(shown)


def test_faults_that_come_too_late_are_reported(wording: Wording) -> None:
    network = Network(partitions=(Partition(3_000_000_000, 1),), restarts=(Restart("scan", 2_500_000_000),))
    case = Case("case", *MODEL.goals[0], MODEL.nominal_state, network=network)
    one, two = Tester(MODEL).execute(case).unused
    wording((one, two))
    assert Tester(MODEL).execute(replace(case, origin=Origin(1))).unused == ()
