"""Patterns of requirements: their letters, all ways to write them, and sentences with values."""

from __future__ import annotations

import pytest

from scbm.model import Constant, Equal, Reference
from scbm.model.requirements import PlaceholderKind, kinds_of, spellings, written

PATTERN = "p at most n times [within d of q] until r"
P, Q, R = (Equal(Reference(name), Constant(True)) for name in ("a", "b", "c"))


def test_the_letters_of_a_pattern_have_kinds() -> None:
    predicate, number, duration = PlaceholderKind.PREDICATE, PlaceholderKind.NUMBER, PlaceholderKind.DURATION
    assert kinds_of(PATTERN) == (predicate, number, duration, predicate, predicate)


def test_a_pattern_is_written_without_and_with_each_optional_part() -> None:
    assert spellings("always p") == ("always p",)
    assert spellings(PATTERN) == ("p at most n times until r", "p at most n times within d of q until r")
    assert spellings("[from p] always q [for d]") == (
        "always q",
        "always q for d",
        "from p always q",
        "from p always q for d",
    )


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((P, 0, None, None, R), "a == true at most 0 times until c == true"),
        ((P, 12, 1_500_000_000, Q, R), "a == true at most 12 times within 1.5 s of b == true until c == true"),
    ],
    ids=["without", "with"],
)
def test_a_sentence_has_the_values_in_their_places(values: tuple[object, ...], text: str) -> None:
    assert written(PATTERN, values) == text
