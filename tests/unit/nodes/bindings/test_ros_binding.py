"""Ranges of numbers, what a binding is made of, and what a request says."""

from __future__ import annotations

from math import inf, nan

import pytest

from scbm.model import Binding, Reference, Resource
from scbm.nodes.bindings.ros_binding import (
    NO_BINDING,
    CallChoice,
    Interval,
    MappedVariable,
    MeasuredTopic,
    RosBinding,
    ServiceCall,
    TopicPair,
    binding_of,
    request_values,
)
from scbm.nodes.buses.bus import BusError
from scbm.nodes.types.definitions import BOOL, SET_BOOL, STRING
from scbm.nodes.types.type_library import TypeLibrary
from support.ros_types import path_to, reading, trigger
from support.wording import Wording


@pytest.mark.parametrize(
    ("interval", "inside", "outside"),
    [
        (Interval(0.5, 2.0), (0.5, 1, 1.9999999999999998), (0.49999999999999994, 2, 2.0, nan, inf, -inf)),
        (Interval(None, 0.5), (-inf, 0), (0.5, nan, inf)),
        (Interval(0.5, None), (inf, 0.5), (-inf, 0, nan)),
        (Interval(None, None), (inf, -inf, 0), (nan,)),
        (Interval(2**53 + 1, None), (2**53 + 1,), (2**53,)),
    ],
)
def test_a_range_begins_with_its_first_end_and_stops_before_the_other(
    interval: Interval, inside: tuple[float, ...], outside: tuple[float, ...]
) -> None:
    assert all(number in interval for number in inside)
    assert not any(number in interval for number in outside)


@pytest.mark.parametrize(
    ("low", "high", "is_empty"), [(1, 1, True), (2, 1, True), (1, 2, False), (None, 0, False), (0, None, False)]
)
def test_a_range_without_numbers_is_empty(low: int | None, high: int | None, is_empty: bool) -> None:  # noqa: FBT001 - what is expected
    assert Interval(low, high).is_empty is is_empty


@pytest.mark.parametrize(
    ("one", "other", "overlaps"),
    [
        ((0, 1), (1, 2), False),
        ((0, 1), (0.5, 2), True),
        ((0, 9), (3, 4), True),
        ((None, 1), (1, None), False),
        ((None, 2), (1, None), True),
        ((None, 0), (None, -5), True),
        ((5, None), (7, None), True),
        ((None, None), (1, 2), True),
    ],
)
def test_ranges_that_have_a_number_in_common_overlap(
    one: tuple[float | None, float | None],
    other: tuple[float | None, float | None],
    overlaps: bool,  # noqa: FBT001 - what is expected
) -> None:
    assert Interval(*one).overlaps(Interval(*other)) is overlaps
    assert Interval(*other).overlaps(Interval(*one)) is overlaps


def test_ranges_print_as_they_are_written() -> None:
    assert [str(Interval(*ends)) for ends in ((0.5, 2), (None, 0.5), (-1, None), (None, None))] == [
        "0.5..2",
        "..0.5",
        "-1..",
        "..",
    ]


def test_a_binding_names_its_services_and_topics() -> None:
    scan, light = trigger("/scan"), ServiceCall("/light", SET_BOOL, ((path_to(SET_BOOL.request), True),))
    lit = MeasuredTopic("/lit", BOOL, reading("lit", BOOL))
    one = RosBinding({}, scan, (lit,))
    choice = RosBinding({}, CallChoice("command", (("scan", scan), ("light", light))))
    pair = RosBinding({}, TopicPair("/request", "/reply"), (lit,))
    assert (one.calls, choice.calls, pair.calls, NO_BINDING.calls) == ((scan,), (scan, light), (), ())
    assert list(one.topics()) == [("/lit", BOOL)]
    assert list(pair.topics()) == [("/request", STRING), ("/reply", STRING), ("/lit", BOOL)]
    assert one.readings == pair.readings == (lit.reading,)
    assert hash(one) == hash(RosBinding({"other": "words"}, scan, (lit,)))
    assert one == RosBinding({"other": "words"}, scan, (lit,))


def test_a_binding_that_nothing_has_checked_reaches_nothing(wording: Wording) -> None:
    assert binding_of(Resource("arm")) is NO_BINDING
    with pytest.raises(BusError) as raised:
        binding_of(Resource("arm", binding=Binding({"service": {}})))
    wording((raised.value.message, raised.value.remedy))


def test_a_request_says_constants_variables_and_what_their_values_stand_for() -> None:
    goal = TypeLibrary().message("trajectory_msgs/msg/JointTrajectory")
    target = MappedVariable("target", (("home", 0.0), ("box_a", 1.25)))
    fields = (
        (path_to(goal, "joint_names"), ("x", Reference("axis"))),
        (path_to(goal, "points[0].positions"), (target,)),
        (path_to(goal, "points[0].time_from_start.sec"), Reference("seconds")),
        (path_to(goal, "header.frame_id"), "base"),
    )
    assert request_values(fields, {"target": "box_a", "axis": "y", "seconds": 3}) == {
        "joint_names": ["x", "y"],
        "points": [{"positions": [1.25], "time_from_start": {"sec": 3}}],
        "header": {"frame_id": "base"},
    }
