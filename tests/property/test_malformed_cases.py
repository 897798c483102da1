"""Whatever happens to a case file on its way, the loader answers with a case or with located errors."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.files import load_model, read_case, read_network, write_case
from scbm.model import InputError
from support.mutations import MUTATIONS, VALUES, check_diagnostics, malformed
from support.profiles import examples, share

if TYPE_CHECKING:
    from support.mutations import Mutation

MODELS = Path(__file__).parent.parent / "models"
CELL = load_model(MODELS / "cell.yaml")
TEXT = (MODELS / "valid_cases" / "everything.yaml").read_text(encoding="utf-8")


def check_answer(text: str) -> None:
    """A case that can be written and read again, or located errors; no other exception than `InputError`."""
    try:
        case = read_case(text, CELL, "case.yaml")
    except InputError as error:
        check_diagnostics(error.diagnostics, text, "case.yaml")
        return
    written = write_case(case, CELL, None)
    assert write_case(read_case(written, CELL), CELL, None) == written


def test_a_character_that_is_missing_ends_in_a_case_or_in_located_errors() -> None:
    third = range(0, len(TEXT), 3)  # is enough, and quick
    for at in third[:: len(third) // share(len(third), usual=20)]:
        check_answer(TEXT[:at] + TEXT[at + 1 :])


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_one_mutation_ends_in_a_case_or_in_located_errors(mutation: Mutation) -> None:
    @given(malformed([TEXT], [mutation], 1))
    @examples(20, usual=2)
    def check(text: str) -> None:
        check_answer(text)

    check()


@given(malformed([TEXT], MUTATIONS, 6))
@examples(80)
def test_many_mutations_end_in_a_case_or_in_located_errors(text: str) -> None:
    check_answer(text)


KEYS = ["goal", "initial", "outcomes", "injections", "network", "limits", "requirements", "expect", "drawn", "recorded"]


@given(st.sampled_from(KEYS), st.sampled_from(VALUES), st.sampled_from(["", "- ", "scanner: ", "set: ", "final: "]))
@examples(120)
def test_anything_under_a_key_ends_in_a_case_or_in_located_errors(key: str, value: str, before: str) -> None:
    goal = "" if key == "goal" else "goal: scanned\n"
    check_answer(f"case: wrong\n{goal}{key}:\n  {before}{value}\n")


@given(st.lists(st.sampled_from([*VALUES, "loss", "jitter: 1 ms", "partitions", ": ", ", ", "{", "}"]), max_size=6))
@examples(120)
def test_any_text_of_an_option_ends_in_a_network_or_in_errors_on_its_line(words: list[str]) -> None:
    text = "".join(words)
    line = re.sub(r"[\r\n]", " ", text)
    try:
        read_network(text, CELL)
    except InputError as error:
        for diagnostic in error.diagnostics:
            assert diagnostic.place.line in {0, 1}
            assert diagnostic.place.column <= len(line) + 1
