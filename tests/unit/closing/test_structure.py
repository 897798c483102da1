"""Facts of the model file: each is found where it is so, and only there."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.closing.proofs.structural_facts import failing_transitions, structural_facts
from scbm.files import load_model
from scbm.proofcheck import Fact
from support.models import scan_cell

ROOT = Path(__file__).parents[3]

_FAILS = "a: [current.state <- failed, "


def _facts(*replacements: tuple[str, str]) -> list[tuple[str, Fact]]:
    return [(str(obligation), fact) for obligation, fact, _ in structural_facts(scan_cell(*replacements))]


@pytest.mark.parametrize("name", ["before", "after"])
def test_nothing_is_settled_by_the_structure_of_the_example(name: str) -> None:
    assert structural_facts(load_model(ROOT / f"examples/robot_in_the_air/{name}.yaml")) == ()


def test_without_a_deadline_nothing_times_out() -> None:
    model = scan_cell(("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    assert [(str(o), fact, why) for o, fact, why in structural_facts(model)] == [
        ("scan_box/timedout", Fact.NO_DEADLINE, "scan_box has no `deadline`, so it never times out")
    ]


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
