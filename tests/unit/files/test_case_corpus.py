"""The cases of `tests/models`: the wrong ones get exactly the diagnostics beside them, the right ones mean what is
written beside them. With `--update-golden` the expectations are written; then read them as a user would.
"""

from __future__ import annotations

import re
from itertools import groupby
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

from scbm.cases import Case
from scbm.files import case_schema, load_model, open_case, read_case, write_case
from scbm.model import InputError, Slug

MODELS = Path(__file__).parent.parent.parent / "models"
REJECTED = sorted((MODELS / "rejected_cases").glob("*.yaml"))
WRONG = {slug: list(paths) for slug, paths in groupby(REJECTED, key=lambda path: path.stem.partition("_")[0])}
"""The rejected cases by the slug that they are named after; `many` show several."""
VALID = sorted((MODELS / "valid_cases").glob("*.yaml"))
CELL = load_model(MODELS / "cell.yaml")

REPORTED_ELSEWHERE = {Slug.MODEL_MISSING}
"""A case with this one can be read; it is tested with the loader."""

OF_CASES = set(list(Slug)[list(Slug).index(Slug.UNKNOWN_OPERATION) : list(Slug).index(Slug.FORMAT_VERSION)])


def error_of(path: Path) -> InputError:
    with pytest.raises(InputError) as raised:
        open_case(path).read(CELL)
    return raised.value


@pytest.mark.parametrize("slug", WRONG)
def test_wrong_cases_get_exactly_these_diagnostics(slug: str, request: pytest.FixtureRequest) -> None:
    shown = {path: str(error_of(path)).replace(str(path), path.name) + "\n" for path in WRONG[slug]}
    if request.config.getoption("--update-golden"):
        for path, text in shown.items():
            path.with_suffix(".expected").write_text(text, encoding="utf-8")
    assert shown == {path: path.with_suffix(".expected").read_text(encoding="utf-8") for path in shown}
    assert [path.stem for path, text in shown.items() if f"error[{slug}]" not in text and slug != "many"] == []
    for path in WRONG[slug]:
        lines = path.read_text(encoding="utf-8").split("\n")
        found = error_of(path).diagnostics
        assert [each.order for each in found] == sorted(each.order for each in found)
        assert [each.source_line for each in found] == [lines[each.place.line - 1] for each in found]
        assert all(1 <= each.place.column <= len(each.source_line or "") + 1 for each in found)


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
    case, expected = open_case(path).read(CELL), path.with_suffix(".expected")
    shown = f"{facts(case)}---\n{write_case(case, CELL, '../cell.yaml', ['written again'])}"
    if request.config.getoption("--update-golden"):
        expected.write_text(shown, encoding="utf-8")
    assert shown == expected.read_text(encoding="utf-8")


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
