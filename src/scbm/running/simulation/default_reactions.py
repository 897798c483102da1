"""Reactions of resources to requests that a case leaves open: drawn from the model file, or plain."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeVar, assert_never

from scbm.cases import Reaction
from scbm.model import LatencyShape, Outcome

if TYPE_CHECKING:
    from collections.abc import Sequence
    from random import Random

    from scbm.cases.trace import Changes
    from scbm.model import DrawnVariable, Latency, Resource, Value

_T = TypeVar("_T")

_MICROSECOND_NS = 1_000
_WIDE_NS = 1_000_000
_LONGEST_MEANS = 37
"""No drawn time is longer than this many means: the largest number below 1 that is drawn gives 36.7."""


class PlainReactions:
    """Every request succeeds, after the typical latency, with the first of the values listed for each variable."""

    def react(self, resource: Resource) -> Reaction:
        """Return the plain reaction, the same each time."""
        latency_ns = typical_ns(resource.simulation.latency)
        return Reaction(resource.name, Outcome.SUCCEED, latency_ns, plainly_measured(resource))


def plainly_measured(resource: Resource, outcome: Outcome = Outcome.SUCCEED) -> Changes | None:
    """Return the first of the values listed for each variable; `None` if there are none."""
    return tuple((each.name, each.possible[0]) for each in resource.drawn(outcome)) or None


def typical_ns(latency: Latency) -> int:
    """Return the typical latency: the one value, the middle, the mode, or the mean of the distribution."""
    match latency.shape:
        case LatencyShape.FIXED | LatencyShape.EXPONENTIAL:
            return latency.points_ns[0]
        case LatencyShape.UNIFORM:
            low, high = latency.points_ns
            return _rounded((low + high) / 2, low, high)
        case LatencyShape.TRIANGULAR:
            return latency.points_ns[1]
        case _:
            assert_never(latency.shape)


class DrawnReactions:
    """Draws reactions from the distributions of the model file.

    Only `Random.random` is used: of all methods it alone promises the same numbers in every version of Python.
    """

    def __init__(self, random: Random) -> None:
        self._random = random

    def react(self, resource: Resource) -> Reaction:
        """Draw an outcome, a latency, and the measured values, in this order."""
        outcome = self._one_of(resource.simulation.cumulative)
        latency_ns = draw_time_ns(resource.simulation.latency, self._random)
        measured = tuple((each.name, self._value(each)) for each in resource.drawn(outcome))
        return Reaction(resource.name, outcome, latency_ns, measured or None)

    def _value(self, variable: DrawnVariable) -> Value:
        if variable.weights:
            return self._one_of(variable.cumulative)
        return variable.values[int(self._random.random() * len(variable.values))]

    def _one_of(self, possible: Sequence[tuple[_T, float]]) -> _T:
        """Draw by the sums of probabilities."""
        drawn = self._random.random()
        for one, reached in possible:
            if drawn < reached:
                return one
        return possible[-1][0]


def draw_time_ns(latency: Latency, random: Random) -> int:
    """Draw a time by the inverse of its distribution function."""
    match latency.shape:
        case LatencyShape.FIXED:
            return latency.points_ns[0]
        case LatencyShape.UNIFORM:
            low, high = latency.points_ns
            return _rounded(low + random.random() * (high - low), low, high)
        case LatencyShape.TRIANGULAR:
            low, mode, high = latency.points_ns
            return _rounded(_triangular(random.random(), low, mode, high), low, high)
        case LatencyShape.EXPONENTIAL:
            (mean,) = latency.points_ns
            return _rounded(-mean * math.log(1 - random.random()), 0, _LONGEST_MEANS * mean)
        case _:
            assert_never(latency.shape)


def _rounded(drawn_ns: float, low_ns: int, high_ns: int) -> int:
    """Round to whole microseconds, precise enough and easy to read; finer in a narrow range."""
    step_ns = _MICROSECOND_NS if high_ns - low_ns >= _WIDE_NS else 1
    rounded = round(drawn_ns / step_ns) * step_ns
    return min(max(rounded, low_ns), high_ns)


def _triangular(drawn: float, low: int, mode: int, high: int) -> float:
    """Return the inverse of the distribution function of the triangular distribution."""
    if low == high:
        return low
    share = (mode - low) / (high - low)
    if drawn <= share:
        return low + (high - low) * math.sqrt(drawn * share)
    return high - (high - low) * math.sqrt((1 - drawn) * (1 - share))
