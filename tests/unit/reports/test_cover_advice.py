"""What would cover a missed obligation: chance is named only where it can help."""

from __future__ import annotations

import pytest

from scbm.cases import Case, RecordedPlan
from scbm.cases.coverage import Aspect, Obligation
from scbm.files import read_model
from scbm.model import BehaviorModel, RunPlans, State
from scbm.planning import model_with_plans
from scbm.reports import coverage_report
from scbm.reports.cover_advice import CampaignKind, CoverAdvice, CoverAdvisor, CoverMeans
from scbm.reports.missed_reasons import missed_reasons
from scbm.testing import Campaign, CampaignResult, RandomCases, Tester
from support.campaigns import drawn_campaign, suite_of
from support.wording import Wording

DELIVERY = """
behavior_model: delivery
variables:
  robot_at: {domain: [dock, pantry], initial: dock}
  load: {domain: [empty, item], initial: empty}
  inspected: {domain: bool, initial: false}
  stored: {domain: bool, initial: false}
  door: {domain: [open, closed], initial: closed, source: input}
  lamp: {domain: bool, initial: false, source: state}
resources:
  base: {simulation: {latency: 10 s}}
  dispenser: {simulation: {latency: 3 s, outcomes: {succeed: 0.7, fail: 0.3}}}
  arm: {simulation: {latency: 1 s, outcomes: {succeed: 0.999, fail: 0.001}}}
operations:
  go: {request: base, deadline: 60 s, guard: robot_at == dock, effects: [robot_at <- pantry]}
  dispense:
    deadline: 20 s
    pre:
      g: robot_at == pantry && load == empty && dispenser_req_state == initial && dispenser_req_trigger == false
      a: [dispenser_req_trigger <- true]
    post:
      g: true
      gr: dispenser_req_state in {succeeded, failed}
      a: [load <- item, dispenser_req_state <- initial, dispenser_req_trigger <- false]
    timedout: [dispenser_req_trigger <- false]
  grip: {request: arm, deadline: 60 s, guard: load == item, effects: [load <- empty, stored <- true]}
  inspect: {pre: {g: inspected == false}, post: {g: true, a: [inspected <- true]}}
automatic_transitions:
  greet: {g: door == open, a: [lamp <- true]}
  shine: {g: robot_at == pantry && lamp == true, a: [lamp <- false]}
goals:
  loaded: load == item
  emptied: load == empty && robot_at == pantry
  stored: stored == true
"""


def result_of(model: BehaviorModel, count: int = 20, *, moves_inputs: bool = False) -> CampaignResult:
    tester, cases = Tester(model), RandomCases(model, moves_inputs=moves_inputs)
    results = [tester.execute(cases.case(1, number)).result for number in range(1, count + 1)]
    suite = suite_of(model, "delivery.yaml", count, moves_inputs=moves_inputs)
    return CampaignResult(drawn_campaign(model, results, count), suite)


def advisor_of(*changes: tuple[str, str], count: int = 20, moves_inputs: bool = False) -> CoverAdvisor:
    text = DELIVERY
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    result = result_of(read_model(text), count, moves_inputs=moves_inputs)
    return CoverAdvisor(result.model, result.coverage, CampaignKind.of_campaign(result))


def advice(name: str, *changes: tuple[str, str], count: int = 20, moves_inputs: bool = False) -> CoverAdvice:
    subject, aspect = name.split("/")
    obligation = Obligation(aspect, Aspect.TAKEN) if subject == "automatic" else Obligation(subject, Aspect(aspect))
    return advisor_of(*changes, count=count, moves_inputs=moves_inputs).advice(obligation)


@pytest.mark.parametrize(
    ("obligation", "means"),
    [
        ("go/failed", CoverMeans.NO_FAILURES),
        ("dispense/failed", CoverMeans.NO_WAY),
        ("grip/failed", CoverMeans.CHANCE),
        ("automatic/base_failed", CoverMeans.NO_FAILURES),
        ("automatic/arm_failed", CoverMeans.CHANCE),
        ("go/timedout", CoverMeans.ANSWERED),
        ("dispense/timedout", CoverMeans.ANSWERED),
        ("go/disabled", CoverMeans.UNDISTURBED),
        ("automatic/greet", CoverMeans.NOT_MOVED),
        ("automatic/shine", CoverMeans.NEVER_HELD),
        ("inspect/queued", CoverMeans.UNREAD),
        ("inspect/failed", CoverMeans.NO_WAY),
    ],
)
def test_chance_is_named_only_where_it_can_help(obligation: str, means: CoverMeans) -> None:
    assert advice(obligation).means is means


def test_the_condition_is_named_that_never_held() -> None:
    found = advice("automatic/shine")
    assert found.missing == "`lamp == true`"
    assert found.states.endswith("states of 20 cases")


@pytest.mark.parametrize(("count", "means"), [(3, CoverMeans.CHANCE), (20, CoverMeans.NEW_GOAL)])
def test_more_cases_may_plan_what_a_goal_reads(count: int, means: CoverMeans) -> None:
    read = ("emptied: load == empty && robot_at == pantry", "emptied: load == empty || inspected == true")
    assert advice("inspect/queued", read, count=count).means is means


def test_what_no_plan_reads_is_named_with_the_operations_that_could_read_it() -> None:
    found = advice("inspect/queued")
    assert found.missing == "inspected"
    assert "go, dispense" in found.states


def test_a_goal_that_no_plan_reaches_reads_nothing_on_the_plans() -> None:
    second = ("goals:\n", "goals:\n  neither: inspected == true && inspected == false\n")
    assert advice("inspect/queued", second).means is CoverMeans.UNREAD
    second = ("goals:\n", "goals:\n  some: inspected == true || load == item\n")
    assert advice("inspect/queued", second).means is CoverMeans.NEW_GOAL


def test_a_request_to_a_resource_of_the_plans_is_no_change_that_they_read() -> None:
    asks = (
        "inspect: {pre: {g: inspected == false}, post: {g: true, a: [inspected <- true]}}",
        "inspect: {request: arm, deadline: 9 s, guard: inspected == false, effects: [inspected <- true]}",
    )
    found = advice("inspect/queued", asks)
    assert (found.means, found.missing) == (CoverMeans.UNREAD, "inspected")


def test_a_late_failure_of_a_request_may_fail_an_operation_that_sends_none() -> None:
    unended = ("dispenser_req_trigger <- false]\n    timedout: [dispenser_req_trigger <- false]", "lamp <- false]")
    guard = "dispenser_req_state == failed && current.state == executing"
    noticed = ("  greet:", f"  spoilt: {{g: {guard}, a: [current.state <- failed]}}\n  greet:")
    assert advice("inspect/failed", noticed).means is CoverMeans.NO_WAY
    assert advice("inspect/failed", noticed, unended).means is CoverMeans.CHANCE


def test_what_fails_another_operation_while_it_executes_is_no_way_to_fail() -> None:
    stop = "  stop: {g: door == open && go.state == executing, a: [current.state <- failed]}"
    assert advice("inspect/failed", ("  greet:", f"{stop}\n  greet:")).means is CoverMeans.NO_WAY


def test_moved_inputs_are_left_to_chance() -> None:
    never = ("initial: closed, source: input", "initial: closed, source: input}\n  e: {domain: bool, initial: false")
    assert advice("automatic/greet", never, count=0, moves_inputs=True).means is CoverMeans.CHANCE


def test_an_input_whose_transitions_have_no_rate_does_not_move() -> None:
    person = "environment:\n  opens: {guard: door == closed, actions: [door <- open]}\ngoals:\n"
    assert advice("automatic/greet", ("goals:\n", person)).means is CoverMeans.NO_RATE
    rated = person.replace("<- open]}", "<- open], every: 100000 s}")
    assert advice("automatic/greet", ("goals:\n", rated)).means is CoverMeans.CHANCE


def test_a_resource_that_may_be_late_or_silent_lets_deadlines_pass() -> None:
    for simulation in ("latency: {exponential: 1 s}", "latency: 61 s", "outcomes: {succeed: 0.9999, timeout: 0.0001}"):
        changed = ("base: {simulation: {latency: 10 s}}", f"base: {{simulation: {{{simulation}}}}}")
        assert advice("go/timedout", changed, count=0).means is CoverMeans.CHANCE


SEES = (
    "grip: {request: arm, deadline: 60 s, guard: load == item, effects",
    "grip: {request: arm, deadline: 60 s, guard: load == item, assumes: {seen: full}, effects",
)
SEEN = ("  lamp:", "  seen: {domain: [full, none], initial: none}\n  lamp:")


@pytest.mark.parametrize(
    ("measured", "means"),
    [
        ("measured: {seen: {full: 0, none: 1}}", CoverMeans.NOT_MEASURED),
        ("measured: {seen: {full: 0.000001, none: 0.999999}}", CoverMeans.CHANCE),
        ("measured: {seen: [none]}, failed: {seen: [full]}, outcomes: {succeed: 1}", CoverMeans.NOT_MEASURED),
        ("latency: 1 s", CoverMeans.NOT_MEASURED),
    ],
)
def test_a_value_that_no_reply_measures_does_not_come_by_chance(measured: str, means: CoverMeans) -> None:
    arm = "arm: {simulation: {latency: 1 s, outcomes: {succeed: 0.999, fail: 0.001}}}"
    found = advice("grip/completed", SEES, SEEN, (arm, f"arm: {{measures: [seen], simulation: {{{measured}}}}}"))
    assert found.means is means
    if means is CoverMeans.NOT_MEASURED:
        assert (found.missing, found.states) == ("`seen == full`", "arm")


@pytest.mark.parametrize(("latency", "means"), [("61 s", CoverMeans.LATE), ("1 s", CoverMeans.CHANCE)])
def test_a_value_does_not_come_by_chance_without_a_reply(latency: str, means: CoverMeans) -> None:
    arm = "arm: {simulation: {latency: 1 s, outcomes: {succeed: 0.999, fail: 0.001}}}"
    never = "measured: {seen: {full: 0.000001, none: 0.999999}}"
    inspects = ("g: inspected == false}", "g: seen == full}")
    read = ("emptied: load == empty && robot_at == pantry", "emptied: load == empty && inspected == true")
    measures = (arm, f"arm: {{measures: [seen], simulation: {{latency: {latency}, {never}}}}}")
    found = advice("inspect/executing", SEES, SEEN, measures, inspects, read)
    assert found.means is means


OPENED = "environment:\n  opens: {guard: door == closed, actions: [door <- open], every: 100000 s}\ngoals:\n"


@pytest.mark.parametrize(
    ("operation", "guard", "means"),
    [
        ("go", "door == closed && ", CoverMeans.PLANNED_AT_ONCE),
        ("dispense", "door == closed && ", CoverMeans.CHANCE),
        ("go", "", CoverMeans.UNDISTURBED),
    ],
)
def test_nothing_disables_what_starts_in_the_moment_of_its_plan(operation: str, guard: str, means: CoverMeans) -> None:
    changes = {
        "go": ("guard: robot_at == dock", f"guard: {guard}robot_at == dock"),
        "dispense": ("g: robot_at == pantry && load", f"g: {guard}robot_at == pantry && load"),
    }
    found = advice(f"{operation}/disabled", changes[operation], ("goals:\n", OPENED))
    assert found.means is means
    assert not guard or means is CoverMeans.CHANCE or found.missing == "door"


def test_what_only_the_runner_reads_may_be_false_in_the_moment_of_the_plan() -> None:
    waits = ("pre: {g: inspected == false}", "pre: {g: inspected == false, gr: door == closed}")
    read = ("emptied: load == empty && robot_at == pantry", "inspected: inspected == true")
    assert advice("inspect/disabled", waits, read, ("goals:\n", OPENED)).means is CoverMeans.CHANCE


def test_what_follows_from_a_step_that_chance_takes_is_left_to_chance() -> None:
    waits = ("  shine: {g: robot_at == pantry && lamp == true", "  shine: {g: robot_at == pantry && load == item")
    assert advice("automatic/shine", waits, count=0).means is CoverMeans.CHANCE


def test_a_reply_in_the_moment_of_the_deadline_is_in_time() -> None:
    changed = ("base: {simulation: {latency: 10 s}}", "base: {simulation: {latency: 60 s}}")
    assert advice("go/timedout", changed, count=0).means is CoverMeans.ANSWERED
    assert advice("go/completed", changed, count=0).means is CoverMeans.CHANCE


LATE = ("base: {simulation: {latency: 10 s}}", "base: {simulation: {latency: {uniform: [61 s, 70 s]}}}")


def test_no_reply_comes_by_chance_after_the_deadline() -> None:
    for obligation in ("go/completed", "go/failed", "automatic/base_failed"):
        found = advice(obligation, LATE)
        assert (found.means, found.missing) == (CoverMeans.LATE, "base")


@pytest.mark.parametrize(
    "late_but_awaited",
    [
        ("deadline: 60 s, guard: robot_at == dock", "guard: robot_at == dock"),
        ("  inspect:", "  back: {request: base, deadline: 65 s, guard: robot_at == dock}\n  inspect:"),
    ],
)
def test_a_request_that_waits_for_long_gets_its_reply_by_chance(late_but_awaited: tuple[str, str]) -> None:
    assert advice("automatic/base_failed", LATE, late_but_awaited, count=0).means is not CoverMeans.LATE


ASKS = (
    "inspect: {pre: {g: inspected == false}, post: {g: true, a: [inspected <- true]}}",
    "inspect: {request: cam, deadline: 5 s, guard: inspected == false, effects: [inspected <- true]}",
)
CAM = ("resources:\n", "resources:\n  cam: {simulation: {outcomes: {succeed: 0.5, fail: 0.5}}}\n")


@pytest.mark.parametrize("cam", ["outcomes: {succeed: 0.5, fail: 0.5}", "latency: 1 s"])
def test_no_reply_comes_by_chance_where_nothing_is_requested(cam: str) -> None:
    resource = ("resources:\n", f"resources:\n  cam: {{simulation: {{{cam}}}}}\n")
    found = advice("automatic/cam_failed", ASKS, resource)
    assert (found.means, found.missing) == (CoverMeans.NOT_SENT, "cam")
    assert advice("automatic/cam_failed", ASKS, resource, count=0).means is not CoverMeans.NOT_SENT


def test_advice_about_replies_needs_a_request() -> None:
    advisor = advisor_of(ASKS, CAM)
    due = [aspect for aspect in Aspect if aspect is not Aspect.TAKEN and advisor.is_due(Obligation("inspect", aspect))]
    assert set(due) == {Aspect.QUEUED, Aspect.DISABLED}


def test_advice_says_that_all_replies_come_only_of_resources_that_always_answer() -> None:
    found = advice(
        "go/timedout", ("latency: 3 s, outcomes: {succeed: 0.7, fail: 0.3}", "outcomes: {succeed: 0.7, timeout: 0.3}")
    )
    assert (found.means, found.missing) == (CoverMeans.ANSWERED, "base")


def test_conditions_that_hold_at_different_times_do_not_hold_together_by_chance() -> None:
    light = ("a: [inspected <- true]", "a: [inspected <- true], ar: [lamp <- true]")
    waits = "disabled_deadline: 1 s, pre: {g: inspected == true, gr: lamp == false}, "
    waits += "post: {g: true, a: [robot_at <- pantry]}"
    go = "request: base, deadline: 60 s, guard: robot_at == dock, effects: [robot_at <- pantry]"
    found = advice("go/executing", light, (go, waits))
    assert (found.means, found.missing) == (CoverMeans.NEVER_HELD, "`lamp == false`")
    assert found.states.endswith("while they were current")
    resets = ("  greet:", "  reset: {g: lamp == true && door == open, a: [lamp <- false]}\n  greet:")
    assert advice("go/executing", light, (go, waits), resets, moves_inputs=True).means is CoverMeans.CHANCE


MEASURES = (
    "inspect: {pre: {g: inspected == false}, post: {g: true, a: [inspected <- true]}}",
    "inspect: {request: arm, deadline: 9 s, guard: inspected == false}",
)
ARM = ("arm: {", "arm: {measures: [inspected], ")


@pytest.mark.parametrize(
    ("drawn", "means"), [(False, CoverMeans.CHOSEN_PLANS), (True, CoverMeans.CHANCE)], ids=["canonical", "drawn"]
)
def test_what_only_cases_with_plans_execute_does_not_fail_by_chance(*, drawn: bool, means: CoverMeans) -> None:
    other = "  grope: {request: arm, deadline: 60 s, guard: load == item, effects: [load <- empty, stored <- true]}\n"
    model = read_model(DELIVERY.replace("  inspect:", f"{other}  inspect:"))
    model = model_with_plans(RunPlans.DRAWN, model) if drawn else model
    goal, start = model.goal("stored"), State(model.space, dict(model.nominal_state))
    assert goal is not None
    plans = (RecordedPlan("solved", ("go", "dispense", "grope")),)
    results = Tester(model).results(
        [Case("chosen", "stored", goal, start, plans=plans), Case("own", "stored", goal, start)]
    )
    result = CampaignResult(Campaign.of(model, results), suite_of(model, "delivery.yaml", 2))
    advisor = CoverAdvisor(model, result.coverage, CampaignKind.of_campaign(result))
    assert advisor.advice(Obligation("grope", Aspect.FAILED)).means is means
    assert advisor.advice(Obligation("grip", Aspect.FAILED)).means is CoverMeans.CHANCE


def test_measured_values_are_what_an_operation_changes() -> None:
    found = advice("inspect/queued", MEASURES, ARM)
    assert (found.means, found.missing) == (CoverMeans.UNREAD, "inspected")


def test_plans_count_on_measured_values_only_if_they_are_assumed() -> None:
    read = ("emptied: load == empty && robot_at == pantry", "emptied: load == empty || inspected == true")
    found = advice("inspect/queued", MEASURES, ARM, read)
    assert (found.means, found.missing) == (CoverMeans.UNASSUMED, "inspected")


def test_what_another_goal_would_plan_is_named() -> None:
    assert CoverAdvice(CoverMeans.NEW_GOAL).is_named


def test_all_reports_say_the_same(wording: Wording) -> None:
    result = result_of(read_model(DELIVERY))
    reasons = missed_reasons(result, "delivery.yaml", CampaignKind.of_campaign(result))
    wording("\n".join(f"{missed.obligation}: {missed.reason}" for missed in reasons))
    lines = [line.plain for line in coverage_report(result)]
    wording("\n".join(lines[lines.index("How to cover the rest") :]))
