"""A suite run against mutants: what kills, what is left out, and the case that a mutant gets."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Case, Expectations, Injection, RecordedPlan
from scbm.cases.coverage import MutantStatus
from scbm.cases.trace import End
from scbm.files import load_model, read_case, read_model
from scbm.model import BehaviorModel
from scbm.mutation import MutantCounts, MutantResult, MutationRuns, mutants_of
from scbm.testing import RandomCases, Tester, load_suite
from support.models import scan_cell
from support.two_robots import two_robots
from support.wording import Wording

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air"
LIGHT = """
behavior_model: light
variables:
  light: {domain: [green, blue], initial: green}
operations:
  switch:
    pre: {g: light == blue}
    post: {g: true, a: [light <- green]}
goals: {green: light == green}
"""


HEATER = """
behavior_model: heater
variables:
  warm: {domain: bool, initial: false}
resources:
  heater: {simulation: {latency: 1 s}}
operations:
  heat:
    pre: {g: warm == false, a: [heater_req_trigger <- true]}
    post: {g: true, a: [warm <- true]}
automatic_transitions:
  off: {g: heater_req_state == succeeded, a: [heater_req_trigger <- false, heater_req_state <- initial]}
goals: {warm: warm == true}
"""


def case_of(model: BehaviorModel, more: str = "", expect: str = "") -> Case:
    return read_case(f"case: plain\nmodel: {model.name}\ngoal: scanned\n{more}{expect}", model)


def results(model: BehaviorModel, cases: Iterable[Case]) -> dict[str, MutantResult]:
    """The result of each mutant by its name."""
    runs = MutationRuns(Tester(model), cases)
    return {result.mutant.name: result for result in runs.results(mutants_of(model))}


def test_the_first_case_that_fails_kills(wording: Wording) -> None:
    model = scan_cell()
    first, second = case_of(model), replace(case_of(model), name="second")
    found = results(model, [first, second])["scan_box/post.a/drop:box_is_scanned <- true"]
    assert (found.status, found.case, found.runs) == (MutantStatus.KILLED, "plain", 1)
    wording(found.reason)


def test_a_mutant_that_no_case_kills_is_undecided() -> None:
    model = scan_cell()
    found = results(model, [case_of(model)])["scan_box/deadline/100 s"]
    assert (found.status, found.case, found.reason) == (MutantStatus.UNDECIDED, "", "")


def test_a_case_whose_run_cannot_differ_is_left_out() -> None:
    model = scan_cell()
    found = results(model, [case_of(model)])
    assert (found["scan_box/deadline/100 s"].runs, found["scan_box/deadline/100 s"].skipped) == (0, 1)
    assert found["scan_box/timedout/drop:scan_req_trigger <- false"].skipped == 1
    assert found["automatic/scan_failed/drop"].skipped == 1
    assert found["scan_box/pre.gr/value:light != blue"].skipped == 1


def test_a_shorter_deadline_that_passes_in_the_run_is_no_reason_to_leave_it_out() -> None:
    model = scan_cell(("measures: [temperature]", "measures: [temperature]\n    simulation: {latency: 1 s}"))
    found = results(model, [case_of(model, expect="expect: {verdict: reached, visits: [scan_box/completed]}")])
    assert found["scan_box/deadline/1 s"].runs == 1


def test_a_case_that_fails_on_the_original_kills_nothing() -> None:
    model = scan_cell()
    wrong = replace(case_of(model), name="wrong", expect=Expectations(verdict=End.UNSOLVABLE))
    runs = MutationRuns(Tester(model), [wrong, case_of(model)])
    assert runs.failing == ["wrong"]
    assert [case.name for case in runs.cases] == ["plain"]
    assert {result.case for result in runs.results(mutants_of(model))} == {"plain", ""}


@pytest.mark.slow
def test_a_case_that_names_an_operation_that_is_gone_is_killed_by_that(wording: Wording) -> None:
    model = two_robots("canonical")
    plain = read_case("case: one\nmodel: two_robots\ngoal: served\n", model)
    named = replace(plain, name="two", injections=(Injection("stop", assign=(("pick_2.state", "failed"),), at_ns=5),))
    kept, gone = results(model, [plain])["pick_2/drop"], results(model, [plain, named])["pick_2/drop"]
    assert kept.status is MutantStatus.UNDECIDED
    assert (gone.status, gone.case) == (MutantStatus.KILLED, "two")
    wording(gone.reason)


@pytest.mark.slow
def test_plans_of_a_case_that_are_no_plans_of_the_mutant_are_planned_anew() -> None:
    model = two_robots()
    plain = read_case("case: one\nmodel: two_robots\ngoal: served\n", model)
    second = replace(plain, plans=(RecordedPlan("solved", ("pick_2", "place_2")),))
    found = results(model, [second])
    assert found["pick_2/drop"].status is MutantStatus.UNDECIDED
    assert found["pick_2/pre.g/negate:box == shelf"].status is MutantStatus.UNDECIDED
    assert found["place_2/post.a/value:box <- shelf"].status is MutantStatus.UNDECIDED


@pytest.mark.slow
def test_plans_of_a_case_that_are_plans_of_the_mutant_are_kept() -> None:
    model = two_robots()
    plain = read_case("case: one\nmodel: two_robots\ngoal: served\nexpect: {order: [pick_2, place_2]}\n", model)
    second = replace(plain, plans=(RecordedPlan("solved", ("pick_2", "place_2")),))
    found = results(model, [second])
    assert found["pick_1/drop"].status is MutantStatus.UNDECIDED
    assert found["pick_2/pre.g/negate:box == shelf"].reason.startswith("expected pick_2 → place_2 to complete")


@pytest.mark.longer
def test_a_case_begins_with_the_initial_values_of_the_mutant(wording: Wording) -> None:
    model = scan_cell()
    expect = "expect: {plan: [scan_box]}"
    found = results(model, [case_of(model, expect=expect)])["variable/box_is_scanned/initial/true"]
    wording(found.reason)
    set_here = case_of(model, "initial: {box_is_scanned: true}\n")
    assert results(model, [set_here])["variable/box_is_scanned/initial/true"].status is MutantStatus.UNDECIDED


def test_a_variable_that_the_mutant_does_not_assign_is_no_input_that_excuses(wording: Wording) -> None:
    model = read_model(LIGHT)
    case = read_case("case: blue\nmodel: light\ngoal: green\ninitial: {light: blue}\n", model)
    found = results(model, [case])["switch/post.a/drop:light <- green"]
    wording(found.reason)


def test_an_equal_run_is_judged_by_what_the_mutant_does_with_its_requests() -> None:
    model = read_model(HEATER)
    case = read_case("case: warm\nmodel: heater\ngoal: warm\n", model)
    found = results(model, [case])["automatic/off/drop"]
    assert (found.status, found.skipped) == (MutantStatus.KILLED, 0)
    assert found.reason.startswith("no_orphan is violated")


@pytest.mark.slow
def test_the_suite_of_the_paper_kills_most_mutants() -> None:
    model = load_model(EXAMPLE / "after.yaml")
    written = load_suite([EXAMPLE / "cases"], model)
    found = results(model, [each.case for each in written])
    counts = MutantCounts.of(found.values())
    assert counts.total == len(found)
    assert counts.of_status(MutantStatus.KILLED) > counts.total / 2
    assert str(counts.score) == f"{100 * counts.of_status(MutantStatus.KILLED) / counts.total:.2f} %"
    assert found["robot_move_to_home/timedout/drop:robot_req_trigger <- false"].case == "delivery_against_all_odds"


def test_random_cases_kill_too() -> None:
    model = scan_cell()
    found = results(model, RandomCases(model).first(3, 0))
    assert found["scan_box/post.a/drop:box_is_scanned <- true"].case == "seed-0-case-1"
