"""Suites in which a bound that claims one too many hides the smallest cover: no reduction decides them."""

from __future__ import annotations

from itertools import combinations

import pytest

from scbm.coverage import smallest_cover

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
