"""Reactions of simulated resources: drawn within their distributions, or plain."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

from scbm.cases import Reaction
from scbm.model import DrawnVariable, Latency, LatencyShape, Outcome, Resource, Simulation
from scbm.running.simulation import DrawnReactions, PlainReactions

MS = 1_000_000


def _resource(latency: Latency, *outcomes: tuple[Outcome, Fraction]) -> Resource:
    return Resource("scan", simulation=Simulation(latency, outcomes or ((Outcome.SUCCEED, Fraction(1)),)))


def _draw(resource: Resource, count: int) -> list[Reaction]:
    chooser = DrawnReactions(Random("draws"))
    return [chooser.react(resource) for _ in range(count)]


@pytest.mark.parametrize(
    ("latency", "mean_ms"),
    [
        (Latency(LatencyShape.FIXED, (300 * MS,)), 300),
        (Latency(LatencyShape.UNIFORM, (200 * MS, 1_500 * MS)), 850),
        (Latency(LatencyShape.TRIANGULAR, (0, 300 * MS, 900 * MS)), 400),
        (Latency(LatencyShape.TRIANGULAR, (5 * MS, 5 * MS, 5 * MS)), 5),
    ],
)
def test_latencies_keep_to_their_distribution(latency: Latency, mean_ms: int) -> None:
    drawn = [reaction.latency_ns for reaction in _draw(_resource(latency), 4_000)]
    assert min(drawn) >= latency.points_ns[0]
    assert max(drawn) <= latency.points_ns[-1]
    assert sum(drawn) / len(drawn) == pytest.approx(mean_ms * MS, rel=0.03)
    assert all(latency_ns % 1_000 == 0 for latency_ns in drawn)


def test_latencies_shorter_than_a_microsecond_stay_in_their_bounds() -> None:
    drawn = _draw(_resource(Latency(LatencyShape.UNIFORM, (100, 900))), 100)
    assert all(100 <= reaction.latency_ns <= 900 for reaction in drawn)
    assert len({reaction.latency_ns for reaction in drawn}) > 50


def test_latencies_are_whole_microseconds_from_a_range_of_a_millisecond_on() -> None:
    whole = _draw(_resource(Latency(LatencyShape.UNIFORM, (MS, 2 * MS))), 100)
    finer = _draw(_resource(Latency(LatencyShape.UNIFORM, (MS, 2 * MS - 1))), 100)
    assert all(reaction.latency_ns % 1_000 == 0 for reaction in whole)
    assert any(reaction.latency_ns % 1_000 for reaction in finer)


def test_outcomes_come_as_often_as_they_are_probable() -> None:
    shares = ((Outcome.SUCCEED, Fraction(7, 10)), (Outcome.FAIL, Fraction(2, 10)), (Outcome.TIMEOUT, Fraction(1, 10)))
    drawn = _draw(_resource(Latency(LatencyShape.FIXED, (0,)), *shares), 10_000)
    for outcome, share in shares:
        assert sum(r.outcome is outcome for r in drawn) / 10_000 == pytest.approx(float(share), abs=0.015)


def test_an_outcome_without_probability_never_comes() -> None:
    shares = ((Outcome.SUCCEED, Fraction(0)), (Outcome.FAIL, Fraction(1)), (Outcome.TIMEOUT, Fraction(0)))
    drawn = _draw(_resource(Latency(LatencyShape.FIXED, (0,)), *shares), 1_000)
    assert {reaction.outcome for reaction in drawn} == {Outcome.FAIL}


def test_only_a_success_carries_measured_values() -> None:
    outcomes = ((Outcome.SUCCEED, Fraction(1, 2)), (Outcome.FAIL, Fraction(1, 2)))
    simulation = Simulation(Latency(LatencyShape.FIXED, (0,)), outcomes, (DrawnVariable("light", ("red", "green")),))
    drawn = _draw(Resource("scan", measures=("light",), simulation=simulation), 200)
    assert all(bool(reaction.measured) == (reaction.outcome is Outcome.SUCCEED) for reaction in drawn)
    assert {reaction.measured for reaction in drawn} == {None, (("light", "red"),), (("light", "green"),)}


@pytest.mark.parametrize(
    ("latency", "typical_ms"),
    [
        (Latency(LatencyShape.FIXED, (300 * MS,)), 300),
        (Latency(LatencyShape.UNIFORM, (200 * MS, 1_500 * MS)), 850),
        (Latency(LatencyShape.TRIANGULAR, (0, 300 * MS, 900 * MS)), 300),
    ],
)
def test_a_plain_reaction_is_a_success_after_the_typical_latency(latency: Latency, typical_ms: int) -> None:
    simulation = Simulation(latency, ((Outcome.FAIL, Fraction(1)),), (DrawnVariable("light", ("red", "green")),))
    resource = Resource("scan", measures=("light",), simulation=simulation)
    expected = Reaction("scan", Outcome.SUCCEED, typical_ms * MS, (("light", "red"),))
    assert PlainReactions().react(resource) == expected
