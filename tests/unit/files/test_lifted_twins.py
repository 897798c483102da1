"""Wrong models keep their errors, in their lines, when all their entries get parameters, and when they become a part.

Each wrong model has such twins, made from its text. Where a twin has other errors, this file says why. A test fails
once that is no longer so, and for a new wrong model without a twin.
"""

from __future__ import annotations

import re
from collections import Counter
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from scbm.files import load_model, read_model
from scbm.model import InputError
from support.lifted_twins import OBJECTS, as_part, with_parameters
from support.profiles import longer_but_one_in

if TYPE_CHECKING:
    from scbm.model import Diagnostic

MODELS = Path(__file__).parents[2] / "models"
TEXTS = {path.stem: path.read_bytes().decode("utf-8") for path in sorted((MODELS / "rejected").glob("*.yaml"))}
LIFTED = [name for name, text in TEXTS.items() if "types:" in text]
"""Wrong models that have objects themselves."""

NO_MAPPING = dict.fromkeys(("wrong-shape_a_list", "wrong-shape_text"), "no key can be added to a file without keys")

OTHER_WITH_PARAMETERS = {
    **NO_MAPPING,
    "ambiguous-symbol_runner": "names with an index are no words that a value can have",
    "ambiguous-symbol_variable": "names with an index are no words that a value can have",
    "duplicate-name_of_a_resource": "variables of a resource with an index have other names",
    "duplicate-name_of_the_runner": "variables of an operation with parameters have other names",
    "predicate-syntax_incomplete": "`robot_at in home` asks for a type where there are types",
    "unknown-goal_reachable_again": "it names goals, and those of the twin have an index",
    "unknown-variable_everywhere": "`scanner.req_state` begins with a name that has an index",
    "wrong-shape_key": "a mapping is no key, so it gets no parameter",
}
"""Models whose twins with parameters have other errors, each with the reason."""

OTHER_IF_INCLUDED = {
    **NO_MAPPING,
    "bad-name_of_entries": "an entry with a wrong name gets no name in a part, and is not read any further",
    "missing-key_model": "what has no key that identifies a model is no part, either",
    "predicate-syntax_list": "an alias cannot name an anchor in another file",
    "unknown-key_model": "what has no key that identifies a model is no part, either",
    "wrong-shape_name": "the name of the model is wrong, and so is that of the part",
    "yaml-syntax_two_documents": "each document would have its sections in the part",
    "yaml-tag_explicit": "the tag stands before all sections, so model and part have it",
}
"""Models whose twins as included files have other errors, each with the reason."""

OTHER_WITH_A_PREFIX = {
    **OTHER_IF_INCLUDED,
    "ambiguous-symbol_objects": "objects have no prefix, so they are no longer called like a variable",
    "ambiguous-symbol_runner": "a name with a prefix is no word that a value can have",
    "ambiguous-symbol_variable": "a name with a prefix is no word that a value can have",
    "bad-date_waivers": "waivers remain in the model, where operations have the prefix",
    "duplicate-name_of_the_runner": "`plan.state` with a prefix is not the variable of the runner",
    "runner-variable_world": "`initial_states` remains in the model, where operations have the prefix",
    "unknown-object_comparisons": "`att` is near to a variable only without the prefix, so it may be an object here",
    "unknown-object_placeholders": "the waiver stands in the model, where `go` needs its prefix",
    "unknown-goal_reachable_again": "it stands in the model, where goals need their prefix",
    "wrong-index_everywhere": "`open.r` begins with a name of the part, and is none itself",
}
"""Models whose twins with a prefix have other errors, each with the reason."""

NEVER_LIFTED = {
    **NO_MAPPING,
    "contradiction_drawn_plans": "`planner` and `runs` stand in the model only, and have no parameters",
    "missing-key_model": "a section is missing, so there is no text",
    "unknown-goal_reachable_again": "`reachable_again` stands in the model only, and has no parameters",
    "unknown-key_model": "a key of the model is wrong, above all entries",
    "unknown-word_plans": "`runs` stands in the model only, and has no parameters",
    "unknown-word_requirements_off": "`requirements_off` stands in the model only, and has no parameters",
    "unknown-word_requirements_on": "`requirements_on` stands in the model only, and has no parameters",
    "unknown-word_runs": "`runs` stands in the model only, and has no parameters",
    "wrong-type_requests": "its types are in a folder beside it, where its twin is not",
    "wrong-type_requirements_off": "`requirements_off` stands in the model only, and has no parameters",
    "wrong-shape_name": "the name stands in the model only, and has no parameters",
    "yaml-syntax_two_documents": "the second document is no text of an entry",
    "yaml-too-large_aliases": "the lists stand beside the sections",
}
"""Models whose error no twin has in a lifted text, each with the reason."""

GROUND_NAMES = {
    "unknown-goal_reachable_again": "it has no parameters, so ground names can stand there",
    "unknown-variable_everywhere": "`initial_states` has no parameters, so ground names can stand there",
}
"""Models whose twins have messages with the names of objects, each with the reason."""


@cache
def diagnostics_of(text: str) -> tuple[Diagnostic, ...]:
    try:
        read_model(text, "model.yaml")
    except InputError as error:
        return error.diagnostics
    return ()


def found_in_files(folder: Path, model: str, part: str) -> tuple[Diagnostic, ...]:
    (folder / "model.yaml").write_bytes(model.encode("utf-8"))
    (folder / "part.yaml").write_bytes(part.encode("utf-8"))
    with pytest.raises(InputError) as raised:
        load_model(folder / "model.yaml")
    return raised.value.diagnostics


def errors(diagnostics: tuple[Diagnostic, ...]) -> Counter[tuple[int, str]]:
    """Return how often each line has an error of each kind."""
    return Counter((each.place.line, each.slug.value) for each in diagnostics)


def compare(name: str, found: tuple[Diagnostic, ...], others: dict[str, str]) -> None:
    """The twin has the errors of the model as often as that, in the same lines, unless `others` says why not."""
    if name in others:
        assert errors(found) != errors(diagnostics_of(TEXTS[name])), f"{name} is the same now: leave it out of the list"
    else:
        assert errors(found) == errors(diagnostics_of(TEXTS[name]))


@pytest.mark.parametrize("name", longer_but_one_in(3, [name for name in TEXTS if name not in LIFTED]))
def test_a_wrong_model_has_its_errors_with_parameters(name: str) -> None:
    found = diagnostics_of(with_parameters(TEXTS[name]).text)
    compare(name, found, OTHER_WITH_PARAMETERS)
    shown = " ".join(f"{each.message} {each.remedy}" for each in found)
    assert (re.search("|".join(OBJECTS), shown) is not None) is (name in GROUND_NAMES)


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_a_wrong_model_has_its_errors_as_an_included_file(name: str, tmp_path: Path) -> None:
    compare(name, found_in_files(tmp_path, *as_part(TEXTS[name], None)), OTHER_IF_INCLUDED)


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_a_wrong_model_has_its_errors_as_a_part_with_a_prefix(name: str, tmp_path: Path) -> None:
    compare(name, found_in_files(tmp_path, *as_part(TEXTS[name], "own_")), OTHER_WITH_A_PREFIX)


def is_lifted(name: str) -> bool:
    """Return whether a twin has an error of the model's kind in an entry with parameters, or in a part."""
    slug = name.partition("_")[0]
    lines = [each.place.line for each in diagnostics_of(TEXTS[name]) if slug in (each.slug.value, "many")]
    lifted = with_parameters(TEXTS[name]).lines if name not in OTHER_WITH_PARAMETERS else ()
    part = as_part(TEXTS[name], None)[1].splitlines() if name not in OTHER_IF_INCLUDED else ()
    in_part = [number for number, line in enumerate(part, start=1) if line.strip()]
    return name in LIFTED or any(line in lifted or line in in_part for line in lines)


@pytest.mark.longer
def test_each_wrong_model_has_a_twin_with_its_error_in_lifted_text() -> None:
    assert [name for name in TEXTS if not is_lifted(name)] == sorted(NEVER_LIFTED)


def test_each_exception_is_a_wrong_model() -> None:
    named = {*OTHER_WITH_PARAMETERS, *OTHER_WITH_A_PREFIX, *NEVER_LIFTED, *GROUND_NAMES}
    assert named <= set(TEXTS)
    assert not set(OTHER_WITH_PARAMETERS) & set(LIFTED)
