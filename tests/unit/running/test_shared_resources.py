"""Other users of a shared resource: when they occupy and leave it, and what follows at that moment (semantics 9.5)."""

from __future__ import annotations

from msgspec.structs import replace

from scbm.cases import Condition, ConditionKind, Injection
from scbm.cases.trace import AutomaticTaken, End, InjectionApplied, LivelockedAtRest, PutBack
from scbm.files import read_model
from scbm.model import BehaviorModel
from scbm.running import RunnerOptions
from support.driving import SECOND_NS, Hand
from support.models import scan_cell

OCCUPIED = Condition(ConditionKind.OCCUPIED)
NOTICES = """automatic_transitions:
  notices: {g: scan_req_state == executing && scan_req_trigger == false && light == green, a: [light <- blue]}
  forgets: {g: scan_req_state == initial && light == blue, a: [light <- green]}
"""


TWO_RESOURCES = """
behavior_model: two_resources
variables:
  users: {domain: [none, left, both, right], initial: none, source: state}
resources:
  left: {shared: true}
  right: {shared: true}
operations:
  wait: {pre: {g: users == both}, post: {g: true, a: [users <- none]}}
automatic_transitions:
  left_comes: {g: users == none && left_req_state == executing, a: [users <- left]}
  right_comes: {g: users == left && right_req_state == executing, a: [users <- both]}
  left_goes: {g: users == both && left_req_state == initial, a: [users <- right]}
  right_goes: {g: users == right && right_req_state == initial, a: [users <- none]}
goals: {alone: users == none}
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


def test_automatic_transitions_are_counted_anew_when_another_user_acts() -> None:
    """At 1 s two other users come, at 2 s both leave; each time one transition follows each of them."""
    hand = Hand(read_model(TWO_RESOURCES), RunnerOptions(livelock_bound=1))
    for resource in ("left", "right"):
        hand.inject(replace(occupies(at_s=1, for_s=1), name=resource, resource=resource))
    hand.wait(1)
    hand.wait(2)
    taken = [record.transition for record in hand.records if isinstance(record, AutomaticTaken)]
    assert taken == ["left_comes", "right_comes", "left_goes", "right_goes"]
    assert not any(isinstance(record, LivelockedAtRest) for record in hand.records)


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
