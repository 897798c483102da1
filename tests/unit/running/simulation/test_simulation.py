"""Runs in virtual time."""

from __future__ import annotations

from fractions import Fraction

import pytest

from scbm.cases import (
    Case,
    CaseGoal,
    CaseLimits,
    Condition,
    ConditionKind,
    Injection,
    Network,
    OutcomeRule,
    Partition,
    Reaction,
    Restart,
)
from scbm.cases.trace import (
    End,
    MessageDisturbed,
    OperationStepped,
    ReplyDropped,
    ReplyReceived,
    ResourceChanged,
    RunEnded,
)
from scbm.model import BehaviorModel, Constant, Equal, Outcome, Reference, Resource
from scbm.running import RunnerOptions
from scbm.running.simulation import Choices, Simulated, Simulator, TooLongError
from support.models import scan_cell
from support.wording import Wording

S = 1_000_000_000
GOAL = ("scanned", Equal(Reference("box_is_scanned"), Constant(True)))


class AfterASecond:
    """What the cases here leave open: a success after a second."""

    def react(self, resource: Resource) -> Reaction:
        return Reaction(resource.name, Outcome.SUCCEED, S)


def _run(  # noqa: PLR0913 - what a case may say
    *outcomes: tuple[Outcome, float],
    model: BehaviorModel | None = None,
    options: RunnerOptions | None = None,
    injections: tuple[Injection, ...] = (),
    network: Network = Network(),  # noqa: B008 - an immutable value
    rules: tuple[OutcomeRule, ...] = (),
    limits: CaseLimits = CaseLimits(),  # noqa: B008 - an immutable value
) -> Simulated:
    """Runs the scan cell, whose requests react one after the other as `outcomes` say, then plainly."""
    model = model or scan_cell()
    forced = tuple(
        OutcomeRule("scan", number, number, outcome, round(seconds * S))
        for number, (outcome, seconds) in enumerate(outcomes, start=1)
    )
    case = Case("case", *GOAL, model.nominal_state, (*forced, *rules), injections, network, limits)
    return Simulator(model, options).run(case, Choices(AfterASecond(), case.outcomes, case.network))


def _states(run: Simulated) -> list[tuple[float, str]]:
    """The states that the operation entered, with the time in seconds."""
    steps = [r for r in run.records if isinstance(r, OperationStepped) and r.target != "initial"]
    return [(r.at_ns / S, r.target.value) for r in steps]


def test_time_jumps_from_event_to_event() -> None:
    run = _run((Outcome.TIMEOUT, 0), (Outcome.FAIL, 3), (Outcome.SUCCEED, 4))
    assert (run.end, run.ended_ns) == (End.REACHED, 17 * S)
    assert _states(run) == [
        (0, "executing"),
        (10, "timedout"),
        (10, "executing"),
        (13, "executing"),
        (17, "completed"),
    ]


def test_a_cancelled_request_is_not_answered() -> None:
    run = _run((Outcome.SUCCEED, 11), (Outcome.SUCCEED, 5))
    assert run.ended_ns == 15 * S
    assert not _dropped(run)
    assert [record.request for record in run.records if isinstance(record, ReplyReceived)] == [2]


def _dropped(run: Simulated) -> list[tuple[float, int, str]]:
    return [(r.at_ns / S, r.request, r.why) for r in run.records if isinstance(r, ReplyDropped)]


def test_a_reply_at_the_deadline_is_in_time() -> None:
    run = _run((Outcome.SUCCEED, 10))
    assert (run.end, run.ended_ns) == (End.REACHED, 10 * S)


ENDLESS = (("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))


def test_a_goal_that_nothing_brings_about_ends_at_the_time_limit() -> None:
    run = _run((Outcome.TIMEOUT, 0), model=scan_cell(*ENDLESS), options=RunnerOptions(time_limit_ns=30 * S))
    assert (run.end, run.ended_ns) == (End.TIME_LIMIT, 30 * S)


def test_all_goals_of_a_case_are_given_at_its_beginning() -> None:
    model = scan_cell()
    again = CaseGoal("again", GOAL[1])
    case = Case("case", *GOAL, model.nominal_state.replace({"box_is_scanned": True}), later=(again, again))
    run = Simulator(model).run(case, Choices(AfterASecond()))
    ends = [(record.at_ns, record.goal, record.end) for record in run.records if isinstance(record, RunEnded)]
    assert ends == [(0, name, "reached") for name in ("scanned", "again", "again")]


def test_the_limits_of_a_case_go_before_those_of_the_simulator() -> None:
    limits = CaseLimits(time_ns=5 * S)
    run = _run((Outcome.TIMEOUT, 0), model=scan_cell(*ENDLESS), limits=limits)
    assert (run.end, run.ended_ns) == (End.TIME_LIMIT, 5 * S)
    run = _run(*[(Outcome.FAIL, 1)] * 9, limits=CaseLimits(plans=3))
    assert (run.end, run.ended_ns) == (End.REPLAN_LIMIT, 3 * S)


def test_injections_act_at_their_time() -> None:
    red = Injection("red", (("light", "red"),), hold_ns=2 * S)
    assert _states(_run((Outcome.SUCCEED, 1), injections=(red,)))[:2] == [(0, "disabled"), (2, "executing")]


# resources


def _becomes(kind: ConditionKind, at_s: float, hold_s: float | None = None, factor: int = 1) -> tuple[Injection, ...]:
    hold_ns = None if hold_s is None else round(hold_s * S)
    condition = Condition(kind, Fraction(factor))
    return (Injection("tester", at_ns=round(at_s * S), hold_ns=hold_ns, resource="scan", condition=condition),)


def test_a_dead_resource_forgets_its_work_and_gets_no_requests() -> None:
    run = _run((Outcome.SUCCEED, 2), (Outcome.SUCCEED, 2), injections=_becomes(ConditionKind.DEAD, 1, 10))
    assert _states(run) == [
        (0, "executing"),
        (10, "timedout"),
        (10, "executing"),
        (20, "timedout"),
        (20, "executing"),
        (21, "completed"),
    ]


def test_an_occupied_resource_begins_when_it_is_free() -> None:
    run = _run((Outcome.SUCCEED, 2), injections=_becomes(ConditionKind.OCCUPIED, 0, 3))
    assert _states(run) == [(0, "executing"), (5, "completed")]


def test_a_cancelled_request_does_not_wait_for_an_occupied_resource() -> None:
    run = _run((Outcome.SUCCEED, 0.5), (Outcome.SUCCEED, 1), injections=_becomes(ConditionKind.OCCUPIED, 0, 15))
    assert _states(run) == [(0, "executing"), (10, "timedout"), (10, "executing"), (16, "completed")]
    assert not _dropped(run)


def test_what_waits_goes_on_waiting_when_the_resource_is_occupied_again() -> None:
    injections = tuple(
        Injection(f"i{n}", at_ns=n * S, hold_ns=2 * S, resource="scan", condition=Condition(ConditionKind.OCCUPIED))
        for n in range(3)
    )
    run = _run((Outcome.SUCCEED, 1), injections=injections)
    assert _states(run) == [(0, "executing"), (5, "completed")]
    changes = [(r.at_ns / S, r.condition) for r in run.records if isinstance(r, ResourceChanged)]
    assert changes == [(0, "occupied"), (4, "well")]


def test_equal_cases_give_equal_runs_whoever_made_their_parts() -> None:
    def injections(first: Condition, second: Condition) -> tuple[Injection, ...]:
        return (
            Injection("held", hold_ns=2 * S, resource="scan", condition=first),
            Injection("stays", at_ns=S, resource="scan", condition=second),
        )

    occupied = Condition(ConditionKind.OCCUPIED)
    options = RunnerOptions(time_limit_ns=30 * S)
    shared = _run(injections=injections(occupied, occupied), options=options)
    assert shared == _run(injections=injections(Condition(ConditionKind.OCCUPIED), occupied), options=options)
    assert shared.end is End.TIME_LIMIT


def test_putting_back_goes_to_the_condition_that_is_still_held(wording: Wording) -> None:
    slower = _becomes(ConditionKind.SLOWER, 0, factor=3)
    failing = Injection("fails", hold_ns=S, resource="scan", condition=Condition(ConditionKind.FAILING))
    run = _run((Outcome.SUCCEED, 1), injections=(*slower, failing))
    changes = [r.condition for r in run.records if isinstance(r, ResourceChanged)]
    assert changes[0] == changes[2] != changes[1]
    wording(changes)


def test_a_failing_resource_does_not_answer_what_it_would_not_have_answered() -> None:
    run = _run((Outcome.TIMEOUT, 0), injections=_becomes(ConditionKind.FAILING, 0, 5))
    assert _states(run)[:2] == [(0, "executing"), (10, "timedout")]


def test_an_occupied_resource_goes_on_with_what_it_has_begun() -> None:
    run = _run((Outcome.SUCCEED, 2), injections=_becomes(ConditionKind.OCCUPIED, 1))
    assert _states(run) == [(0, "executing"), (2, "completed")]


def test_a_failing_resource_fails_what_arrives_from_then_on() -> None:
    run = _run((Outcome.SUCCEED, 1), injections=_becomes(ConditionKind.FAILING, 0, 1.5))
    assert [(r.at_ns / S, r.succeeded) for r in run.records if isinstance(r, ReplyReceived)] == [
        (1, False),
        (2, False),
        (3, True),
    ]


def test_a_slower_resource_takes_a_multiple_of_its_time() -> None:
    run = _run((Outcome.SUCCEED, 2), injections=_becomes(ConditionKind.SLOWER, 0, factor=3))
    assert _states(run) == [(0, "executing"), (6, "completed")]


def test_the_trace_records_what_becomes_of_a_resource() -> None:
    run = _run((Outcome.SUCCEED, 2), injections=_becomes(ConditionKind.OCCUPIED, 1, 0.5))
    changes = [(r.at_ns / S, r.injection, r.condition) for r in run.records if isinstance(r, ResourceChanged)]
    assert changes == [(1, "tester", "occupied"), (1.5, "tester", "well")]


def test_putting_back_leaves_what_something_else_has_changed_since() -> None:
    first = _becomes(ConditionKind.OCCUPIED, 0, 2)
    second = _becomes(ConditionKind.DEAD, 1)
    run = _run(*[(Outcome.SUCCEED, 1)] * 2, injections=(*first, *second), options=RunnerOptions(time_limit_ns=50 * S))
    changes = [(r.at_ns / S, r.condition) for r in run.records if isinstance(r, ResourceChanged)]
    assert changes == [(0, "occupied"), (1, "dead")]
    assert run.end is End.TIME_LIMIT


def test_a_resource_changes_when_a_predicate_becomes_true() -> None:
    executing = Equal(Reference("scan_req_state"), Constant("executing"))
    dead = Injection("dies", when=executing, hold_ns=S, resource="scan", condition=Condition(ConditionKind.DEAD))
    assert _states(_run((Outcome.SUCCEED, 2), injections=(dead,)))[1] == (10, "timedout")


# the network


def test_a_lost_request_is_not_answered_and_reported() -> None:
    run = _run(rules=(OutcomeRule("scan", 1, 1, request=()),))
    assert _states(run) == [(0, "executing"), (10, "timedout"), (10, "executing"), (11, "completed")]
    assert [(r.message, r.copies) for r in run.records if isinstance(r, MessageDisturbed)] == [("request", 0)]


def test_a_reply_that_is_under_way_too_long_is_dropped() -> None:
    run = _run(rules=(OutcomeRule("scan", 1, 1, reply=(10 * S,)), OutcomeRule("scan", 2, 2, latency_ns=4 * S)))
    assert _states(run)[-1] == (14, "completed")
    assert _dropped(run) == [(11, 1, "late")]


def test_each_copy_of_a_request_is_answered_and_one_answer_counts() -> None:
    rules = (OutcomeRule("scan", 1, 1, Outcome.FAIL, request=(0, S)), OutcomeRule("scan", 2, 2, latency_ns=4 * S))
    run = _run(rules=rules)
    assert [r.request for r in run.records if isinstance(r, ReplyReceived)] == [1, 2]
    assert _dropped(run) == [(2, 1, "repeated")]


def test_a_lost_cancellation_leaves_a_late_reply() -> None:
    run = _run(
        rules=(OutcomeRule("scan", 1, 1, latency_ns=12 * S, cancel=()), OutcomeRule("scan", 2, 2, latency_ns=4 * S))
    )
    assert _dropped(run) == [(12, 1, "late")]
    assert _states(run)[-1] == (14, "completed")


def test_a_partition_loses_requests_and_replies() -> None:
    run = _run((Outcome.SUCCEED, 1), network=Network(partitions=(Partition(0, S),)))
    assert _states(run) == [(0, "executing"), (10, "timedout"), (10, "executing"), (11, "completed")]
    run = _run((Outcome.SUCCEED, 1), network=Network(partitions=(Partition(S // 2, S),)))
    assert [(r.at_ns / S, r.message) for r in run.records if isinstance(r, MessageDisturbed)] == [(1, "reply")]


def test_a_restarted_resource_knows_nothing_of_earlier_requests() -> None:
    run = _run((Outcome.SUCCEED, 2), network=Network(restarts=(Restart("scan", S, 0),)))
    assert _states(run) == [(0, "executing"), (10, "timedout"), (10, "executing"), (11, "completed")]
    changes = [(r.injection, r.condition) for r in run.records if isinstance(r, ResourceChanged)]
    assert changes == [("network", "down"), ("network", "well")]


def test_a_resource_is_down_until_the_last_of_its_restarts_is_over() -> None:
    restarts = (Restart("scan", 0, 2 * S), Restart("scan", S, 12 * S))
    run = _run((Outcome.SUCCEED, 2), (Outcome.SUCCEED, 2), network=Network(restarts=restarts))
    assert _states(run)[:4] == [(0, "executing"), (10, "timedout"), (10, "executing"), (20, "timedout")]


def test_a_resource_that_is_down_gets_no_requests() -> None:
    run = _run((Outcome.SUCCEED, 2), network=Network(restarts=(Restart("scan", 0, 5 * S),)))
    assert _states(run)[1] == (10, "timedout")


def test_rules_can_speak_of_the_requests_of_an_operation() -> None:
    run = _run(rules=(OutcomeRule("scan_box", 1, 2, Outcome.FAIL),))
    assert [r.succeeded for r in run.records if isinstance(r, ReplyReceived)] == [False, False, True]


RETRY = (
    "automatic_transitions:",
    "automatic_transitions:\n  again: {g: scan_req_state == failed, a: [scan_req_state <- initial]}",
)


def test_a_run_in_which_no_time_passes_is_a_livelock() -> None:
    """Neither the deadline of the operation nor the limit of the run ever comes."""
    rules = (OutcomeRule("scan", 1, None, Outcome.FAIL, 0),)
    options = RunnerOptions(time_limit_ns=S, instant_bound=300)
    run = _run(model=scan_cell(RETRY), rules=rules, options=options)
    assert (run.end, run.ended_ns) == (End.LIVELOCK, 0)
    assert len(run.records) < 2_000


def test_a_run_can_be_given_up_when_too_much_happens() -> None:
    model = scan_cell(RETRY)
    case = Case("case", *GOAL, model.nominal_state, (OutcomeRule("scan", 1, None, Outcome.FAIL, 1_000),))
    with pytest.raises(TooLongError):
        Simulator(model).run(case, Choices(AfterASecond(), case.outcomes), most_records=500)
