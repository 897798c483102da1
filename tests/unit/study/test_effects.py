"""The statistics of the study against slow and obvious references."""

from __future__ import annotations

from itertools import combinations
from math import sqrt
from random import Random

import pytest

pytestmark = pytest.mark.peer
pytest.importorskip("scipy")

from effects import holm, kendall, over_models, vargha_delaney  # noqa: E402 - only where scipy is installed


def drawn(seed: int) -> tuple[list[int], list[int]]:
    random = Random(seed)
    return [random.randrange(6) for _ in range(20)], [random.randrange(4) for _ in range(20)]


def sign(number: int) -> int:
    return (number > 0) - (number < 0)


@pytest.mark.parametrize("seed", range(5))
def test_kendall_counts_pairs(seed: int) -> None:
    first, second = drawn(seed)
    pairs = [(sign(a - c), sign(b - d)) for (a, b), (c, d) in combinations(zip(first, second, strict=True), 2)]
    untied = sqrt(sum(a != 0 for a, _ in pairs) * sum(b != 0 for _, b in pairs))
    assert kendall(first, second) == pytest.approx(sum(a * b for a, b in pairs) / untied)


def test_what_does_not_vary_has_no_correlation() -> None:
    assert kendall([1, 1, 1], [1, 2, 3]) is None


@pytest.mark.parametrize("seed", range(5))
def test_vargha_delaney_counts_pairs(seed: int) -> None:
    first, second = drawn(seed)
    wins = sum((a > b) + (a == b) / 2 for a in first for b in second)
    assert vargha_delaney(first, second) == pytest.approx(wins / (len(first) * len(second)))


def test_the_median_of_models_has_an_interval_around_it() -> None:
    effect = over_models([0.1, 0.5, None, 0.6, 0.7, 0.9], 0.0)
    assert effect is not None
    assert (effect.median, effect.models) == (0.6, 5)
    assert 0.1 <= effect.low <= effect.median <= effect.high <= 0.9
    assert effect.p < 0.001
    assert over_models([0.5, None], 0.0) is None


def test_holm_multiplies_the_smallest_most() -> None:
    assert holm([0.04, 0.01, 0.03]) == pytest.approx((0.06, 0.03, 0.06))
    assert holm([0.9, 0.9]) == (1.0, 1.0)
