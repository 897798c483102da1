"""Shares: what is one, and that one is written as it is read."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.files import parse_share
from scbm.files.language.quantities import format_share
from support.wording import Wording


@pytest.mark.parametrize(
    ("text", "share"),
    [
        ("2 %", Fraction(1, 50)),
        ("2%", Fraction(1, 50)),
        ("0.5 %", Fraction(1, 200)),
        ("0.02", Fraction(1, 50)),
        (".5", Fraction(1, 2)),
        ("0", Fraction(0)),
        ("1", Fraction(1)),
        ("100 %", Fraction(1)),
        ("  3 % ", Fraction(3, 100)),
    ],
)
def test_a_share_is_a_number_from_0_to_1_or_per_cent(text: str, share: Fraction) -> None:
    assert parse_share(text) == share


@pytest.mark.parametrize("text", ["", "%", "130 %", "1.1", "-1 %", "2 percent", "1/2", "two", "2 % %", "1e-2", "٣ %"])
def test_anything_else_is_no_share(text: str) -> None:
    assert parse_share(text) is None


@given(st.integers(0, 10**9))
def test_a_share_is_read_as_it_was_written(billionths: int) -> None:
    share = Fraction(billionths, 10**9)
    assert parse_share(format_share(share)) == share


def test_a_share_without_end_cannot_be_written(wording: Wording) -> None:
    with wording.raises(ValueError):
        format_share(Fraction(1, 3))
