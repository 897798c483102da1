"""Other users of a shared resource: when they occupy and leave it, and what follows at that moment (semantics 9.5)."""

from __future__ import annotations

from scbm.cases import Condition, ConditionKind, Injection
from scbm.cases.trace import AutomaticTaken, End, InjectionApplied, PutBack
from scbm.model import BehaviorModel
from support.driving import SECOND_NS, Hand
from support.models import scan_cell

OCCUPIED = Condition(ConditionKind.OCCUPIED)
NOTICES = """automatic_transitions:
  notices: {g: scan_req_state == executing && scan_req_trigger == false && light == green, a: [light <- blue]}
  forgets: {g: scan_req_state == initial && light == blue, a: [light <- green]}
"""


SHARED = ("    request: [scan_command]\n", "    request: [scan_command]\n    shared: true\n")


def shared(*replacements: tuple[str, str]) -> BehaviorModel:
    return scan_cell(SHARED, *replacements)


def occupies(at_s: int, for_s: int) -> Injection:
    return Injection("other", resource="scan", condition=OCCUPIED, at_ns=at_s * SECOND_NS, hold_ns=for_s * SECOND_NS)


def times_of(hand: Hand, kind: type[InjectionApplied | PutBack]) -> list[int]:
    return [record.at_ns // SECOND_NS for record in hand.records if isinstance(record, kind)]


def test_automatic_transitions_follow_at_the_moment_at_which_another_user_occupies_or_leaves() -> None:
    hand = Hand(shared(("automatic_transitions:\n", NOTICES)))
    hand.inject(occupies(at_s=1, for_s=2))
    hand.wait(1)
    assert (hand.runner.state["scan_req_state"], hand.runner.state["light"]) == ("executing", "blue")
    hand.wait(3)
    assert (hand.runner.state["scan_req_state"], hand.runner.state["light"]) == ("initial", "green")
    taken = [record.transition for record in hand.records if isinstance(record, AutomaticTaken)]
    assert taken == ["notices", "forgets"]


def test_another_user_waits_while_a_request_is_in_flight() -> None:
    hand = Hand(shared())
    hand.inject(occupies(at_s=1, for_s=2))
    hand.goal()
    hand.wait(1)
    assert times_of(hand, InjectionApplied) == []
    hand.reply(1, 4)
    assert times_of(hand, InjectionApplied) == [4]
    hand.wait(6)
    assert times_of(hand, PutBack) == [6]


def test_a_run_waits_until_another_user_leaves_the_resource() -> None:
    hand = Hand(shared())
    hand.inject(occupies(at_s=0, for_s=2))
    hand.goal()
    assert (hand.ends, hand.sent) == ([], [])
    assert hand.runner.deadline_ns == 2 * SECOND_NS
    hand.wait(2)
    assert hand.lifecycle == ["scan_box executing"]
    hand.reply(1, 3)
    assert hand.ends == [End.REACHED]


def test_the_end_of_a_run_leaves_the_resource_to_another_user() -> None:
    stops = "automatic_transitions:\n  stops: {g: plan.state == planning, a: [plan.state <- aborted]}\n"
    hand = Hand(shared(("automatic_transitions:\n", stops)))
    hand.inject(occupies(at_s=0, for_s=2))
    hand.inject(Injection("triggers", (("scan_req_trigger", True),)))
    hand.goal()
    assert hand.ends == [End.ABORTED]
    assert hand.runner.state["scan_req_state"] == "executing"
    assert hand.runner.state["scan_req_trigger"] is False
