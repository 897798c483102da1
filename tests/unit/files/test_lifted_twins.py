"""Wrong models keep their errors, at their places, when they get objects and parameters."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from scbm.files import read_model
from scbm.model import InputError

if TYPE_CHECKING:
    from scbm.model import Diagnostic

MODELS = Path(__file__).parents[2] / "models"
REJECTED = [path for path in sorted((MODELS / "rejected").glob("*.yaml")) if "types:" not in path.read_text("utf-8")]

TYPES = "\ntypes: {thing_: [thing1_, thing2_]}\n"
SECTION = re.compile(r"(?ms)^(operations|automatic_transitions|environment|goals|requirements):\n(.*?)(?=^\S|\Z)")
ENTRY = re.compile(r"(?m)^  (\w+):")

NO_MAPPING = {"wrong-shape_a_list", "wrong-shape_text"}
"""Files to which no key can be added."""

NAMED_ELSEWHERE = {
    "ambiguous-symbol_runner",
    "assigned-twice_transitions",
    "contradiction_environment",
    "duplicate-name_of_the_runner",
    "many_errors",
    "missing-key_handshakes",
    "not-assignable_places",
    "reserved-name_everywhere",
    "runner-variable_world",
}
"""Files with errors about names such as `scan.state`, which operations with parameters do not have."""


def diagnostics_of(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as raised:
        read_model(text, "model.yaml")
    return raised.value.diagnostics


@pytest.mark.parametrize("path", [path for path in REJECTED if path.stem not in NO_MAPPING], ids=lambda path: path.stem)
def test_a_wrong_model_has_the_same_errors_beside_types(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert diagnostics_of(text + TYPES) == diagnostics_of(text)


def with_parameters(text: str) -> str:
    return SECTION.sub(lambda m: f"{m[1]}:\n" + ENTRY.sub(r"  \1[thing_p in thing_]:", m[2]), text)


LIFTED = [path for path in REJECTED if path.stem not in NAMED_ELSEWHERE]
LIFTED = [path for path in LIFTED if with_parameters(text := path.read_text("utf-8")) != text]


def test_each_exception_is_a_file_and_most_files_with_entries_have_a_lifted_twin() -> None:
    assert {path.stem for path in REJECTED} >= NO_MAPPING | NAMED_ELSEWHERE
    assert len(LIFTED) >= 75


@pytest.mark.slow
@pytest.mark.parametrize("path", LIFTED, ids=lambda path: path.stem)
def test_a_wrong_entry_has_its_errors_in_the_same_lines_with_parameters(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    found = {(each.slug, each.place.line) for each in diagnostics_of(with_parameters(text) + TYPES)}
    assert {(each.slug, each.place.line) for each in diagnostics_of(text)} <= found
