"""Doubts about request protocols by hand: each line of the paper's listing that is missing is named."""

from __future__ import annotations

import re
from itertools import chain
from pathlib import Path

import pytest

from scbm.closing.advice.handshake_doubts import doubts_about_handshakes
from scbm.closing.advice.model_check import check_model
from scbm.closing.advice.request_doubts import doubts_about_requests
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, Slug
from support.models import scan_cell
from support.profiles import longer_but_one_in
from support.wording import Wording

ROOT = Path(__file__).parents[4]
DOCKING = ROOT / "tests/models/valid/docking_retry.yaml"
MODELS = sorted(
    path
    for path in (
        *(ROOT / "examples").glob("*/*.yaml"),
        *(ROOT / "study").glob("models/*.yaml"),
        *(ROOT / "tests/models/valid").glob("*.yaml"),
    )
    if path != DOCKING
)

PAPER = (ROOT / "examples/robot_in_the_air/after.yaml").read_text(encoding="utf-8")
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
        (" && scan_req_trigger == false", "", (*PRE, "g")),
        (", scan_command <- scan_box", "", (*PRE, "a")),
        (" && current.state == executing", "", (*FAILED, "g")),
    ],
)
def test_a_missing_line_is_named(line: str, instead: str, path: tuple[str, ...], wording: Wording) -> None:
    model = scan_cell((line, instead))
    assert _paths(model) == [path]
    (doubt,) = (found for found in check_model(model).doubts if found.slug is Slug.HANDSHAKE_INCOMPLETE)
    wording(f"{doubt.message}; {doubt.remedy}")


def test_a_failure_of_any_operation_that_leaves_the_trigger_is_named(wording: Wording) -> None:
    cleared = "current.state <- failed, robot_req_state <- initial, robot_req_trigger <- false"
    assert cleared in PAPER
    model = read_model(PAPER.replace(cleared, cleared.removesuffix(", robot_req_trigger <- false")))
    (doubt,) = doubts_about_handshakes(model)
    assert doubt.path == ("automatic_transitions", "robot_failed")
    wording(f"{doubt.message}; {doubt.remedy}")


@pytest.mark.parametrize(
    ("line", "key"),
    [("robot_req_trigger == false\n        && ", "g"), (", robot_command <- mount_scanner", "a")],
)
def test_what_only_one_operation_of_a_resource_lacks_is_named(line: str, key: str, wording: Wording) -> None:
    before, name, rest = PAPER.partition("  robot_mount_scanner:\n")
    assert line in rest
    (doubt,) = doubts_about_handshakes(read_model(before + name + rest.replace(line, "", 1)))
    assert doubt.path == ("operations", "robot_mount_scanner", "pre", key)
    wording(f"{doubt.message}; {doubt.remedy}")


def test_a_line_that_all_operations_lack_is_named_for_each() -> None:
    model = read_model(PAPER.replace("robot_req_trigger == false\n        && ", ""))
    robot = [each.name for each in model.operations if "robot_req_state" in each.post.running_guard.reads()]
    assert _paths(model) == [("operations", name, "pre", "g") for name in robot]


# the example of the paper, without one line


def _without(line: str, entry: str) -> BehaviorModel:
    """Return the model of the paper without the first text that matches `line` in an entry of the file."""
    before, head, rest = PAPER.partition(f"  {entry}:\n")
    changed, count = re.subn(line, "", rest, count=1)
    assert count == 1
    return read_model(before + head + changed)


def _found(model: BehaviorModel) -> list[tuple[Slug, tuple[str | int, ...]]]:
    doubts = chain(doubts_about_requests(model), doubts_about_handshakes(model))
    return [(doubt.slug, doubt.path) for doubt in doubts]


@pytest.mark.parametrize(
    ("resource", "operation"),
    [
        ("scanner", "scanner_scan_item_a"),
        ("gantry", "gantry_move_to_box_a"),
        pytest.param("gantry", "gantry_move_to_agv", marks=pytest.mark.slow),
        pytest.param("robot", "robot_move_to_home", marks=pytest.mark.slow),
        ("robot", "place_item_a"),
    ],
    ids=["alone", "first_of_two", "second_of_two", "first_of_eleven", "last_of_eleven"],
)
@pytest.mark.parametrize(
    ("line", "slug", "key"),
    [
        ("{0}_req_state == initial && ", Slug.HANDSHAKE_INCOMPLETE, ("pre", "g")),
        (" && {0}_req_trigger == false", Slug.HANDSHAKE_INCOMPLETE, ("pre", "g")),
        ("{0}_req_trigger <- true, ", Slug.HANDSHAKE_INCOMPLETE, ("pre", "a")),
        (r", {0}_command <- \w+", Slug.HANDSHAKE_INCOMPLETE, ("pre", "a")),
        ("      gr: {0}_req_state == succeeded\n", Slug.HANDSHAKE_INCOMPLETE, ("post", "gr")),
        ("{0}_req_state <- initial, ", Slug.HANDSHAKE_INCOMPLETE, ("post", "a")),
        ("(?<=initial, ){0}_req_trigger <- false, ", Slug.REQUEST_NOT_CLEARED, ("post",)),
        (r"(?<=timedout: \[){0}_req_trigger <- false", Slug.REQUEST_NOT_CLEARED, ("timedout",)),
    ],
)
def test_each_line_of_an_operation_is_missed(
    line: str, slug: Slug, key: tuple[str, ...], resource: str, operation: str
) -> None:
    line = line.format(resource) + (", " if line.startswith("(?<=timedout") and resource == "scanner" else "")
    assert _found(_without(line, operation)) == [(slug, ("operations", operation, *key))]


@pytest.mark.parametrize("resource", ["scanner", "gantry", "robot"])
@pytest.mark.parametrize(
    ("line", "key"),
    [
        ("{0}_req_state == failed && ", ()),
        (" && current.state == executing", ("g",)),
        ("current.state <- failed, ", ()),
        ("{0}_req_state <- initial, ", ()),
        (", {0}_req_trigger <- false", ()),
    ],
)
def test_each_line_of_a_transition_for_failed_replies_is_missed(line: str, key: tuple[str, ...], resource: str) -> None:
    path = ("automatic_transitions", f"{resource}_failed", *key)
    model = _without(line.format(resource), f"{resource}_failed")
    assert _found(model) == [(Slug.HANDSHAKE_INCOMPLETE, path)]


# values that requests carry

ONE_COMMAND = "scan_command <- scan_box"
SENT_BY_ANOTHER = """  scan_lid:
    pre:
      g: scan_req_state == initial && scan_req_trigger == false
      a: [scan_req_trigger <- true, scan_command <- none]
    post: {g: true, gr: scan_req_state == succeeded, a: [scan_req_state <- initial, scan_req_trigger <- false]}
automatic_transitions:
"""
CHOSEN = "automatic_transitions:\n  choose: {g: count == 0 && light == blue, a: [scan_command <- scan_box]}\n"
RESET = "automatic_transitions:\n  reset: {g: count == 1, a: [scan_command <- none]}\n"
MOVED = "environment: {choose: {guard: light == blue, actions: [scan_command <- scan_box]}}\n"
COMMAND = "scan_command: {domain: [none, scan_box], initial: none"


@pytest.mark.parametrize("another", [(), (("automatic_transitions:\n", SENT_BY_ANOTHER),)], ids=["alone", "two"])
@pytest.mark.parametrize(
    ("replacements", "more", "found"),
    [
        ([], "", [(*PRE, "a")]),
        ([("automatic_transitions:\n", RESET)], "", [(*PRE, "a")]),
        ([("box_is_scanned <- true]", "box_is_scanned <- true, scan_command <- none]")], "", [(*PRE, "a")]),
        ([("automatic_transitions:\n", CHOSEN)], "", []),
        ([(COMMAND, f"{COMMAND}, source: input")], "", []),
        ([("== false && box", "== false && scan_command == scan_box && box")], "", []),
        ([("measures: [temperature]", "measures: [temperature, scan_command]")], "", []),
        ([("measures: [temperature]", "publishes: [temperature, scan_command]")], "", []),
        ([], MOVED, []),
    ],
    ids=["nothing", "reset", "reset_after", "chosen", "input", "guard", "measured", "published", "environment"],
)
def test_a_value_that_no_line_says_is_doubted_unless_it_is_meant(
    replacements: list[tuple[str, str]],
    more: str,
    found: list[tuple[str | int, ...]],
    another: tuple[tuple[str, str], ...],
) -> None:
    model = scan_cell((f", {ONE_COMMAND}", ""), *another, *replacements, more=more)
    assert _paths(model) == found


@pytest.mark.parametrize("declared", ["source: constant", "random: any"])
def test_a_value_that_never_changes_may_be_meant(declared: str) -> None:
    assert not _paths(scan_cell((f", {ONE_COMMAND}", ""), (COMMAND, f"{COMMAND}, {declared}")))
    assert not _paths(scan_cell((f", {ONE_COMMAND}", ""), (COMMAND, "scan_command: {domain: [none], initial: none")))


def test_a_value_of_a_request_that_an_automatic_transition_sends_is_no_value_for_others() -> None:
    sends = (
        "automatic_transitions:\n  again: {g: light == blue, a: [scan_req_trigger <- true, scan_command <- scan_box]}"
    )
    assert _paths(scan_cell((f", {ONE_COMMAND}", ""), ("automatic_transitions:", sends))) == [(*PRE, "a")]


def test_a_condition_that_all_operations_have_decides_no_value() -> None:
    free = ("scan_req_trigger == false", "scan_req_trigger == false && scan_command == none")
    another = ("automatic_transitions:\n", SENT_BY_ANOTHER)
    assert _paths(scan_cell((f", {ONE_COMMAND}", ""), another, free)) == [(*PRE, "a")]


def test_a_value_that_no_operation_says_is_doubted_once(wording: Wording) -> None:
    another = ("automatic_transitions:\n", SENT_BY_ANOTHER.replace(", scan_command <- none", ""))
    (doubt,) = doubts_about_handshakes(scan_cell((f", {ONE_COMMAND}", ""), another))
    assert doubt.path == ("variables", "scan_command")
    wording(f"{doubt.message}; {doubt.remedy}")


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


def _docking(*replacements: tuple[str, str]) -> list[tuple[str | int, ...]]:
    text = DOCKING.read_text(encoding="utf-8")
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return _paths(read_model(text))


WAITS = "gr: docker_req_state != failed"
FREE = "docker_req_state == initial && docker_req_trigger == false"
CLEARED = (", docker_req_trigger <- false]\n    failed", "]\n    failed")
LATER = "y: {g: dock.state == executing, a: [m <- true]}"
AUTOMATIC = "goals:\n  docked"


@pytest.mark.parametrize(
    "replacements",
    [
        (),
        ((WAITS, "gr: docker_req_state in {initial, executing, succeeded}"),),
        ((WAITS, "gr: docker_req_state == executing"),),
        ((WAITS, "gr: docker_req_trigger == true -> docked == false"),),
        (("g: true\n", "g: docker_req_state != failed\n"), (WAITS, "gr: true")),
        ((f" && {FREE}", ""), (WAITS, "gr: docked == false")),
        (("docked <- true, docker_req_state <- initial", "docked <- true"),),
        (
            (
                AUTOMATIC,
                f"automatic_transitions:\n  x: {{g: docker_req_state == failed, a: [docked <- false]}}\n{AUTOMATIC}",
            ),
        ),
    ],
)
def test_a_request_that_is_cancelled_in_the_instant_in_which_it_is_sent_is_named(
    replacements: tuple[tuple[str, str], ...], wording: Wording
) -> None:
    assert _docking(*replacements) == [("operations", "dock", "post", "gr")]
    if not replacements:
        (doubt,) = doubts_about_handshakes(load_model(DOCKING))
        wording(f"{doubt.message}; {doubt.remedy}")


@pytest.mark.parametrize(
    "replacements",
    [
        ((WAITS, "gr: docker_req_state == succeeded"),),
        ((WAITS, "gr: docker_req_state in {succeeded, failed}"),),
        ((WAITS, "gr: docker_req_state != executing"),),
        ((WAITS, "gr: docked == true || docker_req_state == succeeded"),),
        (CLEARED,),
        # An automatic transition makes the postcondition false before it is evaluated.
        (
            (WAITS, "gr: docked == false"),
            (
                AUTOMATIC,
                f"automatic_transitions:\n  x: {{g: dock.state == executing, a: [docked <- true]}}\n{AUTOMATIC}",
            ),
        ),
        # It may do so, by way of another one.
        (
            (WAITS, "gr: docked == false"),
            ("variables:\n", "variables:\n  m: {domain: bool, initial: false}\n"),
            (
                AUTOMATIC,
                f"automatic_transitions:\n  x: {{g: m == true, a: [docked <- true]}}\n  {LATER}\n{AUTOMATIC}",
            ),
        ),
    ],
)
def test_an_operation_that_may_wait_for_its_reply_is_not_named(replacements: tuple[tuple[str, str], ...]) -> None:
    assert ("operations", "dock", "post", "gr") not in _docking(*replacements)


@pytest.mark.parametrize("path", longer_but_one_in(3, MODELS), ids=lambda path: f"{path.parent.name}/{path.stem}")
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
        ("arm_req_state == failed", [RESET], ["no operation executes", "goes on waiting", "sent again at once"]),
        (TAKEN, ["a <- 2"], ["goes on waiting", "stays occupied", "sent again at once"]),
    ],
)
def test_a_transition_that_replaces_the_generated_one_needs_all_its_lines(
    guard: str, actions: list[str], found: list[str]
) -> None:
    model = read_model(CELL.format(name="arm_failed", guard=guard, actions=", ".join(actions)))
    doubts = list(doubts_about_handshakes(model))
    assert {doubt.path[:2] for doubt in doubts} <= {("automatic_transitions", "arm_failed")}
    assert all(doubt.message.endswith(end) for doubt, end in zip(doubts, found, strict=True))


def test_the_cleared_trigger_of_a_replaced_failure_is_checked_with_other_requests() -> None:
    model = read_model(CELL.format(name="arm_failed", guard=TAKEN, actions=f"{FAIL}, {RESET}"))
    assert [doubt.slug for doubt in check_model(model).doubts] == [Slug.REQUEST_NOT_CLEARED]


def test_an_automatic_transition_may_be_called_failed() -> None:
    model = read_model(CELL.format(name="failed", guard=TAKEN, actions=f"{RESET}, {CLEAR}"))
    (doubt,) = doubts_about_handshakes(model)
    assert doubt.path == ("automatic_transitions", "failed")


def test_a_transition_with_another_name_replaces_nothing() -> None:
    assert not _paths(read_model(CELL.format(name="arm_tidied", guard="a == 3", actions=FAIL)))
