"""Suites in which a bound that claims one too many hides the smallest cover: no reduction decides them."""

from __future__ import annotations

from itertools import combinations

import pytest

from scbm.cases.coverage import smallest_cover

HARD = (
    (12, 17, 129, 48, 68, 5, 9, 65, 34, 20, 136, 3, 12, 72, 33),
    (2176, 18, 528, 1056, 2049, 2304, 10, 33, 2560, 1152, 384, 528, 544, 17, 260, 80),
    (65, 192, 9, 144, 9, 34, 18, 33, 6, 65, 9, 5, 40, 72),
)


def _union(sets: tuple[int, ...]) -> int:
    union = 0
    for bits in sets:
        union |= bits
    return union


@pytest.mark.parametrize("sets", HARD)
def test_a_cover_that_only_a_search_finds(sets: tuple[int, ...]) -> None:
    size = next(n for n in range(len(sets) + 1) if any(_union(c) == _union(sets) for c in combinations(sets, n)))
    found = smallest_cover(sets)
    assert (len(found.chosen), found.at_least) == (size, size)
    assert _union(tuple(sets[place] for place in found.chosen)) == _union(sets)


HASTY = (
    ((769, 193, 288, 160, 400, 36, 594, 582, 197, 10), 2_000),
    ((1040, 1088, 528, 272, 80, 1536, 384, 288), 0),
    ((513, 129, 576, 640, 9, 33, 65, 288, 10), 200),
)


@pytest.mark.parametrize(("sets", "limit"), HASTY)
def test_with_little_work_no_set_is_needless_and_the_bound_holds(sets: tuple[int, ...], limit: int) -> None:
    """Prices below nothing prove too much, and what is picked first may be had from the others together."""
    size = next(n for n in range(len(sets) + 1) if any(_union(c) == _union(sets) for c in combinations(sets, n)))
    found = smallest_cover(sets, limit)
    assert found.at_least <= size <= len(found.chosen)
    chosen = [sets[place] for place in found.chosen]
    assert _union(tuple(chosen)) == _union(sets)
    assert all(_union(tuple(chosen[:one] + chosen[one + 1 :])) != _union(sets) for one in range(len(chosen)))
