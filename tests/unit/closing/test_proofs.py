"""Why no run visits an obligation, in one short sentence."""

from __future__ import annotations

import pytest

from scbm.closing.proofs.proofs import Proofs
from scbm.closing.runs.all_runs import AllRuns, CloseLimits
from scbm.model import BehaviorModel
from support.closings import obligation
from support.models import scan_cell

FOLLOWED = "all runs to the only goal were explored"


def _reason(model: BehaviorModel, name: str) -> str:
    proof = Proofs(model).by_runs(obligation(model, name), AllRuns(model, CloseLimits(), lambda _: None))
    assert proof is not None
    return proof.reason


@pytest.mark.parametrize(
    ("guard", "followed"),
    [
        ("", FOLLOWED),
        ("  again: box_is_scanned == true\n", "all runs to the 2 goals were explored"),
    ],
)
def test_no_situations_are_counted(guard: str, followed: str) -> None:
    odd = "automatic_transitions:\n  odd: {g: box_is_scanned == true && scan_req_trigger == true, a: [count += 1]}\n"
    model = scan_cell(("automatic_transitions:\n", odd), more=guard)
    assert _reason(model, "automatic/odd") == f"no run takes automatic/odd; {followed}"


def test_an_operation_that_never_ends_so_is_told_so() -> None:
    model = scan_cell(
        ("gr: scan_req_state == succeeded", "gr: scan_req_state == succeeded && scan_req_trigger == false")
    )
    assert _reason(model, "scan_box/completed") == f"scan_box executes, but it never completes; {FOLLOWED}"


def test_a_precondition_that_never_holds_is_told_so() -> None:
    model = scan_cell(("gr: light != red", "gr: scan_req_trigger == true"))
    told = f"scan_box becomes current, but its precondition never holds then; {FOLLOWED}"
    assert _reason(model, "scan_box/executing") == told
    assert _reason(model, "scan_box/failed") == told
