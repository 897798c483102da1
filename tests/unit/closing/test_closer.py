"""Closing whole models: what is covered and by what, what is proved, and what is left."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Aspect, Obligation
from scbm.cases.trace import End
from scbm.closing import CloseLimits, Closer, Closing, Decision
from scbm.closing.decisions import Stage
from scbm.closing.distinguished_values import distinguishing_values
from scbm.closing.runs.all_runs import AllRuns, RunScope
from scbm.closing.symbolic import decision_diagrams
from scbm.files import load_model, read_model
from scbm.model import InputError, Outcome, PlannerChoice, PlannerIdentity, PlanSet, Slug
from scbm.proofcheck import check_certificate
from scbm.running import Program
from scbm.running.untimed.relevance import Relevance
from scbm.testing import Campaign, RandomCases, Tester
from support.models import as_closed
from support.shared_closings import shared_closing
from support.wording import Wording

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air"

SCAN = """
behavior_model: scan
variables:
  scanned: {domain: bool, initial: false}
  timeouts: {domain: 0..3, initial: 0}
  stop: {domain: bool, initial: false}
  lamp: {domain: [dark, green, red], initial: dark}
resources:
  scanner: {}
operations:
  scan:
    deadline: 10 s
    pre:
      g: scanner_req_state == initial && scanner_req_trigger == false && scanned == false
      a: [scanner_req_trigger <- true]
    post:
      g: true
      gr: scanner_req_state == succeeded
      a: [scanner_req_state <- initial, scanner_req_trigger <- false, scanned <- true]
    timedout: [scanner_req_trigger <- false, timeouts += 1]
automatic_transitions:
  scan_failed:
    g: scanner_req_state == failed && current.state == executing
    a: [current.state <- failed, scanner_req_state <- initial, scanner_req_trigger <- false]
%s
goals:
  scanned: scanned == true
"""


def close(automatic: str, limits: CloseLimits | None = None) -> Closing:
    return Closer(read_model(SCAN % automatic, "scan.yaml"), limits or CloseLimits()).close()


def decision(closing: Closing, name: str) -> Decision:
    return next(each.decision for each in closing.decided if str(each.obligation) == name)


@pytest.mark.longer
def test_the_example_before_its_repair() -> None:
    closing = shared_closing(load_model(EXAMPLE / "before.yaml"))
    proved = [d for d in closing.decided if d.certificate is not None and d.obligation.counts]
    never = [d for d in proved if not closing.after.visited & closing.bit(d.obligation)]
    assert {d.obligation.subject for d in never} == {"robot_move_to_home", "robot_unmount_gripper"}
    assert len(never) == 10
    assert {d.obligation.aspect for d in proved if d not in never} == {Aspect.DISABLED}
    assert {d.certificate for d in proved if d.decision is Decision.EXCLUDED} == {"runs-canonical"}
    assert closing.forced == 14
    assert all(d.decision is not Decision.UNDECIDED for d in closing.decided)
    assert closing.after.figure.visited == 76
    assert len(closing.cases) <= 8
    assert all(made.execution.verdict.passed for made in closing.cases)
    assert [str(s.goal) for s in closing.suggestions] == ["robot_at == home", "mounted == none && gripper_act == open"]


@pytest.mark.slow
def test_the_example_after_its_repair() -> None:
    closing = shared_closing(load_model(EXAMPLE / "after.yaml"))
    assert closing.after.figure.visited == 86
    assert len(closing.cases) <= 8
    assert [kind for kind, _ in closing.certificates] == ["runs"]
    assert {claim.partition("/")[2] for _, each in closing.certificates for claim in each.claims} == {"disabled"}
    assert closing.suggestions == ()


@pytest.mark.slow
def test_what_a_suite_visits_is_left_to_it() -> None:
    model = load_model(EXAMPLE / "after.yaml")
    cases = RandomCases(model, "after.yaml").first(20, 1)
    suite = Campaign.of(model, Tester(model).results(cases))
    closing = Closer(model).close(suite)
    covering = {d.obligation: d.case for d in closing.decided}
    assert covering[Obligation("robot_move_to_box_a", Aspect.EXECUTING)] == "seed-1-case-1"
    added = [obligation for made in closing.cases for obligation in made.adds]
    assert len(added) == len(set(added)) == 102 - suite.coverage.visited.bit_count()


def test_every_case_adds_something_and_short_ones_come_first() -> None:
    closing = shared_closing(load_model(EXAMPLE / "before.yaml"))
    assert all(made.adds for made in closing.cases)
    lengths = [(made.forcing is not None, made.execution.ended_ns) for made in closing.cases]
    assert lengths == sorted(lengths)


def test_what_is_asked_for_alone_is_covered_by_a_short_case() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    wanted = (Obligation("scanner_scan_item_a", Aspect.FAILED),)
    (made,) = (closing := Closer(model).close(wanted=wanted)).cases
    assert [d.obligation for d in closing.decided] == [*wanted]
    assert [(rule.subject, rule.outcome) for rule in made.case.outcomes] == [("scanner_scan_item_a", Outcome.FAIL)]
    assert made.case.expect.visits == wanted


def test_timeouts_in_a_row_come_out_without_being_reported() -> None:
    closing = close("  give_up: {g: timeouts == 3, a: [plan.state <- aborted]}")
    made = next(made for made in closing.cases if Obligation("give_up", Aspect.TAKEN) in made.adds)
    assert made.execution.verdict.end is End.ABORTED
    timeouts = [rule for rule in made.case.outcomes if rule.outcome is Outcome.TIMEOUT]
    assert sum(1 + (rule.last or 0) - rule.first for rule in timeouts) == 3


@pytest.mark.slow
@pytest.mark.parametrize("count", [100, 101, 120])
def test_a_case_that_needs_more_plans_than_a_run_may_ask_for_has_a_limit_of_its_own(count: int) -> None:
    text = (SCAN % f"  enough: {{g: timeouts == {count} && lamp == dark, a: [lamp <- green]}}").replace(
        "0..3", "0..150"
    )
    closing = Closer(read_model(text, "scan.yaml")).close()
    made = next(made for made in closing.cases if Obligation("enough", Aspect.TAKEN) in made.adds)
    assert made.execution.verdict.passed
    assert (made.case.limits.plans or 0) > count


@pytest.mark.longer
def test_a_run_that_asks_for_plans_without_end_in_one_instant_ends_as_livelock() -> None:
    text = """
behavior_model: refused
variables: {v: {domain: bool, initial: false}}
operations:
  set_v: {pre: {g: v == false}, post: {g: true, a: [v <- true]}}
automatic_transitions:
  refuse: {g: current.state == executing, a: [current.state <- failed]}
goals: {all: v == true}
"""
    closing = Closer(read_model(text, "refused.yaml")).close()
    assert decision(closing, "automatic/refuse") is Decision.COVERED
    assert closing.cases[0].execution.verdict.end is End.LIVELOCK
    assert closing.cases[0].case.limits.plans is None


def test_an_input_is_injected_for_an_automatic_transition_that_waits_for_it() -> None:
    closing = close("  halt: {g: stop == true && current.state == executing, a: [plan.state <- aborted]}")
    assert decision(closing, "automatic/halt") is Decision.COVERED
    made = next(made for made in closing.cases if Obligation("halt", Aspect.TAKEN) in made.adds)
    assert (("stop", True),) in [change.assign for change in made.case.environment or ()]
    assert made.case.injections == ()


def test_what_the_model_keeps_itself_is_not_changed_by_force(wording: Wording) -> None:
    wonder = SCAN % "  wonder: {g: scanned == true && timeouts == 0 && lamp == red, a: [lamp <- green]}"
    single = wonder + "runs: {goals: single}\n"
    found = {str(d.obligation): d for d in Closer(read_model(single)).close().decided}["automatic/wonder"]
    assert (found.decision, found.is_forced) == (Decision.UNDECIDED, True)
    wording(found.reason)
    closing = Closer(as_closed(read_model(wonder))).close()
    assert decision(closing, "automatic/wonder") is Decision.UNCOVERABLE


@pytest.mark.parametrize("state", ["completed", "aborted"])
def test_behind_the_end_of_a_run_automatic_transitions_have_their_turn(state: str) -> None:
    closing = close(f"  ring: {{g: plan.state == {state} && lamp == dark, a: [lamp <- green]}}")
    assert decision(closing, "automatic/ring") is Decision.COVERED


def test_what_was_not_explored_is_undecided_and_says_why(wording: Wording) -> None:
    nothing = CloseLimits(situations=2, beyond=0, random=0, changes=0)
    closing = close("  give_up: {g: timeouts == 3, a: [plan.state <- aborted]}", nothing)
    undecided = [each for each in closing.decided if each.decision is Decision.UNDECIDED]
    assert [(str(each.obligation), each.is_forced) for each in undecided] == [("automatic/give_up", False)]
    wording(undecided[0].reason)


def test_beyond_what_was_explored_the_nearest_is_looked_at_first() -> None:
    automatic = "  give_up: {g: timeouts == 3, a: [plan.state <- aborted]}"
    few = CloseLimits(situations=2, random=0, changes=0)
    assert decision(close(automatic, replace(few, beyond=0)), "automatic/give_up") is Decision.UNDECIDED
    assert decision(close(automatic, few), "automatic/give_up") is Decision.COVERED


def test_a_model_without_goals_or_initial_states_has_no_runs() -> None:
    text = (SCAN % "").replace("goals:\n  scanned: scanned == true\n", "")
    for model, slug in ((text, Slug.NO_GOALS), (SCAN % "" + "initial_states: lamp == red\n", Slug.NO_INITIAL_STATE)):
        with pytest.raises(InputError) as refused:
            Closer(read_model(model, "scan.yaml")).close()
        assert [diagnostic.slug for diagnostic in refused.value.diagnostics] == [slug]


def test_inputs_that_have_to_change_again_and_again() -> None:
    closing = close(
        """  latch: {g: stop == true && lamp == dark, a: [lamp <- red]}
  unlatch: {g: stop == false && lamp == red, a: [lamp <- green]}
  again: {g: stop == true && lamp == green && current.state == executing, a: [plan.state <- aborted]}"""
    )
    assert decision(closing, "automatic/again") is Decision.COVERED


def test_an_input_with_many_values_takes_those_that_guards_distinguish(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (SCAN % "  hot: {g: heat > 950 && heat != 990, a: [plan.state <- aborted]}").replace(
        "  lamp:", "  heat: {domain: 0..1000, initial: 20}\n  lamp:"
    )
    model = read_model(text, "scan.yaml")
    assert distinguishing_values(model, "heat") == (0, 951, 990)
    monkeypatch.setattr(decision_diagrams, "ENGINES", {})
    closing = Closer(model, CloseLimits(situations=20_000)).close()
    assert decision(closing, "automatic/hot") is Decision.COVERED
    assert [(end.stage, end.option) for end in closing.ended] == [(Stage.GRAPH, "--max-states"), (Stage.SETS, None)]


def test_a_change_that_would_reach_the_goal_disables_nothing() -> None:
    text = """
behavior_model: two
variables: {v: {domain: bool, initial: false}, w: {domain: bool, initial: false}}
operations:
  set_v: {pre: {g: v == false}, post: {g: true, a: [v <- true]}}
  set_w: {pre: {g: w == false}, post: {g: true, a: [w <- true]}}
goals: {all: v == true && w == true}
"""
    closing = Closer(read_model(text, "two.yaml")).close()
    assert decision(closing, "set_w/disabled") is Decision.UNCOVERABLE
    assert [str(o) for made in closing.cases for o in made.adds_by_force] == ["set_v/disabled", "set_w/disabled"]


@pytest.mark.slow
def test_a_reply_after_a_deadline_comes_after_the_plan() -> None:
    """The request of an operation that timed out stays in flight where nothing clears its trigger."""
    text = (SCAN % "  late: {g: scanner_req_state == succeeded && timeouts == 1, a: [lamp <- green]}").replace(
        "timedout: [scanner_req_trigger <- false, timeouts += 1]", "timedout: [timeouts += 1]"
    )
    assert decision(Closer(read_model(text, "scan.yaml")).close(), "automatic/late") is Decision.COVERED


@pytest.mark.slow
def test_closing_twice_comes_to_the_same() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    first, second = shared_closing(model), Closer(model).close()
    assert first.decided == second.decided
    assert [made.case for made in first.cases] == [made.case for made in second.cases]
    assert first.certificates == second.certificates


def test_a_limit_of_plans_ends_a_run_before_the_next_plan() -> None:
    closing = close("""
  mark: {g: scan.state == timedout && lamp == dark, a: [lamp <- green]}
  unmark: {g: scan.state == executing && lamp == green, a: [lamp <- red]}
  late: {g: plan.state == aborted && lamp == green && current.name == none, a: [lamp <- dark]}
""")
    assert decision(closing, "automatic/late") is Decision.COVERED


def test_a_limit_can_end_a_run_while_it_plans() -> None:
    closing = close("""
  mark: {g: plan.state == planning && timeouts == 1 && lamp == dark, a: [lamp <- green]}
  unmark: {g: plan.state == executing && lamp == green, a: [lamp <- red]}
  late: {g: plan.state == aborted && lamp == green, a: [lamp <- dark]}
""")
    assert decision(closing, "automatic/late") is not Decision.UNCOVERABLE


def promised(automatic: str, name: str) -> bool:
    """Whether runs visit an automatic transition, as far as exploring them says."""
    runs = AllRuns(read_model(SCAN % automatic, "scan.yaml"), CloseLimits(), lambda _: None)
    return bool(runs.visited & runs.visits.bit(name, Aspect.TAKEN))


def test_nothing_is_sent_after_the_end_of_a_run() -> None:
    assert not promised(
        """
  again: {g: plan.state == completed && scanner_req_trigger == false && lamp == dark, a: [scanner_req_trigger <- true]}
  seen: {g: plan.state == completed && scanner_req_state == executing && lamp == dark, a: [lamp <- red]}
""",
        "seen",
    )


def test_a_run_that_ends_for_want_of_a_plan_says_so() -> None:
    assert promised(
        """
  occupied: {g: scan.state == timedout && scanner_req_state == initial, a: [scanner_req_state <- failed]}
  notice: {g: plan.state == unsolvable && lamp == dark, a: [lamp <- red]}
""",
        "notice",
    )


def test_answers_are_given_up_at_the_end_of_a_run() -> None:
    closing = close("""
  enough: {g: scanner_req_state == succeeded && plan.state == executing, a: [plan.state <- aborted]}
  kept: {g: plan.state == aborted && current.name == none && scanner_req_state == succeeded, a: [lamp <- red]}
""")
    assert decision(closing, "automatic/kept") is Decision.UNCOVERABLE


def test_initial_states_that_were_not_looked_at_leave_it_open() -> None:
    automatic = "  lit: {g: lamp == red, a: [lamp <- dark]}"
    text = (SCAN % automatic).replace("initial: dark}", "initial: dark, random: any}")
    closing = Closer(read_model(text, "scan.yaml"), CloseLimits(starts=1)).close()
    assert decision(closing, "automatic/lit") is not Decision.UNCOVERABLE


def test_what_can_leave_its_domain_makes_a_difference() -> None:
    model = read_model(SCAN % "", "scan.yaml")
    assert "timeouts" in Relevance(model, Program(model).packing).names


@pytest.mark.slow
def test_under_another_planner_only_proofs_that_hold_for_every_plan_are_kept() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    excluded = {d.obligation for d in shared_closing(model).decided if d.decision is Decision.EXCLUDED}
    assert excluded
    closing = shared_closing(replace(model, planner=PlannerChoice("greedy")))
    assert {certificate.plans for _, certificate in closing.certificates} <= {PlanSet.ANY}
    assert {certificate.planner for _, certificate in closing.certificates} <= {None}
    open_ones = [d for d in closing.decided if d.decision is Decision.UNDECIDED]
    proved = {d.obligation for d in closing.decided if d.certificate is not None}
    assert not excluded & proved
    assert open_ones
    assert all("`--planner canonical`" in d.reason for d in open_ones)


def test_a_proof_from_all_runs_is_none_for_a_model_with_another_planner() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    certificate = dict(shared_closing(model).certificates)["runs-canonical"]
    assert certificate.planner == PlannerIdentity("canonical", "1")
    assert check_certificate(certificate, model) == ()
    other = check_certificate(certificate, replace(model, planner=PlannerChoice("greedy")))
    assert [flaw.where for flaw in other] == ["the planner"]
    forged = replace(certificate, planner=None)
    assert [flaw.where for flaw in check_certificate(forged, model)] == ["the planner"]


@pytest.mark.slow
def test_limits_of_the_model_that_end_plans_leave_runs_unexplored() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    short = Closer(replace(model, planner=PlannerChoice("canonical", max_length=5))).close()
    assert not any(d.certificate == "runs" for d in short.decided)


# the open world

STOP_CELL = """
behavior_model: stop_cell
variables:
  estop: {domain: [released, pressed], initial: released%s}
  at: {domain: [home, box], initial: home}
resources:
  arm: {simulation: {latency: 1 s, outcomes: {succeed: 1, fail: 0, timeout: 0}}}%s
operations:
  move:
    deadline: 5 s
    pre: {g: at == home, a: [arm_req_trigger <- true]}
    post: {g: true, gr: arm_req_state == succeeded, a: [arm_req_trigger <- false, arm_req_state <- initial, at <- box]}
    timedout: [arm_req_trigger <- false]
automatic_transitions:
  emergency_stop: {g: estop == pressed, gr: current.state == executing, a: [plan.state <- aborted]}
  reset_after: {g: plan.state == completed && estop == pressed && at == box, a: [at <- home]}
goals: {at_box: at == box}
"""
PRESSED = [
    ("", "\n  safety: {measures: [estop]}"),
    ("", "\n  safety: {publishes: [estop]}"),
    ("", ""),
    (", source: input", ""),
]


@pytest.mark.parametrize(("source", "resource"), PRESSED)
def test_what_is_pressed_outside_the_model_is_never_proved_uncoverable(source: str, resource: str) -> None:
    closing = Closer(read_model(STOP_CELL % (source, resource))).close()
    assert decision(closing, "automatic/emergency_stop") is Decision.COVERED
    assert decision(closing, "automatic/reset_after") is not Decision.UNCOVERABLE


def test_what_nothing_presses_is_uncoverable_and_the_proof_says_what_it_assumes(wording: Wording) -> None:
    model = read_model(STOP_CELL % (", source: constant", ""))
    closing = Closer(model).close()
    assert decision(closing, "automatic/emergency_stop") is Decision.UNCOVERABLE
    wording(each for each in closing.assumptions if "estop" in each)


def test_a_certificate_about_a_closed_world_proves_nothing_about_an_open_one() -> None:
    closed, opened = (read_model(STOP_CELL % (source, "")) for source in (", source: constant", ""))
    certificates = [certificate for _, certificate in Closer(closed).close().certificates]
    assert [flaw for certificate in certificates for flaw in check_certificate(certificate, closed)] == []
    name = "automatic/emergency_stop"
    (about,) = [each for each in certificates if name in each.claims]
    assert check_certificate(about, opened)


def test_a_limit_of_the_runs_in_which_inputs_change_is_named_and_nothing_is_proved_by_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(decision_diagrams, "ENGINES", {})
    never = "  never_taken: {g: at == box && current.state == executing, a: [plan.state <- aborted]}\n  emergency_stop:"
    model = read_model((STOP_CELL % ("", "")).replace("  emergency_stop:", never))
    assert decision(Closer(model).close(), "automatic/never_taken") is Decision.UNCOVERABLE
    closed, opened = (AllRuns(model, CloseLimits(), lambda _: None, RunScope(is_open)) for is_open in (False, True))
    assert closed.situations < opened.situations
    closing = Closer(model, CloseLimits(situations=closed.situations)).close()
    assert decision(closing, "automatic/never_taken") is Decision.UNDECIDED
    assert [(end.stage, end.option) for end in closing.ended] == [(Stage.GRAPH, "--max-states"), (Stage.SETS, None)]
