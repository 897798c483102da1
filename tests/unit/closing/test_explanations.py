"""Reasons of decisions: the visit of a run, and the states that a proof explored."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.closing import Closing
from scbm.closing.explanations import SearchedRuns, explain, first_visit
from scbm.files import read_case, read_model
from scbm.proofcheck import GoalRuns, RunsArgument, Situation
from scbm.testing import Execution, Tester
from support.closings import closing_of, obligation
from support.models import scan_cell
from support.wording import Wording

CELL = scan_cell(("initial: 0}", "initial: 0, random: any}"))
PRESS = read_model("""
behavior_model: press
variables:
  stop: {domain: [released, pressed], initial: released}
  door: {domain: [closed, open], initial: closed, source: input}
  formed: {domain: bool, initial: false}
resources:
  ram: {simulation: {latency: 3 s}, shared: true}
operations:
  form:
    pre: {g: formed == false && ram_req_state == initial, gr: door == closed, a: [ram_req_trigger <- true]}
    post: {g: true, gr: ram_req_state == succeeded, a: [formed <- true, ram_req_trigger <- false]}
    failed: {g: stop == pressed, a: [ram_req_trigger <- false]}
goals: {formed: formed == true}
environment:
  press_stop: {guard: stop == released, actions: [stop <- pressed], after: 1 s}
""")
"""A cell with an input, an environment transition, and a shared resource."""


def _run(more: str = "") -> Execution:
    return Tester(CELL).execute(read_case(f"case: one\ngoal: scanned\n{more}", CELL))


def _wrong(more: str, name: str) -> tuple[str, ...]:
    visit = first_visit(_run(more), obligation(CELL, name), CELL)
    assert visit is not None
    return visit.wrong


def test_the_first_visit_has_its_moment_and_its_plan() -> None:
    execution = _run("outcomes: {scan: [timeout, timeout]}\n")
    visit = first_visit(execution, obligation(CELL, "scan_box/timedout"), CELL)
    assert visit is not None
    assert (visit.at_ns, visit.plan) == (10_000_000_000, ("scan_box",))
    assert execution.trace.records[visit.record].at_ns == visit.at_ns
    assert first_visit(execution, obligation(CELL, "scan_box/failed"), CELL) is None


def test_what_goes_wrong_is_reported_until_the_visit(wording: Wording) -> None:
    outcomes = "outcomes: {scan: [fail, timeout, succeed]}\n"
    assert _wrong(outcomes, "scan_box/executing") == ()
    first, both = _wrong(outcomes, "scan_box/failed"), _wrong(outcomes, "scan_box/timedout")
    assert both[:1] == first
    assert _wrong(outcomes, "scan_box/completed") == both
    wording(both)


def test_injections_resources_and_messages_are_reported(wording: Wording) -> None:
    injection = "injections: [{name: waits, when: current.name == scan_box, set: {light: red}, hold: 1 s}]\n"
    wording(_wrong(injection, "scan_box/disabled"))
    dead = "injections: [{name: dies, resource: scan, becomes: dead, hold: 1 s}]\n"
    wording(_wrong(dead, "scan_box/timedout"))
    lost = "outcomes: {scan: [{request: lost}]}\n"
    wording(_wrong(lost, "scan_box/timedout"))


def _events(more: str, name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The faults, and the changes from outside, before a case visits an obligation of the press."""
    execution = Tester(PRESS).execute(read_case(f"case: one\ngoal: formed\n{more}", PRESS))
    visit = first_visit(execution, obligation(PRESS, name), PRESS)
    assert visit is not None
    return visit.wrong, visit.outside


def test_changes_of_inputs_are_no_faults(wording: Wording) -> None:
    door = "injections: [{name: visitor, set: {door: open}, hold: 5 s}]\n"
    wrong, outside = _events(door, "form/executing")
    assert wrong == ()
    wording(outside)
    wrong, outside = _events("environment: [{at: 1 s, set: {stop: pressed}, by: press_stop}]\n", "form/failed")
    assert wrong == ()
    wording(outside)
    wrong, outside = _events("environment: [{at: 1 s, set: {door: open}}]\n", "form/completed")
    assert wrong == ()
    wording(outside)


def test_another_user_of_a_shared_resource_is_no_fault(wording: Wording) -> None:
    occupied = "injections: [{name: other_cell, resource: ram, becomes: occupied, hold: 5 s}]\n"
    wrong, outside = _events(occupied, "form/executing")
    assert wrong == ()
    wording(outside)


def test_a_change_that_forces_the_state_is_a_fault_and_so_is_all_that_follows_it() -> None:
    opened = "{name: opens, when: current.name == form, set: {door: open}}"
    forced = f"injections: [{opened}, {{name: closes, at: 5 s, set: {{door: closed}}}}]\n"
    wrong, outside = _events(forced, "form/executing")
    assert ([words.split()[1] for words in wrong], outside) == (["opens", "closes"], ())


def _with_runs(closing: Closing) -> Closing:
    ((name, certificate),) = closing.certificates
    argument = RunsArgument((), (GoalRuns("scanned", (Situation((), None, ()),) * 5),))
    return replace(closing, certificates=((name, replace(certificate, argument=argument)),))


def test_a_proof_about_all_runs_says_what_it_looked_at() -> None:
    asked = [obligation(CELL, "scan_box/failed")]
    (explanation,) = explain(_with_runs(closing_of(CELL)), asked, {})
    assert explanation.searched == SearchedRuns(initial_states=3, goals=1, situations=5)
    (explanation,) = explain(closing_of(CELL), asked, {})
    assert explanation.searched is None, "its certificate lists no runs"


@pytest.mark.slow
def test_initial_states_are_counted_up_to_a_limit() -> None:
    many = scan_cell(
        ("0..9, initial: 5}", "0..60000, initial: 5, random: any}"),
        ("0..2, initial: 0}", "0..2, initial: 0, random: any}"),
    )
    (explanation,) = explain(_with_runs(closing_of(many)), [obligation(many, "scan_box/failed")], {})
    assert explanation.searched == SearchedRuns(initial_states=None, goals=1, situations=5)


def test_explanations_come_in_the_order_of_the_model() -> None:
    names = ["automatic/scan_failed", "scan_box/failed", "scan_box/queued", "scan_box/disabled"]
    shown = explain(closing_of(CELL), [obligation(CELL, name) for name in names], {})
    ordered = ["scan_box/disabled", "scan_box/failed", "automatic/scan_failed", "scan_box/queued"]
    assert [str(each.decided.obligation) for each in shown] == ordered
