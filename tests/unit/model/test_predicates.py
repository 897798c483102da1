"""Negated predicates, and the parts of which all, or of which one, must hold."""

from __future__ import annotations

from itertools import product

import pytest

from scbm.files import read_model
from scbm.model.predicates import all_needed, alternatives, negated

PREDICATES = {
    "a == true && (b == true || !(c == true))": (2, 1),
    "!(a == true || !(b == true && c == true))": (3, 1),
    "!(a == true && (b == true || c == true))": (1, 2),
    "!(a == true -> b == true)": (2, 1),
    "a == true -> b == true -> c == true": (1, 3),
    "!!(a == true || b != true || c in {true})": (1, 3),
    "true": (1, 1),
}


@pytest.mark.parametrize(("text", "numbers"), PREDICATES.items())
def test_predicates_are_divided_below_negations(text: str, numbers: tuple[int, int]) -> None:
    variables = ", ".join(f"{name}: {{domain: bool, initial: false}}" for name in "abc")
    work = "operations: {work: {pre: {g: true}, post: {g: true}}}"
    predicate = read_model(f"behavior_model: m\nvariables: {{{variables}}}\n{work}\ngoals: {{g: '{text}'}}").goals[0][1]
    needed, choices = all_needed(predicate), alternatives(predicate)
    assert (len(needed), len(choices)) == numbers
    for values in product((False, True), repeat=3):
        state = dict(zip("abc", values, strict=True))
        holds = predicate.holds(state)
        assert all(part.holds(state) for part in needed) is holds
        assert any(part.holds(state) for part in choices) is holds
        assert negated(predicate).holds(state) is not holds
