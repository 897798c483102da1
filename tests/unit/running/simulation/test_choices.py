"""What a case says of requests, what it leaves open, and how what was decided becomes a case again."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

from scbm.cases import AT_ONCE, LOST, Network, OutcomeRule, Partition, Reaction
from scbm.model import DrawnVariable, Latency, LatencyShape, Outcome, Resource, Simulation
from scbm.running.simulation import Choices, MessageKind, PlainReactions, leave_nothing_open
from scbm.running.simulation.free_choices import DrawnChance
from support.wording import Wording

MS = 1_000_000
SCAN = Resource("scan", simulation=Simulation(Latency(LatencyShape.FIXED, (5,))))
ROBOT = Resource("robot", simulation=Simulation(Latency(LatencyShape.FIXED, (7,))))
CAMERA = Resource(
    "camera", measures=("light",), simulation=Simulation(measured=(DrawnVariable("light", ("red", "green")),))
)


def _choices(*forced: OutcomeRule, network: Network | None = None) -> Choices:
    return Choices(PlainReactions(), forced, network or Network(), Random("messages"))


def _outcomes(choices: Choices, *requests: tuple[Resource, str | None]) -> list[Outcome]:
    return [choices.react(resource, operation).outcome for resource, operation in requests]


def test_a_drawn_time_is_in_its_range() -> None:
    chance = DrawnChance(Random(1))
    assert [chance.up_to(0) for _ in range(20)] == [0] * 20
    assert sorted({chance.up_to(3) for _ in range(50)}) == [0, 1, 2]
    assert {chance.up_to(50 * MS) % 1_000 for _ in range(50)} == {0}


def test_requests_are_counted_for_each_resource() -> None:
    choices = _choices(OutcomeRule("scan", 2, 2, Outcome.FAIL), OutcomeRule("robot", 1, 1, Outcome.TIMEOUT))
    asked = [(SCAN, None), (ROBOT, None), (SCAN, None), (ROBOT, None), (SCAN, None)]
    assert _outcomes(choices, *asked) == ["succeed", "timeout", "fail", "succeed", "succeed"]


def test_a_rule_without_an_end_goes_on_for_ever() -> None:
    choices = _choices(OutcomeRule("scan", 3, None, Outcome.FAIL))
    assert _outcomes(choices, *[(SCAN, None)] * 5) == ["succeed", "succeed", "fail", "fail", "fail"]


def test_requests_are_counted_for_each_operation_and_its_rule_goes_first() -> None:
    choices = _choices(OutcomeRule("scan", 1, None, Outcome.FAIL, 9), OutcomeRule("pick", 2, 2, Outcome.TIMEOUT))
    assert _outcomes(choices, (SCAN, "pick"), (SCAN, "place"), (SCAN, "pick")) == ["fail", "fail", "timeout"]
    assert choices.taken_by(3).latency_ns == 9


def test_what_a_rule_does_not_say_stays_as_it_was() -> None:
    choices = _choices(OutcomeRule("scan", 1, 1, latency_ns=99, reply=LOST))
    assert choices.react(SCAN, None) == Reaction("scan", Outcome.SUCCEED, 99, reply=LOST)


def test_a_failure_measures_nothing() -> None:
    choices = _choices(
        OutcomeRule("camera", 1, 1, Outcome.FAIL), OutcomeRule("camera", 2, 2, measured=(("light", "green"),))
    )
    measured = [choices.react(CAMERA, None).measured for _ in range(3)]
    assert measured == [None, (("light", "green"),), (("light", "red"),)]


def test_a_success_that_is_forced_measures_the_first_values() -> None:
    class Failing:
        def react(self, resource: Resource) -> Reaction:
            return Reaction(resource.name, Outcome.FAIL, 1)

    choices = Choices(Failing(), [OutcomeRule("camera", 1, 1, Outcome.SUCCEED)])
    assert choices.react(CAMERA, None).measured == (("light", "red"),)


def test_messages_travel_at_once_unless_the_network_or_the_case_says_more() -> None:
    choices = _choices(OutcomeRule("scan", 2, 2, reply=(3, 4)))
    choices.react(SCAN, None)
    choices.react(SCAN, None)
    assert [choices.travel(request, MessageKind.REPLY, 0) for request in (1, 2)] == [AT_ONCE, (3, 4)]
    assert choices.travel(2, MessageKind.REQUEST, 0) == AT_ONCE


def test_chance_needs_something_to_draw_from(wording: Wording) -> None:
    with wording.raises(ValueError):
        Choices(PlainReactions(), network=Network(loss=Fraction(1, 2)))


def test_a_partition_loses_what_is_sent_meanwhile() -> None:
    network = Network(partitions=(Partition(10, 5, "scan"),))
    choices = _choices(network=network)
    choices.react(SCAN, None)
    choices.react(ROBOT, None)
    assert [choices.travel(1, MessageKind.REQUEST, now_ns) for now_ns in (9, 10, 14, 15)] == [(0,), (), (), (0,)]
    assert choices.travel(2, MessageKind.REQUEST, 12) == (0,)


def test_a_partition_of_all_cuts_off_every_resource() -> None:
    choices = _choices(network=Network(partitions=(Partition(0, 5),)))
    choices.react(ROBOT, None)
    assert choices.travel(1, MessageKind.CANCEL, 0) == LOST


def _drawn(network: Network, count: int = 2_000) -> list[tuple[int, ...]]:
    """How the replies to requests travel that are sent a millisecond apart."""
    choices = _choices(network=network)
    for _ in range(count):
        choices.react(SCAN, None)
    return [choices.travel(request, MessageKind.REPLY, request * MS) for request in range(1, count + 1)]


def _arrivals(deliveries: list[tuple[int, ...]]) -> list[int]:
    return [request * MS + delivery[0] for request, delivery in enumerate(deliveries, start=1) if delivery]


def test_messages_are_lost_and_doubled_as_often_as_declared() -> None:
    lost = _drawn(Network(loss=Fraction(1, 5)))
    assert sum(not delivery for delivery in lost) / len(lost) == pytest.approx(0.2, abs=0.03)
    doubled = _drawn(Network(duplication=Fraction(1, 10), held_back_ns=MS))
    assert sum(len(delivery) == 2 for delivery in doubled) / len(doubled) == pytest.approx(0.1, abs=0.03)
    assert all(delivery[0] <= delivery[-1] <= delivery[0] + MS for delivery in doubled)


def test_jitter_delays_and_keeps_the_order() -> None:
    deliveries = _drawn(Network(latency_ns=2 * MS, jitter_ns=50 * MS))
    assert all(delivery[0] >= 2 * MS for delivery in deliveries)
    assert _arrivals(deliveries) == sorted(_arrivals(deliveries))


def test_delays_are_whole_microseconds_from_a_range_of_a_millisecond_on() -> None:
    whole, finer = (_drawn(Network(jitter_ns=jitter_ns), 100) for jitter_ns in (MS, MS - 1))
    assert all(delivery[0] % 1_000 == 0 for delivery in whole)
    assert any(delivery[0] % 1_000 for delivery in finer)


def test_reordering_lets_messages_overtake() -> None:
    deliveries = _drawn(Network(reordering=Fraction(1, 10), held_back_ns=50 * MS))
    assert _arrivals(deliveries) != sorted(_arrivals(deliveries))
    assert all(delivery[0] <= 50 * MS for delivery in deliveries)


def test_all_copies_of_a_reply_travel_alike() -> None:
    choices = _choices(network=Network(loss=Fraction(1, 2)))
    for _ in range(50):
        choices.react(SCAN, None)
    for request in range(1, 51):
        first = choices.travel(request, MessageKind.REPLY, 0)
        assert all(choices.travel(request, MessageKind.REPLY, now_ns) == first for now_ns in (1, 2, 3))


def test_what_was_decided_leaves_nothing_open() -> None:
    reactions = [
        Reaction("scan", Outcome.SUCCEED, 5, (("light", "red"),), reply=(3,)),
        Reaction("robot", Outcome.TIMEOUT, 7, request=AT_ONCE),
        Reaction("scan", Outcome.FAIL, 6, request=LOST),
    ]
    assert leave_nothing_open(reactions) == (
        OutcomeRule("scan", 1, 1, Outcome.SUCCEED, 5, (("light", "red"),), reply=(3,)),
        OutcomeRule("scan", 2, 2, Outcome.FAIL, 6, request=LOST),
        OutcomeRule("robot", 1, 1, Outcome.TIMEOUT),
    )


def test_that_nothing_was_measured_is_reported_where_something_could_have_been() -> None:
    choices = _choices(OutcomeRule("camera", 1, 1, measured=()))
    choices.react(CAMERA, None)
    (rule,) = leave_nothing_open(choices.taken)
    assert rule.measured == ()
    again = _choices(rule)
    assert again.react(CAMERA, None) == choices.taken_by(1)


def test_a_partition_cuts_off_whatever_else_is_declared() -> None:
    choices = _choices(OutcomeRule("scan", 1, 1, reply=(3,)), network=Network(partitions=(Partition(0, 5),)))
    choices.react(SCAN, None)
    assert [choices.travel(1, MessageKind.REPLY, now_ns) for now_ns in (4, 5)] == [LOST, (3,)]


def test_the_two_directions_of_a_link_keep_their_orders_apart() -> None:
    choices = _choices(network=Network(latency_ns=100 * MS, jitter_ns=900 * MS))
    for _ in range(100):
        choices.react(SCAN, None)
    outward = [choices.travel(n, MessageKind.REQUEST, 0)[0] for n in range(1, 101)]
    inward = choices.travel(100, MessageKind.REPLY, 0)[0]
    assert outward == sorted(outward)
    assert inward < outward[-1], "no reply waits behind requests"


def test_the_copy_of_a_message_comes_behind_it() -> None:
    deliveries = _drawn(Network(latency_ns=5 * MS, duplication=Fraction(1, 2), held_back_ns=3 * MS), 200)
    doubled = [delivery for delivery in deliveries if len(delivery) == 2]
    assert doubled
    assert all(5 * MS <= first <= second <= first + 3 * MS for first, second in doubled)
