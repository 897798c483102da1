"""Doubts about request protocols by hand: each line of the paper's listing that is missing is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.closing.advice.handshake_doubts import doubts_about_handshakes
from scbm.closing.advice.model_check import check_model
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, Slug
from support.models import scan_cell
from support.wording import Wording

ROOT = Path(__file__).parents[4]
MODELS = sorted(
    (
        *(ROOT / "examples").glob("*/*.yaml"),
        *(ROOT / "study").glob("models/*.yaml"),
        *(ROOT / "tests/models/valid").glob("*.yaml"),
    )
)

PRE = ("operations", "scan_box", "pre")
POST = ("operations", "scan_box", "post")
FAILED = ("automatic_transitions", "scan_failed")
OPERATION_FAILS = (
    "    failed: {g: scan_req_state == failed, a: [scan_req_state <- initial, scan_req_trigger <- false]}\n"
)
BEHIND_DEADLINE = "    deadline: 10 seconds\n"


def _paths(model: BehaviorModel) -> list[tuple[str | int, ...]]:
    return [doubt.path for doubt in doubts_about_handshakes(model)]


@pytest.mark.parametrize(
    ("line", "instead", "path"),
    [
        ("scan_req_state == initial && ", "", (*PRE, "g")),
        ("scan_req_state == initial && scan_req_trigger == false && ", "", (*PRE, "g")),
        ("scan_req_trigger <- true, ", "", (*PRE, "a")),
        ("      gr: scan_req_state == succeeded\n", "", (*POST, "gr")),
        ("[scan_req_state <- initial, scan_req_trigger <- false, box", "[scan_req_trigger <- false, box", (*POST, "a")),
        ("[current.state <- failed, ", "[", FAILED),
        ("failed, scan_req_state <- initial, ", "failed, ", FAILED),
    ],
)
def test_a_missing_line_is_named(line: str, instead: str, path: tuple[str, ...], wording: Wording) -> None:
    model = scan_cell((line, instead))
    assert _paths(model) == [path]
    (doubt,) = (found for found in check_model(model).doubts if found.slug is Slug.HANDSHAKE_INCOMPLETE)
    wording(f"{doubt.message}; {doubt.remedy}")


def test_a_failure_of_any_operation_that_leaves_the_trigger_is_named(wording: Wording) -> None:
    cleared = "current.state <- failed, robot_req_state <- initial, robot_req_trigger <- false"
    text = (ROOT / "examples/robot_in_the_air/after.yaml").read_text(encoding="utf-8")
    assert cleared in text
    model = read_model(text.replace(cleared, cleared.removesuffix(", robot_req_trigger <- false")))
    (doubt,) = doubts_about_handshakes(model)
    assert doubt.path == ("automatic_transitions", "robot_failed")
    wording(f"{doubt.message}; {doubt.remedy}")


@pytest.mark.parametrize(
    ("line", "key"),
    [("robot_req_trigger == false\n        && ", "g"), (", robot_command <- mount_scanner", "a")],
)
def test_what_only_one_operation_of_a_resource_lacks_is_named(line: str, key: str, wording: Wording) -> None:
    text = (ROOT / "examples/robot_in_the_air/after.yaml").read_text(encoding="utf-8")
    before, name, rest = text.partition("  robot_mount_scanner:\n")
    assert line in rest
    (doubt,) = doubts_about_handshakes(read_model(before + name + rest.replace(line, "", 1)))
    assert doubt.path == ("operations", "robot_mount_scanner", "pre", key)
    wording(f"{doubt.message}; {doubt.remedy}")


def test_what_several_operations_lack_is_meant() -> None:
    text = (ROOT / "examples/robot_in_the_air/after.yaml").read_text(encoding="utf-8")
    assert not _paths(read_model(text.replace("robot_req_trigger == false\n        && ", "")))
    assert not _paths(read_model(text.replace("robot_command <- mount_scanner", "robot_command <- robot_command")))


@pytest.mark.parametrize(("line", "path"), [("scan_req_state <- initial, ", (*PRE[:2], "failed"))])
def test_a_failed_transition_of_an_operation_is_doubted_alike(line: str, path: tuple[str, ...]) -> None:
    assert not _paths(scan_cell((BEHIND_DEADLINE, BEHIND_DEADLINE + OPERATION_FAILS)))
    other = ("automatic_transitions:", "automatic_transitions:\n  abort: {g: count == 2, a: [plan.state <- aborted]}")
    by_hand = ("    a: [current.state <- failed, scan_req_state <- initial, scan_req_trigger <- false]\n", "")
    rest = ("  scan_failed:\n    g: scan_req_state == failed && current.state == executing\n", "")
    faulty = (BEHIND_DEADLINE, BEHIND_DEADLINE + OPERATION_FAILS.replace(line, ""))
    assert _paths(scan_cell(faulty, other, by_hand, rest)) == [path]


@pytest.mark.parametrize(
    "reset",
    [
        "{g: scan_req_state == succeeded && current.state == initial, a: [scan_req_state <- initial]}",
        "{g: scan_req_trigger == false && scan_req_state != initial, a: [scan_req_state <- initial]}",
    ],
)
def test_another_transition_may_reset_the_state(reset: str) -> None:
    line = "[scan_req_state <- initial, scan_req_trigger <- false, box", "[scan_req_trigger <- false, box"
    tidy = ("automatic_transitions:", f"automatic_transitions:\n  tidy: {reset}")
    assert _paths(scan_cell(line)) == [(*POST, "a")]
    assert not _paths(scan_cell(line, tidy))


def test_an_operation_that_only_starts_something_is_no_handshake() -> None:
    reply = ("      gr: scan_req_state == succeeded\n", "")
    ended = ("a: [scan_req_state <- initial, scan_req_trigger <- false, box_is", "a: [box_is")
    assert not _paths(scan_cell(reply, ended))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_whole_protocols_and_other_protocols_raise_no_doubt(path: Path) -> None:
    assert not _paths(load_model(path))


CELL = """behavior_model: cell
variables: {{a: {{domain: 0..3, initial: 0}}}}
resources: {{arm: {{}}}}
operations: {{o: {{request: arm, effects: [a <- 1], deadline: 5 s}}}}
automatic_transitions: {{{name}: {{g: {guard}, a: [{actions}]}}}}
goals: {{d: a == 1}}
"""
FAIL, RESET, CLEAR = "current.state <- failed", "arm_req_state <- initial", "arm_req_trigger <- false"
TAKEN = "arm_req_state == failed && current.state == executing"


@pytest.mark.parametrize(
    ("guard", "actions", "found"),
    [
        (TAKEN, [FAIL, RESET, CLEAR], []),
        ("a == 0", [FAIL, RESET, CLEAR], ["takes none"]),
        (TAKEN, [RESET, CLEAR], ["goes on waiting"]),
        (TAKEN, [FAIL, CLEAR], ["stays occupied"]),
        ("arm_req_state == failed", [RESET], ["goes on waiting", "sent again at once"]),
        (TAKEN, ["a <- 2"], ["goes on waiting", "stays occupied", "sent again at once"]),
    ],
)
def test_a_transition_that_replaces_the_generated_one_needs_all_its_lines(
    guard: str, actions: list[str], found: list[str]
) -> None:
    model = read_model(CELL.format(name="arm_failed", guard=guard, actions=", ".join(actions)))
    doubts = list(doubts_about_handshakes(model))
    assert [(doubt.path, end) for doubt, end in zip(doubts, found, strict=True)] == [
        (("automatic_transitions", "arm_failed"), end) for end in found
    ]
    assert all(doubt.message.endswith(end) for doubt, end in zip(doubts, found, strict=True))


def test_the_cleared_trigger_of_a_replaced_failure_is_checked_with_other_requests() -> None:
    model = read_model(CELL.format(name="arm_failed", guard=TAKEN, actions=f"{FAIL}, {RESET}"))
    assert [doubt.slug for doubt in check_model(model).doubts] == [Slug.REQUEST_NOT_CLEARED]


def test_a_transition_with_another_name_replaces_nothing() -> None:
    assert not _paths(read_model(CELL.format(name="arm_tidied", guard="a == 3", actions=FAIL)))
