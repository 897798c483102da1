"""A form of requirement, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.files import Scope, load_model, parse_requirement
from scbm.files.language.grammar import keywords
from scbm.model import FORMS, InputError, Predicate, RequirementForm
from support.models import scan_cell
from support.profiles import examples
from support.recipe_page import ROOT, followed
from support.strategies import sentences

TITLE = "A form of requirement"
REJECTED = ROOT / "tests/models/rejected"


def test_a_model_with_a_new_form_is_checked_and_tested(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed(TITLE, tmp_path) as recipe:
        check, test = (recipe.in_directory(command, tmp_path) for command in recipe.commands[:2])
        checked = scbm(*check, "--json")
        (model,) = json.loads(checked.out)["models"]
        assert (checked.code, model["errors"], model["warnings"]) == (0, [], [])
        tested = scbm(*test, "--json")
        findings = json.loads(tested.out)["findings"]
        assert (tested.code, [finding["subject"] for finding in findings]) == (1, ["spares_the_lamp"])
        shown = scbm("run", *test[1:2], "--goal", "seen", "--json")
        (violation,) = json.loads(shown.out)["violations"]
        records = json.loads(shown.out)["trace"]
        assert [records[violation[key]]["changes"]["blinks"] for key in ("begins", "record")] == [1, 3]
        assert "`p occurs at most n times [within d]`" in scbm("schema", "model").out
    unknown = scbm(*check)
    assert (unknown.code, "requirement-syntax" in unknown.err) == (2, True)


def test_a_new_form_with_a_duration_is_judged_by_time(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed(TITLE, tmp_path) as recipe:
        *words, sentence = recipe.commands[2]
        assert scbm(*words, sentence).code == 0
        broken = scbm(*words, sentence.replace("1 s", "1 min"), "--json")
        (violation,) = json.loads(broken.out)["violations"]
        assert (broken.code, violation["requirement"]) == (1, "required_1")
        assert violation["begins"] < violation["record"]


@pytest.mark.parametrize(
    ("end", "slug"),
    [
        ("occurs at most -1 times", "bad-number"),
        ("occurs at most 1000000000000000000 times", "bad-number"),
        ("occurs at most 1.5 times", "requirement-syntax"),
        ("occurs at most 1", "requirement-syntax"),
        ("occurs at most 1 times 5 s", "requirement-syntax"),
        ("occurs at most 1 times within 5 parsecs", "bad-duration"),
    ],
)
def test_wrong_values_of_a_new_form_are_located(end: str, slug: str, scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed(TITLE, tmp_path) as recipe:
        wrong = scbm(*recipe.commands[2][:-1], f"mounted == scanner {end}")
    assert (wrong.code, wrong.err.startswith("--require:1:"), f"error[{slug}]" in wrong.err) == (2, True, True)


@pytest.mark.longer
def test_random_sentences_have_the_new_form_and_parse_back(tmp_path: Path) -> None:
    model = scan_cell()

    @given(st.data())
    @examples(2_000)  # in a usual run 200, so that each of some ten forms is drawn
    def every_sentence_parses_back(data: st.DataObject) -> None:
        sentence = data.draw(sentences(model.running_space.variables))
        assert parse_requirement(str(sentence), Scope.of(model)) == sentence
        drawn.add(type(sentence))

    drawn: set[type[RequirementForm]] = set()
    with followed(TITLE, tmp_path):
        every_sentence_parses_back()
        assert drawn == set(FORMS.values())


@pytest.mark.longer
def test_wrong_models_get_the_same_errors_but_for_remedies_that_list_forms_or_words(tmp_path: Path) -> None:
    models = sorted(REJECTED.glob("*.yaml"))
    before = {path: _errors(path) for path in models}
    with followed(TITLE, tmp_path):
        after = {path: _errors(path) for path in models}
        assert "`p occurs at most n times [within d]`" in after[REJECTED / "requirement-syntax_forms.yaml"]
    changed = [path.stem for path in models if after[path] != before[path]]
    assert "requirement-syntax_forms" in changed
    assert [name for name in changed if not name.startswith("requirement-syntax")] == []
    for path in models:
        assert _without_remedies(after[path]) == _without_remedies(before[path])


def test_no_variable_has_the_name_of_a_word_of_the_new_form(tmp_path: Path) -> None:
    models = [*ROOT.glob("tests/models/valid/*.yaml"), *ROOT.glob("examples/*/*.yaml")]
    names = {name for path in models for variable in load_model(path).variables for name in variable.name.split(".")}
    known = keywords()
    with followed(TITLE, tmp_path):
        words = [word for word in keywords() if word not in known]
    assert (words, names & {*words}) == (["occurs", "times"], set())


def _errors(path: Path) -> str:
    with pytest.raises(InputError) as raised:
        load_model(path)
    return f"{raised.value}\n".replace(str(path), path.name)


def _without_remedies(errors: str) -> list[str]:
    return [line for line in errors.splitlines() if not line.startswith("    = ")]


class Unjudged(RequirementForm, frozen=True):
    """A form that does not say what violates it."""

    pattern = "p occurs at most n times [within d]"
    predicate: Predicate
    most: int
    within_ns: int | None = None


def test_a_form_without_a_judgment_is_refused(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed(TITLE, tmp_path) as recipe:
        FORMS["at_most"] = Unjudged  # type: ignore[type-abstract] # mypy refuses it, too
        ran = scbm(*recipe.commands[2])
    assert (ran.code, "first_violation" in ran.err) == (3, True)
