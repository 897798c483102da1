"""The lines that say something under a path of a model file, in all the ways that YAML has of saying it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from scbm.files import read_located

if TYPE_CHECKING:
    from pathlib import Path

HEAD = """behavior_model: cell
variables:
  a: {domain: bool, initial: false}
  b: {domain: bool, initial: false}
operations:
"""
"""Operations begin in line 6."""


def lines(operations: str, *path: str) -> tuple[int, ...]:
    _, places = read_located(HEAD + operations)
    return places.lines(("operations", *path))


@pytest.mark.parametrize(
    ("guard", "expected"),
    [
        ("g: a == true", (8,)),
        ("g: a == true\n        && b == true\n      gr: b == true", (8, 9)),
        ('g: "a == true\n\n         && b == true"\n\n      # not this', (8, 10)),
        ("g: |\n        a == true\n        && b == true\n\n      # not this\n      gr: true", (8, 9, 10)),
        ("g: >-\n        a == true\n        && b == true\n", (8, 9, 10)),
        ("g:\n        a == true", (8, 9)),
        ("g: [a == true,\n          # of this no word\n          b == true\n         ]\n      gr: true", (8, 10, 11)),
        ("g:\n        - a == true\n        # of this no word\n        - b == true\n\n      gr: true", (8, 9, 11)),
        ("g:\n      - a == true\n      - b == true\n      gr: true", (8, 9, 10)),
    ],
)
def test_a_guard_has_all_its_lines_and_no_others(guard: str, expected: tuple[int, ...]) -> None:
    operation = f"  go:\n    pre:\n      {guard}\n    post: {{g: true}}\n"
    assert lines(operation, "go", "pre", "g") == expected


def test_line_ends_of_windows_count_once() -> None:
    text = HEAD + "  go:\n    pre:\n      g: a == true\n        && b == true\n    post: {g: true}\n"
    _, places = read_located(text.replace("\n", "\r\n"))
    assert places.lines(("operations", "go", "pre", "g")) == (8, 9)


def test_an_alias_brings_the_lines_of_what_it_stands_for() -> None:
    operations = """\
  one: &one
    pre:
      g: &guard
        a == true
    post: {g: *guard, a: &set [a <- false]}
  two:
    pre: {g: [*guard, b == true]}
    post:
      g: true
      a:
        *set
  three: *one
"""
    assert lines(operations, "one", "post", "g") == (9, 10)
    assert lines(operations, "two", "pre", "g") == (9, 12)
    assert lines(operations, "two", "post", "a") == (10, 15, 16)
    assert lines(operations, "two") == (9, 10, 11, 12, 13, 14, 15, 16)
    assert lines(operations, "three") == (7, 8, 9, 10, 17)
    assert lines(operations, "three", "pre") == (7, 8, 9)


def test_a_block_ends_with_its_last_word() -> None:
    operations = "  go:\n    pre: {g: true}\n    post:\n      g: true\n\n# goals\n\n  stop:\n    pre: {g: true}\n"
    assert lines(f"{operations}    post: {{g: true}}\n", "go") == (6, 7, 8, 9)


@pytest.mark.parametrize("path", [("stop",), ("go", "failed"), ("go", "pre", "g", "deeper"), ("stop", "pre")])
def test_nothing_is_under_a_path_that_is_not_there(path: tuple[str, ...]) -> None:
    assert lines("  go: {pre: {g: true}, post: {g: true}}\n", *path) == ()


def test_a_file_in_one_line_has_that_line() -> None:
    text = '{"behavior_model": "m", "variables": {}, "operations": {"go": {"pre": {"g": true}, "post": {"g": true}}}}'
    _, places = read_located(text)
    assert places.lines(("operations", "go", "post", "g")) == (1,)


def test_what_comes_from_a_part_has_the_line_that_uses_it() -> None:
    used = """behavior_model: cell
parts:
  left: {use: "scbm:gripper"}
  right: {use: "scbm:gripper"}
variables: {done: {domain: bool, initial: false}}
operations: {work: {pre: {g: done == false}, post: {g: true, a: [done <- true]}}}
"""
    model, places = read_located(used)
    lines = {each.name: places.line(("operations", each.name, "pre", "g")) for each in model.operations}
    assert {name.split(".")[0]: line for name, line in lines.items()} == {"left": 3, "right": 4, "work": 6}
    automatic = [(each.name, places.line(("automatic_transitions", each.name))) for each in model.automatic_transitions]
    assert {name.split(".")[0]: line for name, line in automatic} == {"left": 3, "right": 4}
    assert not any(places.lines(("operations", name)) for name in lines if name != "work")


def test_objects_in_a_part_have_the_line_that_uses_it(tmp_path: Path) -> None:
    part = (
        "part: island\ntypes: {robot: [r1, r2]}\nvariables:\n  'busy[robot]': {domain: bool, initial: false}\n"
        "resources: {'arm[robot]': {}}\noperations:\n  'work[r in robot]':\n    request: arm[r]\n"
        "    effects: ['busy[r] <- true']\n"
        "automatic_transitions: {'rest[r in robot]': {g: 'busy[r] == true', a: ['busy[r] <- false']}}\n"
    )
    own = "operations:\n  own: {pre: {g: true}, post: {g: true}}\n"
    used = f"behavior_model: cell\n\nparts:\n  left: {{use: island.yaml}}\n{own}"
    (tmp_path / "island.yaml").write_text(part, encoding="utf-8")
    model, places = read_located(used, str(tmp_path / "cell.yaml"))
    operations = {each.name: places.line(("operations", each.name, "post", "g")) for each in model.operations}
    assert operations == {"left.work.r1": 4, "left.work.r2": 4, "own": 6}
    automatic = [each.name for each in model.automatic_transitions]
    assert automatic == ["left.rest.r1", "left.rest.r2", "left.arm_failed.r1", "left.arm_failed.r2"]
    assert {places.line(("automatic_transitions", name, "g")) for name in automatic} == {4}
    assert not any(places.lines(("operations", name)) for name in operations if name != "own")
