"""Resources: what carries out requests, and how a simulated resource behaves (semantics 6)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from fractions import Fraction
from itertools import accumulate
from typing import TYPE_CHECKING

from scbm.model.variables import request_state_name, trigger_name

if TYPE_CHECKING:
    from scbm.model.bindings import Binding
    from scbm.model.values import Value
    from scbm.model.variables import Variable


class Outcome(StrEnum):
    """The outcome of a request: a reply of success, a reply of failure, or no reply."""

    SUCCEED = "succeed"
    FAIL = "fail"
    TIMEOUT = "timeout"


class LatencyShape(StrEnum):
    """The distribution of latencies."""

    FIXED = "fixed"
    UNIFORM = "uniform"
    TRIANGULAR = "triangular"
    EXPONENTIAL = "exponential"


@dataclass(frozen=True, slots=True)
class Latency:
    """The time from a request to its reply.

    Attributes:
        shape: the distribution.
        points_ns: its parameters: (value,), (low, high), (low, mode, high), or (mean,).
    """

    shape: LatencyShape
    points_ns: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Simulation:
    """The behavior of a simulated resource.

    Attributes:
        latency: the time to its reply.
        outcomes: the probability of each outcome; they add up to 1.
        measured: for each measured variable the values that a successful reply draws from.
        cumulative: the outcomes that are possible, each with the sum of the probabilities up to it.
    """

    latency: Latency = Latency(LatencyShape.FIXED, (0,))
    outcomes: tuple[tuple[Outcome, Fraction], ...] = ((Outcome.SUCCEED, Fraction(1)),)
    measured: tuple[tuple[str, tuple[Value, ...]], ...] = ()
    cumulative: tuple[tuple[Outcome, float], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        reached = accumulate(float(probability) for _, probability in self.outcomes)
        pairs = zip(self.outcomes, reached, strict=True)
        possible = tuple((outcome, share) for (outcome, probability), share in pairs if probability)
        object.__setattr__(self, "cumulative", possible)


@dataclass(frozen=True, slots=True)
class Resource:
    """A resource that the model sends requests to.

    Attributes:
        name: an identifier; the resource owns `<name>_req_trigger` and `<name>_req_state`.
        request: the variables whose values a request carries.
        measures: the variables whose values a reply may carry.
        publishes: the variables whose values it may send without a request.
        values: for some of what it measures or publishes, the only values that it sends, as they are listed.
        shared: whether another user can occupy it while no request of the controller to it is in flight.
        simulation: its simulated behavior.
        binding: how the real resource is reached; `None` if the model does not say.
        lifted: the name of the entry with parameters that the resource is an instance of; `None` if there is none.
    """

    name: str
    request: tuple[str, ...] = ()
    measures: tuple[str, ...] = ()
    simulation: Simulation = field(default_factory=Simulation)
    binding: Binding | None = None
    publishes: tuple[str, ...] = ()
    values: tuple[tuple[str, tuple[Value, ...]], ...] = ()
    shared: bool = False
    lifted: str | None = field(default=None, compare=False)

    def sends(self, variable: Variable) -> tuple[Value, ...]:
        """Return the values that the resource can send for a variable: those listed, or all; in the domain's order."""
        for name, values in self.values:
            if name == variable.name:
                return tuple(sorted(values, key=variable.domain.index))
        return variable.domain.values

    @property
    def trigger(self) -> str:
        """The variable that triggers a request."""
        return trigger_name(self.name)

    @property
    def request_state(self) -> str:
        """The variable with the state of the request."""
        return request_state_name(self.name)
