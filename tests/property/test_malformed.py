"""Whatever happens to a model file on its way, the loader answers with a model or with located errors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from scbm.files import read_model
from scbm.model import InputError
from support.mutations import CHARACTERS, MUTATIONS, check_diagnostics, malformed
from support.profiles import examples

if TYPE_CHECKING:
    from scbm.model import Diagnostic
    from support.mutations import Mutation

EXAMPLES = Path(__file__).parent.parent.parent / "examples" / "robot_in_the_air"
TEXTS = [(EXAMPLES / name).read_text(encoding="utf-8") for name in ("before.yaml", "handshakes.yaml", "after.yaml")]


def check_answer(text: str) -> tuple[Diagnostic, ...]:
    """A model, or located errors. Any other exception than `InputError` fails the test."""
    try:
        read_model(text, "model.yaml")
    except InputError as error:
        check_diagnostics(error.diagnostics, text, "model.yaml")
        return error.diagnostics
    return ()


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_one_mutation_ends_in_a_model_or_in_located_errors(mutation: Mutation) -> None:
    @given(malformed(TEXTS, [mutation], 1))
    @examples(25, usual=2)
    def check(text: str) -> None:
        check_answer(text)

    check()


@given(malformed(TEXTS, MUTATIONS, 6))
@examples(150, usual=8)
def test_many_mutations_end_in_a_model_or_in_located_errors(text: str) -> None:
    check_answer(text)


FRAGMENTS = [*CHARACTERS, "  ", ": ", "- ", "\n  ", "a: ", "b: ", "&a ", "*a", "!x ", "---\n", "goals:\n"]


@given(st.lists(st.sampled_from(FRAGMENTS), max_size=40).map("".join))
@examples(300)
@example("a: &a\n- *a\n? *a\n: !x &b *b")
@example("&a &b c")
@example("!x !y c")
@example("- &a\n- !x\n- &b !y\n- !z &c\n")
def test_any_text_ends_in_located_errors(text: str) -> None:
    assert check_answer(text)


CELL = """behavior_model: cell
variables:
  a: {domain: bool, initial: false}
  n: {domain: 0..3, initial: 0}
  at: {domain: [home, agv], initial: home}
resources: {arm: {}}
operations:
  scan: {pre: {g: true}, post: {g: true}}
"""
PLACES = [
    "goals: {done: 'WORDS'}",
    "initial_states: ['n in {WORDS}']",
    "requirements: {safe: 'WORDS'}",
    "requirements: {safe: 'always WORDS'}",
    "automatic_transitions: {rule: {g: '!(WORDS)', a: [n += 1]}}",
    "automatic_transitions: {rule: {g: true, a: ['WORDS']}}",
    "automatic_transitions: {rule: {g: true, a: ['a <- WORDS']}}",
]
OPERATORS = ["==", "!=", "<", ">=", "&&", "||", "->", "!", "(", ")", "in", "{", "}", ",", "<-", "+=", "-="]
NAMES_OF_THE_CELL = ["a", "n", "at", "scan.state", "current.name", "plan.state", "arm_req_state", "unknown"]
OTHER_WORDS = ["true", "2", "-9", "home", "scan", "failed", "none", "always", "leads to", "within", "10 s", "until"]


@pytest.mark.parametrize("place", PLACES)
def test_any_words_where_an_expression_belongs_are_resolved_or_complained_of(place: str) -> None:
    @given(st.lists(st.sampled_from([*OPERATORS, *NAMES_OF_THE_CELL, *OTHER_WORDS]), min_size=1, max_size=7))
    @examples(60, usual=4)
    @example(["n", "in", "{", "n", "}"])
    @example(["current.name", "==", "arm_req_state"])
    @example(["arm_req_state", "<-", "at"])
    def check(words: list[str]) -> None:
        check_answer(CELL + place.replace("WORDS", " ".join(words)) + "\n")

    check()


@given(st.binary(max_size=80))
@examples(150)
def test_any_text_in_a_guard_ends_in_a_model_or_in_located_errors(data: bytes) -> None:
    guard = "".join(character if character.isprintable() else " " for character in data.decode("latin-1"))
    head = "behavior_model: cell\nvariables: {a: {domain: bool, initial: false}}\noperations: {}\n"
    for diagnostic in check_answer(f"{head}goals:\n  done: |\n    {guard}\n"):
        assert diagnostic.place.line >= 5
