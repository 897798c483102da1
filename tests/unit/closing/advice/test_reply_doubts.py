"""Doubts about replies: what they never carry although a postcondition waits for it, and variables never carried."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.closing.advice import Doubt, check_model
from scbm.files import read_model
from scbm.model import Severity, Slug
from support.wording import Wording

TEXT = (Path(__file__).parents[3] / "models" / "valid" / "counting_camera.yaml").read_text(encoding="utf-8")
CAMERA = "{measures: {n: [3, 0, 1, 2]}, simulation: {latency: 1 s}}"
POST = ("operations", "count", "post", "gr", 1)
MEASURES = ("resources", "camera", "measures", 0)


def _doubts(camera: str, *replacements: tuple[str, str], more: str = "") -> list[Doubt]:
    text = TEXT + more
    for old, new in ((CAMERA, camera), *replacements):
        assert old in text
        text = text.replace(old, new)
    doubts = check_model(read_model(text)).doubts
    return [doubt for doubt in doubts if doubt.slug is Slug.REPLY_NEVER_CARRIES]


@pytest.mark.parametrize(
    "camera",
    [
        "{measures: [n]}",
        "{measures: {n: any}}",
        "{measures: {n: [0, 1, 2]}}",
        "{measures: {n: any}, simulation: {measured: {n: [0, 1]}}}",
        "{measures: {n: [3, 0]}, simulation: {measured: {n: {3: 0, 0: 1}}}}",
        "{measures: {n: [3, 0]}, simulation: {failed: {n: [0]}}}",
    ],
)
def test_a_postcondition_that_waits_for_what_no_reply_carries_is_doubted_there(camera: str, wording: Wording) -> None:
    (doubt,) = _doubts(camera)
    assert (doubt.path, doubt.severity) == (POST, Severity.WARNING)
    wording((camera, doubt.message, doubt.remedy))


@pytest.mark.parametrize(
    "camera",
    [
        CAMERA,
        "{measures: {n: [3]}}",
        "{measures: {n: any}, simulation: {measured: {n: any}}}",
        "{measures: {n: any}, simulation: {measured: {n: {0: 8, 3: 1}}}}",
        "{measures: {n: any}, publishes: {n: any}}",
    ],
)
def test_replies_that_may_carry_the_value_are_not_doubted(camera: str) -> None:
    assert _doubts(camera) == []


def test_a_value_that_something_else_gives_is_not_doubted() -> None:
    reset = "  reset: {g: done == false && camera_req_state == failed, a: [n <- 3]}\n"
    assert _doubts("{measures: {n: [0]}}", ("automatic_transitions:\n", f"automatic_transitions:\n{reset}")) == []
    guess = "environment:\n  guess: {guard: n == 0, actions: [n <- 3]}\n"
    assert _doubts("{measures: {n: [0]}}", more=guess) == []
    random = ("{domain: 0..3, initial: 0}", "{domain: 0..3, initial: 0, random: any}")
    assert [doubt.severity for doubt in _doubts("{measures: {n: any}}", random)] == [Severity.NOTE]


def test_a_value_from_before_the_reply_does_not_count_if_each_reply_carries_another() -> None:
    random = ("{domain: 0..3, initial: 0}", "{domain: 0..3, initial: 0, random: any}")
    refill = ("operations:\n", "operations:\n  refill: {pre: {g: n < 3}, post: {g: true, a: [n <- 3]}}\n")
    for camera in ("{measures: {n: [0, 1]}}", "{measures: {n: any}, simulation: {measured: {n: {0: 1, 3: 0}}}}"):
        assert [doubt.path for doubt in _doubts(camera, random)] == [POST]
        assert [doubt.path for doubt in _doubts(camera, refill)] == [POST]
    assert _doubts("{measures: {n: [0, 3]}}", refill) == []
    assert [doubt.path for doubt in _doubts("{measures: {n: any}}", refill)] == [MEASURES]


def test_a_postcondition_that_can_never_hold_for_another_reason_is_no_doubt_about_replies() -> None:
    assert _doubts("{measures: {n: [0, 3]}}", ("gr: n == 3", "gr: n == 3 && n == 0")) == []


@pytest.mark.parametrize("measures", ["[n]", "{n: any}"])
def test_a_variable_that_is_read_and_never_drawn_is_a_note_at_its_resource(measures: str, wording: Wording) -> None:
    (doubt,) = _doubts(f"{{measures: {measures}}}", ("post: {gr: n == 3}, ", ""))
    assert (doubt.path, doubt.severity) == (MEASURES, Severity.NOTE)
    wording((doubt.message, doubt.remedy))


def test_a_resource_without_requests_and_a_variable_that_nothing_reads_are_not_doubted() -> None:
    unused = "{measures: {n: [3], m: any}}\n  spare: {measures: [n, m]}"
    more = ("variables:\n", "variables:\n  m: {domain: bool, initial: false}\n")
    assert _doubts(unused, more) == []
