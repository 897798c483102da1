"""Rewritten scalars: every character of an expanded text has its place in the text that people wrote."""

from __future__ import annotations

import pytest

from scbm.files.codec.lifted.part_keys import PART_KEY_NAMES
from scbm.files.expansion.expanded_nodes import (
    Piece,
    PlacedScalar,
    RewrittenScalar,
    entries_of,
    list_node,
    mapping_node,
    text_node,
    with_entries,
)
from scbm.files.expansion.stages import expand
from scbm.files.yaml.document import YamlNode
from scbm.files.yaml.error_collector import ErrorCollector
from scbm.files.yaml.source_text import Scalar
from scbm.files.yaml.text_files import read_tree
from scbm.model import Place, Slug

TEXT = """goals:
  near: "at[r] == \\u0062ox && door == open"
  far: at[r] != box
  folded: >-
    at[r] == box
    && door == open
"""


def goals() -> YamlNode:
    return read_tree(TEXT, "cell", "goals", "")[0].items["goals"]


def scalar(name: str) -> Scalar:
    found = goals().items[name].scalar
    assert found is not None
    return found


def underlined(place: Place) -> str:
    return TEXT.splitlines()[place.line - 1][place.column - 1 :][: place.length]


def renamed(source: Scalar) -> RewrittenScalar:
    """The scalar with `robot_1_at` for `at[r]`."""
    end = source.text.index("]") + 1
    begin = source.text.index("at")
    pieces = Piece.copy(source, 0, begin), Piece.instead("robot_1_at", source, begin, end), Piece.copy(source, end)
    return RewrittenScalar(pieces)


@pytest.mark.parametrize("name", ["near", "far", "folded"])
def test_a_replaced_name_is_underlined_as_it_is_written(name: str) -> None:
    text = renamed(scalar(name))
    assert text.text == scalar(name).text.replace("at[r]", "robot_1_at")
    assert underlined(text.stretch(0, 10)) == "at[r]"
    assert underlined(text.stretch(3, 5)) == "at[r]"
    begin = text.text.index("box")
    assert underlined(text.stretch(begin, begin + 3)) in ("box", "\\u0062ox")


def test_what_goes_over_several_pieces_is_underlined_from_the_first_to_the_last() -> None:
    text = renamed(scalar("far"))
    assert underlined(text.stretch(0, len(text.text))) == "at[r] != box"
    text = renamed(scalar("folded"))
    assert underlined(text.stretch(0, len(text.text))) == "at[r] == box"  # as for any text: its first line
    assert text.stretch(100, 101).line == 6  # the end of the text


def test_a_text_of_several_scalars_leads_to_each_of_them() -> None:
    near, far = scalar("near"), scalar("far")
    text = RewrittenScalar([Piece.copy(near), Piece.instead(" && ", far, 0, 0), Piece.copy(far)])
    assert text.text == f"{near.text} && {far.text}"
    assert underlined(text.stretch(text.text.rindex("box"), len(text.text))) == "box"
    assert text.stretch(text.text.rindex("box"), len(text.text)).line == 3
    assert underlined(text.stretch(text.text.index("open"), len(text.text))) == "open"


def test_a_scalar_can_be_rewritten_twice() -> None:
    once = renamed(scalar("far"))
    end = once.text.index(" ")
    twice = RewrittenScalar([Piece.instead("cell.robot_1_at", once, 0, end), Piece.copy(once, end)])
    assert twice.text == "cell.robot_1_at != box"
    assert underlined(twice.stretch(0, 15)) == "at[r]"
    assert underlined(twice.stretch(19, 22)) == "box"


def test_nodes_are_made_of_others_and_the_others_stay_as_they_are() -> None:
    node = goals()
    place = node.key_places["far"]
    made = with_entries(node, [entry._replace(key=f"{entry.key}.r1") for entry in entries_of(node)])
    assert list(made.items) == ["near.r1", "far.r1", "folded.r1"]
    assert isinstance(made.plain, dict)
    assert made.plain["far.r1"] == "at[r] != box"
    assert made.key_places["far.r1"] == place
    assert list(node.items) == ["near", "far", "folded"]
    pair = list_node([text_node("a == true", place, 40), text_node("true", place, 40)], place, 40)
    assert pair.plain == ["a == true", True]
    assert mapping_node(entries_of(made), place, 40, "goals").size == made.size


def test_a_generated_text_stands_at_one_place() -> None:
    place = Place("cell", 2, 3, 4)
    assert PlacedScalar("robot_req_trigger <- true", place).stretch(6, 9) == place


def test_errors_show_the_lines_of_the_file_that_they_are_in() -> None:
    document, source, _ = read_tree("gripper: part\n", "part.yaml", "part", "")
    report = ErrorCollector(["use: part.yaml"])
    report.add_source(source)
    report.add(Slug.UNKNOWN_KEY, "unknown key `gripper`", document.key_places["gripper"])
    report.add(Slug.UNKNOWN_KEY, "unknown key `use`", Place("cell.yaml", 1, 1, 3))
    shown = [(found.place.file, found.source_line) for found in report.copy().error().diagnostics]
    assert shown == [("cell.yaml", "use: part.yaml"), ("part.yaml", "gripper: part")]


def test_a_tree_with_nothing_to_expand_is_the_same_tree() -> None:
    document, source, _ = read_tree("behavior_model: cell\noperations: {go: {pre: {g: true}}}\n", "cell", "model", "")
    report = ErrorCollector(source.lines)
    assert expand(document, report, PART_KEY_NAMES).ground is document
    assert not len(report)
