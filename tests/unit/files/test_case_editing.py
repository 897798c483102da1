"""Edits of the text of a case: the wanted data, and every other character as it was."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

import pytest

from scbm.files import edited_case, parse_case
from scbm.model import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

LINES = """\
# top
case: a   # its name
outcomes:
  scan: [fail, succeed]   # 2
injections:
  # first
  - {at: 1 s, set: {x: 1}}
  - at: 2 s   # second
    set: {x: 2}
# end
"""


def edit(text: str, change: Callable[[Any], object]) -> str:
    document = parse_case(text)
    data: Any = deepcopy(document.tree.plain)
    change(data)
    edited = edited_case(document, data)
    assert edited.tree.plain == data
    return edited.source.text


def differing(before: str, after: str) -> tuple[list[str], list[str]]:
    """Return the lines that are gone, and those that are new."""
    old, new = before.splitlines(), after.splitlines()
    return [line for line in old if line not in new], [line for line in new if line not in old]


def test_a_changed_list_keeps_its_comment() -> None:
    edited = edit(LINES, lambda data: data["outcomes"]["scan"].append("timeout"))
    assert differing(LINES, edited)[1] == ["  scan: [fail, succeed, timeout]   # 2"]


def test_a_new_element_stands_behind_the_last_one() -> None:
    edited = edit(LINES, lambda data: data["injections"].append({"at": "3 s", "set": {"x": 3}}))
    assert differing(LINES, edited) == ([], ["  - {at: 3 s, set: {x: 3}}"])


def test_a_new_element_stands_before_the_first_one() -> None:
    edited = edit(LINES, lambda data: data["injections"].insert(0, {"at": "0 s", "set": {"x": 3}}))
    assert edited.index("{at: 0 s") < edited.index("{at: 1 s")


def test_an_element_is_removed_with_its_lines() -> None:
    edited = edit(LINES, lambda data: data["injections"].pop())
    assert differing(LINES, edited) == (["  - at: 2 s   # second", "    set: {x: 2}"], [])


def test_a_section_is_removed() -> None:
    edited = edit(LINES, lambda data: data.pop("outcomes"))
    assert differing(LINES, edited) == (["outcomes:", "  scan: [fail, succeed]   # 2"], [])


def test_a_new_key_stands_below_the_others_of_its_element() -> None:
    edited = edit(LINES, lambda data: data["injections"][1].update(hold="1 s"))
    assert differing(LINES, edited) == ([], ["    hold: 1 s"])


def test_new_sections_stand_at_the_end_in_lines() -> None:
    edited = edit("case: a\n", lambda data: data.update(outcomes={"scan": ["fail"]}, network={"loss": "2 %"}))
    assert edited == "case: a\noutcomes:\n  scan: [fail]\nnetwork:\n  loss: 2 %\n"


@pytest.mark.parametrize("text", ["{case: a, initial: {x: 1}}", "{case: a,\n initial: {\n  x: 1}}\n"])
def test_a_case_in_braces_stays_in_braces(text: str) -> None:
    edited = edit(text, lambda data: (data["initial"].update(y=True), data.update(goal="g")))
    assert edited.startswith("{")


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize("end", ["", "\n"])
def test_line_ends_stay(line_end: str, end: str) -> None:
    text = line_end.join(["case: a", "injections:", "- {at: 1 s}"]) + end.replace("\n", line_end)
    edited = edit(text, lambda data: (data["injections"].append({"at": "2 s"}), data.update(goal="g")))
    assert edited.split(line_end)[2:5] == ["- {at: 1 s}", "- {at: 2 s}", "goal: g"]


def test_an_empty_value_is_filled() -> None:
    assert edit("case: a\noutcomes:\ngoal: g\n", lambda data: data.update(outcomes={"scan": "fail"})) == (
        "case: a\noutcomes: {scan: fail}\ngoal: g\n"
    )


def test_texts_that_look_like_other_types_are_quoted() -> None:
    assert edit("case: a\n", lambda data: data.update(initial={"x": "true", "y": True})) == (
        "case: a\ninitial:\n  x: 'true'\n  y: true\n"
    )


def test_an_anchor_in_the_changed_part_is_refused() -> None:
    text = "case: a\noutcomes:\n  scan: &rules [fail]\n  grip: *rules\n"
    with pytest.raises(InputError):
        edit(text, lambda data: data["outcomes"]["grip"].append("succeed"))
