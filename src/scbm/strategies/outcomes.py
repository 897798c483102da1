"""What becomes of requests."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hypothesis import strategies as st

from scbm.cases import Forced
from scbm.model import Outcome
from scbm.simulating import typical_ns
from scbm.strategies.times import times

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hypothesis.strategies import DrawFn, SearchStrategy

    from scbm.model import BehaviorModel, Latency, Resource, Value
    from scbm.trace import Changes

_MOST_REQUESTS = 5
"""Of so many requests to each resource something is said."""

_MS_NS = 1_000_000


def outcomes(model: BehaviorModel) -> SearchStrategy[tuple[Forced, ...]]:
    """What becomes of the first requests to each resource: any outcome, a latency that it may have, measured values.

    Shrinks towards saying nothing, so that all requests succeed. An outcome whose share is 0 is drawn, too: to bring
    about what chance does not is what cases are for.
    """
    rules = [_rules(resource) for resource in model.resources]
    return st.tuples(*rules).map(lambda told: tuple(rule for of_one in told for rule in of_one))


def _rules(resource: Resource) -> SearchStrategy[tuple[Forced, ...]]:
    return st.lists(_rule(resource), max_size=_MOST_REQUESTS).map(_numbered)


def _numbered(rules: Sequence[Forced]) -> tuple[Forced, ...]:
    """The rules of the first, second, … request, without those that say nothing."""
    numbered = (
        (rule, Forced(rule.subject, number, number, rule.outcome, rule.latency_ns, rule.measured))
        for number, rule in enumerate(rules, start=1)
    )
    return tuple(told for rule, told in numbered if rule != Forced(rule.subject, rule.first, rule.last))


def _rule(resource: Resource) -> SearchStrategy[Forced]:
    """What is said of one request; nothing, if it is a plain success."""
    latencies = st.none() | _latencies(resource.simulation.latency)
    measured = st.none() | _measured(resource) if resource.simulation.measured else st.none()

    @st.composite
    def rule(draw: DrawFn) -> Forced:
        outcome = draw(st.sampled_from((None, Outcome.FAIL, Outcome.TIMEOUT)))
        latency_ns = None if outcome is Outcome.TIMEOUT else draw(latencies)
        return Forced(resource.name, 1, 1, outcome, latency_ns, draw(measured) if outcome is None else None)

    return rule()


def _latencies(latency: Latency) -> SearchStrategy[int]:
    """Latencies between the shortest and the longest: whole milliseconds where there are any."""
    low_ns, high_ns = latency.points_ns[0], latency.points_ns[-1]
    low_ms, high_ms = -(-low_ns // _MS_NS), high_ns // _MS_NS
    between = times(high_ms, low_ms) if low_ms < high_ms else st.sampled_from([low_ns, high_ns])
    return st.just(typical_ns(latency)) | between


def _measured(resource: Resource) -> SearchStrategy[Changes]:
    """A value for each variable that the resource measures, of those that it is said to measure."""
    listed = resource.simulation.measured
    values: list[SearchStrategy[tuple[str, Value]]] = [_named(name, choices) for name, choices in listed]
    return st.tuples(*values)


def _named(name: str, values: Sequence[Value]) -> SearchStrategy[tuple[str, Value]]:
    return st.sampled_from(values).map(lambda value: (name, value))
