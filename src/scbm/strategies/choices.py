"""One of several things."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from hypothesis import strategies as st

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hypothesis.strategies import SearchStrategy

_T = TypeVar("_T")


def one_of(choices: Sequence[_T]) -> SearchStrategy[_T]:
    """One of the choices; shrinks towards the first.

    Hypothesis writes down what it draws from, and warns if that is long, as predicates and states are. So it draws a
    number.
    """
    return st.sampled_from(range(len(choices))).map(lambda number: choices[number])
