"""The statistics of the study (protocol, Statistics): within models first, then over models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import kendalltau, rankdata

if TYPE_CHECKING:
    from collections.abc import Sequence

RESAMPLES = 10_000
LEVEL = 0.05


@dataclass(frozen=True, slots=True)
class Effect:
    """A median over models.

    Attributes:
        median: the median.
        low, high: its 95 % interval, by a percentile bootstrap over models.
        models: the number of models.
        p: how often a resampled median is not above the threshold of the hypothesis.
    """

    median: float
    low: float
    high: float
    models: int
    p: float

    def __str__(self) -> str:
        return f"{self.median:.2f} [{self.low:.2f}, {self.high:.2f}], {self.models} models"


def kendall(predictor: Sequence[int], found: Sequence[int]) -> float | None:
    """Return Kendall's τ-b; `None` if one of both does not vary."""
    if len(set(predictor)) < 2 or len(set(found)) < 2:  # noqa: PLR2004 - two different values vary
        return None
    return float(kendalltau(predictor, found).statistic)


def vargha_delaney(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """Return Â12: the probability that one of `ours` is larger than one of `theirs`; equal ones count half."""
    ranks = rankdata([*ours, *theirs])[: len(ours)].sum()
    return float((ranks / len(ours) - (len(ours) + 1) / 2) / len(theirs))


def mean(values: Sequence[float | None]) -> float | None:
    """Return the mean of the values that there are; `None` if there are none."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def over_models(values: Sequence[float | None], threshold: float, resamples: int = RESAMPLES) -> Effect | None:
    """Return the median over models; models without a value are left out. `None` if there are fewer than two."""
    known = np.array([value for value in values if value is not None])
    if len(known) < 2:  # noqa: PLR2004 - an interval needs two
        return None
    random = np.random.default_rng(4)
    medians = np.median(known[random.integers(0, len(known), (resamples, len(known)))], axis=1)
    low, high = np.percentile(medians, [2.5, 97.5])
    p = (np.count_nonzero(medians <= threshold) + 1) / (resamples + 1)
    return Effect(float(np.median(known)), float(low), float(high), len(known), float(p))


def holm(values: Sequence[float]) -> tuple[float, ...]:
    """Return p-values that are corrected by Holm's method, in the order given."""
    order = sorted(range(len(values)), key=lambda index: values[index])
    corrected, largest = [0.0] * len(values), 0.0
    for place, index in enumerate(order):
        largest = max(largest, min(1.0, (len(values) - place) * values[index]))
        corrected[index] = largest
    return tuple(corrected)
