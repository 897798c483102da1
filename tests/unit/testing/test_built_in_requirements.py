"""The built-in requirements (semantics 7.12): each notices a seeded fault, and none calls correct models wrong."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Case, CaseLimits, Injection, OutcomeRule, RecordedPlan
from scbm.cases.trace import End, PlanAsked, ReplyReceived, RequestSent
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, Outcome
from scbm.model.requirements import BUILT_IN_NAMES, OPTIONAL_NAMES, BuiltIn
from scbm.running import RunnerOptions
from scbm.running.micro_steps import MicroStep, MicroSteps
from scbm.testing import (
    Excuse,
    ExcuseRules,
    Execution,
    FailureKind,
    Outcomes,
    RandomCases,
    Shrinker,
    Tester,
    Violation,
)
from scbm.testing.built_in_requirements import BUILT_INS, OPTIONAL_BUILT_INS, BuiltInJudge, part_to_change
from support.models import scan_cell
from support.profiles import longer_but_one_in, share
from support.random_models import random_model
from support.wording import Wording

S = 1_000_000_000
OPTIONS = RunnerOptions(time_limit_ns=600 * S)
STUDIED = sorted((Path(__file__).parents[3] / "study").glob("models/*.yaml"))
EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*/*.yaml"))

NO_CLEAN_UP_AFTER_A_TIMEOUT = ("    timedout: [scan_req_trigger <- false]\n", "")
STAYS_FAILED = ("<- failed, scan_req_state <- initial, scan_req_trigger", "<- failed, scan_req_trigger")
NEEDS_A_GREEN_LIGHT = (
    ("gr: scan_req_state", "gr: light == green && scan_req_state"),
    ("initial: green", "initial: blue"),
)
GIVES_UP_AT_ONCE = ("[current.state <- failed, scan", "[plan.state <- aborted, scan")
ASKS_AGAIN_WHEN_ABORTED = (
    "[current.state <- failed, scan_req_state <- initial, scan_req_trigger <- false]",
    "[plan.state <- aborted, scan_req_state <- initial]",
)


def _execute(model: BehaviorModel, *outcomes: Outcome, injections: tuple[Injection, ...] = ()) -> Execution:
    """The run of a case in which the requests to each resource have these outcomes."""
    name, predicate = model.goals[0]
    rules = (
        OutcomeRule(resource.name, n, n, outcome, S)
        for resource in model.resources
        for n, outcome in enumerate(outcomes, start=1)
    )
    return Tester(model, OPTIONS).execute(
        Case("case", name, predicate, model.nominal_state, tuple(rules), injections=injections)
    )


def _violations(model: BehaviorModel, *outcomes: Outcome) -> list[str]:
    execution = _execute(model, *outcomes)
    assert all(violation.is_built_in for violation in execution.violations)
    return [violation.requirement for violation in execution.violations]


def _violation(execution: Execution, name: BuiltIn) -> Violation:
    (violation,) = (v for v in execution.violations if v.requirement == name.value)
    return violation


def _assert_small(execution: Execution, name: BuiltIn, model: BehaviorModel) -> None:
    (failure,) = (f for f in execution.verdict.failures if f.subject == name.value)
    assert failure.kind is FailureKind.BUILT_IN
    shrunk = Shrinker(Tester(model, OPTIONS)).shrink(execution, failure)
    assert shrunk.after.operations <= 2
    assert shrunk.failure.is_like(failure)
    assert _violation(shrunk.execution, name).is_built_in


def test_each_name_has_one_class() -> None:
    classes = {**BUILT_INS, **OPTIONAL_BUILT_INS}
    assert list(classes) == [*BUILT_IN_NAMES, *OPTIONAL_NAMES] == list(BuiltIn)
    assert [each.name for each in classes.values()] == list(BuiltIn)


def test_a_cell_that_cleans_up_violates_nothing() -> None:
    for first in Outcome:
        for second in Outcome:
            assert not _execute(scan_cell(), first, second, Outcome.SUCCEED).violations


# each notices a seeded fault, in a small case


def test_a_request_that_outlives_its_operation_is_an_orphan(wording: Wording) -> None:
    model = scan_cell(NO_CLEAN_UP_AFTER_A_TIMEOUT)
    done = _execute(model, Outcome.TIMEOUT)
    violation = _violation(done, BuiltIn.NO_ORPHAN)
    wording(violation)
    assert isinstance(done.trace.records[violation.record], PlanAsked)
    assert violation.at_ns == done.trace.records[violation.record].at_ns == 10 * S
    assert dict(violation.values) == {"scan_req_trigger": True, "scan_req_state": "executing"}
    assert part_to_change(str(violation)) == ("operations", "scan_box", "timedout")
    _assert_small(done, BuiltIn.NO_ORPHAN, model)


LIFTED = """\
behavior_model: cells
types: {box: [a, b]}
variables:
  seen[box]: {domain: bool, initial: false}
resources:
  scanner[box]: {}
  lamp[box]: {}
operations:
  scan[s in box]:
    deadline: 5 s
    pre:
      g: scanner_req_state.s == initial && scanner_req_trigger.s == false && seen.s == false
      a: [scanner_req_trigger.s <- true, TRIGGER]
    post:
      gr: scanner_req_state.s == succeeded
      g: true
      a: [scanner_req_trigger.s <- false, scanner_req_state.s <- initial, seen.s <- true]
automatic_transitions:
  fail[s in box]: {g: scanner_req_state.s == failed && scan.s.state == executing, a: [current.state <- failed]}
goals:
  all: seen.a == true
"""


@pytest.mark.parametrize(
    ("outcome", "path"),
    [
        (Outcome.TIMEOUT, ("operations", "scan.a", "timedout")),
        (Outcome.FAIL, ("automatic_transitions", "fail.a")),
    ],
)
def test_what_to_add_to_an_entry_with_parameters_has_its_parameters(
    outcome: Outcome, path: tuple[str, ...], wording: Wording
) -> None:
    done = _execute(read_model(LIFTED.replace(", TRIGGER", "")), outcome)
    violation = _violation(done, BuiltIn.NO_ORPHAN)
    wording(violation)
    assert part_to_change(str(violation)) == path
    assert list(dict(violation.values)) == ["scanner.a_req_trigger", "scanner.a_req_state"]


def test_what_to_add_names_an_object_that_the_entry_names(wording: Wording) -> None:
    text = LIFTED.replace("TRIGGER", "lamp_req_trigger.b <- true").replace("scan.s.state == executing", "false")
    done = _execute(read_model(text))
    violation = _violation(done, BuiltIn.NO_ORPHAN)
    wording(violation)
    assert part_to_change(str(violation)) == ("operations", "scan.a", "post")


def test_an_answered_request_that_nothing_clears_needs_two_lines(wording: Wording) -> None:
    done = _execute(scan_cell((", scan_req_state <- initial, scan_req_trigger <- false]", "]")), Outcome.FAIL)
    wording(_violation(done, BuiltIn.NO_ORPHAN))
    assert [v.requirement for v in done.violations][:1] == ["no_orphan"]
    assert "ready_again" not in [v.requirement for v in done.violations]


def test_a_request_that_completes_without_clean_up_is_an_orphan(wording: Wording) -> None:
    dirty = scan_cell(("[scan_req_state <- initial, scan_req_trigger <- false, box", "[box"))
    wording(_violation(_execute(dirty), BuiltIn.NO_ORPHAN))


def test_a_resource_that_stays_failed_is_not_ready_again(wording: Wording) -> None:
    model = scan_cell(STAYS_FAILED)
    done = _execute(model, Outcome.FAIL)
    violation = _violation(done, BuiltIn.READY_AGAIN)
    wording(violation)
    assert part_to_change(str(violation)) == ("automatic_transitions", "scan_failed")
    _assert_small(done, BuiltIn.READY_AGAIN, model)


def test_a_resource_whose_reply_a_timed_out_operation_left_is_not_ready_again(wording: Wording) -> None:
    """The scanner succeeds, but the operation waits for a green light until its deadline passes."""
    model = scan_cell(*NEEDS_A_GREEN_LIGHT)
    done = _execute(model, Outcome.SUCCEED)
    violation = _violation(done, BuiltIn.READY_AGAIN)
    wording(violation)
    assert violation.at_ns == 10 * S
    assert part_to_change(str(violation)) == ("operations", "scan_box", "timedout")
    _assert_small(done, BuiltIn.READY_AGAIN, model)


def test_a_run_recovers_from_its_only_fault(wording: Wording) -> None:
    model = scan_cell(GIVES_UP_AT_ONCE)
    done = _execute(model, Outcome.FAIL)
    violation = _violation(done, BuiltIn.RECOVERS)
    wording(violation)
    assert done.verdict.excuses == ()
    assert [failure.kind for failure in done.verdict.failures] == [FailureKind.BUILT_IN]
    assert isinstance(done.trace.records[violation.begins], ReplyReceived)
    assert part_to_change(str(violation)) == ("operations", "scan_box")
    _assert_small(done, BuiltIn.RECOVERS, model)


def test_the_operation_that_waits_for_ever_is_named(wording: Wording) -> None:
    endless = scan_cell(("    deadline: 10 seconds\n", ""), NO_CLEAN_UP_AFTER_A_TIMEOUT)
    wording(_violation(_execute(endless, Outcome.TIMEOUT), BuiltIn.RECOVERS))
    unnoticed = scan_cell(("current.state == executing", "current.state == executing && light == blue"))
    unnoticed = replace(unnoticed, operations=(replace(unnoticed.operations[0], deadline_ns=None, timedout=()),))
    wording(_violation(_execute(unnoticed, Outcome.FAIL), BuiltIn.RECOVERS))


def test_nothing_is_sent_after_an_abort(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    model = scan_cell(ASKS_AGAIN_WHEN_ABORTED)
    assert _violations(model, Outcome.FAIL) == ["recovers"]
    correct = MicroSteps.first_not_automatic

    def requests_first(
        self: MicroSteps, state: int, in_flight: tuple[()], *, timer_passed: bool
    ) -> tuple[MicroStep | None, bool]:
        request = self._request(state, in_flight)
        return (request, False) if request else correct(self, state, in_flight, timer_passed=timer_passed)

    monkeypatch.setattr(MicroSteps, "first_not_automatic", requests_first)
    done = _execute(model, Outcome.FAIL)
    violation = _violation(done, BuiltIn.STOPS)
    wording(violation)
    assert isinstance(done.trace.records[violation.record], RequestSent)
    _assert_small(done, BuiltIn.STOPS, model)


def test_nothing_is_sent_between_two_runs(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    model = scan_cell(more="  unscanned: box_is_scanned == false\n")
    tidy = "automatic_transitions:\n  ask: {g: plan.state == completed, a: [scan_req_trigger <- true]}"
    asks = scan_cell(("automatic_transitions:", tidy), more="  unscanned: box_is_scanned == false\n")
    assert not _violations(model)
    assert "stops" not in _violations(asks)
    correct = MicroSteps.first_not_automatic

    def always(
        self: MicroSteps, state: int, in_flight: tuple[()], *, timer_passed: bool
    ) -> tuple[MicroStep | None, bool]:
        request = self._request(state, in_flight)
        return (request, False) if request else correct(self, state, in_flight, timer_passed=timer_passed)

    monkeypatch.setattr(MicroSteps, "first_not_automatic", always)
    wording(_violation(_execute(asks), BuiltIn.STOPS))


# switched off, and beside requirements of the model


@pytest.mark.parametrize(
    ("name", "fault", "outcome"),
    [
        (BuiltIn.NO_ORPHAN, NO_CLEAN_UP_AFTER_A_TIMEOUT, Outcome.TIMEOUT),
        (BuiltIn.READY_AGAIN, STAYS_FAILED, Outcome.FAIL),
        (BuiltIn.RECOVERS, GIVES_UP_AT_ONCE, Outcome.FAIL),
    ],
)
def test_a_model_switches_a_requirement_off_by_its_name(
    name: BuiltIn, fault: tuple[str, str], outcome: Outcome
) -> None:
    model = scan_cell(fault)
    assert name.value in _violations(model, outcome)
    off = scan_cell(fault, more=f"requirements_off: {{{name}: an operator looks after the scanner}}\n")
    assert name.value not in _violations(off, outcome)


def test_without_recovers_a_single_fault_excuses_the_goal() -> None:
    done = _execute(scan_cell(GIVES_UP_AT_ONCE, more="requirements_off: {recovers: people do}\n"), Outcome.FAIL)
    assert (done.verdict.passed, done.verdict.excuses) == (True, (Excuse.FAULT,))


def test_a_requirement_of_the_model_may_have_the_name_of_a_built_in_one() -> None:
    own = "requirements:\n  recovers: never plan.state == aborted\n"
    done = _execute(scan_cell(GIVES_UP_AT_ONCE, more=own), Outcome.FAIL)
    kinds = [(failure.kind, failure.subject) for failure in done.verdict.failures]
    assert kinds == [(FailureKind.REQUIREMENT, "recovers"), (FailureKind.BUILT_IN, "recovers")]
    first, second = done.verdict.failures
    assert not first.is_like(second)


# recovers: what is no violation


@pytest.mark.parametrize(
    "outcomes", [(Outcome.FAIL, Outcome.FAIL), (Outcome.TIMEOUT, Outcome.FAIL), (Outcome.FAIL, Outcome.TIMEOUT)]
)
def test_two_faults_may_be_too_many(outcomes: tuple[Outcome, ...]) -> None:
    counts = (
        "automatic_transitions:",
        "automatic_transitions:\n  give_up: {g: count == 2, a: [plan.state <- aborted, count <- 0]}",
    )
    failed = ("[current.state <- failed, scan", "[current.state <- failed, count += 1, scan")
    timedout = ("timedout: [scan_req_trigger <- false]", "timedout: [scan_req_trigger <- false, count += 1]")
    done = _execute(scan_cell(counts, failed, timedout), *outcomes)
    assert (done.verdict.end, done.verdict.passed, done.verdict.excuses) == (End.ABORTED, True, (Excuse.FAULT,))


def test_an_end_that_the_model_allows_is_no_violation() -> None:
    done = _execute(scan_cell(GIVES_UP_AT_ONCE, more="may_end: [aborted]\n"), Outcome.FAIL)
    assert (done.verdict.passed, done.verdict.excuses) == (True, (Excuse.MAY_END,))


def test_a_fault_beside_an_injection_is_not_the_only_one() -> None:
    red = Injection("red", (("temperature", 7),))
    done = _execute(scan_cell(GIVES_UP_AT_ONCE), Outcome.FAIL, injections=(red,))
    assert done.verdict.passed


def test_a_time_limit_of_the_case_is_no_fault_of_the_model() -> None:
    model = scan_cell()
    rules = (OutcomeRule("scan", 1, 1, Outcome.TIMEOUT),)
    case = Case("case", *model.goals[0], model.nominal_state, rules, limits=CaseLimits(time_ns=5 * S))
    assert Tester(model).execute(case).verdict.excuses == (Excuse.FAULT,)


@pytest.mark.parametrize(
    ("rule", "violated"),
    [
        (OutcomeRule("scan", 1, 1, request=()), True),
        (OutcomeRule("scan", 1, 1, reply=()), True),
        (OutcomeRule("scan", 1, 1, Outcome.FAIL, reply=()), True),
        (OutcomeRule("scan", 1, 1, Outcome.FAIL, reply=(0, 0)), False),
        (OutcomeRule("scan", 1, 1, Outcome.TIMEOUT, cancel=()), False),
    ],
)
def test_a_lost_message_is_a_missing_reply(rule: OutcomeRule, *, violated: bool) -> None:
    given_up = ("timedout: [scan_req_trigger <- false]", "timedout: [scan_req_trigger <- false, plan.state <- aborted]")
    model = scan_cell(given_up, GIVES_UP_AT_ONCE)
    done = Tester(model).execute(Case("case", *model.goals[0], model.nominal_state, (rule,)))
    assert done.verdict.end is End.ABORTED
    assert [v.requirement for v in done.violations] == ["recovers"] * violated


def test_a_real_resource_fails_without_the_tester() -> None:
    model = scan_cell(GIVES_UP_AT_ONCE)
    done = _execute(model, Outcome.FAIL)
    judge = BuiltInJudge(model, ExcuseRules.of(model))
    simulated = Outcomes(done.verdict.end, done.trace.records, done.reactions, (), ())
    assert [v.requirement for v in judge.find_violations(done.case, simulated, None).violations] == ["recovers"]
    assert not judge.find_violations(done.case, replace(simulated, real=("scan",)), None).violations


def test_forced_states_do_not_count() -> None:
    trigger = Injection("trigger", (("scan_req_trigger", True),), at_ns=0)
    done = _execute(scan_cell(("scan_req_trigger == false && ", "")), injections=(trigger,))
    assert done.forced_by is not None
    assert not done.violations
    both = _execute(scan_cell(NO_CLEAN_UP_AFTER_A_TIMEOUT), Outcome.TIMEOUT, injections=(trigger,))
    assert not both.violations


# no_orphan: requests that are handed over

OVEN = """
behavior_model: oven
variables:
  hot: {domain: bool, initial: false, source: state}
  baked: {domain: bool, initial: false, source: state}
  button: {domain: [up, down], initial: up, source: input}
  heating: {domain: bool, initial: false, source: state}
resources:
  heater: {simulation: {latency: 20 s}}
operations:
  start_heater:
    pre: {g: heater_req_state == initial && heating == false && hot == false}
    post: {g: true, a: [heating <- true, heater_req_trigger <- true]}
  bake:
    deadline: 60 s
    pre: {g: heating == true}
    post: {g: true, gr: hot == true, a: [baked <- true]}
automatic_transitions:
  heated:
    g: heater_req_state == succeeded && heating == true
    a: [hot <- true, heater_req_trigger <- false, heater_req_state <- initial]
  heater_failed:
    g: heater_req_state == failed && heating == true
    a: [heating <- false, heater_req_trigger <- false, heater_req_state <- initial]
runs: {goals: single}
goals:
  baked: baked == true
"""


def test_a_request_that_another_part_of_the_model_ends_is_no_orphan() -> None:
    assert not _violations(read_model(OVEN))


def test_a_request_that_nothing_ever_ends_is_an_orphan() -> None:
    forgotten = OVEN.replace("heater_req_trigger <- false, ", "").replace(", heating == true\n", "")
    assert _violations(read_model(forgotten)) == ["no_orphan"]


def test_an_automatic_transition_may_end_the_request_when_a_late_reply_comes() -> None:
    late = (
        "automatic_transitions:",
        (
            "automatic_transitions:\n"
            "  reply_at_last: {g: scan_req_state == succeeded && current.state != executing,"
            " a: [scan_req_trigger <- false, scan_req_state <- initial]}"
        ),
    )
    model = scan_cell(NO_CLEAN_UP_AFTER_A_TIMEOUT, late)
    rules = (OutcomeRule("scan", 1, 1, Outcome.SUCCEED, 30 * S),)
    done = Tester(model, OPTIONS).execute(Case("case", *model.goals[0], model.nominal_state, rules))
    assert done.verdict.end is End.REACHED
    assert not done.violations


def test_clean_up_that_needs_an_operation_under_way_comes_too_late() -> None:
    too_late = (
        "automatic_transitions:",
        (
            "automatic_transitions:\n"
            "  tidy: {g: scan_req_state == succeeded && current.state == executing && light == blue,"
            " a: [scan_req_trigger <- false, scan_req_state <- initial]}"
        ),
    )
    assert "no_orphan" in _violations(scan_cell(NO_CLEAN_UP_AFTER_A_TIMEOUT, too_late), Outcome.TIMEOUT)


def test_an_operation_may_acknowledge_the_request() -> None:
    acknowledge = (
        "automatic_transitions:",
        (
            "  acknowledge:\n"
            "    pre: {g: scan_req_state == failed}\n"
            "    post: {g: true, a: [scan_req_state <- initial, scan_req_trigger <- false]}\n"
            "automatic_transitions:"
        ),
    )
    keeps = (", scan_req_state <- initial, scan_req_trigger <- false]\ngoals", "]\ngoals")
    own = ("current.state == executing", "scan_box.state == executing")
    done = _execute(scan_cell(acknowledge, keeps, own), Outcome.FAIL)
    assert done.verdict.end is End.REACHED
    assert not done.violations


# ready_again: states from which a resource can be used


def test_an_operation_that_starts_with_a_clean_request_needs_no_clean_up_before() -> None:
    clean_start = (
        (
            "      g: scan_req_state == initial && scan_req_trigger == false && box_is_scanned == false\n"
            "      gr: light != red\n"
            "      a: [scan_req_trigger"
        ),
        (
            "      g: scan_req_trigger == false && box_is_scanned == false\n"
            "      a: [scan_req_state <- initial, scan_req_trigger"
        ),
    )
    done = _execute(scan_cell(STAYS_FAILED, clean_start), Outcome.FAIL)
    assert done.verdict.end is End.REACHED
    assert not done.violations


def test_an_input_may_reset_the_resource() -> None:
    button = ("  count: {", "  button: {domain: [up, down], initial: up, source: input}\n  count: {")
    reset = (
        "automatic_transitions:",
        (
            "automatic_transitions:\n"
            "  reset: {g: scan_req_state == failed && button == down && current.name == none,"
            " a: [scan_req_state <- initial]}"
        ),
    )
    assert "ready_again" not in _violations(scan_cell(STAYS_FAILED, button, reset), Outcome.FAIL)
    assert "ready_again" in _violations(scan_cell(STAYS_FAILED, button), Outcome.FAIL)


def test_a_resource_that_is_given_up_need_not_be_ready() -> None:
    spare = """
behavior_model: spare
variables:
  first_works: {domain: bool, initial: true, source: state}
  seen: {domain: bool, initial: false, source: state}
resources:
  first: {}
  second: {}
operations:
  look:
    pre: {g: first_works == true && seen == false && first_req_state == initial, a: [first_req_trigger <- true]}
    post: {g: true, gr: first_req_state == succeeded,
      a: [seen <- true, first_req_trigger <- false, first_req_state <- initial]}
    failed: {g: first_req_state == failed, a: [first_req_trigger <- false, first_works <- false]}
  look_with_spare:
    pre: {g: first_works == false && seen == false, a: [second_req_trigger <- true]}
    post: {g: true, gr: second_req_state == succeeded,
      a: [seen <- true, second_req_trigger <- false, second_req_state <- initial]}
goals: {seen: seen == true}
"""
    model = read_model(spare)
    rules = (OutcomeRule("first", 1, 1, Outcome.FAIL),)
    done = Tester(model).execute(Case("case", *model.goals[0], model.nominal_state, rules))
    assert done.verdict.end is End.REACHED
    assert not done.violations


# no false alarms


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_the_examples_violate_nothing_however_their_resources_fail(path: Path) -> None:
    model = load_model(path)
    outcomes = ((Outcome.SUCCEED, Fraction(8, 10)), (Outcome.FAIL, Fraction(1, 10)), (Outcome.TIMEOUT, Fraction(1, 10)))
    resources = (replace(r, simulation=replace(r.simulation, outcomes=outcomes)) for r in model.resources)
    model = replace(model, resources=tuple(resources))
    tester = Tester(model)
    cases = RandomCases(model)
    for number in range(1, share(100, usual=5) + 1):
        found = [v for v in tester.execute(cases.case(7, number)).violations if v.is_built_in]
        assert not found, f"case {number}: {found[0]}"


@pytest.mark.parametrize("path", longer_but_one_in(3, STUDIED), ids=lambda path: path.stem)
def test_the_models_of_the_study_violate_nothing(path: Path) -> None:
    model = load_model(path)
    if not model.resources:
        pytest.skip("it sends no requests")
    tester, cases = Tester(model), RandomCases(model)
    for number in range(1, share(100, usual=4) + 1):
        found = [v for v in tester.execute(cases.case(7, number)).violations if v.is_built_in]
        assert not found, f"case {number}: {found[0]}"


@pytest.mark.slow
def test_no_random_model_makes_the_runner_send_after_an_end() -> None:
    for number in range(share(200)):
        model = random_model(number)
        tester, cases = Tester(model, OPTIONS), RandomCases(model)
        for case in cases.first(5, seed=number):
            assert "stops" not in [v.requirement for v in tester.execute(case).violations if v.is_built_in]


def test_a_mutant_is_judged_by_what_it_does_with_requests() -> None:
    model = read_model(OVEN)
    mutant = read_model(
        OVEN.replace("[hot <- true, heater_req_trigger <- false, ", "[hot <- true, ").replace(
            "[heating <- false, heater_req_trigger <- false, ", "[heating <- false, "
        )
    )
    case = Case("case", *model.goals[0], model.nominal_state)
    tester = Tester(model, OPTIONS)
    assert not tester.execute(case).violations
    violations = tester.of_mutant(mutant, plans_alike=True).execute(case).violations
    assert [violation.requirement for violation in violations] == ["no_orphan"]


def test_a_recorded_plan_is_judged_as_any_other() -> None:
    model = scan_cell(STAYS_FAILED)
    rules = (OutcomeRule("scan", 1, 1, Outcome.FAIL),)
    plans = (RecordedPlan("solved", ("scan_box",)), RecordedPlan("unsolvable", ()))
    case = Case("case", *model.goals[0], model.nominal_state, rules, plans=plans)
    assert "ready_again" in [v.requirement for v in Tester(model).execute(case).violations]


HOLD = """
behavior_model: held
variables: {done: {domain: bool, initial: false}}
resources: {drill: {}, hold: {}}
operations:
  work: {request: drill, deadline: 5 s, guard: done == false, effects: [done <- true]}
automatic_transitions:
  clamp:
    g: current.state == executing && hold_req_state == initial && hold_req_trigger == false
    a: [hold_req_trigger <- true]
  release: {g: hold_req_state == succeeded && RELEASED, a: [hold_req_trigger <- false, hold_req_state <- initial]}
goals: {done: done == true}
"""


@pytest.mark.parametrize(
    ("released", "violated"), [("current.state == initial", []), ("done == true && done == false", ["ready_again"])]
)
def test_a_resource_that_only_automatic_transitions_use_is_ready_again(released: str, violated: list[str]) -> None:
    model = read_model(HOLD.replace("RELEASED", released))
    rules = (OutcomeRule("drill", 1, 1, Outcome.FAIL, latency_ns=4_000_000_000),)
    done = Tester(model).execute(Case("case", *model.goals[0], model.nominal_state, rules))
    assert [v.requirement for v in done.violations if v.requirement == "ready_again"] == violated
