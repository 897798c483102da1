"""Topics of values: how their data is converted, and the errors of data that cannot be."""

from __future__ import annotations

from math import inf, nan
from time import monotonic_ns
from types import SimpleNamespace

import pytest
from msgspec.structs import replace

from scbm.cases.trace import MeasurementReceived, MeasurementRefused
from scbm.files import read_model
from scbm.model import Resource, Value
from scbm.model.json_reader import MAX_LONG_TEXT
from scbm.nodes.bindings.ros_binding import Interval, MeasuredTopic, Reading, RosBinding
from scbm.nodes.buses.bus import Topic
from scbm.nodes.buses.loopback import LoopbackHub
from scbm.nodes.links.measured_topics import MeasuredTopics, value_of
from scbm.nodes.types.definitions import BOOL, FLOAT64, INT64, Scalar
from scbm.running import Measured, Program, Runner
from support.hearing import Heard
from support.loops import run
from support.ros_types import reading
from support.wording import Wording

DISTANCES = reading(
    "zone",
    FLOAT64,
    ranges=(("near", Interval(0.0, 0.5)), ("far", Interval(0.5, 2.0)), ("away", Interval(3.0, None))),
)
LEVELS = reading("zone", INT64, ranges=(("near", Interval(None, 3)), ("far", Interval(3, 2**62 + 1))))
TEXTS = reading("zone", meanings=(("CLOSE", "near"), ("", "far")))
CODES = reading("lit", INT64, meanings=((-4, True), (0, False)))


@pytest.mark.parametrize(
    ("measured", "data", "value"),
    [
        (DISTANCES, 0.0, "near"),
        (DISTANCES, -0.0, "near"),
        (DISTANCES, 0.49999999999999994, "near"),
        (DISTANCES, 0.5, "far"),
        (DISTANCES, 3.0, "away"),
        (DISTANCES, inf, "away"),
        (DISTANCES, 2.0, "2.0"),
        (DISTANCES, 2.75, "2.75"),
        (DISTANCES, -1e-300, "-1e-300"),
        (DISTANCES, nan, "+nan"),
        (DISTANCES, -inf, "-inf"),
        (reading("zone", FLOAT64, ranges=(("near", Interval(None, None)),)), nan, "+nan"),
        (reading("zone", FLOAT64, ranges=(("near", Interval(0.0, 1.0)),)), inf, "+inf"),
        (LEVELS, -(2**63), "near"),
        (LEVELS, 2**62, "far"),
        (LEVELS, 2**62 + 1, str(2**62 + 1)),
        (TEXTS, "CLOSE", "near"),
        (TEXTS, "", "far"),
        (TEXTS, "near", '"near"'),
        (TEXTS, "a\nb", '"a\\nb"'),
        (reading("lit", BOOL), True, True),
        (reading("level", INT64), 7, 7),
        (reading("zone"), "near", "near"),
        (CODES, -4, True),
        (CODES, 0, False),
        (CODES, 3, "3"),
    ],
)
def test_data_means_a_value_or_is_shown_as_it_came(measured: Reading, data: Scalar, value: Value) -> None:
    meant = value_of(measured, SimpleNamespace(data=data))
    assert (type(meant), meant) == (type(value), value)


MODEL = read_model("""
behavior_model: measuring
variables:
  zone: {domain: [near, far, nan, inf], initial: near}
  level: {domain: 0..5, initial: 0}
resources:
  scanner: {measures: [zone, level]}
operations: {}
""")


@pytest.mark.parametrize(
    ("measured", "data"),
    [
        (DISTANCES, nan),
        (DISTANCES, 2.5),
        (replace(DISTANCES, ranges=DISTANCES.ranges[:1]), inf),
        (TEXTS, "near"),
        (reading("zone"), "nowhere"),
        (reading("zone"), "\n" * 3_000_000),
        (reading("level", INT64), 6),
        (reading("level", INT64, ranges=((1, Interval(10, 20)),)), 1),
    ],
)
def test_the_runner_refuses_what_means_nothing_and_says_what_it_was(measured: Reading, data: Scalar) -> None:
    runner = Runner(Program(MODEL), MODEL.nominal_state)
    value = value_of(measured, SimpleNamespace(data=data))
    assert len(str(value)) < MAX_LONG_TEXT
    effects = runner.handle(Measured(((measured.variable, value),)), 5)
    assert [effect for effect in effects if isinstance(effect, MeasurementRefused)] == [
        MeasurementRefused(5, measured.variable, value)
    ]
    (received,) = (effect for effect in effects if isinstance(effect, MeasurementReceived))
    assert received.changes == ()


def measuring(*topics: MeasuredTopic) -> Resource:
    return Resource("scanner", (), ("zone", "level", "lit"), binding=RosBinding({}, None, topics))


DISTANCE = MeasuredTopic("/distance", FLOAT64, DISTANCES)
LIT = MeasuredTopic("/lit", BOOL, reading("lit", BOOL))


def test_each_message_is_one_measurement_with_its_time() -> None:
    async def scene() -> None:
        hub, heard = LoopbackHub(), Heard()
        MeasuredTopics(hub.join("controller"), measuring(DISTANCE, LIT), heard)
        driver = hub.join("driver")
        before_ns = monotonic_ns()
        driver.publisher(Topic("/distance", FLOAT64)).publish({"data": 0.25})
        driver.publisher(Topic("/lit", BOOL)).publish({"data": False})
        await heard.until(lambda: len(heard.values) == 2)
        assert [(name, measured.values) for name, measured in heard.values] == [
            ("scanner", (("zone", "near"),)),
            ("scanner", (("lit", False),)),
        ]
        stamps = [measured.stamp_ns for _, measured in heard.values]
        assert before_ns <= stamps[0] <= stamps[1] <= monotonic_ns()

    run(scene())


def test_a_topic_that_is_read_into_two_variables_gives_both_at_once() -> None:
    async def scene() -> None:
        hub, heard = LoopbackHub(), Heard()
        level = MeasuredTopic("/distance", FLOAT64, reading("level", FLOAT64, ranges=((4, Interval(0.25, None)),)))
        MeasuredTopics(hub.join("controller"), measuring(DISTANCE, level), heard)
        hub.join("driver").publisher(Topic("/distance", FLOAT64)).publish({"data": 0.25})
        hub.join("driver").publisher(Topic("/distance", FLOAT64)).publish({"data": 0.125})
        await heard.until(lambda: len(heard.values) == 2)
        assert [measured.values for _, measured in heard.values] == [
            (("zone", "near"), ("level", 4)),
            (("zone", "near"), ("level", "0.125")),
        ]

    run(scene())


def test_a_driver_that_publishes_as_best_effort_is_heard_if_the_binding_says_so(wording: Wording) -> None:
    async def scene() -> None:
        hub, heard, deaf = LoopbackHub(), Heard(), Heard()
        reliable = MeasuredTopics(hub.join("deaf"), measuring(DISTANCE), deaf)
        asks_for_less = MeasuredTopics(hub.join("hears"), measuring(replace(DISTANCE, is_best_effort=True)), heard)
        hub.join("driver").publisher(Topic("/distance", FLOAT64, is_best_effort=True)).publish({"data": 0.25})
        await heard.until(lambda: bool(heard.values))
        assert (asks_for_less.is_there, asks_for_less.why_unmatched()) == (True, None)
        assert (reliable.is_there, deaf.values) == (False, [])
        reason = reliable.why_unmatched()
        assert reason is not None
        wording(reason.why)

    run(scene())


def test_what_only_measures_is_there_while_all_of_its_topics_are() -> None:
    async def scene() -> None:
        hub, heard = LoopbackHub(), Heard()
        topics = MeasuredTopics(hub.join("controller"), measuring(DISTANCE, LIT), heard)
        first, second = hub.join("first"), hub.join("second")
        first.publisher(Topic("/distance", FLOAT64))
        assert topics.is_there is False
        second.publisher(Topic("/lit", BOOL))
        await heard.until(lambda: bool(heard.presence))
        seen = [topics.is_there]
        await first.close()
        await heard.until(lambda: len(heard.presence) == 2)
        assert [*seen, topics.is_there] == [True, False]
        assert heard.presence == [("scanner", True), ("scanner", False)]

    run(scene())


def test_why_nobody_publishes_is_reported_for_each_topic_that_is_missing() -> None:
    async def scene() -> None:
        hub = LoopbackHub()
        topics = MeasuredTopics(hub.join("controller"), measuring(DISTANCE, LIT), Heard())
        assert topics.why_unmatched() is None
        hub.join("driver").publisher(Topic("/distance"))
        reason = topics.why_unmatched()
        assert reason is not None
        assert "`/distance`" in reason.why
        assert "`/lit`" not in reason.why
        hub.join("driver").publisher(Topic("/lit"))
        reason = topics.why_unmatched()
        assert reason is not None
        assert all(word in reason.why for word in ("`/distance`", "; ", "`/lit`"))
        hub.join("driver").publisher(Topic("/distance", FLOAT64))
        reason = topics.why_unmatched()
        assert reason is not None
        assert "`/distance`" not in reason.why

    run(scene())
