"""Smallest covers that are known, ties, and limits."""

from __future__ import annotations

from itertools import permutations
from random import Random

import pytest

from scbm.cases.coverage import Cover, smallest_cover

Triples = list[tuple[int, ...]]


def tripled(points: int, triples: Triples) -> tuple[int, Triples]:
    """The Steiner triple system of three times the points."""
    lines: Triples = [tuple(3 * point + copy for point in triple) for triple in triples for copy in range(3)]
    lines += [(3 * point, 3 * point + 1, 3 * point + 2) for point in range(points)]
    lines += [
        tuple(3 * point + copy for point, copy in zip(triple, copies, strict=True))
        for triple in triples
        for copies in permutations(range(3))
    ]
    return 3 * points, lines


def as_sets(points: int, triples: Triples) -> list[int]:
    """For each point the triples that it is in: to cover them is to hit every triple."""
    return [sum(1 << number for number, triple in enumerate(triples) if point in triple) for point in range(points)]


def test_nothing_is_covered_by_nothing() -> None:
    assert smallest_cover([]) == Cover((), 0)
    assert smallest_cover([0, 0]) == Cover((), 0)
    assert smallest_cover([]).is_smallest


def test_one_set_that_holds_all_is_enough() -> None:
    assert smallest_cover([0b01, 0b11, 0b10]) == Cover((1,), 1)


def test_of_equal_sets_the_first_is_chosen() -> None:
    assert smallest_cover([0, 0b11, 0b11]).chosen == (1,)


def test_of_sets_that_would_do_the_earliest_is_chosen() -> None:
    # the largest set brings 0 and 1, but what only it brings beside the other is 0, which an earlier one has
    assert smallest_cover([0b0001, 0b0011, 0b1110]).chosen == (0, 2)


def test_the_greedy_choice_is_not_the_smallest() -> None:
    # the largest set is a trap: with it three are needed
    rows = [0b000111, 0b111000, 0b011110]
    assert smallest_cover(rows).chosen == (0, 1)


def test_groups_that_share_nothing_are_solved_apart() -> None:
    odd_cycle = [1 << place | 1 << (place + 1) % 5 for place in range(5)]  # three of five cover a ring
    rows = [bits << 5 * group for group in range(40) for bits in odd_cycle]
    cover = smallest_cover(rows)
    assert (len(cover.chosen), cover.at_least) == (120, 120)


def test_steiner_triples_have_the_cover_that_is_known() -> None:
    # Fulkerson, Nemhauser and Trotter, 1974: five points hit all triples of nine; the linear bound is three
    nine = tripled(3, [(0, 1, 2)])
    assert smallest_cover(as_sets(*nine)).at_least == 5
    assert len(smallest_cover(as_sets(*nine)).chosen) == 5


def test_without_work_there_is_still_a_cover_and_a_bound_below_it() -> None:
    random = Random(1)
    sets = [sum(1 << element for element in random.sample(range(60), 6)) for _ in range(200)]
    hasty, patient = smallest_cover(sets, limit=0), smallest_cover(sets, limit=200_000)
    assert not hasty.is_smallest
    assert 1 <= hasty.at_least <= patient.at_least <= len(patient.chosen) <= len(hasty.chosen)


def test_a_search_at_its_limit_of_work_says_what_it_has_proved() -> None:
    sets = [164, 42, 13, 56, 25, 140, 134, 19]
    assert smallest_cover(sets, limit=1) == Cover((0, 1, 4), at_least=2)
    assert smallest_cover(sets) == Cover((0, 1, 4), at_least=3)


def test_prices_that_no_step_improves_end_the_search_for_a_bound() -> None:
    """On the way two disjoint sets cover all at their prices, so the subgradient is zero."""
    assert smallest_cover([18, 20, 12, 7, 11, 17]) == Cover((1, 4), at_least=2)


def test_smaller_steps_of_prices_prove_a_smallest_cover_with_little_work() -> None:
    """Without smaller steps the proof of this cover takes ten times the work."""
    random = Random(3)
    sets = [sum(1 << element for element in random.sample(range(45), 4)) for _ in range(55)]
    cover = smallest_cover(sets, limit=100_000)
    assert (len(cover.chosen), cover.at_least) == (14, 14)


@pytest.mark.longer
def test_ten_thousand_cases_that_visit_alike_are_few() -> None:
    random = Random(1)
    kinds = [random.getrandbits(86) & random.getrandbits(86) for _ in range(12)]
    sets = [random.choice(kinds) & random.getrandbits(86) for _ in range(10_000)] + kinds
    chosen = smallest_cover(sets).chosen
    union = 0
    for bits in kinds:
        union |= bits
    for place in chosen:
        union &= ~sets[place]
    assert not union
    assert len(chosen) <= len(smallest_cover(kinds).chosen)


def test_the_same_sets_give_the_same_answer() -> None:
    random = Random(3)
    sets = [random.getrandbits(50) & random.getrandbits(50) for _ in range(300)]
    assert smallest_cover(sets, 300_000) == smallest_cover(sets, 300_000)


def test_a_cover_is_smallest_only_if_the_bound_is_its_size() -> None:
    assert Cover((0, 1), 2).is_smallest
    assert not Cover((0, 1), 1).is_smallest
