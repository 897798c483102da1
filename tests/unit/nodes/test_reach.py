"""Cases that ask for what a tester cannot bring about, as resources are real."""

from __future__ import annotations

import pytest

from scbm.files import read_bindings, read_case
from scbm.nodes import beyond_reach
from support.models import scan_cell
from support.wording import Wording

MODEL = scan_cell(
    ("  scan_command: {", "  lamp_command: {domain: [none, shine], initial: none}\n  scan_command: {"),
    ("resources:\n", "resources:\n  lamp: {request: [lamp_command]}\n"),
)


@pytest.mark.parametrize(
    ("more", "is_beyond"),
    [
        ("", False),
        ("outcomes: {lamp: fail}", False),
        ("outcomes: {scan: fail}", True),
        ("outcomes: {scan_box: fail}", True),
        ("network: {loss: 2 %}", False),
        ("network: {restarts: [{resource: lamp, at: 1 s, for: 1 s}]}", False),
        ("network: {restarts: [{resource: scan, at: 1 s, for: 1 s}]}", True),
        ("network: {partitions: [{resource: scan, at: 1 s, for: 1 s}]}", True),
    ],
)
def test_a_case_may_say_nothing_of_a_resource_that_is_real(more: str, *, is_beyond: bool, wording: Wording) -> None:
    case = read_case(f"case: x\ngoal: scanned\ndrawn: {{seed: 1}}\n{more}\n", MODEL)
    why = beyond_reach(case, MODEL, ["scan"])
    assert (why is not None) == is_beyond
    if why is not None:
        wording(why)
    assert beyond_reach(case, MODEL, []) is None


OPEN = read_bindings(
    "bindings_of: scan_cell\nresources: {door: {measured: {light: {topic: /light, type: std_msgs/msg/String}}}}\n",
    scan_cell(
        ("resources:\n", "resources:\n  lamp: {publishes: [count]}\n  door: {}\n"),
        more="environment: {heats: {guard: true, actions: [temperature += 1]}}\n",
        is_open=True,
    ),
)


@pytest.mark.parametrize(
    ("environment", "real", "is_beyond"),
    [
        ("[{at: 1 s, set: {count: 1}}]", ["door", "scan"], False),
        ("[{at: 1 s, set: {count: 1}}]", ["lamp"], True),
        ("[{at: 1 s, set: {light: red}}]", ["lamp", "scan"], False),
        ("[{at: 1 s, set: {light: red}}]", ["door"], True),
        ("[{at: 1 s, set: {}}]", ["lamp", "door", "scan"], False),
        ("[{at: 1 s, by: heats}, {at: 2 s, set: {temperature: 7}}]", ["lamp", "door", "scan"], False),
    ],
)
def test_a_case_does_not_change_what_a_real_driver_sends_unasked(
    environment: str, real: list[str], wording: Wording, *, is_beyond: bool
) -> None:
    case = read_case(f"case: x\ngoal: scanned\nenvironment: {environment}\n", OPEN)
    why = beyond_reach(case, OPEN, real)
    assert (why is not None) == is_beyond
    if why is not None:
        wording(why)


def test_nor_by_an_environment_transition(wording: Wording) -> None:
    publishes = ("measures: [temperature]", "measures: [temperature]\n    publishes: [temperature]")
    model = scan_cell(publishes, more="environment: {heats: {guard: true, actions: [temperature += 1]}}\n")
    case = read_case("case: x\ngoal: scanned\nenvironment: [{at: 1 s, by: heats}]\n", model)
    assert beyond_reach(case, model, []) is None
    wording(beyond_reach(case, model, ["scan"]))


@pytest.mark.parametrize("network", ["{latency: 1 ms}", "{jitter: 1 ms}", "{partitions: [{at: 1 s, for: 1 s}]}"])
def test_faults_of_the_network_need_a_resource_that_is_simulated(network: str, wording: Wording) -> None:
    case = read_case(f"case: x\ngoal: scanned\ndrawn: {{seed: 1}}\nnetwork: {network}\n", MODEL)
    assert beyond_reach(case, MODEL, ["scan"]) is None
    why = beyond_reach(case, MODEL, ["lamp", "scan"])
    assert why is not None
    wording(why)
