"""Where a part cannot be read, names that it may declare are no further errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.files import load_model
from scbm.model import InputError

CELL = """\
behavior_model: cell
PARTS
types: {robot: [r1, r2], wall: {of: place, objects: [w]}}
tables: {beside: {of: [robot, place], rows: [[r1, w]]}}
variables:
  own: {domain: bool, initial: false}
  at[robot]: {domain: zone, initial: a}
  full[x in box]: {domain: bool, initial: false}
operations:
  go: {pre: {g: left.leaf == open && stop == healthy}, post: {g: true, a: [left.leaf <- closed, own <- true]}}
  ask: {request: scanner, guard: own == true}
  fetch[r in robot]: {request: "arm[r]", guard: "at[r] == a && near(a, b)"}
  move[r in robot, x in zone]: {where: "near(x, b)", pre: {g: "at[r] == x && level[r] >= 1"}, post: {g: true}}
automatic_transitions:
  t: {g: "left.close.state == executing", a: [scanner_req_state <- initial]}
environment:
  e: {guard: left.leaf == closed, actions: [left.leaf <- open]}
goals:
  closed: left.leaf == closed
  all: forall z in zone. (full[z] == true)
requirements:
  r: always left.close.state == executing -> own == true
waivers:
  - {obligation: left.close/failed, reason: none, author: me, date: 2026-01-01}
  - {obligation: "shut[r in robot]/failed", reason: none, author: me, date: 2026-01-01}
"""

FILES = {
    "broken": "part: broken\nvariables: {a: [\n",
    "outer": "part: outer\nparts: {door: {use: missing.yaml}}\n",
    "odd": "part: odd\nvariabels: {leaf: {domain: [open, closed], initial: open}}\n",
    "model": "behavior_model: other\n",
}


def found_in(folder: Path, cell: str, **files: str) -> list[str]:
    """Return file, line and slug of each error."""
    for name, text in {"cell": cell, **files}.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        load_model(folder / "cell.yaml")
    return [f"{Path(each.place.file).stem}:{each.place.line} {each.slug}" for each in raised.value.diagnostics]


@pytest.mark.parametrize(
    ("parts", "error"),
    [
        ("parts: {left: {use: missing.yaml}}", "cell:2 file-missing"),
        ("include: missing.yaml", "cell:2 file-missing"),
        ("parts: {left: {use: 'scbm:missing'}}", "cell:2 file-missing"),
        ("parts: {left: {use: broken.yaml}}", "broken:2 yaml-syntax"),
        ("include: [broken.yaml]", "broken:2 yaml-syntax"),
        ("include: [model.yaml]", "model:1 wrong-shape"),
        ("parts: {left: {use: outer.yaml}}", "outer:2 file-missing"),
        ("parts: {left: {use: odd.yaml}}", "odd:2 unknown-key"),
        ("parts: {left: missing.yaml}", "cell:2 wrong-shape"),
        ("parts: {left: {}}", "cell:2 missing-key"),
        ("parts: {left: {uze: missing.yaml}}", "cell:2 unknown-key"),
        ("parts: {state: {use: missing.yaml}}", "cell:2 reserved-name, cell:2 file-missing"),
        ("parts: [missing.yaml]", "cell:2 wrong-shape"),
    ],
)
def test_names_of_a_part_that_cannot_be_read_are_no_errors(parts: str, error: str, tmp_path: Path) -> None:
    assert ", ".join(found_in(tmp_path, CELL.replace("PARTS", parts), **FILES)) == error


def test_other_errors_are_reported_beside_a_part_that_is_missing(tmp_path: Path) -> None:
    cell = CELL.replace("PARTS", "include: missing.yaml").replace("own == true}", "own == 3}", 1)
    cell = cell.replace("robot: [r1, r2]", "robot: [r1, r1]")
    assert found_in(tmp_path, cell) == ["cell:2 file-missing", "cell:3 duplicate-value", "cell:11 different-kinds"]


def test_types_are_known_where_only_an_argument_is_missing(tmp_path: Path) -> None:
    part = "part: door\nparameters: {start: {}}\nvariables: {leaf: {domain: [open, closed], initial: start}}\n"
    cell = "behavior_model: cell\nparts: {left: {use: door.yaml}}\ntypes: {zone: [a]}\n"
    cell += "variables: {'full[zoen]': {domain: bool, initial: true}}\noperations: {}\n"
    assert found_in(tmp_path, cell, door=part) == ["cell:2 missing-key", "cell:4 unknown-type"]


def test_an_index_of_an_entry_that_is_an_error_itself_is_no_second_error(tmp_path: Path) -> None:
    cell = "behavior_model: cell\ntypes: {zone: [a]}\nvariables: {'full[zoen]': {domain: bool, initial: true}}\n"
    cell += "operations: {}\ngoals: {all: 'forall z in zone. (full[z] == true)'}\n"
    assert found_in(tmp_path, cell) == ["cell:3 unknown-type"]


@pytest.mark.parametrize("request_", ["arn[r]", "[arm]", "spindle"])
def test_waivers_of_an_operation_that_is_an_error_are_no_further_errors(request_: str, tmp_path: Path) -> None:
    cell = "behavior_model: cell\ntypes: {robot: [r1, r2]}\nvariables:\n  on[robot]: {domain: bool, initial: false}\n"
    cell += "resources:\n  arm[robot]: {}\n  laser: {}\noperations:\n"
    cell += f"  go[r in robot]:\n    request: {request_}\n    guard: on.r == false\n    effects: [on.r <- true]\n"
    cell += "  cut: {request: lasr, guard: on.r1 == false}\nwaivers:\n"
    names = ["go[r in robot]/failed", "go/timedout", "go.r2/queued", "cut/failed", "automatic/laser_failed"]
    names += ["automatic/arm_failed[r in robot]", "automatic/arm_failed", "og/failed"]
    for name in names:
        cell += f"  - {{obligation: '{name}', reason: none, author: me, date: 2026-01-01}}\n"
    found = found_in(tmp_path, cell)
    assert list(dict.fromkeys(each.partition(" ")[0] for each in found)) == ["cell:10", "cell:13", "cell:22"], found
