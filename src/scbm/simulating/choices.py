"""Free choices: what a simulated resource does with a request. Drawn once, recorded, and then only repeated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from scbm.errors import Diagnostic, Place, ReplayError, Slug
from scbm.model import LatencyShape, Outcome

if TYPE_CHECKING:
    from collections.abc import Sequence
    from random import Random

    from scbm.model import Latency, Resource
    from scbm.trace import Changes

_MICROSECOND_NS = 1_000
_WIDE_NS = 1_000_000


@dataclass(frozen=True, slots=True)
class Reaction:
    """What a resource does with one request.

    Attributes:
        resource: which resource.
        outcome: a reply that says succeeded, one that says failed, or no reply.
        latency_ns: the time from the request to the reply.
        measured: values that the reply carries.
    """

    resource: str
    outcome: Outcome
    latency_ns: int
    measured: Changes = ()


class Chooser(Protocol):
    """Decides how resources react."""

    def react(self, resource: Resource) -> Reaction:
        """The reaction to the next request, which goes to `resource`."""
        ...


class DrawnChoices:
    """Draws reactions from the distributions of the model file, and keeps them.

    Only `Random.random` is used: of all methods it alone promises the same numbers in every version of Python.
    """

    def __init__(self, random: Random) -> None:
        self._random = random
        self.drawn: list[Reaction] = []

    def react(self, resource: Resource) -> Reaction:
        """Draws an outcome, a latency, and for a success the measured values, in this order."""
        outcome = self._outcome(resource)
        latency_ns = self._latency_ns(resource.simulation.latency)
        measured: Changes = ()
        if outcome is Outcome.SUCCEED:
            drawn = resource.simulation.measured
            measured = tuple((name, values[self._below(len(values))]) for name, values in drawn)
        reaction = Reaction(resource.name, outcome, latency_ns, measured)
        self.drawn.append(reaction)
        return reaction

    def _outcome(self, resource: Resource) -> Outcome:
        drawn = self._random.random()
        outcomes = resource.simulation.outcomes
        reached = 0.0
        for outcome, probability in outcomes:
            reached += float(probability)
            if drawn < reached and probability:
                return outcome
        return next(outcome for outcome, probability in reversed(outcomes) if probability)

    def _latency_ns(self, latency: Latency) -> int:
        """A latency, by the inverse of its distribution function."""
        match latency.shape:
            case LatencyShape.FIXED:
                return latency.points_ns[0]
            case LatencyShape.UNIFORM:
                low, high = latency.points_ns
                return _rounded(low + self._random.random() * (high - low), low, high)
            case LatencyShape.TRIANGULAR:
                low, mode, high = latency.points_ns
                return _rounded(_triangular(self._random.random(), low, mode, high), low, high)

    def _below(self, count: int) -> int:
        return int(self._random.random() * count)


def _rounded(drawn_ns: float, low_ns: int, high_ns: int) -> int:
    """Whole microseconds, which are more than any resource keeps to and easier to read; finer in a narrow range."""
    step_ns = _MICROSECOND_NS if high_ns - low_ns >= _WIDE_NS else 1
    rounded = round(drawn_ns / step_ns) * step_ns
    return min(max(rounded, low_ns), high_ns)


def _triangular(drawn: float, low: int, mode: int, high: int) -> float:
    """The inverse of the distribution function of the triangular distribution."""
    if low == high:
        return low
    share = (mode - low) / (high - low)
    if drawn <= share:
        return low + (high - low) * math.sqrt(drawn * share)
    return high - (high - low) * math.sqrt((1 - drawn) * (1 - share))


class RecordedChoices:
    """Repeats reactions that were recorded."""

    def __init__(self, reactions: Sequence[Reaction]) -> None:
        self._reactions = tuple(reactions)
        self._used = 0

    @property
    def used(self) -> tuple[Reaction, ...]:
        """The reactions that were repeated so far."""
        return self._reactions[: self._used]

    def react(self, resource: Resource) -> Reaction:
        """The next recorded reaction. Raises `ReplayError` if there is none, or one for another resource."""
        if self._used == len(self._reactions):
            raise _differs(f"the run sends request {self._used + 1}, and {self._used} were recorded")
        reaction = self._reactions[self._used]
        self._used += 1
        if reaction.resource != resource.name:
            raise _differs(
                f"request {self._used} goes to `{resource.name}`, and was recorded as going to `{reaction.resource}`"
            )
        return reaction


def _differs(message: str) -> ReplayError:
    remedy = "the model has changed since the run was recorded"
    return ReplayError([Diagnostic(Slug.REPLAY_DIFFERS, message, Place("replay"), remedy)])
