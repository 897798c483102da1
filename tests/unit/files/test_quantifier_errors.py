"""A malformed quantifier is one error, and letters that names do not have belong to their word."""

from __future__ import annotations

import pytest

from scbm.files import read_model
from scbm.model import InputError

MODEL = """\
behavior_model: cell
types: {zone: [a, b]}
variables: {'full[zone]': {domain: bool, initial: false}}
operations: {o: {pre: {g: true, a: [ACTION]}, post: {g: true}}}
goals:
  goal: GOAL
"""


def found_in(goal: str = "full.a == true", action: str = "full.a <- true") -> list[str]:
    """Return line, column in the goal, length and slug of each error."""
    with pytest.raises(InputError) as raised:
        read_model(MODEL.replace("GOAL", f"'{goal}'").replace("ACTION", f"'{action}'"))
    return [
        f"{p.line}:{p.column - 10}+{p.length} {each.slug}" for each in raised.value.diagnostics for p in (each.place,)
    ]


@pytest.mark.parametrize(
    ("goal", "error"),
    [
        ("forall t in Förderer.: full[t] == true", "6:0+6 predicate-syntax"),
        ("exists t in Förderer.: full[t] == true", "6:0+6 predicate-syntax"),
        ("full.a == true && forall t in zoen.: full[t] == true", "6:18+6 predicate-syntax"),
        ("forall t: full[t] == true", "6:0+6 predicate-syntax"),
        ("forall t in. (full[t] == true)", "6:0+6 predicate-syntax"),
        ("forall t in (zone). (full[t] == true)", "6:0+6 predicate-syntax"),
        ("forall t in {a, b}. (full[t] == true)", "6:0+6 predicate-syntax"),
        ("forall t in zo-ne. (full[t] == true)", "6:0+6 predicate-syntax"),
        ("count t in Förderer (full[t] == true) >= 1", "6:0+5 predicate-syntax"),
        ("forall t in Förderer. (full[t] == true)", "6:12+8 unknown-type"),
        ("forall Tür in zone. (full[Tür] == true)", "6:7+3 bad-name"),
        ("full[Förderer] == true", "6:5+8 unknown-object"),
    ],
)
def test_a_malformed_quantifier_is_one_error(goal: str, error: str) -> None:
    assert found_in(goal) == [error]


def test_a_malformed_quantifier_of_an_action_is_one_error() -> None:
    (found,) = found_in(action="forall t in Förderer: full[t] <- true")
    assert found.endswith("+6 predicate-syntax")
