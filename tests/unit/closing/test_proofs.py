"""Why no run visits an obligation: each fact of the model file where it is so, and reasons in one short sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.cases.coverage import Obligations
from scbm.closing import Decision
from scbm.closing.proofs.proofs import (
    by_runs,
    explored_for_proofs,
    failing_transitions,
    scope_of_proofs,
    structural_facts,
)
from scbm.closing.runs.all_runs import AllRuns, CloseLimits
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel
from scbm.proofcheck import Fact, check_certificate
from support.closings import obligation
from support.models import scan_cell
from support.shared_closings import shared_closing
from support.wording import Wording

ROOT = Path(__file__).parents[3]

_FAILS = "a: [current.state <- failed, "


def _facts(*replacements: tuple[str, str]) -> list[tuple[str, Fact]]:
    return [(str(obligation), fact) for obligation, fact, _ in structural_facts(scan_cell(*replacements))]


@pytest.mark.parametrize("name", ["before", "after"])
def test_nothing_is_settled_by_the_structure_of_the_example(name: str) -> None:
    assert structural_facts(load_model(ROOT / f"examples/robot_in_the_air/{name}.yaml")) == ()


def test_without_a_deadline_nothing_times_out(wording: Wording) -> None:
    model = scan_cell(("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    ((obligation, fact, why),) = structural_facts(model)
    assert (str(obligation), fact) == ("scan_box/timedout", Fact.NO_DEADLINE)
    wording(why)


def test_what_nothing_fails_never_fails() -> None:
    assert _facts((_FAILS, "a: [")) == [("scan_box/failed", Fact.CANNOT_FAIL)]


@pytest.mark.parametrize("assigned", ["current.state", "scan_box.state"])
def test_an_automatic_transition_can_fail_an_operation_by_either_name(assigned: str) -> None:
    model = scan_cell((_FAILS, f"a: [{assigned} <- failed, "))
    assert failing_transitions(model.operations[0], model) == ("scan_failed",)
    assert structural_facts(model) == ()


def test_an_operation_can_fail_by_its_own_transition() -> None:
    own = "    failed: {name: gives_up, g: scan_req_state == failed}\n    timedout:"
    assert _facts((_FAILS, "a: ["), ("    timedout:", own)) == []


_PRE = (
    "g: scan_req_state == initial && scan_req_trigger == false && box_is_scanned == false\n      gr: light != red",
    "a: [scan_req_trigger <- true, scan_command <- scan_box]",
)


@pytest.mark.parametrize(
    ("guard", "actions", "always"),
    [
        ("g: true", "", True),
        ("g: light == red || light != red", "count <- 2", True),
        ("g: light == red\n      gr: light != red", "", False),
        ("g: light == red || light == blue", "", False),
        ("g: count <= 2\n      gr: temperature >= 0", "temperature <- count", True),
        ("g: true", "count <- temperature", False),
        ("g: true", "count += 1", False),
        ("g: scan_box.state in {initial, disabled}", "", False),
    ],
)
def test_a_precondition_that_always_holds_never_disables(guard: str, actions: str, always: bool) -> None:  # noqa: FBT001
    found = _facts((_PRE[0], guard), (_PRE[1], f"a: [{actions}]"))
    assert found == ([("scan_box/disabled", Fact.ALWAYS_ENABLED)] if always else [])


def _reason(model: BehaviorModel, name: str) -> str:
    proof = by_runs(obligation(model, name), AllRuns(model, CloseLimits(), lambda _: None))
    assert proof is not None
    return proof.reason


@pytest.mark.parametrize(
    "guard",
    [
        "",
        "  again: box_is_scanned == true\n",
    ],
)
def test_no_situations_are_counted(guard: str, wording: Wording) -> None:
    odd = "automatic_transitions:\n  odd: {g: box_is_scanned == true && scan_req_trigger == true, a: [count += 1]}\n"
    model = scan_cell(("automatic_transitions:\n", odd), more=guard)
    wording(_reason(model, "automatic/odd"))


def test_an_operation_that_never_ends_so_is_reported(wording: Wording) -> None:
    model = scan_cell(
        ("gr: scan_req_state == succeeded", "gr: scan_req_state == succeeded && scan_req_trigger == false")
    )
    wording(_reason(model, "scan_box/completed"))


def test_a_precondition_that_never_holds_is_reported(wording: Wording) -> None:
    model = scan_cell(("gr: light != red", "gr: scan_req_trigger == true"))
    assert _reason(model, "scan_box/executing") == _reason(model, "scan_box/failed")
    wording(_reason(model, "scan_box/executing"))


# runs that the limit of plans ends


TRIPS = """
behavior_model: trips
variables:
  at: {domain: [home, halfway, work], initial: home}
  fuel: {domain: 0..2, initial: 2}
operations:
  go: {pre: {g: at == home}, post: {g: true, a: [at <- work]}}
  rest: {pre: {g: at == halfway}, post: {g: true, a: [at <- work]}}
  burn: {pre: {g: fuel > 0}, post: {g: true, a: [fuel -= 1]}}
automatic_transitions:
  trip: {g: go.state == executing && at == home, a: [current.state <- failed, at <- halfway]}
  ends_halfway: {g: plan.state == aborted && at == halfway && fuel == FUEL, a: [at <- home]}
goals:
  work: at == work
  empty: fuel == 0
runs: {goals: single}
"""
"""A run is halfway only at the moment at which it requests another plan, where the limit of plans may end it. Canonical
plans to work burn no fuel before."""


@pytest.mark.parametrize(("fuel", "decision"), [(2, Decision.COVERED), (1, Decision.EXCLUDED)])
def test_an_end_by_the_limit_of_plans_is_no_proof_and_hides_none(fuel: int, decision: Decision) -> None:
    model = read_model(TRIPS.replace("FUEL", str(fuel)))
    closing = shared_closing(model)
    found = {str(each.obligation): each.decision for each in closing.decided}
    assert found["automatic/ends_halfway"] is decision
    assert Decision.UNDECIDED not in found.values()
    for _, certificate in closing.certificates:
        assert check_certificate(certificate, model) == ()


@pytest.mark.parametrize("situations", [1, 10_000])
def test_any_plans_are_not_explored_beyond_a_limit_that_canonical_plans_exceed(situations: int) -> None:
    model, limits = scan_cell(), CloseLimits(situations=situations)
    canonical = AllRuns(model, limits, lambda _: None, scope_of_proofs(model))
    explored: list[str] = []
    missing = sum(Obligations.of(model).bit(each) for each in Obligations.of(model))
    found = explored_for_proofs(model, limits, explored.append, missing & ~canonical.visited, (canonical,))
    assert bool(explored) is bool(found) is (canonical.stopped is None) is (situations > 1)
