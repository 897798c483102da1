"""A forecast of what ten times as many random cases would visit, from how often obligations were visited so far.

The number of obligations that no case visited yet, but that random cases can visit, is estimated from the numbers of
those that one case and two cases visited (Chao 2 for incidence data, bias-corrected: Chao, Biometrics 43, 1987). How
many of them more cases find follows by the extrapolation of Colwell and others (Journal of Plant Ecology 5, 2012).

The standard error adds what that estimate leaves out: cases visit obligations in groups, so the variance grows with the
mean size of a group, and an event that no case has shown yet brings a group of its own.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import bits_of

if TYPE_CHECKING:
    from scbm.cases.coverage import Obligations
    from scbm.testing.batches.batch_summary import BatchSummary

FACTOR = 10
"""A forecast is for this many times the number of cases that ran."""

FEWEST_CASES = 100
"""Minimum number of random cases for a forecast; with fewer, running more costs next to nothing."""

_STEP = 1e-4
"""The step of numerical derivatives, in obligations."""


class Forecast(Struct, frozen=True):
    """An estimate of the coverage by more random cases; it proves nothing.

    Attributes:
        cases: the number of random cases in the forecast.
        visited: how many obligations of the figure these would visit.
        error: the standard error of that number.
    """

    cases: int
    visited: float
    error: float


def forecast(summary: BatchSummary, obligations: Obligations) -> Forecast | None:
    """Return the forecast of a campaign; `None` for few cases, and where cases from files have visited obligations."""
    cases = summary.count
    if summary.written or cases < FEWEST_CASES:
        return None
    counted = obligations.counted
    visits = [summary.visits[bit] for bit in bits_of(counted)]
    visited = sum(count > 0 for count in visits)
    once, twice = visits.count(1), visits.count(2)
    more = (FACTOR - 1) * cases
    new = min(_new(once, twice, cases, more), float(len(visits) - visited))
    groups, later = _groups(summary, counted)
    variance = _variance(once + 1.0, twice + 1.0, cases, more) * (once / groups if groups else 1.0) + later**2
    error = min(sqrt(variance), float(len(visits) - visited))
    return Forecast(FACTOR * cases, round(visited + new, 1), round(error, 1))


def _new(once: int, twice: int, cases: int, more: int) -> float:
    """Return the expected number of obligations that `more` cases visit first.

    Args:
        once: the number of obligations that one case visited.
        twice: the number of obligations that two cases visited.
        cases: the number of cases so far.
        more: the number of further cases.
    """
    pairs = once * (once - 1) if once > 1 else once
    return _found((cases - 1) / cases * pairs / (2 * (twice + 1)), once, cases, more)


def _found(unseen: float, once: float, cases: int, more: int) -> float:
    """Return how many of so many unseen obligations `more` cases find."""
    return unseen * (1 - (1 - once / (cases * unseen + once)) ** more) if unseen > 0 else 0.0


def _variance(once: float, twice: float, cases: int, more: int) -> float:
    """Return the variance of the number found, with numbers of visits that are independent and Poisson-distributed."""

    def found(once: float, twice: float) -> float:
        return _found((cases - 1) / cases * once * once / (2 * twice), once, cases, more)

    by_once = (found(once + _STEP, twice) - found(once - _STEP, twice)) / (2 * _STEP)
    by_twice = (found(once, twice + _STEP) - found(once, twice - _STEP)) / (2 * _STEP)
    return by_once**2 * once + by_twice**2 * twice + found(once, twice)


def _groups(summary: BatchSummary, counted: int) -> tuple[int, float]:
    """Return the number of cases with a visit of their own, and the mean number of new visits of a later case.

    The mean is over cases that visited something new, without the first one.
    """
    union, groups = 0, 0
    sizes = []
    for _, visited in summary.news:
        new = visited & counted & ~union
        union |= visited
        groups += any(summary.visits[bit] == 1 for bit in bits_of(new))
        if new:
            sizes.append(new.bit_count())
    later = sizes[1:]
    return groups, sum(later) / len(later) if later else 0.0
