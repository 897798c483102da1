"""Parts and included files: the model is the one that is written out, and errors stand in the file that has them."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from scbm.files import Scope, digest_of, load_model, parse_predicate
from scbm.files.codec.lifted.part_keys import PART_KEY_NAMES
from scbm.files.expansion.stage_keys import LIFTED_SECTIONS, SHARED_SECTIONS
from scbm.model import Diagnostic, Domain, DrawnVariable, InputError, Slug, Variable
from support.wording import Wording

MODEL = """\
behavior_model: cell
parts:
  left: {use: door.yaml, with: {stop: estop}}
  right: {use: door.yaml, with: {stop: estop, time: {uniform: [1 s, 2 s]}, start: closed}}
variables:
  estop: {domain: [healthy, pressed], initial: healthy, source: input}
operations:
  wait: {pre: {g: estop == healthy && left.leaf == open}, post: {g: true}}
goals:
  both: left.leaf == closed && right.leaf == closed
"""

DOOR = """\
part: door
parameters:
  stop: {help: the emergency stop}
  time: {default: 2 s}
  start: {default: open}
variables:
  leaf: {domain: [open, closed], initial: start}
  seen: {domain: bool, initial: false}
resources:
  drive: {measures: {seen: [true]}, simulation: {latency: time, measured: {seen: [true]}}}
operations:
  close:
    deadline: 10 s
    pre:
      name: begin
      g: drive_req_state == initial && drive_req_trigger == false && leaf == open
      gr: stop == healthy
      a: [drive_req_trigger <- true]
    post:
      gr: drive_req_state == succeeded
      g: true
      a: [drive_req_trigger <- false, drive_req_state <- initial, leaf <- closed]
    timedout: [drive_req_trigger <- false]
automatic_transitions:
  drive_failed:
    g: drive_req_state == failed && close.state == executing
    a: [current.state <- failed, drive_req_state <- initial]
environment:
  open_it: {guard: leaf == closed, actions: [leaf <- open]}
goals:
  is_closed: {goal: leaf == closed, may_end: [aborted]}
requirements:
  still: always leaf == closed -> drive_req_state != executing
"""

OPERATION = "operations: {o: {pre: {g: a == true}, post: {g: true}}}\n"


def one_door(name: str, latency: str, start: str) -> dict[str, str]:
    """Return the sections of one door, written out."""
    r = f"{name}.drive_req"
    return {
        "variables": f"  {name}.leaf: {{domain: [open, closed], initial: {start}}}\n"
        f"  {name}.seen: {{domain: bool, initial: false}}\n",
        "resources": f"  {name}.drive: {{measures: {{{name}.seen: [true]}}, "
        f"simulation: {{latency: {latency}, measured: {{{name}.seen: [true]}}}}}}\n",
        "operations": f"""\
  {name}.close:
    deadline: 10 s
    pre:
      name: {name}.begin
      g: {r}_state == initial && {r}_trigger == false && {name}.leaf == open
      gr: estop == healthy
      a: [{r}_trigger <- true]
    post:
      gr: {r}_state == succeeded
      g: true
      a: [{r}_trigger <- false, {r}_state <- initial, {name}.leaf <- closed]
    timedout: [{r}_trigger <- false]
""",
        "automatic_transitions": f"  {name}.drive_failed: {{g: {r}_state == failed && {name}.close.state == executing, "
        f"a: [current.state <- failed, {r}_state <- initial]}}\n",
        "environment": f"  {name}.open_it: {{guard: {name}.leaf == closed, actions: [{name}.leaf <- open]}}\n",
        "goals": f"  {name}.is_closed: {{goal: {name}.leaf == closed, may_end: [aborted]}}\n",
        "requirements": f"  {name}.still: always {name}.leaf == closed -> {r}_state != executing\n",
    }


OWN = {
    "variables": "  estop: {domain: [healthy, pressed], initial: healthy, source: input}\n",
    "operations": "  wait: {pre: {g: estop == healthy && left.leaf == open}, post: {g: true}}\n",
    "goals": "  both: left.leaf == closed && right.leaf == closed\n",
}


def written(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return folder / "cell.yaml"


def found_in(path: Path) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as raised:
        load_model(path)
    return raised.value.diagnostics


def heads(path: Path) -> list[str]:
    """Return place, slug and caret of each error."""
    return [
        f"{Path(each.place.file).name}:{each.place.line}:{each.place.column}:{each.place.length} {each.slug}"
        for each in found_in(path)
    ]


def test_a_model_with_parts_is_the_model_written_out(tmp_path: Path) -> None:
    doors = (one_door("left", "2 s", "open"), one_door("right", "{uniform: [1 s, 2 s]}", "closed"))
    text = "behavior_model: cell\n" + "".join(
        f"{section}:\n{''.join(door[section] for door in doors)}{OWN.get(section, '')}" for section in doors[0]
    )
    parts = load_model(written(tmp_path, cell=MODEL, door=DOOR))
    whole = load_model(written(tmp_path, cell=text))
    assert parts == whole
    assert digest_of(parts) == digest_of(whole)


def test_an_included_file_keeps_its_names(tmp_path: Path) -> None:
    included = load_model(
        written(
            tmp_path,
            cell=f"behavior_model: cell\ninclude: [signals.yaml]\n{OPERATION}",
            signals="part: signals\nvariables: {a: {domain: bool, initial: false}}\n",
        )
    )
    assert [variable.name for variable in included.variables] == ["a"]


def test_min_and_max_are_names_of_a_part_only_where_they_are_no_functions(tmp_path: Path) -> None:
    part = """\
part: stock
variables: {min: {domain: 0..3, initial: 0}, kept: {domain: 0..3, initial: 0}}
operations:
  put: {pre: {g: "min(min, kept) < 3"}, post: {g: true, a: [min <- min+1, "kept <- max (kept, min)"]}}
"""
    parts = "behavior_model: m\nparts: {left: {use: stock.yaml}}\nvariables: {}\noperations: {}\n"
    model = load_model(written(tmp_path, cell=parts, stock=part))
    (put,) = model.operations
    assert str(put.pre.g) == "min(left.min, left.kept) < 3"
    assert [str(action) for action in put.post.a] == [
        "left.min <- left.min + 1",
        "left.kept <- max(left.kept, left.min)",
    ]


SCOPE = Scope.over(Variable(name, Domain.integers(-4, 9), 0, (0,)) for name in ("a", "m.n"))


@pytest.mark.parametrize(
    ("argument", "guard", "action"),
    [
        ("a + 1", "m.n == 3 - (a + 1)", "m.n <- a + 1"),
        ("(a + 1)", "m.n == 3 - (a + 1)", "m.n <- a + 1"),
        ("a", "m.n == 3 - a", "m.n <- a"),
        ("-1", "m.n == 4", "m.n <- -1"),
    ],
)
def test_a_sum_as_an_argument_is_one_operand(argument: str, guard: str, action: str, tmp_path: Path) -> None:
    files = {
        "cell": "behavior_model: cell\nvariables: {a: {domain: -1..3, initial: 0}}\n"
        f"parts: {{m: {{use: machine.yaml, with: {{value: {argument}}}}}}}\n",
        "machine": "part: machine\nparameters: {value: {}}\nvariables: {n: {domain: -4..9, initial: 0}}\n"
        "operations: {o: {pre: {g: n == 3 - value, a: [n <- value]}, post: {g: true}}}\n",
    }
    before = load_model(written(tmp_path, **files)).operation("m.o").pre
    assert before.g == parse_predicate(guard, SCOPE)
    assert [str(each) for each in before.a] == [action]


@pytest.mark.parametrize(
    ("written_guard", "guard"), [("!busy", "!(a == 0 || a == 1)"), ("n == 0 && busy", "m.n == 0 && (a == 0 || a == 1)")]
)
def test_a_predicate_as_an_argument_is_one_operand(written_guard: str, guard: str, tmp_path: Path) -> None:
    files = {
        "cell": "behavior_model: cell\nvariables: {a: {domain: -1..3, initial: 0}}\n"
        "parts: {m: {use: machine.yaml, with: {busy: a == 0 || a == 1}}}\n",
        "machine": "part: machine\nparameters: {busy: {}}\nvariables: {n: {domain: -4..9, initial: 0}}\n"
        f"operations: {{o: {{pre: {{g: '{written_guard}'}}, post: {{g: true}}}}}}\n",
    }
    assert load_model(written(tmp_path, **files)).operation("m.o").pre.g == parse_predicate(guard, SCOPE)


def test_parts_of_parts_have_names_of_both(tmp_path: Path) -> None:
    model = load_model(
        written(
            tmp_path,
            cell="behavior_model: cell\nparts: {m: {use: machine.yaml, with: {first: true}}}\n"
            "operations: {o: {pre: {g: m.ready == true && m.lock.shut == true}, post: {g: true}}}\n",
            machine="part: machine\nparameters: {first: {}}\n"
            "parts: {lock: {use: lock.yaml, with: {whose: ready, first: first}}}\n"
            "variables: {ready: {domain: bool, initial: false}}\n"
            "requirements: {shut: always ready == true -> lock.shut == true}\n",
            lock="part: lock\nparameters: {whose: {}, first: {}}\nvariables: {shut: {domain: bool, initial: first}}\n"
            "requirements: {both: always whose == true -> shut == true}\n",
        )
    )
    assert [(variable.name, variable.initial) for variable in model.variables] == [
        ("m.lock.shut", True),
        ("m.ready", False),
    ]
    assert [(each.name, str(each.sentence)) for each in model.requirements] == [
        ("m.lock.both", "always m.ready == true -> m.lock.shut == true"),
        ("m.shut", "always m.ready == true -> m.lock.shut == true"),
    ]


def test_an_error_stands_in_the_part_and_names_the_line_that_uses_it(tmp_path: Path) -> None:
    alone = MODEL.replace("  right", "  # right").replace(" && right.leaf == closed", "")
    (found,) = found_in(written(tmp_path, cell=alone, door=DOOR.replace("gr: stop ==", "gr: stopp ==")))
    assert Path(found.place.file).name == "door.yaml"
    assert (found.place.line, found.place.column, found.place.length) == (17, 11, 5)
    assert found.source_line == "      gr: stopp == healthy"
    assert found.message.endswith(f"(used in {tmp_path / 'cell.yaml'}:3)")


def test_a_wrong_argument_is_an_error_where_it_is_given(tmp_path: Path) -> None:
    assert heads(written(tmp_path, cell=MODEL.replace("stop: estop}", "stop: estopp}"), door=DOOR)) == [
        "cell.yaml:3:39:6 unknown-variable"
    ]
    assert heads(written(tmp_path, cell=MODEL.replace("[1 s, 2 s]", "[1 s, 2]"), door=DOOR)) == [
        "cell.yaml:4:69:1 bare-duration"
    ]


@pytest.mark.parametrize(
    ("wrong", "expected"),
    [
        ("parts: {d: {use: dor.yaml, with: {stop: e}}}", ["cell.yaml:2:18:8 file-missing"]),
        ("parts: {d: {use: 'scbm:dor'}}", ["cell.yaml:2:18:10 file-missing"]),
        ("parts: {d: {use: /etc/passwd}}", ["cell.yaml:2:18:11 file-unreadable"]),
        ("parts: {d: {use: ../door.yaml}}", ["cell.yaml:2:18:12 file-unreadable"]),
        ("parts: {d: {use: door.yaml}}", ["cell.yaml:2:9:1 missing-key"]),
        ("parts: {d: {use: door.yaml, with: {stopp: e}}}", ["cell.yaml:2:36:5 unknown-name"]),
        ("parts: {d: {use: door.yaml, wiht: {}, with: {stop: e}}}", ["cell.yaml:2:29:4 unknown-key"]),
        ("parts: {d: {use: door.yaml, with: 3}}", ["cell.yaml:2:9:1 missing-key", "cell.yaml:2:29:4 wrong-shape"]),
        ("parts: {d: {with: {}}}", ["cell.yaml:2:9:1 missing-key"]),
        ("parts: {d: door.yaml}", ["cell.yaml:2:9:1 wrong-shape"]),
        ("parts: [door.yaml]", ["cell.yaml:2:1:5 wrong-shape"]),
        ("parts: {d: {use: [door.yaml]}}", ["cell.yaml:2:18:1 wrong-shape"]),
        ("parts: {d.e: {use: door.yaml, with: {stop: e}}}", ["cell.yaml:2:9:3 bad-name"]),
        ("parts: {0d: {use: door.yaml, with: {stop: e}}}", ["cell.yaml:2:9:2 bad-name"]),
        ("parts: {0d: {use: door.yaml}}", ["cell.yaml:2:9:2 bad-name", "cell.yaml:2:9:2 missing-key"]),
        ("include: door.yaml", ["cell.yaml:2:10:9 missing-key"]),
        ("include: [cycle.yaml]", ["cycle.yaml:2:10:10 contradiction"]),
        ("include: cell.yaml", ["cell.yaml:1:1:14 wrong-shape"]),
        ("include: [own.yaml]", ["cell.yaml:3:13:1 duplicate-name"]),
        ("include: odd.yaml", ["odd.yaml:1:1:5 unknown-key", "odd.yaml:2:17:1 wrong-shape",
                               "odd.yaml:2:24:7 unknown-key"]),
        ("include: [hidden.yaml]", ["hidden.yaml:2:14:1 duplicate-name"]),
        ("include: [text.yaml]", ["text.yaml:1:1:4 wrong-shape"]),
    ],
)  # fmt: skip
def test_what_can_be_wrong_about_a_part(wrong: str, expected: list[str], tmp_path: Path) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    (tmp_path / "door.yaml").write_text(DOOR)
    path = written(
        folder,
        cell=f"behavior_model: cell\n{wrong}\nvariables: {{e: {{domain: bool, initial: false, source: input}}}}\n"
        "operations: {o: {pre: {g: e == true}, post: {g: true}}}\n",
        door="part: door\nparameters: {stop: {}}\nrequirements: {r: always stop == true}\n",
        cycle="part: cycle\ninclude: cycle.yaml\n",
        names="part: names\nvariables: {n: {domain: bool, initial: false}}\n",
        own="part: own\nvariables: {e: {domain: bool, initial: false}}\n",
        odd="parrt: odd\nparameters: {p: 3, q: {defualt: 3}}\n",
        hidden="part: hidden\nparameters: {p: {default: 3}}\nvariables: {p: {domain: bool, initial: false}}\n",
        text="text\n",
    )
    assert heads(path) == expected


ISLAND = """\
part: island
parameters: {stop: {}}
types: {zone: [a, b], robot: [r1, r2]}
tables: {near: {of: [zone, zone], rows: [[a, b], [b, a]]}}
variables:
  at[robot]: {domain: zone, initial: a}
  load[robot]: {domain: 0..3, initial: 0}
resources:
  arm[robot]: {}
operations:
  move[r in robot, x in zone, y in zone]:
    where: near(x, y)
    request: arm[r]
    guard: at[r] == x && forall o in robot. (o == r || at[o] != y)
    pre: {gr: stop == healthy}
    effects: [at.r <- y]
goals:
  one[r in robot]: load[r] >= 1
requirements:
  few: always load.r1 + load.r2 <= 3
  there: always move[r1, a, b].state == executing -> at[r1] == a && arm_req_state[r2] == initial
"""


def test_a_part_can_have_objects_requests_and_sums(tmp_path: Path) -> None:
    model = load_model(
        written(
            tmp_path,
            cell="behavior_model: cell\nparts:\n  left: {use: island.yaml, with: {stop: estop}}\n"
            "  right: {use: island.yaml, with: {stop: estop}}\noperations: {}\n"
            "variables: {estop: {domain: [healthy, pressed], initial: healthy, source: input}}\n"
            "goals:\n  all: forall r in robot. (left.at[r] == b)\n",
            island=ISLAND,
        )
    )
    assert [operation.name for operation in model.operations[:3]] == [
        "left.move.r1.a.b",
        "left.move.r1.b.a",
        "left.move.r2.a.b",
    ]
    assert str(model.operation("right.move.r2.a.b").pre.running_guard) == (
        "(right.arm.r2_req_state == initial && right.arm.r2_req_trigger == false && right.at.r2 == a"
        " && right.at.r1 != b) && estop == healthy"
    )
    assert [str(requirement.sentence) for requirement in model.requirements[2:]] == [
        "always right.load.r1 + right.load.r2 <= 3",
        "always right.move.r1.a.b.state == executing -> right.at.r1 == a && right.arm.r2_req_state == initial",
    ]
    assert str(model.goal("all")) == "left.at.r1 == b && left.at.r2 == b"


def test_what_two_files_include_is_there_once(tmp_path: Path) -> None:
    model = load_model(
        written(
            tmp_path,
            cell=f"behavior_model: cell\ninclude: [first.yaml, second.yaml]\n{OPERATION}",
            first="part: first\ninclude: common.yaml\n",
            second="part: second\ninclude: [common.yaml]\n",
            common="part: common\nvariables: {a: {domain: bool, initial: false}}\n",
        )
    )
    assert [variable.name for variable in model.variables] == ["a"]


@pytest.mark.parametrize("name", ["round.yaml", "round.yaml/door.yaml", '"a\\0b.yaml"', '"scbm:\\0"'])
@pytest.mark.parametrize("use", ["include: [{}]", "parts: {{a: {{use: {}}}}}"])
def test_a_name_that_leads_to_no_file_is_a_located_error(use: str, name: str, tmp_path: Path) -> None:
    (tmp_path / "round.yaml").symlink_to("round.yaml")
    path = written(tmp_path, cell=f"behavior_model: cell\n{use.format(name)}\n{OPERATION}")
    with pytest.raises(InputError) as raised:
        load_model(path)
    (found,) = raised.value.diagnostics
    assert found.slug in {Slug.FILE_UNREADABLE, Slug.FILE_MISSING}
    assert (found.place.file, found.place.line, found.place.length) == (str(path), 2, len(name))
    assert found.message.isprintable()
    assert ("NUL character" in found.message) is ("a\\0b" in name)
    assert ("`a\\x00b.yaml`" in found.message) is ("a\\0b" in name)


def test_a_folder_can_be_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cell").mkdir()
    (tmp_path / "parts").mkdir()
    written(tmp_path / "parts", names="part: names\nvariables: {a: {domain: bool, initial: false}}\n")
    path = written(
        tmp_path / "cell",
        cell=f"behavior_model: cell\ninclude: ../parts/names.yaml\n{OPERATION}",
    )
    assert heads(path) == ["cell.yaml:2:10:19 file-unreadable"]
    monkeypatch.setenv("SCBM_PARTS", str(tmp_path / "parts"))
    assert load_model(path).name == "cell"


@pytest.mark.slow
def test_parts_that_multiply_are_refused_before_they_fill_the_memory(tmp_path: Path) -> None:
    for level in range(1, 9):
        uses = ", ".join(f"p{index}: {{use: level{level - 1}.yaml}}" for index in range(10))
        written(tmp_path, **{f"level{level}": f"part: level{level}\nparts: {{{uses}}}\n"})
    written(tmp_path, level0="part: level0\nvariables: {a: {domain: bool, initial: false}}\n")
    (found,) = found_in(written(tmp_path, cell="behavior_model: cell\nparts: {all: {use: level8.yaml}}\n"))
    assert found.slug == "yaml-too-large"


def test_the_sections_of_a_part_are_those_that_are_copied() -> None:
    assert PART_KEY_NAMES.part == ("part", "parameters", "include", "parts", *SHARED_SECTIONS, *LIFTED_SECTIONS)


GUARDED = """\
part: guarded
parameters: {stop: {}}
variables: {x: {domain: 0..3, initial: 0}}
operations:
  go: {pre: {g: x < 2 && stop == healthy, a: [x <- 1]}, post: {g: stop == healthy || x == 1}}
"""


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ('"estop == pressed || estop"', "`stop` stands for a name here, and this is a condition"),
        ('"estop == healthy && estop"', "`stop` stands for a name here, and this is a condition"),
        ("[estop]", "`stop` stands for a name here, and this is a list"),
        ("{name: estop}", "`stop` stands for a name here, and this is a mapping"),
        ('""', "`stop` stands for a name here, and this is empty"),
        ("null", "`stop` stands for a name here, and this is empty"),
        ('"estop) || (estop"', "`stop` stands for one unit here, and the brackets of this do not match"),
    ],
)
def test_an_argument_that_does_not_fit_is_one_error_there(argument: str, message: str, tmp_path: Path) -> None:
    cell = f"behavior_model: cell\nparts:\n  left: {{use: guarded.yaml, with: {{stop: {argument}}}}}\nvariables:\n"
    cell += "  estop: {domain: [healthy, pressed], initial: healthy}\noperations: {}\n"
    (found,) = found_in(written(tmp_path, cell=cell, guarded=GUARDED))
    words = found.message.partition(" (used in ")[0]
    assert (words, Path(found.place.file).name, found.place.line) == (message, "cell.yaml", 3)


@pytest.mark.parametrize("name", ["true", "state", "current", "plan", "none", "forall", "never"])
def test_a_reserved_word_is_no_name_of_a_part(name: str, tmp_path: Path) -> None:
    path = written(tmp_path, cell=MODEL.replace("right:", f"{name}:").replace("right.", "left."), door=DOOR)
    assert heads(path) == [f"cell.yaml:4:3:{len(name)} reserved-name"]


def test_an_included_file_whose_parameter_needs_a_value_belongs_under_parts(tmp_path: Path) -> None:
    (found,) = found_in(written(tmp_path, cell=f"{MODEL}include: guarded.yaml\n", door=DOOR, guarded=GUARDED))
    assert found.remedy == "use it under `parts`: `parts: {NAME: {use: guarded.yaml, with: {stop: …}}}`"


def test_the_path_of_a_part_is_shown_without_detours(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    cell = "behavior_model: cell\ninclude: sub/../more.yaml\nvariables: {}\noperations: {}\n"
    (found,) = found_in(written(tmp_path, cell=cell, more="part: more\nmore: 1\nvariables: {}\n"))
    assert found.place.file == str(tmp_path / "more.yaml")


def test_a_part_is_checked_with_a_model_that_uses_it(tmp_path: Path, wording: Wording) -> None:
    (found,) = found_in(written(tmp_path, cell=GUARDED))
    wording((found.message, found.remedy))


REPORTING = """\
part: reporting
parameters: {seen: {}}
resources:
  camera: {measures: {seen: any}, simulation: {measured: {seen: any}}}
operations:
  look: {request: camera}
"""


def reporting(tmp_path: Path, argument: str) -> Path:
    cell = f"behavior_model: cell\nparts:\n  left: {{use: reporting.yaml, with: {{seen: {argument}}}}}\nvariables:\n"
    return written(tmp_path, cell=f"{cell}  item: {{domain: [box, tube], initial: box}}\n", reporting=REPORTING)


def test_a_parameter_can_be_the_key_of_a_mapping_of_variables(tmp_path: Path) -> None:
    (camera,) = load_model(reporting(tmp_path, "item")).resources
    assert camera.measures == ("item",)
    assert [drawn.name for drawn in camera.simulation.measured] == ["item"]


WEIGHING = """\
part: weighing
parameters: {chance: {}}
variables: {seen: {domain: [box, none], initial: none}, g: {domain: bool, initial: false}}
resources:
  camera: {measures: {seen: any}, simulation: {measured: {seen: {box: chance, none: 1}}, failed: {seen: {none: 1}}}}
operations:
  look: {pre: {g: g == true}, post: {g: true}, failed: {g: g == false, a: [g <- true]}}
"""


def test_what_replies_of_a_part_draw_from_has_its_prefix_and_its_arguments(tmp_path: Path) -> None:
    cell = "behavior_model: cell\nparts:\n  left: {use: weighing.yaml, with: {chance: 3}}\n"
    model = load_model(written(tmp_path, cell=f"{cell}variables: {{}}\noperations: {{}}\n", weighing=WEIGHING))
    simulation = model.resources[0].simulation
    assert simulation.measured == (DrawnVariable("left.seen", ("box", "none"), (Fraction(3), Fraction(1))),)
    assert simulation.failed == (DrawnVariable("left.seen", ("none",), (Fraction(1),)),)
    assert [str(model.operations[0].failed)] == ["fail_left.look: left.g == false / true / [left.g <- true] / []"]


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("[item]", "`seen` stands for a name here, and this is a list"),
        ("item == box", "`seen` stands for the name of a variable here, and this is no name"),
        ("5", "`seen` stands for the name of a variable here, and this is no name"),
        ("null", "`seen` stands for a name here, and this is empty"),
    ],
)
def test_an_argument_that_is_no_key_is_one_error_there(argument: str, message: str, tmp_path: Path) -> None:
    (found,) = found_in(reporting(tmp_path, argument))
    words = found.message.partition(" (used in ")[0]
    assert (words, Path(found.place.file).name, found.place.line) == (message, "cell.yaml", 3)


@pytest.mark.parametrize(
    "section", ["variables: {stop: {domain: bool, initial: false}}", "goals: {stop: stop == healthy}"]
)
def test_a_parameter_is_no_name_of_an_entry(section: str, tmp_path: Path) -> None:
    guarded = f"part: guarded\nparameters: {{stop: {{}}}}\n{section}\n"
    cell = MODEL.replace("  right:", "  more: {use: guarded.yaml, with: {stop: estop}}\n  right:")
    (found,) = found_in(written(tmp_path, cell=cell, door=DOOR, guarded=guarded))
    assert (found.slug, Path(found.place.file).name, found.place.line) == ("duplicate-name", "guarded.yaml", 2)


BOUND = """\
part: bound
parameters: {code: {}}
variables:
  scan: {domain: [none, all], initial: none}
  seen: {domain: bool, initial: false}
  near: {domain: bool, initial: false}
resources:
  arm:
    request: [scan]
    measures: [seen]
    publishes: [near]
    ros:
      services:
        scan:
          none: {name: /scan/none, type: TYPE, request: {scan: scan}, succeeded: {seen: true}, measured: {seen: seen}}
          all:
            name: /scan/all
            type: TYPE
            request: {scan: [code, {variable: scan, values: {scan: seen}}]}
            succeeded: {seen: true}
            measured: {seen: seen}
      measured: {near: {topic: /near/scan, type: std_msgs/msg/Bool}}
  lamp:
    ros: {topics: {request: /lamp/request, reply: /lamp/scan}}
operations:
  look: {request: arm, with: {scan: all}}
""".replace("TYPE", "p/srv/S")


def test_a_binding_in_a_part_keeps_its_names_and_reads_variables_of_the_copy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scbm.nodes.bindings.binding_keys.has_library", lambda: False)  # so that no file is needed
    cell = "behavior_model: cell\nparts:\n  left: {use: bound.yaml, with: {code: some}}\n"
    arm, lamp = load_model(written(tmp_path, cell=cell, bound=BOUND)).resources
    assert arm.binding is not None
    assert lamp.binding is not None
    written_arm = arm.binding.written
    calls = written_arm["services"]["left.scan"]
    assert [(call["name"], call["request"], call["measured"]) for call in calls.values()] == [
        ("/scan/none", {"scan": "left.scan"}, {"left.seen": "seen"}),
        ("/scan/all", {"scan": ["some", {"variable": "left.scan", "values": {"scan": "seen"}}]}, {"left.seen": "seen"}),
    ]
    assert written_arm["measured"]["left.near"]["topic"] == "/near/scan"
    assert lamp.binding.written == {"topics": {"request": "/lamp/request", "reply": "/lamp/scan"}}


@pytest.mark.parametrize(
    ("section", "name"),
    [
        ("variables: {in: {domain: bool, initial: false}}", "in"),
        ("operations: {plan: {pre: {g: true}, post: {g: true}}}", "plan"),
        ("goals: {'never[z in zone]': true}\ntypes: {zone: [a]}", "never"),
    ],
)
def test_a_reserved_word_is_no_name_of_an_entry_of_a_part(section: str, name: str, tmp_path: Path) -> None:
    cell = "behavior_model: cell\nparts: {left: {use: part.yaml}}\n"
    path = written(tmp_path, cell=f"{cell}{OPERATION.replace('a == true', 'true')}", part=f"part: part\n{section}\n")
    found = [each for each in found_in(path) if each.slug == "reserved-name"]
    assert [(Path(each.place.file).name, each.place.line) for each in found] == [("part.yaml", 2)]
    assert f"`{name}`" in found[0].message


def test_an_empty_list_in_a_part_stays_a_list(tmp_path: Path) -> None:
    part = "part: part\nvariables: {}\noperations:\n  o: {pre: {g: true, a: []}, post: {g: true}}\n"
    path = written(tmp_path, cell="behavior_model: cell\nparts: {left: {use: part.yaml}}\n", part=part)
    assert [operation.name for operation in load_model(path).operations] == ["left.o"]


def test_an_empty_section_of_an_included_file_is_there(tmp_path: Path) -> None:
    part = "part: part\nvariables: {}\noperations: {}\n"
    model = load_model(written(tmp_path, cell="behavior_model: cell\ninclude: part.yaml\n", part=part))
    assert (model.variables, model.operations) == ((), ())


def test_an_error_of_all_uses_of_a_part_is_one_error_with_the_names_of_the_part(
    tmp_path: Path, wording: Wording
) -> None:
    door = DOOR.replace("leaf == open\n", "leaf == opened\n", 1).replace("initial, leaf <- closed", "initial, lef <- 1")
    outer = "part: outer\nparts: {inner: {use: door.yaml, with: {stop: well}}}\n"
    outer += "variables: {well: {domain: [healthy, pressed]}}\n"
    cell = MODEL.replace("variables:\n", "  deep: {use: outer.yaml}\nvariables:\n")
    found = found_in(written(tmp_path, cell=cell, door=door, outer=outer))
    places = [(Path(each.place.file).name, each.place.line) for each in found]
    assert places == [("door.yaml", 16), ("door.yaml", 22), ("outer.yaml", 3)]
    wording((*(each.message for each in found), found[1].remedy))


def test_a_file_that_is_no_part_is_an_error_that_names_its_use(tmp_path: Path) -> None:
    cell = tmp_path / "cell.yaml"
    cell.write_text("behavior_model: cell\nparts: {d: {use: other.yaml}}\n", encoding="utf-8")
    (tmp_path / "other.yaml").write_text("behavior_model: other\n", encoding="utf-8")
    with pytest.raises(InputError) as raised:
        load_model(cell)
    (first, *_) = raised.value.diagnostics
    assert first.place.file == str(tmp_path / "other.yaml")
    assert first.message.endswith(f"(used in {cell}:2)")


def test_a_byte_of_a_part_that_is_not_utf8_has_its_place_in_the_part(tmp_path: Path) -> None:
    (tmp_path / "latin.yaml").write_bytes(b"part: latin\n# caf\xe9\n")
    model = tmp_path / "model.yaml"
    model.write_text("behavior_model: m\nparts:\n  one: {use: latin.yaml}\n", encoding="utf-8")
    with pytest.raises(InputError) as raised:
        load_model(model)
    (found,) = raised.value.diagnostics
    assert (found.slug, found.place.file) == (Slug.NOT_UTF8, str(tmp_path / "latin.yaml"))
    assert (found.place.line, found.place.column) == (2, 6)
    assert f"used in {model}:3" in found.message


CNC = """\
part: cnc
parameters:
  cycle: {default: 40 s}
  limit: {default: 60 s}
  stop: {help: stop variable}
types: {shelf: [s1, s2]}
variables:
  work: {domain: [none, raw, cut], initial: none}
  slot[shelf]: {domain: bool, initial: false}
resources:
  spindle: {simulation: {latency: cycle}}
operations:
  cut: {request: spindle, deadline: limit, guard: work == raw && stop == healthy, effects: [work <- cut]}
  put[s in shelf]: {pre: {g: work == cut && slot.s == false}, post: {g: true, a: [work <- none, slot.s <- true]}}
goals:
  all_cut: forall s in shelf. (slot[s] == true)
"""

LINE = """\
behavior_model: line
parts:
  m1: {use: cnc.yaml, with: {stop: estop}}
  m2: {use: cnc.yaml, with: {stop: estop}}
variables:
  estop: {domain: [healthy, pressed], initial: healthy, source: input}
operations:
  load: {pre: {g: m1.work == none}, post: {g: true, a: [m1.work <- raw]}}
  reload: {pre: {g: m2.work == none}, post: {g: true, a: [m2.work <- raw]}}
goals:
  done: m1.work == cut
"""


@pytest.mark.parametrize(
    ("right", "wrong", "underlined"),
    [
        ("stop == healthy", "stpo == healthy", "stpo"),
        ("guard: work ==", "guard: wrk ==", "wrk"),
        ("guard: work ==", "guard: zzz ==", "zzz"),
        ("latency: cycle", "latency: cylce", "cylce"),
        ("deadline: limit", "deadline: limt", "limt"),
        ("put[s in shelf]", "put[s in shelv]", "shelv"),
        ("request: spindle", "request: spindel", "spindel"),
    ],
)
def test_remedies_in_a_part_name_what_the_part_knows(
    tmp_path: Path, right: str, wrong: str, underlined: str, wording: Wording
) -> None:
    (tmp_path / "cnc.yaml").write_text(CNC.replace(right, wrong))
    (tmp_path / "line.yaml").write_text(LINE)
    with pytest.raises(InputError) as caught:
        load_model(tmp_path / "line.yaml")
    (found,) = caught.value.diagnostics
    line = found.source_line or ""
    assert line[found.place.column - 1 :][: found.place.length] == underlined
    assert "estop" not in (found.remedy or "")
    wording(found.remedy or "")
