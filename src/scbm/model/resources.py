"""Resources: what carries out requests, and how a simulated resource behaves (semantics 6)."""

from __future__ import annotations

from enum import StrEnum
from fractions import Fraction
from functools import cached_property
from itertools import accumulate
from typing import TYPE_CHECKING, TypeVar

from msgspec import Struct, field

from scbm.model.struct_classes import PartlyCompared
from scbm.model.variables import request_state_name, trigger_name

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model.bindings import Binding
    from scbm.model.values import Value
    from scbm.model.variables import Variable

_T = TypeVar("_T")


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


class Latency(Struct, frozen=True):
    """The time from a request to its reply.

    Attributes:
        shape: the distribution.
        points_ns: its parameters: (value,), (low, high), (low, mode, high), or (mean,).
    """

    shape: LatencyShape
    points_ns: tuple[int, ...]

    @property
    def longest_ns(self) -> int | None:
        """The longest latency; `None` if there is none."""
        return None if self.shape is LatencyShape.EXPONENTIAL else self.points_ns[-1]

    @property
    def shortest_ns(self) -> int:
        """The shortest latency."""
        return 0 if self.shape is LatencyShape.EXPONENTIAL else self.points_ns[0]


class DrawnVariable(Struct, frozen=True, dict=True):
    """A variable that simulated replies measure, and the values that they draw from.

    Attributes:
        name: the variable.
        values: its values, as they are listed.
        weights: how likely each value is, compared with the others; empty if all are equally likely.
    """

    name: str
    values: tuple[Value, ...]
    weights: tuple[Fraction, ...] = ()

    @cached_property
    def cumulative(self) -> tuple[tuple[Value, float], ...]:
        """With weights, the values that are possible, each with the sum of the probabilities up to it."""
        shares = [weight / sum(self.weights) for weight in self.weights]
        return _cumulative([*zip(self.values, shares, strict=True)] if shares else [])

    @property
    def possible(self) -> tuple[Value, ...]:
        """The values that can be drawn; a plain reply measures the first."""
        return tuple(value for value, _ in self.cumulative) if self.weights else self.values


class Simulation(Struct, frozen=True, dict=True):
    """The behavior of a simulated resource.

    Attributes:
        latency: the time to its reply.
        outcomes: the probability of each outcome; they add up to 1.
        measured: the variables that a successful reply measures.
        failed: the variables that a failed reply measures.
    """

    latency: Latency = Latency(LatencyShape.FIXED, (0,))
    outcomes: tuple[tuple[Outcome, Fraction], ...] = ((Outcome.SUCCEED, Fraction(1)),)
    measured: tuple[DrawnVariable, ...] = ()
    failed: tuple[DrawnVariable, ...] = ()

    @cached_property
    def cumulative(self) -> tuple[tuple[Outcome, float], ...]:
        """The outcomes that are possible, each with the sum of the probabilities up to it."""
        return _cumulative(self.outcomes)


def _cumulative(shares: Sequence[tuple[_T, Fraction]]) -> tuple[tuple[_T, float], ...]:
    """Return what has a probability above 0, each with the sum of the probabilities up to it."""
    reached = accumulate(float(probability) for _, probability in shares)
    return tuple((one, share) for (one, probability), share in zip(shares, reached, strict=True) if probability)


class Resource(PartlyCompared, frozen=True):
    """A resource that the model sends requests to.

    Attributes:
        name: an identifier; the resource owns `<name>_req_trigger` and `<name>_req_state`.
        request: the variables whose values a request carries.
        measures: the variables whose values a reply may carry.
        publishes: the variables whose values it may send without a request.
        values: for some of what it measures or publishes, the only values that it sends, as they are listed.
        shared: whether another user can occupy it while no request of the controller to it is in flight.
        parallel: whether it may work at several requests at once.
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
    lifted: str | None = None
    parallel: bool = False
    uncompared = ("lifted",)

    def sends(self, variable: Variable) -> tuple[Value, ...]:
        """Return the values that the resource can send for a variable: those listed, or all; in the domain's order."""
        for name, values in self.values:
            if name == variable.name:
                return tuple(sorted(values, key=variable.domain.index))
        return variable.domain.values

    def drawn(self, outcome: Outcome) -> tuple[DrawnVariable, ...]:
        """Return what simulated replies with an outcome measure.

        Successful ones draw from the values listed for drawing, else from those that the resource sends. A variable
        that only failed replies draw is not among these.
        """
        simulation = self.simulation
        if outcome is not Outcome.SUCCEED:
            return simulation.failed if outcome is Outcome.FAIL else ()
        if not self.values:
            return simulation.measured
        known = {each.name for each in (*simulation.measured, *simulation.failed)}
        sent = ((name, values) for name, values in self.values if name in self.measures and name not in known)
        return (*simulation.measured, *(DrawnVariable(name, values) for name, values in sent))

    @property
    def trigger(self) -> str:
        """The variable that triggers a request."""
        return trigger_name(self.name)

    @property
    def request_state(self) -> str:
        """The variable with the state of the request."""
        return request_state_name(self.name)
