"""The runner by its public door: events with times in, effects and deadlines out (semantics 5 and 6)."""

from __future__ import annotations

import pytest

from scbm.cases import Injection
from scbm.cases.coverage import Obligations, visited_by
from scbm.cases.trace import (
    SENT,
    AutomaticTaken,
    Changes,
    End,
    InjectionApplied,
    MeasurementRefused,
    PlanDropped,
    PlanReceived,
    ReplyDropped,
    RunEnded,
    RunnerStarted,
    RunStarted,
    state_after,
)
from scbm.files import read_model
from scbm.model import Constant, Equal, Reference
from scbm.running import (
    AskPlan,
    GoalGiven,
    Measured,
    PlanAnswered,
    PlanStatus,
    Program,
    ReplyArrived,
    RunnerOptions,
    TimePassed,
    describe_cycle,
)
from support.driving import SECOND_NS, Hand
from support.models import scan_cell
from support.wording import Wording

PUBLISHES = ("measures: [temperature]", "measures: [temperature]\n    publishes: [temperature]")


def current_is(name: str) -> Equal:
    return Equal(Reference("current.name"), Constant(name))


# the way to the goal


def test_a_run_goes_through_the_life_of_its_operation_to_the_goal() -> None:
    hand = Hand(scan_cell())
    hand.goal()
    assert [(sent.request, sent.resource, sent.payload) for sent in hand.sent] == [
        (1, "scan", (("scan_command", "scan_box"),))
    ]
    assert hand.runner.deadline_ns == 10 * SECOND_NS
    hand.reply(1, 2.5)
    assert hand.lifecycle == ["scan_box executing", "scan_box completed"]
    assert hand.ends == [End.REACHED]
    assert hand.runner.state["plan.state"] == "completed"
    assert hand.runner.state["scan_box.state"] == "initial"
    assert hand.runner.state["current.name"] == "none"
    assert hand.runner.deadline_ns is None


def test_a_goal_that_holds_is_reached_without_a_plan() -> None:
    hand = Hand(scan_cell(), state={"box_is_scanned": True})
    hand.goal()
    assert hand.ends == [End.REACHED]
    assert not any(isinstance(effect, AskPlan) for effect in hand.effects)


def test_the_runner_settles_when_it_starts_before_its_goal_is_given() -> None:
    fade = "automatic_transitions:\n  fade: {g: light == blue, a: [light <- green]}"
    hand = Hand(scan_cell(("automatic_transitions:", fade)), state={"light": "blue"})
    hand.goal()
    assert [type(record) for record in hand.records[:3]] == [RunnerStarted, AutomaticTaken, RunStarted]
    assert hand.ends == []


def test_goals_wait_in_order_while_one_is_pursued() -> None:
    hand = Hand(scan_cell(("goals:", "goals:\n  red: light == red")))
    hand.goal()
    hand.goal("scanned")
    assert hand.ends == []
    hand.reply(1, 1)
    assert hand.ends == [End.REACHED, End.REACHED]


def test_the_goal_is_not_reached_while_the_operation_executes() -> None:
    hand = Hand(scan_cell())
    hand.goal()
    hand.inject(Injection("shortcut", (("box_is_scanned", True),)), 1)
    assert hand.ends == []
    hand.reply(1, 2)
    assert hand.ends == [End.REACHED]


# the order at one instant


def test_a_reply_at_the_instant_of_the_deadline_is_in_time() -> None:
    hand = Hand(scan_cell())
    hand.goal()
    hand.reply(1, 10)
    assert hand.lifecycle[-1] == "scan_box completed"


def test_everything_that_happens_at_the_instant_of_a_deadline_is_in_time() -> None:
    both = scan_cell(
        ("gr: scan_req_state == succeeded", "gr: scan_req_state == succeeded && temperature == 8"), PUBLISHES
    )
    hand = Hand(both)
    hand.goal()
    hand.reply(1, 10)
    assert hand.lifecycle == ["scan_box executing"]
    hand.give(Measured((("temperature", 8),)), 10)
    assert hand.lifecycle == ["scan_box executing", "scan_box completed"]
    late = Hand(both)
    late.goal()
    late.reply(1, 10)
    late.wait(10)
    assert late.lifecycle[1] == "scan_box timedout"


def test_failed_by_an_automatic_transition_comes_before_completed() -> None:
    model = scan_cell(("g: scan_req_state == failed &&", "g: scan_req_state == succeeded &&"))
    hand = Hand(model)
    hand.goal()
    hand.reply(1, 1)
    assert hand.lifecycle[:2] == ["scan_box executing", "scan_box failed by scan_failed"]


FAILED = "    failed: {g: scan_req_state == failed, a: [scan_req_state <- initial, scan_req_trigger <- false]}\n"


def _with_failed_transition() -> tuple[tuple[str, str], ...]:
    return (
        ("    timedout: [scan_req_trigger <- false]\n", "    timedout: [scan_req_trigger <- false]\n" + FAILED),
        (
            "g: scan_req_state == failed && current.state",
            "g: light == blue && scan_req_state == failed && current.state",
        ),
    )


def test_the_failed_transition_fails_the_operation() -> None:
    hand = Hand(scan_cell(*_with_failed_transition()))
    hand.goal()
    hand.reply(1, 1, succeeded=False)
    assert hand.lifecycle == ["scan_box executing", "scan_box failed", "scan_box executing"]


def test_completed_comes_before_failed_and_failed_before_timedout() -> None:
    both = Hand(
        scan_cell(*_with_failed_transition(), ("gr: scan_req_state == succeeded", "gr: scan_req_state == failed"))
    )
    both.goal()
    both.reply(1, 1, succeeded=False)
    assert both.lifecycle[1] == "scan_box completed"
    late = Hand(scan_cell(*_with_failed_transition()))
    late.goal()
    late.reply(1, 10, succeeded=False)
    assert late.lifecycle[1] == "scan_box failed"


def test_failed_timedout_and_completed_are_seen_by_one_round_of_automatic_transitions() -> None:
    seen = "\n".join(
        f"  saw_{state}: {{g: 'scan_box.state == {state} && light == green', a: [light <- blue]}}"
        for state in ("completed", "failed", "timedout")
    )
    model = scan_cell(("automatic_transitions:", f"automatic_transitions:\n{seen}"))
    for state in ("completed", "failed", "timedout"):
        hand = Hand(model)
        hand.goal()
        if state == "timedout":
            hand.wait(10)
        else:
            hand.reply(1, 1, succeeded=state == "completed")
        taken = [record.transition for record in hand.records if isinstance(record, AutomaticTaken)]
        assert f"saw_{state}" in taken


# disabled


def test_an_operation_whose_runner_guard_is_false_is_disabled_until_it_holds() -> None:
    hand = Hand(scan_cell(), state={"light": "red"})
    hand.goal()
    assert hand.lifecycle == ["scan_box disabled"]
    assert hand.sent == []
    hand.inject(Injection("go", (("light", "green"),)), 3)
    assert hand.lifecycle == ["scan_box disabled", "scan_box executing"]


def test_an_injection_at_the_moment_an_operation_becomes_current_still_disables_it() -> None:
    hand = Hand(scan_cell())
    hand.inject(Injection("occupy", (("scan_req_state", "executing"),), when=current_is("scan_box"), hold_ns=SECOND_NS))
    hand.goal()
    assert hand.lifecycle == ["scan_box disabled"]
    assert hand.runner.deadline_ns == SECOND_NS
    hand.wait_for_deadline()
    assert hand.lifecycle == ["scan_box disabled", "scan_box executing"]


def test_the_state_of_the_plan_is_never_put_back() -> None:
    hand = Hand(scan_cell())
    assign = (("plan.state", "aborted"), ("count", 2))
    hand.inject(Injection("aborts", assign, when=current_is("scan_box"), hold_ns=SECOND_NS))
    hand.goal()
    assert hand.ends == [End.ABORTED]
    hand.wait(1)
    assert (hand.runner.state["plan.state"], hand.runner.state["count"]) == ("aborted", 0)


def test_what_was_changed_and_changed_back_since_an_injection_is_not_put_back() -> None:
    """The injected value is there again, but another action has assigned it."""
    hand = Hand(scan_cell())
    hand.inject(Injection("held", (("light", "blue"), ("count", 2)), hold_ns=5 * SECOND_NS), 0)
    hand.inject(Injection("other", (("light", "red"),)), 1)
    hand.inject(Injection("third", (("light", "blue"),)), 2)
    hand.wait(5)
    assert (hand.runner.state["light"], hand.runner.state["count"]) == ("blue", 0)


def test_a_request_that_was_sent_meanwhile_is_not_put_back() -> None:
    hand = Hand(scan_cell())
    hand.inject(Injection("occupied", (("scan_req_state", "executing"),), hold_ns=2 * SECOND_NS), 0)
    hand.goal()
    hand.inject(Injection("freed", (("scan_req_state", "initial"),)), 1)
    assert len(hand.sent) == 1
    hand.wait(2)
    assert (hand.cancelled, hand.runner.state["scan_req_state"]) == ([], "executing")


def test_what_else_changed_since_an_injection_is_not_put_back() -> None:
    hand = Hand(scan_cell(), state={"light": "red"})
    hand.inject(Injection("blue", (("light", "blue"), ("count", 2)), hold_ns=5 * SECOND_NS), 0)
    hand.inject(Injection("green", (("light", "green"),)), 1)
    hand.wait_for_deadline()
    assert (hand.runner.state["light"], hand.runner.state["count"]) == ("green", 0)


def test_an_operation_that_is_failed_by_an_injection_stays_failed_and_is_covered() -> None:
    hand = Hand(scan_cell())
    hand.goal()
    hand.inject(Injection("break", (("current.state", "failed"),), hold_ns=0), 1)
    assert [record.failed for record in hand.records if isinstance(record, InjectionApplied)] == ["scan_box"]
    obligations = Obligations.of(hand.model)
    assert "scan_box/failed" in obligations.names(visited_by(hand.records, obligations))
    assert hand.runner.state["current.state"] == hand.runner.state["scan_box.state"] == "initial"


def test_a_timed_injection_acts_at_its_time_and_not_before() -> None:
    hand = Hand(scan_cell())
    hand.inject(Injection("later", (("count", 1),), at_ns=4 * SECOND_NS))
    hand.wait(3)
    assert hand.runner.state["count"] == 0
    assert hand.runner.deadline_ns == 4 * SECOND_NS
    hand.wait_for_deadline()
    assert hand.runner.state["count"] == 1


def test_a_disabled_deadline_asks_for_a_new_plan() -> None:
    model = scan_cell(("    deadline: 10 seconds\n", "    deadline: 10 seconds\n    disabled_deadline: 2 s\n"))
    hand = Hand(model, state={"light": "red"})
    hand.goal()
    hand.wait_for_deadline()
    assert hand.now_ns == 2 * SECOND_NS
    plans = [record for record in hand.records if isinstance(record, PlanReceived)]
    assert len(plans) == 2
    assert hand.lifecycle == ["scan_box disabled", "scan_box disabled"]


# timing out and failing


def test_a_deadline_that_passes_cancels_the_request_and_asks_for_a_new_plan() -> None:
    hand = Hand(scan_cell())
    hand.goal()
    hand.wait_for_deadline()
    assert hand.lifecycle == ["scan_box executing", "scan_box timedout", "scan_box executing"]
    assert hand.cancelled == [1]
    assert [sent.request for sent in hand.sent] == [1, 2]


def test_an_operation_without_a_deadline_never_times_out() -> None:
    model = scan_cell(("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    hand = Hand(model, RunnerOptions(time_limit_ns=60 * SECOND_NS))
    hand.goal()
    assert hand.runner.deadline_ns == 60 * SECOND_NS


def test_an_operation_may_be_failed_by_its_own_name() -> None:
    model = scan_cell(("a: [current.state <- failed,", "a: [scan_box.state <- failed,"))
    hand = Hand(model)
    hand.goal()
    hand.reply(1, 1, succeeded=False)
    assert hand.lifecycle[1] == "scan_box failed by scan_failed"


def test_nothing_fails_an_operation_that_does_not_execute() -> None:
    model = scan_cell(("g: scan_req_state == failed && current.state == executing", "g: scan_req_state == failed"))
    hand = Hand(model, state={"scan_req_state": "failed"})
    hand.wait(1)
    assert [type(record) for record in hand.records] == [RunnerStarted]


def test_an_operation_that_only_sets_its_state_is_failed_once() -> None:
    model = scan_cell(
        (
            "a: [current.state <- failed, scan_req_state <- initial, scan_req_trigger <- false]",
            "a: [current.state <- failed]",
        )
    )
    hand = Hand(model, plans=[("scan_box",), PlanAnswered(0, PlanStatus.UNSOLVABLE)])
    hand.goal()
    hand.reply(1, 1, succeeded=False)
    assert hand.lifecycle == ["scan_box executing", "scan_box failed by scan_failed"]
    assert hand.ends == [End.UNSOLVABLE]


# every end of a run


def test_unsolvable_ends_the_run() -> None:
    hand = Hand(scan_cell(), state={"scan_req_state": "failed"})
    hand.goal()
    assert hand.ends == [End.UNSOLVABLE]
    assert hand.runner.state["plan.state"] == "unsolvable"


def test_unsolvable_waits_while_a_request_is_in_flight_and_plans_again_when_the_state_changes() -> None:
    model = scan_cell(
        ("timedout: [scan_req_trigger <- false]", "timedout: [light <- blue]"),
        (
            "  scan_failed:",
            (
                "  tidy:\n    g: light == blue && scan_req_state == succeeded\n"
                "    a: [scan_req_state <- initial, scan_req_trigger <- false, light <- green]\n"
                "  scan_failed:"
            ),
        ),
    )
    hand = Hand(model)
    hand.goal()
    hand.wait_for_deadline()
    assert hand.lifecycle == ["scan_box executing", "scan_box timedout"]
    assert hand.ends == []
    hand.reply(1, 12)
    assert hand.lifecycle[-1] == "scan_box executing"
    assert [sent.request for sent in hand.sent] == [1, 2]


def test_an_answer_that_is_out_of_date_is_not_held_against_the_new_state() -> None:
    hand = Hand(scan_cell(), state={"scan_req_state": "failed"}, answering=False)
    hand.goal()
    hand.inject(Injection("repair", (("scan_req_state", "initial"),)))
    hand.give(PlanAnswered(1, PlanStatus.UNSOLVABLE))
    assert hand.ends == []
    assert [effect.ask for effect in hand.effects if isinstance(effect, AskPlan)] == [1, 2]


def test_unsolvable_waits_for_an_injection_and_ends_when_the_last_one_changed_nothing() -> None:
    hand = Hand(scan_cell(), state={"scan_req_state": "failed"})
    hand.inject(Injection("nothing", (("scan_req_state", "failed"),), at_ns=5 * SECOND_NS))
    hand.goal()
    assert hand.ends == []
    hand.wait_for_deadline()
    assert hand.ends == [End.UNSOLVABLE]


def test_unsolvable_waits_for_measured_values_where_they_may_come_unasked() -> None:
    hand = Hand(scan_cell(), RunnerOptions(awaits_measurements=True), {"scan_req_state": "failed"})
    hand.goal()
    assert hand.ends == []
    hand.give(TimePassed(), 3600)
    assert hand.ends == [End.TIME_LIMIT]


def test_an_abort_ends_the_run_cancels_and_clears() -> None:
    model = scan_cell(
        (
            "automatic_transitions:",
            "automatic_transitions:\n  stop: {g: light == red, a: [plan.state <- aborted, light <- green]}",
        )
    )
    hand = Hand(model)
    hand.goal()
    hand.inject(Injection("red", (("light", "red"),)), 1)
    assert hand.ends == [End.ABORTED]
    assert hand.cancelled == [1]
    state = hand.runner.state
    assert (state["scan_req_trigger"], state["scan_req_state"], state["scan_box.state"]) == (
        False,
        "initial",
        "initial",
    )
    hand.reply(1, 2)
    assert hand.runner.dropped_replies == {"late": 1, "repeated": 0, "unknown": 0}


def test_a_request_that_was_not_sent_yet_when_the_run_ends_is_never_sent() -> None:
    stop = "automatic_transitions:\n  stop: {g: scan_box.state == executing, a: [plan.state <- aborted]}"
    hand = Hand(scan_cell(("automatic_transitions:", stop)))
    hand.goal()
    assert hand.ends == [End.ABORTED]
    assert hand.sent == []
    assert hand.runner.state["scan_req_trigger"] is False


def test_an_answered_request_is_cleared_at_the_end_and_an_occupied_resource_is_left_alone() -> None:
    stop = "automatic_transitions:\n  stop: {g: scan_req_state == succeeded, a: [plan.state <- aborted]}"
    answered = Hand(scan_cell(("automatic_transitions:", stop)))
    answered.goal()
    answered.reply(1, 1)
    assert answered.ends == [End.ABORTED]
    assert (answered.runner.state["scan_req_state"], answered.runner.state["scan_req_trigger"]) == ("initial", False)
    occupied = Hand(scan_cell(), state={"scan_req_state": "executing", "scan_req_trigger": True})
    occupied.goal()
    assert occupied.ends == [End.UNSOLVABLE]
    assert (occupied.runner.state["scan_req_state"], occupied.runner.state["scan_req_trigger"]) == ("executing", False)


def test_the_time_limit_ends_the_run() -> None:
    hand = Hand(scan_cell(), RunnerOptions(time_limit_ns=15 * SECOND_NS))
    hand.goal()
    hand.wait_for_deadline()
    hand.wait_for_deadline()
    assert hand.now_ns == 15 * SECOND_NS
    assert hand.ends == [End.TIME_LIMIT]
    assert hand.cancelled == [1, 2]


def test_the_limit_on_plans_ends_the_run() -> None:
    hand = Hand(scan_cell(), RunnerOptions(plan_limit=3))
    hand.goal()
    for request in (1, 2, 3):
        hand.reply(request, request, succeeded=False)
    assert hand.ends == [End.REPLAN_LIMIT]
    assert sum(isinstance(effect, AskPlan) for effect in hand.effects) == 3


@pytest.mark.parametrize(
    ("limit", "end"),
    [(100, End.LIVELOCK), (50, End.LIVELOCK), (49, End.REPLAN_LIMIT), (3, End.REPLAN_LIMIT)],
)
def test_a_run_that_uses_its_many_plans_in_one_instant_ends_as_livelock(limit: int, end: End) -> None:
    hand = Hand(scan_cell(), RunnerOptions(plan_limit=limit), plans=[()] * limit)
    hand.goal()
    assert hand.ends == [end]


@pytest.mark.parametrize(("earlier", "end"), [(1, End.LIVELOCK), (50, End.LIVELOCK), (51, End.REPLAN_LIMIT)])
def test_plans_of_earlier_instants_do_not_hide_a_livelock(earlier: int, end: End) -> None:
    hand = Hand(scan_cell(), plans=[("scan_box",)] * earlier + [()] * (100 - earlier))
    hand.goal()
    for request in range(1, earlier + 1):
        hand.reply(request, request, succeeded=False)
    assert hand.ends == [end]


def test_a_planner_that_gives_up_is_not_an_unsolvable_goal() -> None:
    hand = Hand(scan_cell(), plans=[PlanAnswered(0, PlanStatus.LIMIT_REACHED)])
    hand.goal()
    assert hand.ends == [End.PLANNER_LIMIT]


def test_an_incomplete_search_that_finds_nothing_is_not_an_unsolvable_goal() -> None:
    hand = Hand(scan_cell(), plans=[PlanAnswered(0, PlanStatus.NO_PLAN_FOUND)])
    hand.goal()
    assert hand.ends == [End.NO_PLAN_FOUND]
    assert state_after(hand.records)["plan.state"] == "aborted"


def test_a_livelock_is_named_by_its_transitions() -> None:
    ring = (
        "automatic_transitions:\n"
        "  to_red: {g: light == green && box_is_scanned == true, a: [light <- red]}\n"
        "  to_blue: {g: light == red && box_is_scanned == true, a: [light <- blue]}\n"
        "  to_green: {g: light == blue && box_is_scanned == true, a: [light <- green]}"
    )
    hand = Hand(scan_cell(("automatic_transitions:", ring)), RunnerOptions(livelock_bound=50))
    hand.goal()
    hand.reply(1, 1)
    assert hand.ends == [End.LIVELOCK]
    ended = next(record for record in hand.records if isinstance(record, RunEnded))
    assert ended.detail == ("to_red", "to_blue", "to_green", "to_red")
    before = hand.records[: hand.records.index(ended)]
    assert sum(isinstance(record, AutomaticTaken) for record in before) == 50


def test_a_livelock_between_an_automatic_transition_and_the_sending_of_requests_is_named() -> None:
    again = "automatic_transitions:\n  again: {g: scan_req_state == executing, a: [scan_req_state <- initial]}"
    hand = Hand(scan_cell(("automatic_transitions:", again)), RunnerOptions(livelock_bound=20))
    hand.goal()
    assert hand.ends == [End.LIVELOCK]
    assert next(record.detail for record in hand.records if isinstance(record, RunEnded)) == ("again", "again")


def test_a_long_chain_that_does_not_go_round_is_not_called_a_round(wording: Wording) -> None:
    count = "automatic_transitions:\n  count_up: {g: count != 9, a: [count += 1]}"
    model = scan_cell(("automatic_transitions:", count), ("count: {domain: 0..2", "count: {domain: 0..9"))
    hand = Hand(model, RunnerOptions(livelock_bound=5))
    hand.goal()
    detail = next(record.detail for record in hand.records if isinstance(record, RunEnded))
    assert detail == ("count_up",)
    wording(describe_cycle(detail))


def test_exactly_as_many_automatic_transitions_as_the_bound_are_no_livelock() -> None:
    count = "automatic_transitions:\n  count_up: {g: box_is_scanned == true && count < 2, a: [count += 1]}"
    model = scan_cell(("automatic_transitions:", count))
    for bound, end in ((2, End.REACHED), (1, End.LIVELOCK)):
        hand = Hand(model, RunnerOptions(livelock_bound=bound))
        hand.goal()
        hand.reply(1, 1)
        assert hand.ends == [end]


TURNS = """
behavior_model: turns
variables:
  at: {domain: 0..2, initial: 0}
  copy: {domain: 0..2, initial: 0, source: state}
  marks: {domain: 0..2, initial: 0, source: state}
  lamp: {domain: [off, on, far], initial: off}
operations:
  first: {pre: {g: at == 0}, post: {g: true, a: [at <- 1]}}
  second: {pre: {g: at == 1}, post: {g: true, a: [at <- 2]}}
automatic_transitions:
  follow: {g: copy < at, a: [copy += 1]}
  mark: {g: marks < copy, a: [marks += 1]}
  light: {g: plan.state == planning && at == 1 && lamp == off, a: [lamp <- on]}
  far: {g: lamp == on, a: [lamp <- far]}
goals: {there: at == 2}
"""
"""Two automatic transitions follow each operation, and two the request for a second plan, all at one moment."""


def test_automatic_transitions_are_counted_anew_for_each_operation_of_a_plan() -> None:
    program = Program(read_model(TURNS))
    for bound, end in ((2, End.REACHED), (1, End.LIVELOCK), (2, End.REACHED)):
        hand = Hand(program, RunnerOptions(livelock_bound=bound))
        hand.goal("there")
        assert hand.ends == [end]


def test_automatic_transitions_are_counted_anew_when_a_plan_is_requested() -> None:
    """The first plan ends too early, so a second one is requested."""
    for bound, end in ((2, End.REACHED), (1, End.LIVELOCK)):
        hand = Hand(read_model(TURNS), RunnerOptions(livelock_bound=bound), plans=[("first",), ("second",)])
        hand.goal("there")
        assert hand.ends == [end]


def test_timedout_actions_that_leave_a_domain_are_a_fault_of_the_model() -> None:
    model = scan_cell(("timedout: [scan_req_trigger <- false]", "timedout: [scan_req_trigger <- false, count += 1]"))
    hand = Hand(model, state={"count": 2})
    hand.goal()
    hand.wait_for_deadline()
    assert hand.ends == [End.MODEL_ERROR]
    ended = next(record for record in hand.records if isinstance(record, RunEnded))
    assert "scan_box" in ended.detail[0]


# automatic transitions


def test_the_first_automatic_transition_in_the_file_goes_first() -> None:
    two = (
        "automatic_transitions:\n"
        "  one: {g: light == red, a: [light <- green]}\n"
        "  two: {g: light == red, a: [light <- blue]}"
    )
    hand = Hand(scan_cell(("automatic_transitions:", two)), state={"light": "red"})
    hand.wait(1)
    assert [record.transition for record in hand.records if isinstance(record, AutomaticTaken)] == ["one"]


def test_an_automatic_transition_that_changes_nothing_or_leaves_a_domain_is_not_taken() -> None:
    both = "automatic_transitions:\n  same: {g: 'true', a: [light <- green]}\n  over: {g: count == 2, a: [count += 1]}"
    hand = Hand(scan_cell(("automatic_transitions:", both)), state={"count": 2})
    hand.wait(1)
    assert [type(record) for record in hand.records] == [RunnerStarted]


# requests and replies


def test_late_repeated_and_unknown_replies_are_dropped_and_counted() -> None:
    hand = Hand(scan_cell())
    hand.goal()
    hand.wait_for_deadline()
    before = hand.runner.state
    hand.reply(1, 11)
    hand.reply(99, 11)
    hand.reply(0, 11)
    assert hand.runner.state == before
    hand.reply(2, 12)
    hand.reply(2, 12)
    assert hand.runner.dropped_replies == {"late": 1, "repeated": 1, "unknown": 2}
    assert [record.why for record in hand.records if isinstance(record, ReplyDropped)] == [
        "late",
        "unknown",
        "unknown",
        "repeated",
    ]


def test_an_occupied_resource_gets_no_request_and_is_left_alone() -> None:
    hand = Hand(scan_cell(), state={"scan_req_state": "executing", "scan_req_trigger": True})
    hand.wait(1)
    assert hand.sent == []
    assert hand.runner.state["scan_req_state"] == "executing"


def test_nothing_is_sent_before_a_goal_is_given_and_after_the_end_of_a_run() -> None:
    early = Hand(scan_cell(), state={"scan_req_trigger": True})
    early.wait(1)
    assert early.sent == []
    hand = Hand(scan_cell())
    hand.goal()
    hand.reply(1, 1)
    assert hand.runner.state["plan.state"] == "completed"
    hand.inject(Injection("ask", (("scan_req_trigger", True),)), 2)
    assert [sent.request for sent in hand.sent] == [1]


def test_a_trigger_that_falls_cancels_the_request_in_flight() -> None:
    hand = Hand(scan_cell(), state={"scan_req_trigger": True})
    hand.goal()
    assert [sent.request for sent in hand.sent] == [1]
    assert [sent.request for sent in hand.sent] == [1]
    hand.inject(Injection("fall", (("scan_req_trigger", False),)), 2)
    assert hand.cancelled == [1]


def test_asking_anew_while_a_request_is_in_flight_cancels_the_former() -> None:
    hand = Hand(scan_cell(), state={"scan_req_trigger": True})
    hand.goal()
    hand.inject(Injection("anew", (("scan_req_state", "initial"),)), 2)
    assert hand.cancelled == [1]
    assert [sent.request for sent in hand.sent] == [1, 2]
    hand.reply(1, 3)
    assert hand.runner.state["scan_req_state"] == "executing"


def test_a_reply_carries_measured_values_and_wrong_ones_are_refused() -> None:
    hand = Hand(scan_cell())
    hand.goal()
    hand.give(ReplyArrived(1, succeeded=True, measured=(("temperature", 8), ("temperature", 99), ("light", "red"))), 1)
    assert hand.runner.state["temperature"] == 8
    assert hand.runner.state["light"] == "green"
    refused = [(r.variable, r.value) for r in hand.records if isinstance(r, MeasurementRefused)]
    assert refused == [("temperature", 99), ("light", "red")]


def test_a_reply_cannot_measure_for_another_resource() -> None:
    model = scan_cell(("resources:\n", "resources:\n  lamp: {publishes: [light]}\n"))
    hand = Hand(model)
    hand.goal()
    hand.give(ReplyArrived(1, succeeded=True, measured=(("light", "red"),)), 1)
    assert hand.runner.state["light"] == "green"
    hand.give(Measured((("light", "red"),)), 2)
    assert hand.runner.state["light"] == "red"


def test_measured_values_come_unasked_too() -> None:
    hand = Hand(scan_cell(PUBLISHES))
    hand.give(Measured((("temperature", 3),)), 1)
    assert hand.runner.state["temperature"] == 3


def forcing(hand: Hand) -> list[tuple[str, Changes]]:
    """What nobody in the model can have changed."""
    return [
        (each.injection, each.changes) for each in hand.records if isinstance(each, InjectionApplied) and each.forced
    ]


def test_values_of_replies_that_come_unasked_force_the_state() -> None:
    hand = Hand(scan_cell())
    hand.give(Measured((("temperature", 3),)), 1)
    assert hand.runner.state["temperature"] == 3
    assert forcing(hand) == [(SENT, (("temperature", 3),))]


def test_values_without_a_meaning_are_refused() -> None:
    hand = Hand(scan_cell())
    hand.give(Measured((("temperature", 99), ("light", "red"), ("nothing", 1))), 1)
    assert [record.variable for record in hand.records if isinstance(record, MeasurementRefused)] == [
        "temperature",
        "light",
        "nothing",
    ]
    assert forcing(hand) == []


def test_a_value_that_the_model_rules_out_forces_the_state_in_replies_and_unasked() -> None:
    narrow = ("measures: [temperature]", "measures: {temperature: [3, 4]}\n    publishes: {temperature: [3, 4]}")
    hand = Hand(scan_cell(narrow))
    hand.give(Measured((("temperature", 8),)), 1)
    hand.goal()
    hand.give(ReplyArrived(1, succeeded=True, measured=(("temperature", 9),)), 2)
    assert hand.runner.state["temperature"] == 9
    assert forcing(hand) == [(SENT, (("temperature", 8),)), (SENT, (("temperature", 9),))]
    hand.give(Measured((("temperature", 4),)), 3)
    assert hand.runner.state["temperature"] == 4
    assert len(forcing(hand)) == 2


# plans and time


def test_an_answer_to_a_question_that_nobody_asks_any_more_is_dropped() -> None:
    hand = Hand(scan_cell(), answering=False)
    hand.goal()
    hand.give(PlanAnswered(7, PlanStatus.SOLVED, ("scan_box",)))
    assert isinstance(hand.records[-1], PlanDropped)
    assert hand.lifecycle == []
    hand.give(PlanAnswered(1, PlanStatus.SOLVED, ("scan_box",)))
    assert hand.lifecycle == ["scan_box executing"]


def test_a_plan_that_ends_without_the_goal_is_followed_by_another() -> None:
    hand = Hand(scan_cell(), RunnerOptions(plan_limit=5), plans=[()] * 5)
    hand.goal()
    assert hand.ends == [End.REPLAN_LIMIT]


def test_time_does_not_run_backwards(wording: Wording) -> None:
    hand = Hand(scan_cell())
    hand.wait(2)
    with wording.raises(ValueError):
        hand.wait(1)


def test_an_idle_runner_waits_for_nothing_and_pursues_a_goal_given_later() -> None:
    hand = Hand(scan_cell())
    assert hand.runner.deadline_ns is None
    hand.wait(100)
    hand.give(GoalGiven("scanned", Equal(Reference("box_is_scanned"), Constant(True))), 200)
    assert hand.runner.deadline_ns == 210 * SECOND_NS
