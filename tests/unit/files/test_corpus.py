"""The models of `tests/models`: the wrong ones get exactly the diagnostics beside them, the right ones mean what is
written beside them. With `--update-golden` the expectations are written; then read them as a user would.
"""

from __future__ import annotations

import re
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from scbm.files import load_model, read_model
from scbm.files.yaml.error_collector import MAX_ERRORS
from scbm.files.yaml.text_files import MAX_BYTES
from scbm.model import InputError, PlannerChoice, RunsDeclaration, Slug, format_duration, format_value
from support.profiles import longer_but_one_in, slow_beyond
from support.wording import Wording

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Diagnostic, DrawnVariable, Latency, Operation, Resource, Value

MODELS = Path(__file__).parent.parent.parent / "models"
REJECTED = sorted((MODELS / "rejected").glob("*.yaml"))
WRONG = {slug: list(paths) for slug, paths in groupby(REJECTED, key=lambda path: path.stem.partition("_")[0])}
"""The rejected models by the slug that they are named after; `many` show several."""
VALID = sorted((MODELS / "valid").glob("*.yaml"))

OF_THE_FILE = {
    Slug.FILE_MISSING,
    Slug.FILE_IS_DIRECTORY,
    Slug.FILE_UNREADABLE,
    Slug.FILE_TOO_LARGE,
    Slug.FILE_EMPTY,
    Slug.NOT_UTF8,
    Slug.TEXT_TOO_LONG,
}
"""What no model in a repository can cause well: each has a test below."""

OF_MODELS_TOO = {
    Slug.UNKNOWN_GOAL,
    Slug.CONTRADICTION,
    Slug.UNKNOWN_OBLIGATION,
    Slug.UNKNOWN_RESOURCE,
    Slug.UNKNOWN_WORD,
}
OF_NO_MODEL = set(list(Slug)[list(Slug).index(Slug.BAD_OPTION) :]) - OF_MODELS_TOO
"""What commands, traces and `scbm check` report of a model that loads: the groups at the end of the list of slugs."""


def diagnostics_of(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as raised:
        read_model(text, "model.yaml")
    return raised.value.diagnostics


@cache
def error_of_file(path: Path) -> InputError:
    with pytest.raises(InputError) as raised:
        load_model(path)
    return raised.value.with_traceback(None)  # what the loader has read is not kept


def the_diagnostic_of_file(path: Path) -> Diagnostic:
    with pytest.raises(InputError) as raised:
        load_model(path)
    (diagnostic,) = raised.value.diagnostics
    return diagnostic


# the corpus


@pytest.mark.parametrize("slug", WRONG)
def test_wrong_models_get_exactly_these_diagnostics(slug: str, request: pytest.FixtureRequest) -> None:
    shown = {path: str(error_of_file(path)).replace(str(path), path.name) for path in WRONG[slug]}
    shown = {path: text.replace(f"{MODELS}/", "") + "\n" for path, text in shown.items()}
    if request.config.getoption("--update-golden"):
        for path, text in shown.items():
            path.with_suffix(".expected").write_text(text, encoding="utf-8")
    assert shown == {path: path.with_suffix(".expected").read_text(encoding="utf-8") for path in shown}
    assert [path.stem for path, text in shown.items() if f"error[{slug}]" not in text and slug != "many"] == []
    assert [wrong for path in WRONG[slug] for wrong in wrongly_placed(path)] == []


def wrongly_placed(path: Path) -> list[Diagnostic]:
    """Return the diagnostics whose place lies outside of the text; those of other files follow those of the model."""
    lines = re.split(r"\r\n|\r|\n", path.read_text(encoding="utf-8"))
    everywhere = error_of_file(path).diagnostics
    here = [found for found in everywhere if found.place.file == str(path)]
    assert tuple(here) == everywhere[: len(here)]
    places = [(found.place.line, found.place.column) for found in here]
    assert places == sorted(places), "errors read downwards"
    return [
        found
        for found in here
        if found.source_line != lines[found.place.line - 1]
        or not 1 <= found.place.column <= len(found.source_line or "") + 1
    ]


@pytest.mark.parametrize("path", VALID, ids=lambda path: path.stem)
def test_a_right_model_means_what_is_written_beside_it(path: Path, request: pytest.FixtureRequest) -> None:
    shown, expected = "".join(f"{fact}\n" for fact in facts(load_model(path))), path.with_suffix(".expected")
    if request.config.getoption("--update-golden"):
        expected.write_text(shown, encoding="utf-8")
    assert shown == expected.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", longer_but_one_in(3, VALID), ids=lambda path: path.stem)
def test_a_right_model_means_the_same_with_other_line_ends_and_a_mark(path: Path) -> None:
    lines = re.split(r"\r\n|\n", path.read_bytes().decode("utf-8").removeprefix("\N{BYTE ORDER MARK}"))
    model = load_model(path)
    texts = [end.join(lines) for end in ("\n", "\r\n", "\r")]
    for text in (*texts, "\N{BYTE ORDER MARK}" + texts[1]):
        assert read_model(text, str(path)) == model


def test_every_slug_that_a_model_can_cause_is_in_some_expectation() -> None:
    assert not OF_THE_FILE & OF_NO_MODEL
    shown = "".join(path.with_suffix(".expected").read_text(encoding="utf-8") for path in REJECTED)
    caused = {Slug(slug) for slug in re.findall(r"^\S+: error\[([a-z0-9-]+)\]", shown, re.MULTILINE)}
    assert caused == set(Slug) - OF_THE_FILE - OF_NO_MODEL


@pytest.mark.parametrize("folder", ["rejected", "valid"])
def test_every_expectation_has_its_model(folder: str) -> None:
    models = {path.stem for path in (MODELS / folder).glob("*.yaml")}
    assert models == {path.stem for path in (MODELS / folder).glob("*.expected")}


def test_the_files_with_odd_bytes_still_have_them() -> None:
    assert b"\r\n" in (MODELS / "valid" / "crlf.yaml").read_bytes()
    assert b"\n" not in (MODELS / "valid" / "crlf.yaml").read_bytes().replace(b"\r\n", b"")
    assert (MODELS / "valid" / "byte_order_mark.yaml").read_bytes().startswith(b"\xef\xbb\xbf")
    assert b"\t" in (MODELS / "rejected" / "yaml-syntax_tab.yaml").read_bytes()


def test_a_line_with_carriage_return_is_shown_without_it() -> None:
    text = (MODELS / "valid" / "crlf.yaml").read_bytes().decode("utf-8")
    (diagnostic,) = diagnostics_of(text.replace("&& n == 0", "&& m == 0", 1))
    assert (diagnostic.place.line, diagnostic.place.column) == (8, 8)
    assert diagnostic.source_line == "    && m == 0"


# the output about a model, one line for each fact


def facts(model: BehaviorModel) -> Iterator[str]:
    yield f"model {model.name}"
    for variable in model.variables:
        drawn = "" if variable.random == (variable.initial,) else f", random {values(variable.random)}"
        yield f"variable {variable.name}: {variable.domain}, initial {format_value(variable.initial)}{drawn}"
    for resource in model.resources:
        yield f"resource {resource.name}: {', '.join(facts_of_resource(resource))}"
    for operation in model.operations:
        yield f"operation {operation.name}: {', '.join(facts_of_operation(operation))}"
        yield f"  pre {operation.pre}"
        yield f"  post {operation.post}"
        if operation.failed is not None:
            yield f"  failed {operation.failed}"
        if operation.timedout:
            yield f"  timedout [{', '.join(map(str, operation.timedout))}]"
    yield from (f"automatic {transition}" for transition in model.automatic_transitions)
    for each in model.environment:
        rate = "" if each.rate is None else f", {each.rate.kind} {latency(each.rate.time)}"
        yield f"environment {each}{rate}"
    yield f"initial states {model.initial_states}"
    yield from (f"goal {name}: {goal}" for name, goal in model.goals)
    yield from (f"requirement {requirement}" for requirement in model.requirements)
    yield from (f"requirement {name} off: {reason}" for name, reason in model.requirements_off)
    yield from (f"requirement {name} on" for name in model.requirements_on)
    if model.runs != RunsDeclaration():
        yield str(model.runs)
    if model.planner != PlannerChoice():
        yield str(model.planner)


def facts_of_resource(resource: Resource) -> Iterator[str]:
    yield f"request [{', '.join(resource.request)}]"
    yield f"measures [{', '.join(resource.measures)}]"
    if resource.publishes:
        yield f"publishes [{', '.join(resource.publishes)}]"
    yield from (f"sends {name} from {values(sent)}" for name, sent in resource.values)
    if resource.shared:
        yield "shared"
    if resource.parallel:
        yield "parallel"
    yield latency(resource.simulation.latency)
    yield from (f"{outcome} {probability}" for outcome, probability in resource.simulation.outcomes)
    yield from (f"{drawn.name} from {weighted(drawn)}" for drawn in resource.simulation.measured)
    yield from (f"failed {drawn.name} from {weighted(drawn)}" for drawn in resource.simulation.failed)
    if resource.binding is not None:
        yield f"real {resource.binding.written}"


def weighted(drawn: DrawnVariable) -> str:
    pairs = zip(map(format_value, drawn.values), drawn.weights, strict=True) if drawn.weights else ()
    return ", ".join(f"{value} {weight}" for value, weight in pairs) or values(drawn.values)


def latency(time: Latency) -> str:
    return f"{time.shape} {' '.join(format_duration(point_ns) for point_ns in time.points_ns)}"


def facts_of_operation(operation: Operation) -> Iterator[str]:
    yield "no deadline" if operation.deadline_ns is None else f"deadline {format_duration(operation.deadline_ns)}"
    if operation.disabled_deadline_ns is not None:
        yield f"disabled deadline {format_duration(operation.disabled_deadline_ns)}"


def values(shown: tuple[Value, ...]) -> str:
    return f"[{', '.join(map(format_value, shown))}]" if len(shown) <= 10 else f"{len(shown)} values"


# one mistake, one error


USES = """operations:
  scan:
    pre: {g: a == true && n < 3 && at == home, a: [arm_req_trigger <- true, b <- a]}
    post: {g: "n in {0, 1} -> at != agv", gr: arm_req_state == succeeded, a: [at <- agv, n += 1]}
goals: {done: home == at && b == true && true == a}
requirements: {safe: always scan.state == executing -> n == 2}
"""
DECLARED = {
    "behavior_model": "cell",
    "variables": (
        "{a: {domain: bool, initial: false}, b: {domain: bool, initial: false}, "
        "n: {domain: 0..5, initial: 0}, at: {domain: [home, agv], initial: home}}"
    ),
    "resources": "{arm: {request: [n]}}",
}


def declared(**changed: str) -> str:
    sections = {**DECLARED, **changed}
    return "".join(f"{key}: {value}\n" for key, value in sections.items() if value) + USES


def test_the_declarations_that_mistakes_are_made_in_are_right() -> None:
    assert read_model(declared()).name == "cell"


@pytest.mark.parametrize(
    ("text", "slug"),
    [
        (declared().replace("resources:", "resource:"), Slug.UNKNOWN_KEY),
        (declared().replace("variables:", "variable:"), Slug.UNKNOWN_KEY),
        (declared(variables=""), Slug.MISSING_KEY),
        (declared(variables="[a, b]"), Slug.WRONG_SHAPE),
        (declared(resources="arm"), Slug.WRONG_SHAPE),
        (declared(resources="{arm: {request: [n], pre: {g: true}}}"), Slug.UNKNOWN_KEY),
        (declared(resources="{arm-1: {request: [n]}}"), Slug.BAD_NAME),
        (declared(resources="{{arm}: {request: [n]}}"), Slug.WRONG_SHAPE),
        (declared(resources="{!arm: {request: [n]}}"), Slug.YAML_TAG),
        (declared(resources="*arms"), Slug.YAML_SYNTAX),
        (declared().replace("domain: bool, initial: false}, b", "domain: bol, initial: false}, b"), Slug.BAD_DOMAIN),
        (declared().replace("domain: bool", "domain: [false, true]", 1), Slug.BAD_DOMAIN),
        (declared().replace("0..5", "5..0"), Slug.EMPTY_DOMAIN),
        (declared().replace("[home, agv], ", "[], "), Slug.EMPTY_DOMAIN),
        (declared().replace("[home, agv], ", "[home, agv, home], "), Slug.DUPLICATE_VALUE),
        (declared().replace("[home, agv], ", "!set [home, agv], "), Slug.YAML_TAG),
        (declared().replace("[home, agv], ", "[home, *agv], "), Slug.YAML_SYNTAX),
        (declared().replace("domain: 0..5", "domian: 0..5"), Slug.UNKNOWN_KEY),
        (declared().replace("n: {domain: 0..5, initial: 0}", "n: 0..5"), Slug.WRONG_SHAPE),
        (declared().replace("n: {domain", "<<: {}, n: {domain"), Slug.UNKNOWN_KEY),
        (declared().replace("initial: home", "initial: house"), Slug.VALUE_OUTSIDE_DOMAIN),
        (declared().replace("    pre: ", "    prae: "), Slug.UNKNOWN_KEY),
        (declared().replace("[at <- agv, n += 1]", "*done"), Slug.YAML_SYNTAX),
    ],
)
def test_one_mistake_is_reported_once_and_nothing_that_follows_from_it(text: str, slug: Slug) -> None:
    assert [diagnostic.slug for diagnostic in diagnostics_of(text)] == [slug]


# files that are no models


def test_a_missing_file_is_reported_with_the_name_of_its_neighbour(tmp_path: Path, wording: Wording) -> None:
    (tmp_path / "scan_cell.yaml").touch()
    (tmp_path / "other.txt").touch()
    path = tmp_path / "scan_cel.yaml"
    diagnostic = the_diagnostic_of_file(path)
    assert (diagnostic.slug, str(diagnostic.place)) == (Slug.FILE_MISSING, str(path))
    assert f"`{tmp_path / 'scan_cell.yaml'}`" in (diagnostic.remedy or "")
    wording(diagnostic)


def test_a_missing_file_in_a_missing_directory_has_no_neighbour(tmp_path: Path) -> None:
    diagnostic = the_diagnostic_of_file(tmp_path / "nowhere" / "model.yaml")
    assert (diagnostic.slug, diagnostic.remedy) == (Slug.FILE_MISSING, None)


def test_a_directory_is_not_a_file(tmp_path: Path) -> None:
    assert the_diagnostic_of_file(tmp_path).slug is Slug.FILE_IS_DIRECTORY


def test_a_path_through_a_file_cannot_be_read(tmp_path: Path, wording: Wording) -> None:
    (tmp_path / "model.yaml").touch()
    diagnostic = the_diagnostic_of_file(tmp_path / "model.yaml" / "more.yaml")
    assert diagnostic.slug is Slug.FILE_UNREADABLE
    wording(diagnostic.message)


@pytest.mark.parametrize("name", ["a\0b.yaml", "x" * 5000 + ".yaml"])
def test_a_path_that_the_system_does_not_take_cannot_be_read(name: str, tmp_path: Path) -> None:
    assert the_diagnostic_of_file(tmp_path / name).slug is Slug.FILE_UNREADABLE


@pytest.mark.parametrize(
    ("data", "line", "column", "byte"),
    [
        (b"\xff\xfeb\x00", 1, 1, "0xff"),
        (b"name: a\r\n# caf\xe9\r\n", 2, 6, "0xe9"),
        (b"a: \xc3\xa4\xc3\xa4\n\n  \xc3", 3, 3, "0xc3"),
        (b"\xef\xbb\xbfa\xff", 1, 2, "0xff"),
        (b"a\rb\r\xf8", 3, 1, "0xf8"),
    ],
)
def test_a_byte_that_is_not_utf8_is_reported_by_its_place(
    data: bytes, line: int, column: int, byte: str, tmp_path: Path
) -> None:
    path = tmp_path / "latin.yaml"
    path.write_bytes(data)
    diagnostic = the_diagnostic_of_file(path)
    assert diagnostic.slug is Slug.NOT_UTF8
    assert f" {byte} " in diagnostic.message
    assert (diagnostic.place.line, diagnostic.place.column) == (line, column)


@pytest.mark.parametrize(
    "text",
    [
        "",
        " \n\n",
        "\N{BYTE ORDER MARK}",
        "# a comment\n# and one more\n",
        "---\n...\n",
        "~",
    ],
)
def test_a_file_without_a_model_is_empty(text: str, tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "empty.yaml"
    path.write_text(text, encoding="utf-8")
    diagnostic = the_diagnostic_of_file(path)
    assert diagnostic.slug is Slug.FILE_EMPTY
    wording(diagnostic.message)
    assert str(diagnostic.place) == str(path)


@pytest.mark.parametrize("text", ["model", "5", '""', "[]", "- behavior_model: cell", "'{}'"])
def test_a_scalar_or_a_list_is_no_model(text: str) -> None:
    (diagnostic,) = diagnostics_of(text)
    assert diagnostic.slug is Slug.WRONG_SHAPE
    assert (diagnostic.place.line, diagnostic.place.column) == (1, 1)


@pytest.mark.slow
def test_a_file_may_have_so_many_bytes_and_not_one_more(tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "large.yaml"
    text = "behavior_model: large\nvariables: {}\noperations: {}\n#"
    path.write_text(text + "x" * (MAX_BYTES - len(text)), encoding="utf-8")
    assert load_model(path).name == "large"
    with path.open("a", encoding="utf-8") as stream:
        stream.write("x")
    diagnostic = the_diagnostic_of_file(path)
    assert diagnostic.slug is Slug.FILE_TOO_LARGE
    wording(diagnostic.message)


# texts that are made to harm


BEGIN = "behavior_model: cell\nvariables:\n  a: {domain: bool, initial: false}\noperations: {}\n"


def test_an_alias_bomb_is_refused_before_it_goes_off() -> None:
    levels = [f"l{level}: &l{level} [{', '.join([f'*l{level - 1}'] * 9)}]" for level in range(1, 40)]
    (diagnostic,) = diagnostics_of("\n".join(["l0: &l0 [x, x]", *levels]))
    assert (diagnostic.slug, diagnostic.place.line) == (Slug.YAML_TOO_LARGE, 6)


@pytest.mark.parametrize("opening", slow_beyond(4, ["[", "- ", "? ", "{a: ", "{", "[{"]))
def test_deep_nesting_is_refused_where_it_gets_too_deep(opening: str, wording: Wording) -> None:
    (diagnostic,) = diagnostics_of(opening * 1_500)  # more than calls of Python can be nested
    assert diagnostic.slug is Slug.YAML_TOO_LARGE
    wording(diagnostic.message)
    assert 30 <= diagnostic.place.column <= 31 * len(opening) + 1


def test_too_many_nodes_are_refused() -> None:
    (diagnostic,) = diagnostics_of(f"- &many [{'x, ' * 999}]\n" + "- *many\n" * 500)
    assert (diagnostic.slug, diagnostic.place.line) == (Slug.YAML_TOO_LARGE, 200)


@pytest.mark.parametrize(
    ("predicate", "slug"),
    [
        ("(" * 100_000, Slug.TEXT_TOO_LONG),
        ("(" * 3_000 + "a == true" + ")" * 3_000, Slug.TOO_DEEP),
        ("!" * 100_000, Slug.TEXT_TOO_LONG),
    ],
)
def test_nested_parentheses_are_too_deep_or_too_long(predicate: str, slug: Slug) -> None:
    (diagnostic,) = diagnostics_of(f'{BEGIN}goals: {{done: "{predicate}"}}\n')
    assert (diagnostic.slug, diagnostic.place.line) == (slug, 5)


@pytest.mark.longer
def test_a_predicate_may_be_long_but_not_huge(wording: Wording) -> None:
    long = " && ".join(["a == true"] * 1_500)
    assert str(read_model(f"{BEGIN}goals:\n  done: {long}\n").goals[0][1]) == long
    (diagnostic,) = diagnostics_of(f"{BEGIN}goals:\n  done: {long} && {long}\n")
    assert diagnostic.slug is Slug.TEXT_TOO_LONG
    wording(diagnostic.message)


@pytest.mark.parametrize("seed", range(20))
def test_binary_junk_ends_in_one_located_error(seed: int) -> None:
    junk = bytes((seed * 101 + index * index * 31) % 256 for index in range(400)).decode("latin-1")
    (diagnostic,) = diagnostics_of(junk)
    assert diagnostic.slug in {Slug.YAML_SYNTAX, Slug.YAML_TAG}
    assert diagnostic.place.line >= 1
    assert diagnostic.place.column >= 1


@pytest.mark.parametrize("character", ["\0", "\a", "\x0b", "\x0c", "\x1b", "\x7f", "\ud800", "\ufffe"])
def test_a_character_that_yaml_does_not_allow_is_reported_by_its_place(character: str) -> None:
    (diagnostic,) = diagnostics_of(f"behavior_model: cell\nvariables: {{}}  # {character}\noperations: {{}}\n")
    assert f" U+{ord(character):04X} " in diagnostic.message
    assert (diagnostic.slug, diagnostic.place.line, diagnostic.place.column) == (Slug.YAML_SYNTAX, 2, 18)


def test_messages_have_no_characters_that_move_the_cursor() -> None:
    text = BEGIN + 'goals: {"\\e[2Jdone\\r\\n\\u202e": true, "\\x07": "a == \\x08true"}\n'
    shown = [f"{diagnostic.message} {diagnostic.remedy}" for diagnostic in diagnostics_of(text)]
    assert shown[0].startswith("`\\x1b[2Jdone\\r\\n\\u202e` ")
    assert all(words.isprintable() for words in shown)


def test_messages_are_not_longer_than_a_few_lines() -> None:
    (diagnostic,) = diagnostics_of(f"{BEGIN}goals: {{done: {'x' * 10_000} == true}}\n")
    assert len(diagnostic.message) < 500
    assert diagnostic.place.length == 10_000


def test_so_many_errors_are_reported_and_no_more() -> None:
    goals = "".join(f"  goal_{number}: b == true\n" for number in range(3 * MAX_ERRORS))
    found = diagnostics_of(f"{BEGIN}goals:\n{goals}")
    assert [diagnostic.place.line for diagnostic in found] == list(range(6, 6 + MAX_ERRORS))


def test_documents_after_the_first_are_refused_and_the_first_is_checked() -> None:
    found = diagnostics_of(f"{BEGIN}goals: {{done: b == true}}\n---\n{BEGIN}---\n- &a [*b]\n")
    assert [(diagnostic.slug, diagnostic.place.line) for diagnostic in found] == [
        (Slug.UNKNOWN_VARIABLE, 5),
        (Slug.YAML_SYNTAX, 6),
    ]
