"""Draws for random models: strategies over indices that are made once, as making a strategy costs more than a draw."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, TypeVar

from hypothesis import strategies as st

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hypothesis.strategies import DrawFn, SearchStrategy

T = TypeVar("T")

_BOOLEANS = st.booleans()


def flag(draw: DrawFn) -> bool:
    """Draw a truth value; the simpler one is `False`."""
    return draw(_BOOLEANS)


@cache
def _whole(low: int, high: int) -> SearchStrategy[int]:
    return st.integers(low, high)


def whole(draw: DrawFn, low: int, high: int) -> int:
    """Draw a whole number of a range; the simplest one is the one nearest to 0."""
    return draw(_whole(low, high))


def one_of(draw: DrawFn, items: Sequence[T]) -> T:
    """Draw one of `items`; the simplest one is the first."""
    return items[whole(draw, 0, len(items) - 1)]


@cache
def _indices(number: int, least: int, most: int | None) -> SearchStrategy[list[int]]:
    return st.lists(_whole(0, number - 1), min_size=least, max_size=most, unique=True)


def some_of(draw: DrawFn, items: Sequence[T], least: int = 0, most: int | None = None) -> list[T]:
    """Draw some of `items`, each at most once; the simplest choice is the shortest."""
    largest = len(items) if most is None else min(most, len(items))
    return [items[index] for index in draw(_indices(len(items), least, largest))]
