"""Case files: opened without their model, and read with it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from scbm.cases import Case, Network, Partition
from scbm.files import (
    is_case_text,
    is_model_text,
    load_model,
    open_case,
    read_case,
    read_model,
    read_network,
    write_network,
)
from scbm.files.yaml.text_files import MAX_BYTES
from scbm.model import InputError, Place, Slug
from support.wording import Wording

if TYPE_CHECKING:
    from scbm.model import Diagnostic

MODELS = Path(__file__).parent.parent.parent / "models"
CELL = load_model(MODELS / "cell.yaml")
CASE = "case: first\ngoal: scanned\n"


def diagnostics_of(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as raised:
        read_case(text, CELL, "case.yaml")
    return raised.value.diagnostics


def the_diagnostic_of_opening(path: Path) -> Diagnostic:
    with pytest.raises(InputError) as raised:
        open_case(path)
    (diagnostic,) = raised.value.diagnostics
    return diagnostic


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


# opening


def test_a_case_is_opened_without_its_model(tmp_path: Path) -> None:
    path = write(tmp_path / "first.yaml", "case: 1st\nmodel: models/cell.yaml\ngaol: x\n")
    document = open_case(path)
    assert document.name == "1st"
    assert document.model_path == tmp_path / "models" / "cell.yaml"


@pytest.mark.parametrize("text", ["goal: scanned\n", "case: [x]\nmodel: [y]\n", "case:\nmodel:\n", 'model: ""\n'])
def test_a_case_without_name_and_model_has_that_of_its_file(text: str, tmp_path: Path) -> None:
    document = open_case(write(tmp_path / "second.yaml", text))
    assert document.name == "second"
    assert document.model_path is None
    with pytest.raises(InputError) as raised:
        document.required_model_path()
    diagnostic, *others = raised.value.diagnostics
    assert diagnostic.slug is Slug.MODEL_MISSING
    assert diagnostic.place == Place(str(tmp_path / "second.yaml"))
    assert others, "what else is wrong is reported at once"
    assert diagnostic.remedy


def test_a_model_that_is_there_is_found_and_fits(tmp_path: Path) -> None:
    path = write(tmp_path / "case.yaml", f"model: {MODELS / 'cell.yaml'}\n{CASE}")
    document = open_case(path)
    assert document.read(load_model(document.required_model_path())).name == "first"


def test_a_model_that_is_not_there_is_reported_where_it_is_named(tmp_path: Path) -> None:
    write(tmp_path / "cell.yaml", "")
    document = open_case(write(tmp_path / "case.yaml", f"{CASE}model: cel.yaml\n"))
    with pytest.raises(InputError) as raised:
        document.required_model_path()
    (diagnostic,) = raised.value.diagnostics
    assert diagnostic.slug is Slug.FILE_MISSING
    assert diagnostic.place == Place(str(tmp_path / "case.yaml"), 3, 8, 8)
    assert diagnostic.remedy == f"did you mean `{tmp_path / 'cell.yaml'}`?"


def test_a_path_that_no_system_can_have_is_not_there(tmp_path: Path) -> None:
    document = open_case(write(tmp_path / "case.yaml", f'{CASE}model: "a\\0b"\n'))
    with pytest.raises(InputError) as raised:
        document.required_model_path()
    assert raised.value.diagnostics[0].slug is Slug.FILE_MISSING


@pytest.mark.parametrize(
    ("text", "slug"),
    [
        ("", Slug.FILE_EMPTY),
        ("# nothing\n", Slug.FILE_EMPTY),
        ("- case: x\n", Slug.WRONG_SHAPE),
        ("case", Slug.WRONG_SHAPE),
        ("case: [", Slug.YAML_SYNTAX),
        ("!x {case: x}", Slug.YAML_TAG),
    ],
)
def test_what_is_no_mapping_cannot_be_opened(text: str, slug: Slug, tmp_path: Path) -> None:
    path = write(tmp_path / "case.yaml", text)
    if slug is Slug.YAML_TAG:  # the error of the tag comes when the case is read: the mapping below is there
        with pytest.raises(InputError) as raised:
            open_case(path).read(CELL)
        assert raised.value.diagnostics[0].slug is slug
    else:
        assert the_diagnostic_of_opening(path).slug is slug


def test_a_file_that_cannot_be_read_is_reported_as_that_of_a_model(tmp_path: Path) -> None:
    write(tmp_path / "case.yaml", CASE)
    missing = the_diagnostic_of_opening(tmp_path / "cas.yaml")
    assert missing.slug is Slug.FILE_MISSING
    assert missing.remedy == f"did you mean `{tmp_path / 'case.yaml'}`?"
    assert the_diagnostic_of_opening(tmp_path).slug is Slug.FILE_IS_DIRECTORY
    (tmp_path / "latin.yaml").write_bytes(b"case: gr\xfcn\n")
    assert the_diagnostic_of_opening(tmp_path / "latin.yaml").slug is Slug.NOT_UTF8
    (tmp_path / "large.yaml").write_bytes(b"#" * (MAX_BYTES + 1))
    assert the_diagnostic_of_opening(tmp_path / "large.yaml").slug is Slug.FILE_TOO_LARGE


# reading


def test_a_document_is_read_as_often_as_one_likes(tmp_path: Path) -> None:
    wrong = open_case(write(tmp_path / "wrong.yaml", f"{CASE}initial: {{a: 1, a: 2}}\n"))
    with pytest.raises(InputError) as first:
        wrong.read(CELL)
    with pytest.raises(InputError) as second:
        wrong.read(CELL)
    assert first.value.diagnostics == second.value.diagnostics
    assert len(first.value.diagnostics) == 2
    right = open_case(write(tmp_path / "right.yaml", CASE))
    assert right.read(CELL) == right.read(CELL)


def test_a_short_case_is_plain() -> None:
    predicate = CELL.goal("scanned")
    assert predicate is not None
    assert read_case(CASE, CELL) == Case("first", "scanned", predicate, CELL.nominal_state)


def test_a_goal_that_is_no_name_is_a_predicate() -> None:
    case = read_case("case: first\ngoal: scans==2\n", CELL)
    assert (case.goal, str(case.predicate)) == ("scans == 2", "scans == 2")
    assert read_case('case: first\ngoal: "true"\n', CELL).goal == "true"
    assert read_case("case: first\ngoal: [scans == 2, true]\n", CELL).goal == "scans == 2 && true"


def test_a_nominal_state_that_is_not_allowed_is_reported_at_the_name(wording: Wording) -> None:
    text = (MODELS / "cell.yaml").read_text(encoding="utf-8").replace("initial: home", "initial: box_a", 1)
    model = read_model(text.replace("initial: green", "initial: red"))
    with pytest.raises(InputError) as raised:
        read_case(CASE, model, "case.yaml")
    (diagnostic,) = raised.value.diagnostics
    assert diagnostic.slug is Slug.INITIAL_STATE_NOT_ALLOWED
    assert diagnostic.place == Place("case.yaml", 1, 1, 4)
    wording(diagnostic.remedy)


def test_a_list_of_many_requests_is_no_larger_for_that() -> None:
    case = read_case(f"{CASE}outcomes: {{scanner: [{{outcome: fail, times: 10000}}, timeout]}}\n", CELL)
    assert [(forced.first, forced.last) for forced in case.outcomes] == [(1, 10_000), (10_001, 10_001)]


@pytest.mark.slow
def test_there_are_bounds_for_copies_and_injections() -> None:
    copies = ", ".join(["1 ms"] * 101)
    (diagnostic,) = diagnostics_of(f"{CASE}outcomes: {{scanner: {{request: [{copies}]}}}}\n")
    assert diagnostic.slug is Slug.BAD_NUMBER
    (diagnostic,) = diagnostics_of(f"{CASE}injections:\n" + "  - {set: {light: red}}\n" * 1001)
    assert (diagnostic.slug, diagnostic.place.line) == (Slug.BAD_NUMBER, 1004)


def test_one_cause_gives_one_error() -> None:
    diagnostics = diagnostics_of(
        f"{CASE}injections: [{{resource: arm, becmes: dead}}]\nnetwork: {{loss: 1 %}}\ndrwan: {{}}\n"
    )
    assert [diagnostic.slug for diagnostic in diagnostics] == [Slug.UNKNOWN_KEY, Slug.UNKNOWN_KEY]


def test_injections_that_hold_contradict_only_while_they_hold() -> None:
    def slugs(first: str, second: str) -> list[Slug]:
        text = f"{CASE}injections:\n  - {{set: {{light: red}}, {first}}}\n  - {{set: {{light: green}}, {second}}}\n"
        try:
            read_case(text, CELL)
        except InputError as error:
            return [diagnostic.slug for diagnostic in error.diagnostics]
        return []

    assert slugs("hold: 2 s", "at: 1 s") == [Slug.CONTRADICTION]
    assert slugs("at: 1 s", "hold: 2 s") == [Slug.CONTRADICTION]
    assert slugs("hold: 2 s", "at: 2 s") == []
    assert slugs("at: 1 s", "at: 2 s") == []
    assert slugs("hold: 2 s", "at: 1 s, when: scanned == true") == []
    assert slugs("hold: 2 s, when: true", "at: 1 s") == [Slug.CONTRADICTION]


# kinds of texts


@pytest.mark.parametrize(
    "text", ["case: x\n", "# c\ngoal: y\ncase: x\n", "case:\n", '"case": x', "\ufeffcase: x", "a: b\r\ncase : x"]
)
def test_a_case_is_seen_at_a_glance(text: str) -> None:
    assert is_case_text(text)
    assert not is_model_text(text)


@pytest.mark.parametrize(
    "text", ["", "  case: x", "# case: x", "case:x", "cases: x", "drawn: {case: 3}", "lowercase: x"]
)
def test_other_texts_are_no_cases(text: str) -> None:
    assert not is_case_text(text)


def test_a_model_is_seen_at_a_glance() -> None:
    text = (MODELS / "cell.yaml").read_text(encoding="utf-8")
    assert is_model_text(text)
    assert not is_case_text(text)


# the text of an option


FIVE_MS = ["latency: 5 ms", "{latency: 5 ms}", " { latency: 5 ms }", "latency: 5 ms # slow", "latency:\n 5 ms"]


@pytest.mark.parametrize("text", FIVE_MS)
def test_a_network_is_read_with_braces_and_without(text: str) -> None:
    assert read_network(text, CELL) == Network(latency_ns=5_000_000)


def test_a_network_of_a_line_needs_no_drawn_and_is_written_as_it_is_read() -> None:
    network = read_network("loss: 2 %, jitter: 10 ms, partitions: [{at: 3 s, for: 2 s, resource: arm}]", CELL)
    assert network.partitions == (Partition(3_000_000_000, 2_000_000_000, "arm"),)
    assert write_network(network) == "jitter: 10 ms, loss: 2 %, partitions: [{resource: arm, at: 3 s, for: 2 s}]"
    assert read_network(write_network(Network()), CELL) == Network()


@pytest.mark.parametrize(
    ("text", "slug", "column", "length"),
    [
        ("loss: 130 %", Slug.NOT_A_SHARE, 7, 5),
        ("{loss: 130 %}", Slug.NOT_A_SHARE, 8, 5),
        ("latency: 5 ms, jiter: 10 ms", Slug.UNKNOWN_KEY, 16, 5),
        ("latency: [5 ms", Slug.YAML_SYNTAX, 15, 1),
        ("loss: 2 %}", Slug.YAML_SYNTAX, 11, 1),
        ("partitions: [{at: 1 s, for: 1 s, resource: amr}]", Slug.UNKNOWN_RESOURCE, 44, 3),
        ("- loss", Slug.YAML_SYNTAX, 1, 1),
        ("{", Slug.YAML_SYNTAX, 2, 1),
    ],
)
def test_what_is_wrong_with_the_network_of_a_line_is_located_in_it(
    text: str, slug: Slug, column: int, length: int
) -> None:
    with pytest.raises(InputError) as raised:
        read_network(text, CELL)
    diagnostic = raised.value.diagnostics[0]
    assert diagnostic.slug is slug
    assert diagnostic.place == Place("--network", 1, column, length)
    assert diagnostic.source_line == text
