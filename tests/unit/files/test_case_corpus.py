"""The cases of `tests/models`: the wrong ones get exactly the diagnostics beside them, the right ones mean what is
written beside them. With `--update-golden` the expectations are written; then read them as a user would.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

from scbm.cases import Case
from scbm.files import case_schema, load_model, open_case, read_case, write_case
from scbm.model import InputError, Slug

MODELS = Path(__file__).parent.parent.parent / "models"
REJECTED = sorted((MODELS / "rejected_cases").glob("*.yaml"))
VALID = sorted((MODELS / "valid_cases").glob("*.yaml"))
CELL = load_model(MODELS / "cell.yaml")

REPORTED_ELSEWHERE = {Slug.MODEL_MISSING}
"""A case with this one can be read; it is tested with the loader."""

OF_CASES = set(list(Slug)[list(Slug).index(Slug.UNKNOWN_OPERATION) : list(Slug).index(Slug.FORMAT_VERSION)])


def compare(request: pytest.FixtureRequest, path: Path, shown: str) -> None:
    expected = path.with_suffix(".expected")
    if request.config.getoption("--update-golden"):
        expected.write_text(shown, encoding="utf-8")
    assert shown == expected.read_text(encoding="utf-8")


def error_of(path: Path) -> InputError:
    with pytest.raises(InputError) as raised:
        open_case(path).read(CELL)
    return raised.value


@pytest.mark.parametrize("path", REJECTED, ids=lambda path: path.stem)
def test_a_wrong_case_gets_exactly_these_diagnostics(path: Path, request: pytest.FixtureRequest) -> None:
    compare(request, path, str(error_of(path)).replace(str(path), path.name) + "\n")


@pytest.mark.parametrize("path", REJECTED, ids=lambda path: path.stem)
def test_a_wrong_case_shows_the_slug_that_it_is_named_after(path: Path) -> None:
    name = path.stem.partition("_")[0]
    assert name == "many" or f"error[{name}]" in path.with_suffix(".expected").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", REJECTED, ids=lambda path: path.stem)
def test_every_place_in_a_wrong_case_lies_in_its_text_and_reads_downwards(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").split("\n")
    diagnostics = error_of(path).diagnostics
    assert [diagnostic.order for diagnostic in diagnostics] == sorted(diagnostic.order for diagnostic in diagnostics)
    for diagnostic in diagnostics:
        line = lines[diagnostic.place.line - 1]
        assert diagnostic.source_line == line
        assert 1 <= diagnostic.place.column <= len(line) + 1


def test_every_slug_of_cases_is_in_some_expectation() -> None:
    shown = "".join(path.with_suffix(".expected").read_text(encoding="utf-8") for path in REJECTED)
    caused = {Slug(slug) for slug in re.findall(r"^\S+: error\[([a-z0-9-]+)\]", shown, re.MULTILINE)}
    assert caused >= OF_CASES - REPORTED_ELSEWHERE


@pytest.mark.parametrize("folder", ["rejected_cases", "valid_cases"])
def test_every_expectation_has_its_case(folder: str) -> None:
    cases = {path.stem for path in (MODELS / folder).glob("*.yaml")}
    assert cases == {path.stem for path in (MODELS / folder).glob("*.expected")}


def facts(case: Case) -> str:
    """What a case says, part by part."""
    parts = [
        f"case {case.name}",
        f"goal {case.goal}: {case.predicate}",
        *(f"then {goal.name}: {goal.predicate}, {goal.when}, {goal.may_end}, {goal.expect}" for goal in case.later),
        *([f"may end {case.may_end}"] if case.may_end else []),
        f"initial {case.initial}",
        *map(repr, case.outcomes),
        *map(repr, case.injections),
        repr(case.network),
        repr(case.limits),
        *map(str, case.requirements),
        repr(case.expect),
        repr(case.origin),
        repr(case.recorded),
    ]
    return "".join(f"{part}\n" for part in parts)


@pytest.mark.parametrize("path", VALID, ids=lambda path: path.stem)
def test_a_right_case_means_what_is_written_beside_it(path: Path, request: pytest.FixtureRequest) -> None:
    case = open_case(path).read(CELL)
    compare(request, path, f"{facts(case)}---\n{write_case(case, CELL, '../cell.yaml', ['written again'])}")


@pytest.mark.parametrize("path", VALID, ids=lambda path: path.stem)
def test_a_right_case_is_written_as_one_that_means_the_same(path: Path) -> None:
    case = open_case(path).read(CELL)
    written = write_case(case, CELL, None)
    assert read_case(written, CELL) == case
    assert write_case(read_case(written, CELL), CELL, None) == written


@pytest.mark.parametrize("path", VALID, ids=lambda path: path.stem)
def test_a_right_case_means_the_same_with_other_line_ends_and_a_mark(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    case = open_case(path).read(CELL)
    for other in (text.replace("\n", "\r\n"), text.replace("\n", "\r"), f"\N{BYTE ORDER MARK}{text}"):
        assert read_case(other, CELL) == case


@pytest.mark.parametrize("path", VALID, ids=lambda path: path.stem)
def test_a_right_case_satisfies_the_schema(path: Path) -> None:
    data = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    assert [fault.message for fault in Draft202012Validator(case_schema()).iter_errors(data)] == []


def test_there_are_cases_to_try() -> None:
    assert len(REJECTED) >= 30
    assert len(VALID) >= 3
