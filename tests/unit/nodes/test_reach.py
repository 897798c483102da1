"""Cases that ask for what a tester cannot bring about, as resources are real."""

from __future__ import annotations

import pytest

from scbm.files import read_case
from scbm.nodes import beyond_reach
from support.models import scan_cell

MODEL = scan_cell(
    ("  scan_command: {", "  lamp_command: {domain: [none, shine], initial: none}\n  scan_command: {"),
    ("resources:\n", "resources:\n  lamp: {request: [lamp_command]}\n"),
)
SAID = "says what becomes of `scan`, which is real"
FAULTS = "has faults of the network, and no resource is simulated that could carry them out"


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ("", None),
        ("outcomes: {lamp: fail}", None),
        ("outcomes: {scan: fail}", SAID),
        ("outcomes: {scan_box: fail}", SAID),
        ("network: {loss: 2 %}", None),
        ("network: {restarts: [{resource: lamp, at: 1 s, for: 1 s}]}", None),
        ("network: {restarts: [{resource: scan, at: 1 s, for: 1 s}]}", SAID),
        ("network: {partitions: [{resource: scan, at: 1 s, for: 1 s}]}", SAID),
    ],
)
def test_a_case_may_say_nothing_of_a_resource_that_is_real(more: str, why: str | None) -> None:
    case = read_case(f"case: x\ngoal: scanned\ndrawn: {{seed: 1}}\n{more}\n", MODEL)
    assert beyond_reach(case, MODEL, ["scan"]) == why
    assert beyond_reach(case, MODEL, []) is None


@pytest.mark.parametrize("network", ["{latency: 1 ms}", "{jitter: 1 ms}", "{partitions: [{at: 1 s, for: 1 s}]}"])
def test_faults_of_the_network_need_a_resource_that_is_simulated(network: str) -> None:
    case = read_case(f"case: x\ngoal: scanned\ndrawn: {{seed: 1}}\nnetwork: {network}\n", MODEL)
    assert beyond_reach(case, MODEL, ["scan"]) is None
    assert beyond_reach(case, MODEL, ["lamp", "scan"]) == FAULTS
