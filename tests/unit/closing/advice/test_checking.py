"""Doubts about models that load: each kind is raised where it is due, and not where it is not."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.closing.advice import Doubt, check_model
from scbm.files import load_model
from scbm.model import Slug
from support.models import scan_cell

ROOT = Path(__file__).parents[4]


def _doubts(*replacements: tuple[str, str], more: str = "") -> list[Doubt]:
    """What is doubtful about the scanning cell with some texts replaced, but for the variables that it only has
    for other tests."""
    doubts = check_model(scan_cell(*replacements, more=more)).doubts
    return [doubt for doubt in doubts if doubt.path not in (("variables", "count"), ("variables", "temperature"))]


@pytest.mark.parametrize("name", ["before", "after"])
def test_the_example_raises_no_doubt(name: str) -> None:
    checked = check_model(load_model(ROOT / f"examples/robot_in_the_air/{name}.yaml"))
    assert checked.doubts == ()
    assert (checked.initial_states, checked.complete) == (12, True)
    assert checked.reachable == {"before": 190, "after": 152}[name]


def test_a_good_model_raises_no_doubt() -> None:
    assert _doubts() == []


@pytest.mark.parametrize(
    ("replacement", "slug", "path"),
    [
        (
            ("gr: light != red", "gr: light == green && light == blue"),
            Slug.GUARD_NEVER_HOLDS,
            ("operations", "scan_box", "pre", "gr"),
        ),
        (
            ("g: true\n      gr: scan_req_state == succeeded", "g: light == green\n      gr: light == red"),
            Slug.GUARD_NEVER_HOLDS,
            ("operations", "scan_box", "post", "gr"),
        ),
        (
            ("scanned: box_is_scanned == true", "scanned: count == 1 && count == 2"),
            Slug.GUARD_NEVER_HOLDS,
            ("goals", "scanned"),
        ),
        (
            ("g: scan_req_state == failed &&", "g: scan_req_state == failed && scan_req_state == succeeded &&"),
            Slug.GUARD_NEVER_HOLDS,
            ("automatic_transitions", "scan_failed", "g"),
        ),
        (
            ("&& box_is_scanned == false", "&& box_is_scanned == true"),
            Slug.OPERATION_NEVER_ENABLED,
            ("operations", "scan_box", "pre", "g"),
        ),
        (("scanned: box_is_scanned == true", "scanned: light == red"), Slug.GOAL_UNREACHABLE, ("goals", "scanned")),
        (
            ("initial: green}", "initial: green, random: any}"),
            None,
            (),
        ),
        (
            ("box_is_scanned <- true]", "box_is_scanned <- true, count += 2]"),
            None,
            (),
        ),
        (
            ("box_is_scanned == false\n", "count != 2\n"),
            None,
            (),
        ),
        (
            ("&& box_is_scanned == false", "&& scan_box.state == initial && box_is_scanned == false"),
            Slug.PLANNER_READS_RUNNER,
            ("operations", "scan_box", "pre", "g"),
        ),
        (
            ("box_is_scanned <- true]", "box_is_scanned <- true, count <- 2]"),
            None,
            (),
        ),
    ],
)
def test_each_doubt_where_it_is_due(replacement: tuple[str, str], slug: Slug | None, path: tuple[str, ...]) -> None:
    found = [(doubt.slug, doubt.path) for doubt in _doubts(replacement)]
    if slug is None:
        assert found == []
    else:
        assert (slug, path) in found


def test_a_goal_that_only_some_initial_states_reach_names_one_that_does_not() -> None:
    doubts = _doubts(
        (
            "box_is_scanned: {domain: bool, initial: false}",
            "box_is_scanned: {domain: bool, initial: false, random: any}",
        ),
        ("scanned: box_is_scanned == true", "scanned: box_is_scanned == false"),
    )
    assert [(d.slug, d.remedy) for d in doubts] == [
        (Slug.GOAL_NOT_ALWAYS_REACHABLE, "one of them: box_is_scanned == true")
    ]


def test_a_step_that_leaves_a_domain_is_told_with_the_state_in_which_it_does() -> None:
    doubts = _doubts(
        ("&& box_is_scanned == false", ""),
        ("box_is_scanned <- true]", "box_is_scanned <- true, count += 1]"),
    )
    assert [(d.slug, d.path) for d in doubts] == [(Slug.DOMAIN_LEFT, ("operations", "scan_box", "post", "a"))]
    assert "count == 2" in doubts[0].message


def test_automatic_transitions_that_go_round_are_named_once() -> None:
    ring = (
        "automatic_transitions:\n"
        "  up: {g: light == green && current.state == executing, a: [light <- blue]}\n"
        "  down: {g: light == blue, a: [light <- green]}"
    )
    doubts = _doubts(("automatic_transitions:", ring))
    assert [doubt.slug for doubt in doubts] == [Slug.AUTOMATIC_LIVELOCK]
    assert "up -> down -> up" in doubts[0].message


def test_no_initial_state_and_a_nominal_one_that_is_not_allowed() -> None:
    nominal = _doubts(
        ("count: {domain: 0..2, initial: 0}", "count: {domain: 0..2, initial: 0, random: any}"),
        more="initial_states: count == 2\n",
    )
    assert [doubt.slug for doubt in nominal] == [Slug.INITIAL_STATE_NOMINAL]
    none = _doubts(more="initial_states: count == 2\n")
    assert [doubt.slug for doubt in none] == [Slug.INITIAL_STATE_NOMINAL, Slug.NO_INITIAL_STATE]


def test_failures_that_nothing_notices_and_replies_that_are_awaited_for_ever_are_told() -> None:
    unsure = ("    measures: [temperature]\n", "    measures: [temperature]\n    simulation: {outcomes: OUTCOMES}\n")
    fails = (unsure[0], unsure[1].replace("OUTCOMES", "{succeed: 0.5, fail: 0.5}"))
    silent = (unsure[0], unsure[1].replace("OUTCOMES", "{succeed: 0.5, timeout: 0.5}"))
    no_deadline = (("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    unwatched = ("g: scan_req_state == failed && current.state == executing", "g: light == blue")
    assert _doubts(fails) == _doubts(silent) == []
    assert [doubt.slug for doubt in _doubts(fails, unwatched)] == [Slug.FAILURE_UNNOTICED]
    assert [doubt.slug for doubt in _doubts(silent, *no_deadline)] == [Slug.NO_DEADLINE]


def test_a_variable_that_nothing_reads_is_told() -> None:
    doubts = check_model(scan_cell()).doubts
    assert [(d.slug, d.path[-1]) for d in doubts] == [
        (Slug.UNUSED_VARIABLE, "count"),
        (Slug.UNUSED_VARIABLE, "temperature"),
    ]


@pytest.mark.slow
def test_what_is_too_large_is_said_to_be_incomplete() -> None:
    many = "".join(f"  n{index}: {{domain: 0..9, initial: 0}}\n" for index in range(6))
    steps = "".join(
        f"  up{index}: {{pre: {{g: n{index} != 9}}, post: {{g: true, a: [n{index} += 1]}}}}\n" for index in range(6)
    )
    model = scan_cell(("variables:\n", "variables:\n" + many), ("operations:\n", "operations:\n" + steps))
    checked = check_model(model)
    assert not checked.complete
    assert Slug.CHECK_INCOMPLETE in [doubt.slug for doubt in checked.doubts]


@pytest.mark.parametrize(
    ("guard", "waits"),
    [
        ("true", False),
        ("scan_req_trigger == true || light == blue", False),
        ("scan_command in {scan_box} && !(scan_command == none)", False),
        ("scan_req_state == succeeded || scan_command == none", True),
        ("light == green", True),
    ],
)
def test_an_operation_that_completes_at_once_needs_no_deadline(guard: str, waits: bool) -> None:  # noqa: FBT001
    silent = (
        "    measures: [temperature]\n",
        "    measures: [temperature]\n    simulation: {outcomes: {timeout: 1}}\n",
    )
    no_deadline = (("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    doubts = _doubts(silent, *no_deadline, ("gr: scan_req_state == succeeded", f"gr: {guard}"))
    assert (Slug.NO_DEADLINE in [doubt.slug for doubt in doubts]) == waits
