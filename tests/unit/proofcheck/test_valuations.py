"""Valuations that satisfy a predicate, and the truth of a predicate of which some variables are known."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.files import Scope, Where, parse_predicate, read_model
from scbm.model import Predicate, Value
from scbm.proofcheck.valuations import TooManyStepsError, is_satisfiable, truth, valuations

MODEL = read_model(
    """
behavior_model: three
variables:
  a: {domain: bool, initial: false}
  n: {domain: 0..2, initial: 0}
  m: {domain: 0..2, initial: 0}
operations:
  work: {pre: {g: a == false}, post: {g: true, a: [a <- true, n <- m]}}
goals: {done: a == true}
"""
)
CHOICES: dict[str, tuple[Value, ...]] = {"a": (False, True), "n": (0, 1, 2), "m": (0, 1, 2)}
ATOMS = ["a == true", "n == m", "n < m", "n != 2", "n + m == 3", "m in {0, 2}", "true", "false"]
TEXTS = st.recursive(
    st.sampled_from(ATOMS),
    lambda inner: (
        st.builds("({} && {})".format, inner, inner)
        | st.builds("({} || {})".format, inner, inner)
        | st.builds("({} -> {})".format, inner, inner)
        | st.builds("!({})".format, inner)
    ),
    max_leaves=6,
)


def predicate(text: str) -> Predicate:
    return parse_predicate(text, Scope.of(MODEL), Where.GUARD)


def completions(known: dict[str, Value]) -> list[dict[str, Value]]:
    """All valuations that have these values, in order."""
    choices = [(known[name],) if name in known else values for name, values in CHOICES.items()]
    return [dict(zip(CHOICES, values, strict=True)) for values in product(*choices)]


@given(TEXTS)
def test_the_valuations_are_those_for_which_the_predicate_holds_in_order(text: str) -> None:
    wanted = predicate(text)
    expected = [each for each in completions({}) if wanted.holds(each)]
    assert list(valuations(wanted, CHOICES, 1_000)) == expected
    assert is_satisfiable(wanted, CHOICES) == bool(expected)


@given(TEXTS, st.dictionaries(st.sampled_from(["a", "n", "m"]), st.integers(0, 1)))
def test_a_truth_value_that_is_known_is_that_of_all_completions(text: str, chosen: dict[str, int]) -> None:
    wanted = predicate(text)
    known: dict[str, Value] = {name: bool(value) if name == "a" else value for name, value in chosen.items()}
    answer = truth(wanted, known)
    assert answer is None or {wanted.holds(each) for each in completions(known)} == {answer}
    assert answer is not None or any(name not in known for name in wanted.reads())


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        ("a == true", None),
        ("n == 1", True),
        ("a == true && n == 1", None),
        ("a == true && n == 2", False),
        ("a == true || n == 1", True),
        ("a == true || n == 2", None),
        ("a == true -> n == 1", True),
        ("n == 2 -> a == true", True),
        ("n == 1 -> a == true", None),
        ("!(a == true)", None),
        ("!(a == true && n == 2)", True),
        ("n == m", None),
    ],
)
def test_a_predicate_may_be_decided_though_a_variable_is_unknown(text: str, answer: bool | None) -> None:  # noqa: FBT001 - a parameter of the test
    assert truth(predicate(text), {"n": 1}) is answer


def test_partial_valuations_count_towards_the_limit() -> None:
    """The empty valuation, two of `a`, and three of `n` below one of them: the other is ruled out at once."""
    wanted, choices = predicate("a == true && n != 2"), {name: CHOICES[name] for name in ("a", "n")}
    assert len(list(valuations(wanted, choices, 6))) == 2
    with pytest.raises(TooManyStepsError):
        list(valuations(wanted, choices, 5))
