"""Each key of types, tables, parts and conditions takes its own YAML sort; another sort is an error at that key."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.files import load_model
from scbm.files.codec.model_keys import ModelKeys
from scbm.files.expansion.stage_keys import shared_section
from scbm.model import InputError

MODEL = """\
behavior_model: cell
include: own.yaml
parts: {d: {use: door.yaml}}
types:
  robot: [r1, r2]
  arm: {objects: [r3], of: robot}
tables:
  near: {of: [robot, robot], rows: [[r1, r3]]}
variables:
  on[robot]: {domain: bool, initial: false}
operations:
  go[x in robot, y in robot]:
    where: near(x, y)
    pre: {g: on.x == false}
    post: {g: true, a: [on.x <- true]}
goals: {all: "forall x in robot. (on.x == true)"}
requirements:
  r[x in robot]: {requirement: "always on[x] == true", where: x == r1}
"""

DOOR = """\
part: door
parameters: {start: {default: false, help: Where it starts.}}
variables: {v: {domain: bool, initial: start}}
"""

LIST, MAPPING, NUMBER, NOTHING = "[[r1]]", "{r1: r2}", "5", "null"

WRONG: dict[str, tuple[str, ...]] = {
    "include: own.yaml": (LIST, MAPPING, NUMBER, NOTHING),
    "parts: {d: {use: door.yaml}}": (LIST, NUMBER, NOTHING),
    "d: {use: door.yaml}": (LIST, NUMBER, NOTHING),
    "use: door.yaml": (LIST, MAPPING, NUMBER, NOTHING),
    "robot: [r1, r2]": (LIST, MAPPING, NUMBER, NOTHING),
    "arm: {objects: [r3], of: robot}": (LIST, MAPPING, NUMBER, NOTHING),
    "objects: [r3]": (LIST, MAPPING, NUMBER, NOTHING),
    "of: robot": (LIST, MAPPING, NUMBER, NOTHING),
    "near: {of: [robot, robot], rows: [[r1, r3]]}": (LIST, MAPPING, NUMBER, NOTHING),
    "of: [robot, robot]": (LIST, MAPPING, NUMBER, NOTHING),
    "rows: [[r1, r3]]": (LIST, MAPPING, NUMBER, NOTHING),
    "where: near(x, y)": (LIST, MAPPING, NUMBER, NOTHING),
    "where: x == r1": (LIST, MAPPING, NUMBER, NOTHING),
    'requirement: "always on[x] == true"': (LIST, MAPPING, NUMBER, NOTHING),
    "part: door": (LIST, MAPPING, NOTHING),
    "parameters: {start: {default: false, help: Where it starts.}}": (LIST, NUMBER, NOTHING),
    "start: {default: false, help: Where it starts.}": (LIST, NUMBER),
    "help: Where it starts.": (LIST, MAPPING, NOTHING),
}


def found_in(folder: Path, model: str, door: str = DOOR) -> list[str]:
    """Return file, line and slug of each error; none for a model that is right."""
    for name, text in {"cell": model, "door": door, "own": "part: own\ntypes: {zone: [a]}\n"}.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    try:
        load_model(folder / "cell.yaml")
    except InputError as error:
        return [f"{Path(each.place.file).stem}:{each.place.line} {each.slug}" for each in error.diagnostics]
    return []


def test_the_model_of_these_tests_is_right(tmp_path: Path) -> None:
    assert found_in(tmp_path, MODEL) == []


@pytest.mark.parametrize(
    ("entry", "value"), [(entry, value) for entry, values in WRONG.items() for value in values]
)  # fmt: skip
def test_a_value_of_another_sort_is_an_error_in_the_line_of_its_key(entry: str, value: str, tmp_path: Path) -> None:
    key = entry.partition(":")[0]
    name, text = ("cell", MODEL) if entry in MODEL else ("door", DOOR)
    assert text.count(entry) == 1
    line = text[: text.index(entry)].count("\n") + 1
    texts = {"cell": MODEL, "door": DOOR} | {name: text.replace(entry, f"{key}: {value}")}
    found = found_in(tmp_path, texts["cell"], texts["door"])
    assert any(each.startswith(f"{name}:{line} ") for each in found), found


@pytest.mark.parametrize("parent", ["[robot]", "{robot: r1}", ""])
def test_a_type_that_is_part_of_no_type_is_one_error(parent: str, tmp_path: Path) -> None:
    assert found_in(tmp_path, MODEL.replace("of: robot", f"of: {parent}")) == ["cell:6 wrong-shape"]


@pytest.mark.parametrize(
    ("table", "slug"),
    [
        ("{of: [robot, robot], row: [[r1, r3]]}", "unknown-key"),
        ("{off: [robot, robot], rows: [[r1, r3]]}", "unknown-key"),
        ("{of: robot, rows: [[r1, r3]]}", "wrong-shape"),
        ("{rows: [[r1, r3]]}", "wrong-shape"),
        ("[[r1, r3]]", "wrong-shape"),
    ],
)
def test_a_table_that_cannot_be_read_is_one_error(table: str, slug: str, tmp_path: Path) -> None:
    model = MODEL.replace("{of: [robot, robot], rows: [[r1, r3]]}", table)
    assert found_in(tmp_path, model) == [f"cell:8 {slug}"]


@pytest.mark.parametrize(("section", "typo"), [("types", "typos"), ("types", "type"), ("tables", "tabels")])
def test_a_misspelt_section_of_objects_is_one_error(section: str, typo: str, tmp_path: Path) -> None:
    line = MODEL[: MODEL.index(f"\n{section}:")].count("\n") + 2
    assert found_in(tmp_path, MODEL.replace(f"\n{section}:", f"\n{typo}:")) == [f"cell:{line} unknown-key"]


def test_no_key_of_a_model_is_a_misspelt_section_of_objects() -> None:
    assert [key for key in ModelKeys.declared if shared_section(key) is not None] == ["types", "tables"]


@pytest.mark.parametrize("first", ["", "parts: {}\n", "parameters: {start: {default: true}}\n"])
def test_a_file_without_the_name_of_a_part_is_no_part(first: str, tmp_path: Path) -> None:
    door = first + "variables: {v: {domain: bool, initial: false}}\n"
    assert found_in(tmp_path, MODEL, door) == ["door:1 missing-key"]


@pytest.mark.parametrize(
    ("old", "new", "errors"),
    [
        ("a: [on.x <- true]", "a: on.x", ["cell:15 wrong-shape", "cell:15 action-syntax"]),
        ('requirement: "always on[x] == true"', "requirement: [on, x]", ["cell:18 wrong-shape"]),
    ],
)
def test_a_wrong_text_has_its_shape_checked_too(old: str, new: str, errors: list[str], tmp_path: Path) -> None:
    assert found_in(tmp_path, MODEL.replace(old, new)) == errors


def test_a_remedy_names_a_file_of_a_part_as_its_user_writes_it(tmp_path: Path) -> None:
    for name, text in {
        "cell": MODEL.replace("use: door.yaml", "use: dor.yaml"),
        "door": DOOR,
        "own": "part: own",
    }.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        load_model(tmp_path / "cell.yaml")
    assert "`door.yaml`" in str(raised.value.diagnostics[0].remedy)
