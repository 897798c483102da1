"""The name that was probably meant."""

from __future__ import annotations

import pytest

from scbm.files import nearest, suggestion
from support.wording import Wording

NAMES = ["robot_at", "gantry_at", "mounted", "scan_req_state", "scan_req_trigger", "Home"]


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("robot_at", "robot_at"),
        ("robt_at", "robot_at"),
        ("robotat", "robot_at"),
        ("robot_ta", "robot_at"),
        ("ROBOT_AT", "robot_at"),
        ("Robot-At", "robot_at"),
        ("home", "Home"),
        ("hoem", "Home"),
        ("gantri_at", "gantry_at"),
        ("scan.req_state", "scan_req_state"),
        ("scan_req_triger", "scan_req_trigger"),
        ("mount", "mounted"),
        ("req_state.scan", "scan_req_state"),
        ("at_robot", "robot_at"),
    ],
)
def test_a_misspelled_name_is_near_to_the_right_one(name: str, near: str) -> None:
    assert nearest(name, NAMES) == near


@pytest.mark.parametrize("name", ["", "x", "xyz", "box", "temperature", "at"])
def test_a_name_that_is_like_none_is_near_to_none(name: str) -> None:
    assert nearest(name, NAMES) is None


def test_of_two_near_names_the_nearer_one_is_taken() -> None:
    assert nearest("scan_3", ["scan_12", "scan_13", "scan_33"]) == "scan_33"
    assert nearest("agv", ["avg", "agv_1", "agv"]) == "agv"


def test_nothing_is_near_where_nothing_is_known() -> None:
    assert nearest("robot_at", []) is None
    assert suggestion("robot_at", [], "names") is None


def test_a_suggestion_names_the_nearest(wording: Wording) -> None:
    remedy = suggestion("robt_at", iter(NAMES), "names") or ""
    assert "`robot_at`" in remedy
    wording(remedy)


def test_a_suggestion_lists_a_few_names_if_none_is_near() -> None:
    assert suggestion("xyz", iter(["a", "b"]), "values") == "values: a, b"


def test_a_suggestion_lists_no_more_than_a_line_of_names() -> None:
    names = [f"name_{number}" for number in range(11)]
    assert suggestion("xyz", names[:10], "these") == f"these: {', '.join(names[:10])}"
    assert suggestion("xyz", names, "these") == f"these: {', '.join(names[:10])}, …"


def test_names_are_compared_in_bounded_numbers() -> None:
    names = [f"variable_{number}" for number in range(50_000)]
    assert nearest("variable_7x", names) == "variable_7"
    assert nearest("another_name", [*names, "another_nam"]) is None
