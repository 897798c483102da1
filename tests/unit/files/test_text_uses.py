"""An error names the other line that it is about: where an argument, the file of a part or an anchored text is used."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.files import load_model
from scbm.files.yaml.document import MAX_USED_NODES
from scbm.model import Diagnostic, InputError, Place
from support.wording import Wording

DEVICE = """\
part: device
parameters: {stop: {}, start: {default: open}, time: {default: 2 s}, kind: {default: zone}, seen: {}, at: {default: a}}
variables:
  leaf: {domain: [open, closed], initial: start}
  full[kind]: {domain: bool, initial: false}
resources:
  drive: {measures: {seen: any}, simulation: {latency: time, measured: {seen: any}}}
operations:
  close:
    deadline: time
    pre:
      g: drive_req_state == initial && leaf == open && (forall z in kind. (full[z] == true || full.at == true))
      gr: stop == healthy
      a: [drive_req_trigger <- true, seen <- closed]
    post: {gr: true, g: true}
"""

CELL = """\
behavior_model: cell
types: {zone: [a, b]}
parts:
  left: {use: device.yaml, with: {stop: lamp, seen: lid}}
  right:
    use: device.yaml
    with:
      ARGUMENTS
variables:
  estop: {domain: [healthy, pressed], initial: healthy}
  lamp: {domain: [healthy, broken], initial: healthy}
  count: {domain: 0..3, initial: 0}
  lid: {domain: [open, closed], initial: open}
"""


def found_in(folder: Path, **files: str) -> tuple[Diagnostic, ...]:
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        load_model(folder / "cell.yaml")
    return raised.value.diagnostics


def shown(place: Place | None) -> str:
    """Return the file and the line of a place and of all its users, from inside to outside."""
    return "" if place is None else f"{Path(place.file).stem}:{place.line} {shown(place.user)}".rstrip()


def uses(found: tuple[Diagnostic, ...]) -> list[tuple[str, str]]:
    return [(each.slug.value, shown(each.place)) for each in found]


def with_argument(argument: str) -> str:
    given = {"stop": "stop: estop", "seen": "seen: lid"}
    given[argument.partition(":")[0]] = argument
    return CELL.replace("ARGUMENTS", "\n      ".join(reversed(given.values())))


@pytest.mark.parametrize(
    ("argument", "slug", "line"),
    [
        ("stop: estopp", "unknown-variable", 13),
        ("stop: estop == pressed", "wrong-shape", 13),
        ("stop: [estop]", "wrong-shape", 13),
        ("stop: (estop", "wrong-shape", 13),
        ("stop: z", "unknown-variable", 13),
        ("stop: true", "compares-no-variable", 13),
        ("start: shut", "value-outside-domain", 4),
        ("start: 3", "different-kinds", 4),
        ("time: 3", "bare-duration", 7),
        ("time: quick", "bad-duration", 7),
        ("time: {uniform: [1 s, 2]}", "bare-duration", 7),
        ("time: {unform: [1 s, 2 s]}", "unknown-key", 7),
        ("kind: '3'", "wrong-shape", 5),
        ("seen: lidd", "unknown-variable", 7),
        ("seen: [lid]", "wrong-shape", 7),
        ("seen: lid == open", "wrong-shape", 7),
        ("at: [a]", "wrong-shape", 12),
    ],
)
def test_an_error_at_an_argument_names_the_line_of_the_part_that_uses_it(
    argument: str, slug: str, line: int, tmp_path: Path
) -> None:
    (first, *_) = found_in(tmp_path, cell=with_argument(argument), device=DEVICE)
    number = with_argument(argument).splitlines().index(f"      {argument}") + 1
    assert (first.slug, Path(first.place.file).name, first.place.line) == (slug, "cell.yaml", number)
    assert shown(first.place.user).startswith(f"device:{line}")
    assert first.message.endswith(f"(used in {tmp_path / 'device.yaml'}:{line})")


@pytest.mark.parametrize(
    ("argument", "slug", "line"),
    [
        ("stop: count", "different-kinds", 13),
        ("stop: lid", "value-outside-domain", 13),
        ("seen: estop", "value-outside-domain", 14),
        ("at: c", "unknown-object", 12),
    ],
)
def test_an_error_in_a_part_names_the_use_with_the_wrong_argument(
    argument: str, slug: str, line: int, tmp_path: Path
) -> None:
    found = found_in(tmp_path, cell=with_argument(argument), device=DEVICE)
    assert uses(found) == [(slug, f"device:{line} cell:5")]


def test_an_argument_that_is_wrong_itself_is_the_only_error(tmp_path: Path) -> None:
    found = found_in(tmp_path, cell=with_argument("stop: !x estop"), device=DEVICE)
    assert [each.slug for each in found] == ["yaml-tag"]


INNER = """\
part: inner
parameters: {whose: {}, first: {default: shut}}
variables: {leaf: {domain: [open, closed], initial: first}}
requirements: {r: always whose == true}
"""

OUTER = """\
part: outer
parameters: {ready: {}}
parts:
  deep:
    use: inner.yaml
    with: {whose: ready, first: open}
"""


def test_an_argument_of_a_part_in_a_part_names_both_files(tmp_path: Path, wording: Wording) -> None:
    cell = "behavior_model: cell\nparts:\n  left: {use: outer.yaml, with: {ready: redy}}\n"
    cell += "variables: {}\noperations: {}\n"
    (found,) = found_in(tmp_path, cell=cell, outer=OUTER, inner=INNER)
    wording((found.message,))
    assert shown(found.place).startswith("cell:3 outer:6 inner:4")


def test_a_wrong_default_names_its_use_in_the_part_and_the_use_of_the_part(tmp_path: Path, wording: Wording) -> None:
    cell = "behavior_model: cell\nparts:\n  left: {use: inner.yaml, with: {whose: w}}\n"
    cell += "variables: {w: {domain: bool, initial: true}}\noperations: {}\n"
    (found,) = found_in(tmp_path, cell=cell, inner=INNER)
    wording((found.message,))
    assert shown(found.place) == "inner:2 inner:3 cell:3"


def test_a_text_of_a_part_that_is_no_clean_yaml_names_the_use(tmp_path: Path) -> None:
    cell = "behavior_model: cell\nparts:\n  left: {use: twice.yaml}\noperations: {}\n"
    twice = "part: twice\nvariables: {a: {domain: bool, initial: true}}\nvariables: {}\n"
    (found,) = found_in(tmp_path, cell=cell, twice=twice)
    assert (found.slug, found.place.line) == ("duplicate-key", 3)
    assert found.message.endswith(f"(used in {tmp_path / 'cell.yaml'}:3)")


ANCHORED = """\
behavior_model: cell
variables:
  a: {domain: [on, off], initial: &first on}
  b: {domain: [open, closed], initial: *first}
  c: {domain: [left, right], initial: *first}
operations:
  go: {deadline: &long 10 s, pre: {g: &ready a == on}, post: &post {g: true, a: [a <- off, b <- open]}}
  come: {pre: {g: *ready}, post: *post}
"""


def test_an_error_at_an_anchor_names_the_line_of_the_alias(tmp_path: Path, wording: Wording) -> None:
    (found,) = found_in(tmp_path, cell=ANCHORED.replace("  c:", "  # c:"))
    assert uses((found,)) == [("value-outside-domain", "cell:3 cell:4")]
    wording((found.message,))


def test_an_error_of_the_anchored_text_itself_names_no_alias(tmp_path: Path) -> None:
    text = ANCHORED.replace("*first", "open").replace("c: {domain: [left, right]", "c: {domain: [open, right]")
    found = found_in(tmp_path, cell=text.replace("a == on", "a == onn").replace("b <- open", "bb <- open"))
    assert uses(found) == [("value-outside-domain", "cell:7"), ("unknown-variable", "cell:7")]


def test_an_error_deep_in_an_anchored_list_names_the_alias(tmp_path: Path) -> None:
    text = """\
behavior_model: cell
variables: {a: {domain: bool, initial: true}}
resources: {lamp: {}}
operations:
  o: {pre: {g: true, a: &light [a <- false, lamp_req_trigger <- true]}, post: {g: true}}
environment:
  e: {guard: a == true, actions: *light}
"""
    assert uses(found_in(tmp_path, cell=text)) == [("not-assignable", "cell:5 cell:7")]


@pytest.mark.longer
def test_errors_beyond_many_aliases_name_the_anchor_alone(tmp_path: Path) -> None:
    wrong = ANCHORED.replace("  c:", "  # c:")
    for more, expected in ((0, "cell:4 cell:5"), (MAX_USED_NODES, "cell:4")):
        text = wrong.replace("  a:", f"  m: {{domain: [1, &n 2{', *n' * more}], initial: 1}}\n  a:")
        found = found_in(tmp_path, cell=text)
        assert ("value-outside-domain", expected) in uses(found)


def test_an_alias_in_a_part_names_its_line_and_the_use_of_the_part(tmp_path: Path, wording: Wording) -> None:
    part = ANCHORED.replace("behavior_model: cell", "part: anchored").replace("  c:", "  # c:")
    cell = "behavior_model: cell\nparts:\n  left: {use: anchored.yaml}\n"
    (found,) = found_in(tmp_path, cell=cell, anchored=part)
    assert uses((found,)) == [("value-outside-domain", "anchored:3 anchored:4 cell:3")]
    wording((found.message,))


def test_an_anchored_argument_names_the_alias_and_the_line_of_the_part(tmp_path: Path, wording: Wording) -> None:
    cell = with_argument("stop: *e").replace("initial: healthy}", "initial: &e healthy}", 1)
    head, parts, rest = cell.partition("parts:")
    uses_of_parts, variables, declared = rest.partition("variables:")
    cell = f"{head}{variables}{declared}{parts}{uses_of_parts}"
    (found,) = found_in(tmp_path, cell=cell, device=DEVICE)
    assert shown(found.place) == "cell:4 cell:14 device:13 cell:10"
    wording((found.message,))


def test_an_error_of_an_anchored_text_is_one_whatever_it_calls_its_uses(tmp_path: Path) -> None:
    cell = "behavior_model: cell\nvariables:\n  a: &d {domain: [aa, bb], initial: cc}\n  b: *d\n  c: *d\n"
    cell += (
        "  e: {domain: bool, initial: &f dd}\n  f: {domain: 0..3, initial: *f}\n  g: {domain: [u, v], initial: *f}\n"
    )
    found = found_in(tmp_path, cell=cell + "operations: {}\n")
    assert [f"{each.slug} {shown(each.place)}" for each in found] == [
        "value-outside-domain cell:3",
        "different-kinds cell:6",
        "value-outside-domain cell:6 cell:8",
    ]
