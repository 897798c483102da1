"""Parts with types, indices and parameters: the forms of an index, and names that would stand for two things."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.files import digest_of, load_model
from scbm.model import Diagnostic, InputError, Severity

CELL = """behavior_model: cell
types: {robot: [r1, r2]}
parts: {a: {use: part.yaml, with: {%s}}}
variables:
  free[tank]: {domain: bool, initial: true}
  x: {domain: [slow, fast], initial: slow}
operations: {}
goals: {g: a.level.q2 == 3}
"""

TANKS = """part: tanks
parameters: {one: {default: q1}, who: {default: robot}, is_free: {default: free}}
types: {tank: [q1, q2]}
variables:
  level[tank]: {domain: 0..3, initial: 0}
  command[tank]: {domain: [go, stop], initial: stop}
  measured[tank]: {domain: 0..3, initial: 0}
  seen[who]: {domain: bool, initial: false}
resources:
  pump[t in tank]:
    request: ["command[t]"]
    measures: {"measured[t]": [1, 2]}
operations:
  fill[t in tank]:
    request: "pump[t]"
    with: {"command[t]": go}
    guard: level[t] < 3 && is_free[one] == true && measured[t] == 0
    effects: ["level[t] += 1"]
  first: {request: "pump[one]", with: {"command[one]": go}, guard: "level[one] == 0"}
  look[r in who]: {pre: {g: "seen[r] == false"}, post: {g: true, a: ["seen[r] <- true"]}}
goals:
  all: forall u in tank. (level[u] == 3) && exists v in who. (seen[v] == true)
"""


def written(folder: Path, arguments: str, part: str) -> Path:
    (folder / "part.yaml").write_text(part, encoding="utf-8")
    path = folder / "cell.yaml"
    path.write_text(CELL % arguments, encoding="utf-8")
    return path


def errors_of(folder: Path, arguments: str, part: str) -> list[Diagnostic]:
    with pytest.raises(InputError) as raised:
        load_model(written(folder, arguments, part))
    return [each for each in raised.value.diagnostics if each.severity is Severity.ERROR]


def with_dots(text: str) -> str:
    """Return a part whose indices stand after dots; keys of entries need brackets."""
    for word in ("t", "u", "v", "r", "one"):
        text = text.replace(f"[{word}]", f".{word}")
    return text


def test_an_index_of_a_part_is_written_in_brackets_or_after_a_dot(tmp_path: Path) -> None:
    assert "[one]" in TANKS
    assert "[" not in with_dots(TANKS).partition("fill[t in tank]")[2].partition("guard:")[2].partition("effects")[0]
    arguments = "one: q2, who: robot, is_free: free"
    bracketed = load_model(written(tmp_path, arguments, TANKS))
    assert digest_of(load_model(written(tmp_path, arguments, with_dots(TANKS)))) == digest_of(bracketed)
    first = bracketed.operation("a.first").pre
    assert str(first.g) == "a.pump.q2_req_state == initial && a.pump.q2_req_trigger == false && a.level.q2 == 0"
    assert [str(action) for action in first.a] == ["a.pump.q2_req_trigger <- true", "a.command.q2 <- go"]
    assert "free.q2 == true" in str(bracketed.operation("a.fill.q1").pre.g)


def test_a_parameter_of_a_part_can_be_a_type(tmp_path: Path) -> None:
    part = TANKS.replace("variables:\n", "variables:\n  last: {domain: who, initial: r2}\n")
    model = load_model(written(tmp_path, "who: robot", part))
    assert (model.variables[0].name, model.variables[0].domain.values) == ("a.last", ("r1", "r2"))
    assert [each.name for each in model.variables if "seen" in each.name] == ["a.seen.r1", "a.seen.r2"]
    assert [each.name for each in model.operations if "look" in each.name] == ["a.look.r1", "a.look.r2"]
    assert str(model.goal("a.all")).endswith("(a.seen.r1 == true || a.seen.r2 == true)")


@pytest.mark.parametrize("argument", ["[r1, r2]", "r1 == r2", "5"])
def test_an_argument_that_is_no_type_is_an_error_there(argument: str, tmp_path: Path) -> None:
    found = errors_of(tmp_path, f"who: {argument}", TANKS)
    assert {(each.slug, Path(each.place.file).name, each.place.line) for each in found} == {
        ("wrong-shape", "cell.yaml", 3)
    }


@pytest.mark.parametrize("part", [TANKS, with_dots(TANKS)])
def test_an_argument_that_is_no_object_is_an_error_there(part: str, tmp_path: Path) -> None:
    found = errors_of(tmp_path, "one: '3 +'", part)
    assert ("wrong-shape", 3) in [(each.slug, each.place.line) for each in found]


@pytest.mark.parametrize("with_", ['{"comand[t]": go}', '{"comand.t": go}'])
def test_a_misspelt_key_with_an_index_is_one_error(with_: str, tmp_path: Path) -> None:
    (found,) = errors_of(tmp_path, "one: q1", TANKS.replace('{"command[t]": go}', with_))
    assert (found.slug, found.place.line) == ("unknown-variable", 16)
    assert "command" in (found.remedy or "")


@pytest.mark.parametrize(
    ("section", "line"),
    [
        ("operations:\n  up[p in tank]: {pre: {g: 'level[p] < 3'}, post: {g: true, a: [level.p += 1]}}", 7),
        ("automatic_transitions:\n  up[t in tank, p in tank]: {g: 'level[p] < 3', a: [level.p += 1]}", 7),
        ("environment:\n  up[p in tank]: {guard: 'level[p] < 3', actions: [level.p += 1]}", 7),
        ("goals:\n  up[p in tank]: level[p] == 3", 7),
        ("requirements:\n  up[p in tank]: always level[p] <= 3", 7),
        ("goals:\n  all: forall t in tank, p in tank. (level[p] == level[t])", 7),
        ("goals:\n  some: exists p in tank. (level[p] == 3)", 7),
        ("goals:\n  few: count p in tank. (level[p] == 3) <= 1", 7),
        ("requirements:\n  few: always forall p in tank. (level[p] <= 3)", 7),
        ("goals:\n  both: [level.q1 == 3, 'exists p in tank. (level[p] == 3)']", 7),
        ("goals:\n  up[t in tank]: {where: 'exists p in tank. (p != t)', goal: level.t == 3}", 7),
        ("resources:\n  pump[p in tank]: {measures: {level.p: any}}", 7),
        (
            "operations:\n  up:\n    pre: {g: true}\n    post: {g: true, a: ['forall p in tank. level[p] <- 0']}",
            9,
        ),
    ],
)
def test_a_parameter_of_a_part_has_no_name_of_a_parameter_in_the_part(section: str, line: int, tmp_path: Path) -> None:
    head = "part: shadow\nparameters: {p: {default: q1}}\ntypes: {tank: [q1, q2]}\n"
    variables = "variables:\n  level[tank]: {domain: 0..3, initial: 0}\n"
    (found,) = errors_of(tmp_path, "p: q2", f"{head}{variables}{section}\n")
    assert (found.slug, Path(found.place.file).name, found.place.line) == ("duplicate-name", "part.yaml", 2)
    assert f"part.yaml:{line}" in found.message


@pytest.mark.parametrize("guard", ["level[fast] < 3 && x == speed", "(level[fast] < 3) && (x == speed)"])
def test_an_argument_does_not_become_a_parameter_where_it_stands(guard: str, tmp_path: Path) -> None:
    part = f"""part: captured
parameters: {{speed: {{}}}}
types: {{tank: [q1, q2]}}
variables:
  level[tank]: {{domain: 0..3, initial: 0}}
operations:
  up[fast in tank]: {{pre: {{g: '{guard}'}}, post: {{g: true, a: [level.fast += 1]}}}}
"""
    (found,) = errors_of(tmp_path, "speed: fast", part)
    assert (found.slug, Path(found.place.file).name, found.place.line) == ("ambiguous-symbol", "cell.yaml", 3)
    operation = load_model(written(tmp_path, "speed: slow", part)).operation("a.up.q1")
    assert str(operation.pre.g) == "a.level.q1 < 3 && x == slow"


def test_types_and_tables_of_parts_are_known_everywhere_and_their_names_must_differ(tmp_path: Path) -> None:
    part = TANKS.replace("types: {tank: [q1, q2]}", "types: {tank: [q1, q2], robot: [r3]}")
    (found,) = errors_of(tmp_path, "one: q1", part)
    assert found.slug == "duplicate-name"
    assert "rename one of them" in (found.remedy or "")


HIDDEN = """behavior_model: cell
types: {robot: [r1, y]}
parts: {a: {use: part.yaml, with: {limit: x}}}
variables:
  x: {domain: 0..3, initial: 2}
  z[robot]: {domain: bool, initial: true}
operations: {}
goals: {g: a.level.q2 == 3}
"""

TANK = """part: tank
parameters: {limit: {default: 3}}
types: {tank: [q1, q2]}
variables:
  level[tank]: {domain: 0..3, initial: 0}
operations:
  up[%s in tank]: {pre: {g: 'level[%s] < 3'}, post: {g: true, a: [level.%s += 1]}}
goals:
  full: forall %s in tank. (level[%s] == 3)
  high: exists v in tank. (level[v] == limit)
"""


@pytest.mark.parametrize("name", ["x", "y", "z"])
def test_a_parameter_in_a_part_can_have_a_name_of_the_model_that_uses_the_part(name: str, tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(HIDDEN)
    (tmp_path / "part.yaml").write_text(TANK.replace("%s", name))
    model = load_model(tmp_path / "cell.yaml")
    assert str(model.operation("a.up.q1").pre.g) == "a.level.q1 < 3"
    assert [str(action) for action in model.operation("a.up.q2").post.a] == ["a.level.q2 += 1"]
    assert str(model.goal("a.full")) == "a.level.q1 == 3 && a.level.q2 == 3"
    assert str(model.goal("a.high")) == "a.level.q1 == x || a.level.q2 == x"


@pytest.mark.parametrize("name", ["q1", "level"])
def test_a_parameter_in_a_part_has_no_name_of_an_object_or_variable_of_the_part(name: str, tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(HIDDEN)
    (tmp_path / "part.yaml").write_text(TANK.replace("%s", name))
    with pytest.raises(InputError) as raised:
        load_model(tmp_path / "cell.yaml")
    assert {Path(each.place.file).name for each in raised.value.diagnostics} == {"part.yaml"}


def test_a_parameter_in_an_included_file_has_no_name_of_the_model(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(
        HIDDEN.replace("parts: {a: {use: part.yaml, with: {limit: x}}}", "include: part.yaml").replace(
            "a.level", "level"
        )
    )
    (tmp_path / "part.yaml").write_text(TANK.replace("%s", "x"))
    with pytest.raises(InputError) as raised:
        load_model(tmp_path / "cell.yaml")
    assert [each.slug for each in raised.value.diagnostics][:2] == ["ambiguous-symbol", "duplicate-name"]


WORDS = """part: words
types: {tank: [q1, q2]}
variables:
  level[tank]: {domain: 0..3, initial: 0}
  go[tank]: {domain: bool, initial: false}
  command[tank]: {domain: [go, fill, pump, stop], initial: stop}
resources:
  pump[t in tank]: {request: ["command[t]"]}
operations:
  fill[t in tank]:
    request: "pump[t]"
    with: {"command[t]": fill}
    guard: go[t] == false
    effects: ["go[t] <- true", "level[t] <- 3"]
  idle[t in tank]:
    pre:
      g: command[t] in {go, fill, pump} && level[t] == 3
      gr: fill[t].state == initial && fill.q2.state == initial
    post: {g: true, a: ["command[t] <- go"]}
goals:
  all: forall t in tank. (command[t] == go && go[t] == true)
"""


def test_a_value_in_a_part_can_have_the_name_of_an_entry_with_an_index(tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(WORDS)
    (tmp_path / "cell.yaml").write_text(
        "behavior_model: cell\nparts: {a: {use: part.yaml}}\nvariables: {}\noperations: {}\ngoals: {}\n"
    )
    model = load_model(tmp_path / "cell.yaml")
    assert [str(each) for each in model.operation("a.fill.q1").pre.a][1:] == ["a.command.q1 <- fill"]
    idle = model.operation("a.idle.q1")
    assert str(idle.pre.g) == "a.command.q1 in {go, fill, pump} && a.level.q1 == 3"
    assert str(idle.pre.gr) == "a.fill.q1.state == initial && a.fill.q2.state == initial"
    assert str(model.goal("a.all")).startswith("a.command.q1 == go && a.go.q1 == true")


CLASH = """behavior_model: cell
%s
variables: {}
operations: {up: {pre: {g: true}, post: {g: true}}, x.up: {pre: {g: true}, post: {g: true}}}
goals: {g: current.state == executing}
"""


@pytest.mark.parametrize(
    ("used", "hint"),
    [
        ("parts: {x: {use: part.yaml}}", "rename the use `x`"),
        ("include: [part.yaml]", "use one of them under `parts`"),
    ],
)
def test_the_hint_about_two_entries_of_one_name_can_be_followed(used: str, hint: str, tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text("part: up\noperations: {up: {pre: {g: true}, post: {g: true}}}\n")
    (tmp_path / "cell.yaml").write_text(CLASH % used)
    with pytest.raises(InputError) as raised:
        load_model(tmp_path / "cell.yaml")
    (found,) = [each for each in raised.value.diagnostics if each.slug == "duplicate-name"]
    assert hint in (found.remedy or "")


@pytest.mark.parametrize(
    ("facts", "slug", "column"),
    [
        ("types: {near: {objects: [q1], of: who}}", "unknown-type", 35),
        ("tables: {near: {of: [who, robot], rows: [[r1, r2]]}}", "unknown-type", 22),
        ("tables: {near: {of: [robot, robot], rows: [[r1, one]]}}", "unknown-object", 49),
        ("tables: {near: {of: [robot], rows: [r1, one]}}", "unknown-object", 41),
    ],
)
def test_a_parameter_stands_for_nothing_in_types_and_tables_that_uses_share(
    facts: str, slug: str, column: int, tmp_path: Path
) -> None:
    (tmp_path / "part.yaml").write_text(f"part: shared\nparameters: {{one: {{}}, who: {{default: robot}}}}\n{facts}\n")
    (tmp_path / "cell.yaml").write_text(
        "behavior_model: cell\ntypes: {robot: [r1, r2]}\nvariables: {}\noperations: {}\ngoals: {}\n"
        "parts: {a: {use: part.yaml, with: {one: r2}}, b: {use: part.yaml, with: {one: r1, who: robot}}}\n"
    )
    with pytest.raises(InputError) as raised:
        load_model(tmp_path / "cell.yaml")
    (found,) = raised.value.diagnostics
    place = found.place
    assert (found.slug, Path(place.file).name, place.line, place.column) == (slug, "part.yaml", 3, column)
    assert "parameter" in found.message


def test_a_type_of_the_model_with_the_name_of_its_parameter_can_stand_in_tables_of_parts(tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(
        "part: shared\nparameters: {robot: {}}\ntables: {near: {of: [robot], rows: [r1]}}\n"
    )
    (tmp_path / "cell.yaml").write_text(
        "behavior_model: cell\ntypes: {robot: [r1, r2]}\nvariables: {}\n"
        "operations: {'up[r in robot]': {where: near(r), pre: {g: true}, post: {g: true}}}\ngoals: {}\n"
        "parts: {a: {use: part.yaml, with: {robot: robot}}}\n"
    )
    assert [each.name for each in load_model(tmp_path / "cell.yaml").operations] == ["up.r1"]
