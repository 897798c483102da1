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


@pytest.mark.parametrize(
    ("goal", "error"),
    [
        ("forall t in zone. (full[t] == )", "6:30+1 predicate-syntax"),
        ("forall t in zone. (full[t] == true && )", "6:38+1 predicate-syntax"),
        ("forall t in zone. ()", "6:19+1 predicate-syntax"),
        ("forall t in zone. (!)", "6:20+1 predicate-syntax"),
        ("forall t in zone. (full[t] == true))", "6:35+1 predicate-syntax"),
        ("forall t in zone. (full[t] == true) full[a] == true", "6:36+7 predicate-syntax"),
        ("forall t in zone. (full[t] == true && t == a a)", "6:45+1 predicate-syntax"),
        ("forall t in zone. (full[t == true)", "6:23+1 predicate-syntax"),
        ("count t in zone. (full[t] == true &&) <= 1", "6:36+1 predicate-syntax"),
        ("exists t in zone, u: zone. (t != u && (full[u] == ))", "6:50+1 predicate-syntax"),
        ("forall t in zone. (exists u in zone. (full[u] == ))", "6:49+1 predicate-syntax"),
        ("exists t in zone. (t in zone && t in {a, b} && near(t, t) && )", "6:61+1 predicate-syntax"),
    ],
)
def test_a_syntax_error_below_a_quantifier_stands_at_its_own_word(goal: str, error: str) -> None:
    assert found_in(goal) == [error]


@pytest.mark.parametrize(
    ("requirement", "column"),
    [
        ("always forall t in zone. (full[t] == )", 37),
        ("always forall t in zone. (full[t] == true))", 42),
        ("forall t in zone. (!) leads to true", 20),
    ],
)
def test_a_syntax_error_in_a_requirement_stands_at_its_own_word(requirement: str, column: int) -> None:
    model = MODEL.replace("GOAL", "full.a == true").replace("ACTION", "full.a <- true")
    with pytest.raises(InputError) as raised:
        read_model(f"{model}requirements:\n  one: {requirement}\n")
    (found,) = raised.value.diagnostics
    assert (found.slug.value, found.place.line, found.place.column) == ("requirement-syntax", 8, column + 8)
