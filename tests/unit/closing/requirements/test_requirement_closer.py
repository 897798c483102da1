"""Built-in requirements in all runs (decision 53): what holds, what a small case violates, and what stays open."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Case, CaseLimits, OutcomeRule, RecordedPlan
from scbm.cases.trace import End
from scbm.closing import CloseLimits
from scbm.closing.decisions import DecidedRequirement, RequirementDecisions, RequirementStatus
from scbm.closing.requirements import violating_cases
from scbm.closing.requirements.requirement_closer import RequirementCloser
from scbm.closing.requirements.violating_cases import RequirementKey, ViolatingCases
from scbm.files import Scope, load_model, parse_requirement, read_case, read_model, write_case
from scbm.model import BehaviorModel, GoalOrder, Outcome, Requirement, RunPlans, RunsDeclaration
from scbm.proofcheck import check_certificate
from scbm.running.micro_steps import MicroStep, MicroSteps
from scbm.testing import Campaign, Execution, FailureKind, RandomCases, Tester
from scbm.testing.continuations import waiting_runs
from scbm.testing.decided_requirements import checked_requirements
from scbm.testing.shrinking.case_sizes import size_of
from support.closings import closing_of
from support.models import scan_cell
from support.wording import Wording

ROOT = Path(__file__).parents[4]
SMALL_EXAMPLES = ("robot_in_the_air/after.yaml", "robot_in_the_air/before.yaml")
LARGE_EXAMPLES = ("robot_in_the_air/shared.yaml", "dual_cnc/cell.yaml")
HOLDS, VIOLATED = RequirementStatus.HOLDS, RequirementStatus.VIOLATED
HOLDS_CANONICAL = RequirementStatus.HOLDS_CANONICAL
UNDECIDED, OFF = RequirementStatus.UNDECIDED, RequirementStatus.OFF
NAMES = ("no_orphan", "ready_again", "recovers", "stops", "non_blocking")

NO_CLEAN_UP_AFTER_A_TIMEOUT = ("    timedout: [scan_req_trigger <- false]\n", "")
STAYS_FAILED = ("<- failed, scan_req_state <- initial, scan_req_trigger", "<- failed, scan_req_trigger")
NEEDS_A_GREEN_LIGHT = [
    ("gr: scan_req_state", "gr: light == green && scan_req_state"),
    ("initial: green", "initial: blue"),
]
GIVES_UP_AT_ONCE = ("[current.state <- failed, scan", "[plan.state <- aborted, scan")
WAITS_FOR_EVER = ("    deadline: 10 seconds\n", "")
ASKS_AGAIN_WHEN_ABORTED = (
    "[current.state <- failed, scan_req_state <- initial, scan_req_trigger <- false]",
    "[plan.state <- aborted, scan_req_state <- initial]",
)
RESUMES = RunsDeclaration(GoalOrder.SEQUENCE)


LIMITS = CloseLimits()


def decide(model: BehaviorModel, limits: CloseLimits = LIMITS, suite: tuple[Case, ...] = ()) -> RequirementDecisions:
    campaign = Campaign.of(model, Tester(model).results(suite))
    return RequirementCloser(model, limits, lambda _: None).decide(campaign, closing_of(model, suite=suite))


def statuses(decisions: RequirementDecisions) -> dict[str, RequirementStatus]:
    return {each.name: each.status for each in decisions.decided if each.is_built_in}


def decided(decisions: RequirementDecisions, name: str) -> DecidedRequirement:
    return next(each for each in decisions.decided if each.name == name)


def assert_small_case_fails(found: DecidedRequirement, model: BehaviorModel) -> None:
    """The case, written and read, fails by this requirement, and its run has at most two operations."""
    assert found.execution is not None
    case = read_case(write_case(found.execution.case, model, "model.yaml"), model)
    execution = Tester(model).execute(case)
    (failure,) = (each for each in execution.verdict.failures if each.subject == found.name)
    assert (failure.kind, str(failure)) == (FailureKind.BUILT_IN, found.reason)
    assert case.name == f"{found.name}-1"
    assert size_of(execution, failure, model).operations <= 2


# what holds


@pytest.mark.longer
@pytest.mark.parametrize(
    "path", [*SMALL_EXAMPLES, *(pytest.param(path, marks=pytest.mark.slow) for path in LARGE_EXAMPLES)]
)
def test_all_hold_in_the_examples(path: str) -> None:
    decisions = decide(load_model(ROOT / "examples" / path))
    is_single = load_model(ROOT / "examples" / path).runs.goals is GoalOrder.SINGLE
    single = {"non_blocking": OFF} if is_single else {}
    with_canonical_plans = dict.fromkeys(NAMES, HOLDS_CANONICAL)  # with any plans there are too many runs
    assert statuses(decisions) == with_canonical_plans | single
    assert decisions.assumptions
    assert not decisions.is_open


@pytest.mark.slow
def test_the_first_version_of_the_cell_waits_without_end_after_a_broken_tool() -> None:
    decisions = decide(load_model(ROOT / "examples/dual_cnc/before.yaml"))
    assert statuses(decisions) == {
        **dict.fromkeys(NAMES, HOLDS_CANONICAL),
        "recovers": VIOLATED,
    }


NO_REQUESTS = """
behavior_model: no_requests
variables:
  done: {domain: bool, initial: false}
operations:
  work: {pre: {g: done == false}, post: {g: true, a: [done <- true]}}
goals:
  done: done == true
"""


def test_the_report_says_which_runs_an_answer_is_about(wording: Wording) -> None:
    for model in (scan_cell(), scan_cell(is_open=True), read_model(NO_REQUESTS)):
        decisions = decide(model)
        lines = [f"{each.name} {each.status.value} {each.reason}" for each in decisions.decided]
        wording("\n".join([*lines, *decisions.assumptions]))


@pytest.mark.parametrize("runs", [RunsDeclaration(), RESUMES, RunsDeclaration(plans=RunPlans.DRAWN)])
def test_the_checker_accepts_each_certificate_that_closing_writes(runs: RunsDeclaration) -> None:
    model = replace(scan_cell(), runs=runs)
    decisions = decide(model)
    found = decided(decisions, "non_blocking")
    has_certificate = runs.goals is GoalOrder.SEQUENCE and runs.plans is RunPlans.CANONICAL
    assert (found.holds, found.certificate is not None) == (runs.goals is GoalOrder.SEQUENCE, has_certificate)
    certificates = dict(decisions.certificates)
    assert len(certificates) == 1 + has_certificate
    assert not [flaw for each in certificates.values() for flaw in check_certificate(each, model)]


# what is violated


@pytest.mark.parametrize("runs", [RunsDeclaration(GoalOrder.SINGLE), RESUMES, RunsDeclaration(plans=RunPlans.DRAWN)])
@pytest.mark.parametrize(
    ("replacements", "name", "others"),
    [
        ([NO_CLEAN_UP_AFTER_A_TIMEOUT], "no_orphan", {"recovers": UNDECIDED}),
        ([STAYS_FAILED], "ready_again", {"recovers": UNDECIDED}),
        (NEEDS_A_GREEN_LIGHT, "ready_again", {"recovers": UNDECIDED}),
        ([GIVES_UP_AT_ONCE], "recovers", {}),
        ([WAITS_FOR_EVER, NO_CLEAN_UP_AFTER_A_TIMEOUT], "recovers", {}),
    ],
)
def test_a_seeded_fault_is_shown_by_a_small_case(
    replacements: list[tuple[str, str]], name: str, others: dict[str, RequirementStatus], runs: RunsDeclaration
) -> None:
    model = replace(scan_cell(*replacements), runs=runs)
    decisions = decide(model)
    goes_on = {"non_blocking": OFF if runs.goals is GoalOrder.SINGLE else HOLDS}
    assert statuses(decisions) == dict.fromkeys(NAMES, HOLDS) | goes_on | others | {name: VIOLATED}
    assert_small_case_fails(decided(decisions, name), model)


def test_what_is_sent_after_an_abort_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    model = scan_cell(ASKS_AGAIN_WHEN_ABORTED)
    assert statuses(decide(model))["stops"] is HOLDS
    correct = MicroSteps.first_not_automatic

    def requests_first(
        self: MicroSteps, state: int, in_flight: tuple[()], *, timer_passed: bool
    ) -> tuple[MicroStep | None, bool]:
        request = self._request(state, in_flight)
        return (request, False) if request else correct(self, state, in_flight, timer_passed=timer_passed)

    monkeypatch.setattr(MicroSteps, "first_not_automatic", requests_first)
    found = decided(decide(model), "stops")
    assert found.status is VIOLATED
    assert_small_case_fails(found, model)


def test_what_is_sent_while_no_goal_is_pursued_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    tidy = "automatic_transitions:\n  ask: {g: plan.state == completed, a: [scan_req_trigger <- true]}"
    model = scan_cell(("automatic_transitions:", tidy), more="  unscanned: box_is_scanned == false\n")
    assert statuses(decide(model))["stops"] is HOLDS
    correct = MicroSteps.first_not_automatic

    def always(
        self: MicroSteps, state: int, in_flight: tuple[()], *, timer_passed: bool
    ) -> tuple[MicroStep | None, bool]:
        request = self._request(state, in_flight)
        return (request, False) if request else correct(self, state, in_flight, timer_passed=timer_passed)

    monkeypatch.setattr(MicroSteps, "first_not_automatic", always)
    found = decided(decide(model), "stops")
    assert found.status is VIOLATED
    assert_small_case_fails(found, model)


OCCUPIED = """
behavior_model: occupied
variables:
  done: {domain: bool, initial: false}
resources:
  lift: {shared: true}
  robot: {}
operations:
  drive:
    deadline: 15 s
    pre: {g: done == false, a: [robot_req_trigger <- true]}
    post:
      g: true
      gr: robot_req_state == succeeded
      a: [done <- true, robot_req_trigger <- false, robot_req_state <- initial]
    failed: {g: robot_req_state == failed, a: [robot_req_trigger <- false, robot_req_state <- initial]}
    timedout: [robot_req_trigger <- false]
automatic_transitions:
  lift_moves: {g: lift_req_state == executing && current.state == executing, a: [current.state <- failed]}
goals:
  done: done == true
"""


@pytest.mark.longer
def test_a_change_from_outside_is_part_of_the_case(wording: Wording) -> None:
    model = read_model(OCCUPIED)
    decisions = decide(model)
    found = decided(decisions, "no_orphan")
    assert found.execution is not None
    assert [injection.resource for injection in found.execution.case.injections] == ["lift"]
    assert_small_case_fails(found, model)
    wording(decided(decisions, "recovers").reason)


LAMP = """
environment:
  switch: {guard: light == green, actions: [light <- blue], every: 1 h}
"""


def test_an_environment_that_cannot_help_hides_nothing() -> None:
    model = scan_cell(WAITS_FOR_EVER, NO_CLEAN_UP_AFTER_A_TIMEOUT, more=LAMP)
    found = decided(decide(model), "recovers")
    assert_small_case_fails(found, model)


ACKNOWLEDGED = """
environment:
  push: {guard: light == blue, actions: [light <- green], after: 5 s}
"""


def test_runs_that_wait_for_a_person_are_not_judged(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    waits = ("[current.state <- failed, scan", "[current.state <- failed, light <- blue, scan")
    model = scan_cell(waits, ("gr: light != red", "gr: light == green"), more=ACKNOWLEDGED)
    found = decided(decide(model), "recovers")
    assert found.status == HOLDS
    wording(found.reason)
    monkeypatch.setattr(waiting_runs, "MOST_SITUATIONS", 1)
    found = decided(decide(model), "recovers")
    assert (found.status, found.reason.partition(",")[0]) == (UNDECIDED, "a run waits")


def test_a_case_of_the_suite_shows_a_violation_that_the_limits_hide() -> None:
    model = scan_cell(STAYS_FAILED)
    case = Case("mine", *model.goals[0], model.nominal_state, (OutcomeRule("scan", 1, 1, Outcome.FAIL),))
    found = decided(decide(model, CloseLimits(situations=1), (case,)), "ready_again")
    assert (found.status, found.case, found.execution) == (VIOLATED, "mine", None)
    failing = ("    measures: [temperature]\n", "    simulation: {outcomes: {succeed: 0, fail: 1, timeout: 0}}\n")
    model = scan_cell(STAYS_FAILED, failing)
    found = decided(decide(model, CloseLimits(situations=1), (RandomCases(model).case(1, 1),)), "ready_again")
    assert_small_case_fails(found, model)


# what stays open


def test_a_limit_leaves_the_answers_open() -> None:
    decisions = decide(read_model(OCCUPIED.replace("lift: {shared: true}", "lift: {}")), CloseLimits(situations=2))
    assert statuses(decisions) == dict.fromkeys(NAMES, UNDECIDED)
    assert {each.option for each in decisions.decided} == {"--max-states"}
    assert decisions.is_open


LOOKS_AGAIN = """
behavior_model: looks_again
variables:
  seen: {domain: [nothing, box], initial: nothing}
  found: {domain: bool, initial: false}
resources:
  camera: {measures: [seen], simulation: {measured: {seen: [box]}}}
operations:
  look:
    deadline: 10 s
    pre: {g: camera_req_state == initial && found == false, a: [camera_req_trigger <- true]}
    post:
      g: true
      gr: camera_req_state == succeeded && seen == box
      a: [found <- true, camera_req_trigger <- false, camera_req_state <- initial]
    timedout: [camera_req_trigger <- false]
automatic_transitions:
  look_again:
    g: current.state == executing && (camera_req_state == failed || camera_req_state == succeeded && seen == nothing)
    a: [current.state <- failed, camera_req_trigger <- false, camera_req_state <- initial]
goals:
  found: found == true
"""


SLOW_AND_OPEN = """
behavior_model: slow_and_open
variables:
  light: {domain: [red, green], initial: green}
  done: {domain: bool, initial: false}
resources: {arm: {}}
environment:
  flicker: {guard: light == green, actions: [light <- red], after: 1 s}
  again: {guard: light == red, actions: [light <- green], after: 1 s}
operations:
  work: {request: arm, guard: done == false, pre: {gr: light == green && light == red}, effects: [done <- true]}
goals: {done: done == true}
"""


def test_a_run_that_replies_may_keep_going_round_is_open(wording: Wording) -> None:
    found = decided(decide(read_model(LOOKS_AGAIN), CloseLimits(candidates=0)), "recovers")
    assert found.status is UNDECIDED
    wording(found.reason)


def test_random_cases_that_take_hours_are_few(monkeypatch: pytest.MonkeyPatch) -> None:
    records: list[int] = []
    execute = Tester.execute

    def counted(
        self: Tester, case: Case, most: int | None = None, preferred: tuple[RecordedPlan, ...] = ()
    ) -> Execution:
        execution = execute(self, case, most, preferred)
        records.append(len(execution.trace.records))
        return execution

    model = read_model(SLOW_AND_OPEN)
    found = ViolatingCases(model, (), 100, lambda _: None)
    monkeypatch.setattr(Tester, "execute", counted)
    monkeypatch.setattr(violating_cases, "MOST_RANDOM_RECORDS", 20_000)
    found.try_random((RequirementKey("recovers", is_built_in=True),))
    assert sum(records) <= 20_000
    assert 0 < len(records) < 100


def test_an_end_that_the_model_allows_is_no_violation() -> None:
    gives_up = replace(scan_cell(GIVES_UP_AT_ONCE), may_end=("aborted",))
    assert statuses(decide(gives_up))["recovers"] is HOLDS
    gives_up = replace(scan_cell(GIVES_UP_AT_ONCE), goals_may_end=(("scanned", ("aborted",)),))
    assert statuses(decide(gives_up))["recovers"] is HOLDS


def test_a_reply_that_may_be_late_counts_as_no_fault() -> None:
    """Two late replies and one fault are too many for this model, where its resource may be so slow."""
    twice = replace(scan_cell(), operations=(replace(scan_cell().operations[0], deadline_ns=10),))
    assert statuses(decide(twice))["recovers"] is HOLDS
    slow = scan_cell(("    measures: [temperature]\n", "    simulation: {latency: {uniform: [1 s, 12 s]}}\n"))
    assert statuses(decide(slow))["recovers"] is UNDECIDED


def test_a_requirement_that_is_off_is_not_decided() -> None:
    model = replace(scan_cell(STAYS_FAILED), requirements_off=(("ready_again", "a person clears it"),))
    found = decided(decide(model), "ready_again")
    assert (found.status, found.reason, found.execution) == (OFF, "a person clears it", None)
    everything = replace(model, requirements_off=tuple((name, "why") for name in NAMES))
    decisions = decide(everything)
    assert statuses(decisions) == dict.fromkeys(NAMES, OFF)
    assert decisions.situations == 0


LATCHES = """
behavior_model: latches
variables:
  placed: {domain: bool, initial: false}
  stop: {domain: [up, down], initial: up}
  latch: {domain: [none, set], initial: none SOURCE}
resources:
  arm: {simulation: {latency: 4 s}}
operations:
  place: {request: arm, deadline: 20 s, guard: placed == false && latch == none, effects: [placed <- true]}
  back: {pre: {g: placed == true && latch == none}, post: {g: true, a: [placed <- false]}}
automatic_transitions:
  trip: {g: SET && latch == none, a: [latch <- set]}
  reset: {g: RESET && latch == set, a: [latch <- none]}
environment:
  press: {guard: stop == up, actions: [stop <- down]}
  pull: {guard: stop == down, actions: [stop <- up]}
goals: {placed: placed == true, away: placed == false}
"""


@pytest.mark.parametrize(
    ("trips", "resets", "violated"),
    [
        ("stop == down", "false", ("non_blocking",)),
        ("arm_req_state == failed", "false", ("recovers", "non_blocking")),
        ("stop == down", "stop == up", ()),
    ],
)
def test_what_holds_only_as_a_latch_has_no_source_says_so(trips: str, resets: str, violated: tuple[str, ...]) -> None:
    text = LATCHES.replace("RESET", resets).replace("SET", trips)
    inferred, declared = (decide(read_model(text.replace(" SOURCE", each))) for each in ("", ", source: state"))
    assert {each.name: each.undeclared for each in inferred.decided if each.undeclared} == dict.fromkeys(
        violated, ("latch",)
    )
    assert statuses(inferred) == dict.fromkeys(NAMES, HOLDS)
    assert [name for name in violated if statuses(declared)[name] is HOLDS] == []
    assert not any(each.undeclared for each in declared.decided)


RESETS_WHILE_FREE = """
behavior_model: resets_while_free
variables:
  scanned: {domain: bool, initial: false}
  latch: {domain: [free, set], initial: free}
resources:
  scan: {simulation: {latency: 1 s}}
operations:
  scan_box:
    deadline: 10 s
    pre: {g: scanned == false && scan_req_state == initial && scan_req_trigger == false, a: [scan_req_trigger <- true]}
    post:
      g: true
      gr: scan_req_state == succeeded
      a: [scanned <- true, scan_req_trigger <- false, scan_req_state <- initial]
    timedout: [scan_req_trigger <- false]
automatic_transitions:
  scan_failed:
    g: scan_req_state == failed && scan_box.state == executing
    a: [current.state <- failed, scan_req_trigger <- false, latch <- set]
  reset: {g: latch == free && scan_req_state == failed, a: [scan_req_state <- initial]}
goals: {scanned: {goal: scanned == true, may_end: [unsolvable, time_limit]}}
"""


def test_ready_again_says_on_which_undeclared_variables_it_rests() -> None:
    inferred = read_model(RESETS_WHILE_FREE)
    declared = read_model(RESETS_WHILE_FREE.replace("initial: free}", "initial: free, source: state}"))
    found = {name: decided(decide(inferred), name) for name in ("ready_again", "no_orphan", "stops")}
    assert {name: (each.status, each.undeclared) for name, each in found.items()} == {
        "ready_again": (HOLDS, ("latch",)),
        "no_orphan": (HOLDS, ()),
        "stops": (HOLDS, ()),
    }
    assert decided(decide(declared), "ready_again").status is VIOLATED
    rows = checked_requirements(inferred, (), 1, {}, {})
    assert {row.name: row.undeclared for row in rows if row.is_notable} == dict.fromkeys(
        ("ready_again", "non_blocking"), ("latch",)
    )


TWO_WAYS = """
behavior_model: two_ways
variables:
  seen: {domain: bool, initial: false}
resources:
  eye: {simulation: {latency: 4 s}}
operations:
  look: {request: eye, deadline: 20 s, guard: seen == false, effects: [seen <- true]}
  stare:
    deadline: 1 s
    pre: {g: seen == false && eye_req_state == initial, a: [eye_req_trigger <- true]}
    post:
      g: true
      gr: eye_req_state == succeeded
      a: [seen <- true, eye_req_trigger <- false, eye_req_state <- initial]
    timedout: []
goals: {seen: {goal: seen == true, may_end: [unsolvable, time_limit, replan_limit]}}
"""


def test_what_only_other_plans_violate_holds_under_canonical_plans() -> None:
    model = read_model(TWO_WAYS)
    decisions = decide(model)
    assert (statuses(decisions)["no_orphan"], statuses(decisions)["stops"]) == (HOLDS_CANONICAL, HOLDS)
    plans = {decided(decisions, name).certificate for name in ("no_orphan", "stops")}
    assert plans == {"requirements", "requirements-canonical"}
    every = decide(replace(model, runs=RunsDeclaration(plans=RunPlans.DRAWN)))
    assert statuses(every)["no_orphan"] is not HOLDS
    assert [len(found.assumptions) for found in (decisions, decide(scan_cell()))] == [6, 5]


def test_an_interruption_leaves_what_is_not_decided_open() -> None:
    def interrupt(message: str) -> None:
        if message.startswith("following the runs"):
            raise KeyboardInterrupt

    model = scan_cell()
    decisions = RequirementCloser(model, CloseLimits(), interrupt).decide(Campaign.of(model, ()), closing_of(model))
    assert decisions.is_interrupted
    assert statuses(decisions)["recovers"] is UNDECIDED


# requirements of the user


def test_a_race_that_few_random_cases_have_is_found() -> None:
    model = load_model(ROOT / "tests/models/possible_runs/gate_race.yaml")
    found = decided(decide(model), model.requirements[0].name)
    assert (found.status, found.is_built_in) == (VIOLATED, False)
    assert found.execution is not None
    (change,) = found.execution.case.environment or ()
    assert change.by == "open_door"
    again = Tester(model).execute(read_case(write_case(found.execution.case, model, "model.yaml"), model))
    assert next((each.kind, each.subject) for each in again.verdict.failures) == (FailureKind.REQUIREMENT, found.name)


TIMED = """
requirements:
  at_once: scan_req_state == failed leads to scan_req_trigger == false within 1 s
  in_time: scan_req_trigger == true leads to box_is_scanned == true within 1 min
  some_day: scan_req_trigger == true leads to scan_req_trigger == false
  never_ends: scan_req_trigger == true leads to light == blue
"""


def test_times_are_left_to_cases_unless_nothing_takes_time() -> None:
    model = scan_cell(more=TIMED)
    decisions = decide(model)
    statuses_of_user = {each.name: each.status for each in decisions.decided if not each.is_built_in}
    assert statuses_of_user == {
        "at_once": HOLDS,
        "in_time": RequirementStatus.CASES_ONLY,
        "some_day": HOLDS,
        "never_ends": VIOLATED,
    }
    assert not decisions.is_open


SEES_BAD = """
behavior_model: sees_bad
variables:
  found: {domain: [unknown, good, bad], initial: unknown}
  go: {domain: bool, initial: true, source: input}
  done: {domain: bool, initial: false}
resources:
  cam: {measures: {found: [good, bad]}, simulation: {latency: 1 s}}
  arm: {simulation: {latency: 1 s}}
operations:
  look: {request: cam, deadline: 5 s, guard: found != good, assumes: {found: good}}
  pick: {request: arm, guard: found == good && done == false, pre: {gr: go == true}, effects: [done <- true]}
goals:
  done: {goal: done == true, may_end: [aborted, unsolvable]}
requirements:
  bad_good: found == bad leads to found == good
  looked: look.state == executing leads to cam_req_state == succeeded || found == good
  ends: pick.state == executing leads to pick.state != executing
  starts: pick.state == disabled leads to pick.state == executing
"""


def test_rounds_and_waits_are_shown_by_cases_that_a_limit_ends(wording: Wording) -> None:
    model = read_model(SEES_BAD)
    decisions = decide(model)
    found = {each.name: each for each in decisions.decided if not each.is_built_in}
    assert found["looked"].holds, "a request that times out each time does not succeed in the end"
    ends = {"bad_good": End.REPLAN_LIMIT, "ends": End.TIME_LIMIT, "starts": End.TIME_LIMIT}
    for name, end in ends.items():
        execution = found[name].execution
        assert execution is not None
        assert (found[name].status, execution.verdict.end) == (VIOLATED, end)
        wording(found[name].reason)


def test_a_closed_suite_needs_no_further_case_of_a_round_or_a_wait() -> None:
    model = read_model(SEES_BAD)
    first = decide(model)
    suite = tuple(each.execution.case for each in first.decided if each.execution is not None)
    assert suite
    again = decide(model, suite=suite)
    assert [each.status for each in again.decided] == [each.status for each in first.decided]
    assert not [each for each in again.decided if each.execution is not None]


PICKED = "pick.state == executing leads to done == true"


def test_a_limit_that_ends_a_run_in_which_a_reply_is_late_or_bad_shows_nothing() -> None:
    model = read_model(
        SEES_BAD.replace("request: arm, guard", "request: arm, deadline: 5 s, guard").replace(
            "pre: {gr: go == true}, ", ""
        )
    )
    model = replace(model, requirements=(Requirement("picked", parse_requirement(PICKED, Scope.of(model))),))
    failed = tuple(OutcomeRule("pick", number, number, Outcome.FAIL) for number in range(1, 200))
    missing = (OutcomeRule("pick", 1, None, Outcome.TIMEOUT),)
    for rules, limits in (((), CaseLimits(1_500_000_000)), (failed, CaseLimits()), (missing, CaseLimits())):
        case = Case("case", *model.goals[0], model.nominal_state, rules, limits=limits)
        execution = Tester(model).execute(case)
        assert [each.requirement for each in execution.violations if not each.is_built_in] == ["picked"]
        found = ViolatingCases(model, (), 1, lambda _: None)
        found.keep(execution)
        assert RequirementKey("picked") not in found
    assert decided(decide(model), "picked").holds


STOPS = """
behavior_model: stops
variables:
  light: {domain: [red, green], initial: green, source: input}
  done: {domain: bool, initial: false}
resources: {arm: {simulation: {latency: 1 s}}}
operations:
  work:
    {request: arm, deadline: 5 s, disabled_deadline: 5 s, guard: done == false, pre: {gr: light == green},
     effects: [done <- true]}
automatic_transitions:
  stop: {g: light == red && work.state == executing, a: [current.state <- failed, arm_req_trigger <- false]}
goals: {done: done == true}
requirements: {works: work.state == executing leads to done == true}
"""


def test_a_round_of_changes_from_outside_is_shown_until_a_time_limit() -> None:
    model = read_model(STOPS)
    decisions = decide(model)
    found = decided(decisions, "works")
    assert found.execution is not None
    changes = found.execution.case.environment or ()
    assert (found.status, found.execution.verdict.end, len(changes)) == (VIOLATED, End.TIME_LIMIT, 3)


def test_a_requirement_of_the_command_line_stands_in_its_case() -> None:
    model = scan_cell(more=TIMED)
    extra = replace(model.requirements[3], name="mine")
    plain = replace(model, requirements=())
    closer = RequirementCloser(plain, LIMITS, lambda _: None, extra=(extra,))
    found = decided(closer.decide(Campaign.of(plain, ()), closing_of(plain)), "mine")
    assert found.execution is not None
    assert found.execution.case.requirements == (extra,)


def test_what_only_drawn_plans_violate_is_shown_by_a_case_with_these_plans() -> None:
    model = read_model(
        """
behavior_model: ways
variables:
  door: {domain: [shut, open], initial: shut}
operations:
  push: {pre: {g: door == shut}, post: {g: true, a: [door <- open]}}
  pull: {pre: {g: door == shut}, post: {g: true, a: [door <- open]}}
goals: {opened: door == open}
requirements: {no_pull: never pull.state == executing}
runs: {plans: drawn}
"""
    )
    found = decided(decide(model), "no_pull")
    assert found.status is RequirementStatus.VIOLATED
    assert found.execution is not None
    text = write_case(found.execution.case, model, None)
    again = Tester(model).execute(read_case(text, model))
    assert [each.requirement for each in again.violations] == ["no_pull"]


def test_a_run_that_ends_in_the_step_in_which_its_goal_is_given_leaves_q_due() -> None:
    model = read_model(
        """
behavior_model: at_once
variables:
  door: {domain: [shut, open], initial: shut}
operations:
  open: {pre: {g: door == shut}, post: {g: true, a: [door <- open]}}
  shut: {pre: {g: door == open}, post: {g: true, a: [door <- shut]}}
goals: {opened: door == open, closed: door == shut}
requirements:
  shut_again: open.state == executing leads to shut.state == executing
  opens: open.state == executing leads to door == open
"""
    )
    decisions = decide(model)
    found = decided(decisions, "shut_again")
    assert (found.status, decided(decisions, "opens").holds) == (RequirementStatus.VIOLATED, True)
    assert found.execution is not None
    assert found.execution.case.goal_names == "opened"


def test_a_requirement_about_what_runs_do_not_depend_on_is_decided_where_nothing_else_is() -> None:
    model = read_model(
        """
behavior_model: lamp
variables: {lamp: {domain: [off, on], initial: off}, sign: {domain: [red, green], initial: red}}
operations: {light: {pre: {g: lamp == off}, post: {g: true, a: [lamp <- on, sign <- green]}}}
goals: {lit: lamp == on}
runs: {goals: single}
requirements: {red_first: lamp == on leads to sign == green, always_red: always sign == red}
"""
    )
    decisions = decide(model)
    assert decided(decisions, "red_first").holds
    assert decided(decisions, "always_red").status is RequirementStatus.VIOLATED
