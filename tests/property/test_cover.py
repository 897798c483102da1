"""Smallest covers against looking at every selection, and what holds of each answer however large."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from scbm.cases.coverage import smallest_cover
from support.profiles import examples

SMALL = st.integers(1, 9).flatmap(lambda width: st.lists(st.integers(0, (1 << width) - 1), max_size=10))
SPARSE = st.lists(
    st.frozensets(st.integers(0, 11), max_size=3).map(lambda bits: sum(1 << bit for bit in bits)), max_size=14
)
LARGE = st.lists(st.integers(0, (1 << 40) - 1), max_size=60)


def union_of(sets: list[int]) -> int:
    union = 0
    for bits in sets:
        union |= bits
    return union


def fewest(sets: list[int]) -> int:
    """How many are needed: all unions of none, of one, of two, … until one of them is that of all."""
    wanted = union_of(sets)
    unions, count = {0: None}, 0
    while wanted not in unions:
        unions = {union | bits: None for union in unions for bits in sets}
        count += 1
    return count


@given(SMALL | SPARSE)
@examples(400)
def test_no_selection_is_smaller(sets: list[int]) -> None:
    cover = smallest_cover(sets)
    assert cover.is_smallest
    assert len(cover.chosen) == fewest(sets)
    assert union_of([sets[place] for place in cover.chosen]) == union_of(sets)


@given(LARGE, st.integers(0, 3_000))
@examples(200)
def test_with_any_limit_the_answer_covers_all_and_says_what_is_proved(sets: list[int], limit: int) -> None:
    cover = smallest_cover(sets, limit)
    assert list(cover.chosen) == sorted(dict.fromkeys(cover.chosen))
    assert union_of([sets[place] for place in cover.chosen]) == union_of(sets)
    assert cover.at_least <= len(smallest_cover(sets, 300_000).chosen)
    for place in cover.chosen:  # none of them is redundant
        assert union_of([sets[other] for other in cover.chosen if other != place]) != union_of(sets)


EDGES = st.lists(
    st.frozensets(st.integers(0, 9), min_size=2, max_size=2).map(lambda bits: sum(1 << bit for bit in bits)),
    max_size=12,
)


@pytest.mark.longer
@given(EDGES, st.integers(0, 1_000))
@example(
    [9, 48, 130, 20, 258, 516, 72, 66, 264, 384, 544, 65], 400
)  # two parts; an element of one has no set in the other
@example([9, 264, 384, 264, 6, 5, 513, 640, 130, 640, 192, 320], 200)  # stopped with a needless set
@examples(400)
def test_with_any_limit_the_bound_is_no_more_than_are_needed(sets: list[int], limit: int) -> None:
    cover = smallest_cover(sets, limit)
    assert cover.at_least <= fewest(sets) <= len(cover.chosen)
    assert len(smallest_cover(sets).chosen) == fewest(sets)
    for place in cover.chosen:
        assert union_of([sets[other] for other in cover.chosen if other != place]) != union_of(sets)


@given(SMALL)
def test_sets_that_bring_nothing_change_nothing(sets: list[int]) -> None:
    padded = [*sets, 0, *sets, *(bits & bits >> 1 for bits in sets)]
    more, fewer = smallest_cover(padded), smallest_cover(sets)
    assert (len(more.chosen), more.at_least) == (len(fewer.chosen), fewer.at_least)
