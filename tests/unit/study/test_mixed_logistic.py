"""The logistic model with random intercepts: its likelihood, its estimates, and its intervals."""

from __future__ import annotations

from dataclasses import replace
from math import exp, log, pi, sqrt

import pytest

pytestmark = pytest.mark.peer
pytest.importorskip("scipy")

import numpy as np  # noqa: E402 - only where scipy is installed
from mixed_logistic import MarginalLikelihood, MixedLogistic, mixed_logistic, standardized  # noqa: E402
from model_figures import SuiteCounts  # noqa: E402

SIZE, COVERAGE = 0.3, 0.8
"""The coefficients that drawn counts have."""


def drawn(seed: int, mutants: int, intercept: float) -> SuiteCounts:
    """Return suites that find each of many mutants with the probability of the logistic model."""
    random = np.random.default_rng(seed)
    cases = [2**power for power in (1, 2, 3, 4, 5) for _ in range(20)]
    visited = [int(10 * log(each)) + int(random.integers(0, 10)) for each in cases]
    size, coverage = standardized(np.log(np.array(cases))), standardized(np.array(visited, dtype=float))
    chances = 1 / (1 + np.exp(-(intercept + SIZE * size + COVERAGE * coverage)))
    return SuiteCounts(tuple(cases), tuple(visited), tuple(map(int, random.binomial(mutants, chances))), mutants)


MODELS = tuple(drawn(seed, 500, seed / 4 - 1) for seed in range(9))


def estimated(models: tuple[SuiteCounts, ...]) -> MixedLogistic:
    found = mixed_logistic(models)
    assert found is not None
    return found


def test_the_coefficients_are_found_again() -> None:
    found = estimated(MODELS)
    assert log(found.coverage.value) == pytest.approx(COVERAGE, abs=0.03)
    assert log(found.cases.value) == pytest.approx(SIZE, abs=0.03)
    assert found.deviation == pytest.approx(np.std([seed / 4 - 1 for seed in range(9)]), rel=0.05)
    assert found.coverage.low < exp(COVERAGE) < found.coverage.high
    assert (found.models, found.suites, found.pairs) == (9, 900, 450_000)


def test_the_likelihood_is_the_integral_over_the_intercept() -> None:
    counts = SuiteCounts((2, 4, 8), (3, 4, 7), (5, 9, 20), 30)
    parameters = np.array([0.2, 0.5, 0.7, log(0.9)])
    size, coverage = standardized(np.log([2.0, 4, 8])), standardized(np.array([3.0, 4, 7]))
    fixed = 0.2 + 0.5 * size + 0.7 * coverage
    intercepts = np.linspace(-8, 8, 20_001)
    logs = sum(
        found * (each + intercepts) - 30 * np.logaddexp(0, each + intercepts)
        for each, found in zip(fixed, counts.found, strict=True)
    )
    heights = np.exp(logs - intercepts**2 / (2 * 0.81)) / (0.9 * sqrt(2 * pi))
    integral = log(float(heights.sum()) * (intercepts[1] - intercepts[0]))
    assert MarginalLikelihood([counts]).logs(parameters)[0] == pytest.approx(integral, abs=0.01)


def test_more_suites_of_the_same_kind_are_no_more_models() -> None:
    many = tuple(replace(m, cases=m.cases * 9, visited=m.visited * 9, found=m.found * 9) for m in MODELS)
    once, often = estimated(MODELS).coverage, estimated(many).coverage
    assert often.value == pytest.approx(once.value, rel=0.001)
    assert (often.low, often.high) == pytest.approx((once.low, once.high), rel=0.002)
    narrow = log(once.narrow[1] / once.narrow[0]) / log(often.narrow[1] / often.narrow[0])
    assert narrow == pytest.approx(3, rel=0.01)


def test_a_model_whose_coverage_does_not_vary_does_not_count() -> None:
    constant = SuiteCounts((2, 4, 8), (5, 5, 5), (1, 2, 3), 9)
    assert estimated((*MODELS, constant)) == estimated(MODELS)
    assert mixed_logistic([MODELS[0], constant]) is None


@pytest.mark.parametrize("seed", range(8))
def test_models_that_do_not_differ_have_intervals_like_those_that_do(seed: int) -> None:
    found = estimated((drawn(seed, 20, 0), drawn(seed + 100, 20, 0)))
    for ratio in (found.coverage, found.cases):
        assert 0 < ratio.low < ratio.value < ratio.high
        assert 0 < ratio.narrow[0] < ratio.value < ratio.narrow[1]
