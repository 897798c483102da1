"""The bytes of messages, next to `rosbags` and `cyclonedds`, which encode them on their own."""

from __future__ import annotations

import math
import struct
import tracemalloc
from itertools import product
from random import Random
from types import SimpleNamespace

import pytest

from scbm.nodes.types.cdr import BadPayloadError, BadValueError, codec_of
from scbm.nodes.types.definitions import (
    BOOL,
    FLOAT64,
    GOAL_STATUS_ARRAY,
    INT64,
    SET_BOOL,
    STRING,
    TRIGGER,
    ListShape,
    MessageDefinition,
    Primitive,
)
from scbm.nodes.types.type_library import TypeLibrary
from support.profiles import share
from support.ros_values import STORE, by_rosbags, plain, random_value
from support.wording import Wording

LIBRARY = TypeLibrary()
ALL = sorted(STORE.fielddefs)


def one(kind: str, bound: int = 0) -> MessageDefinition:
    return MessageDefinition("p/msg/One", (("x", Primitive(kind, bound)),))


def several(element: Primitive | MessageDefinition, size: int = 0, *, is_array: bool = False) -> MessageDefinition:
    return MessageDefinition("p/msg/Several", (("x", ListShape(element, size, is_array=is_array)),))


def test_values_of_all_types_of_ros_2_are_encoded_as_by_rosbags_and_read_from_its_bytes() -> None:
    """For zeros that pad the end, `rosbags` and DDS differ."""
    assert len(ALL) == 162
    random = Random(1)
    values_of_each = -(-100_000 // len(ALL)) if share(100) == 100 else 2
    for name in ALL:
        definition = LIBRARY.message(name)
        codec = codec_of(definition)
        for _ in range(values_of_each):
            values = random_value(definition, random)
            theirs = by_rosbags(definition, values)
            ours = codec.encode(values)
            assert ours.rstrip(b"\0") == theirs.rstrip(b"\0"), name
            assert len(ours) % 4 == 0
            assert plain(definition, codec.decode(theirs)) == values == plain(definition, codec.decode(ours)), name


@pytest.mark.parametrize("name", ["sensor_msgs/msg/JointState", "std_msgs/msg/Int64", "nav_msgs/msg/OccupancyGrid"])
def test_big_endian_is_read_too(name: str) -> None:
    definition = LIBRARY.message(name)
    values = random_value(definition, Random(3))
    message = STORE.deserialize_cdr(codec_of(definition).encode(values), name)
    theirs = bytes(STORE.serialize_cdr(message, name, little_endian=False))
    assert plain(definition, codec_of(definition).decode(theirs)) == values


def test_version_2_aligns_to_four_bytes() -> None:
    both = MessageDefinition("p/msg/Both", (("a", Primitive("uint8")), ("b", Primitive("int64"))))
    assert codec_of(both).decode(bytes((0, 7, 0, 0)) + struct.pack("<Bxxxq", 7, -5)) == SimpleNamespace(a=7, b=-5)
    assert codec_of(both).decode(bytes((0, 6, 0, 0)) + struct.pack(">Bxxxq", 7, -5)) == SimpleNamespace(a=7, b=-5)
    assert codec_of(both).decode(bytes((0, 1, 0, 0)) + struct.pack("<Bxxxxxxxq", 7, -5)) == SimpleNamespace(a=7, b=-5)


def test_a_request_is_laid_out_as_in_ros_2() -> None:
    fields = (("a", Primitive("int64")), ("b", Primitive("int64")))
    add = MessageDefinition("example_interfaces/srv/AddTwoInts_Request", fields)
    header = struct.pack("<Qq", 0x1122334455667788, 1)
    assert codec_of(add).encode({"a": 41, "b": 1}, header).hex(" ", -4) == (
        "00010000 88776655 44332211 01000000 00000000 29000000 00000000 01000000 00000000"
    )
    assert codec_of(TRIGGER.request).encode({}).hex() == "0001000000000000"
    assert codec_of(TRIGGER.request).decode(bytes.fromhex("0001000000")) == SimpleNamespace()


def test_what_is_left_out_is_zero_and_empty() -> None:
    definition = LIBRARY.message("sensor_msgs/msg/BatteryState")
    empty = codec_of(definition).complete({"header": {"frame_id": "map"}})
    assert (empty.header.frame_id, empty.header.stamp.sec) == ("map", 0)
    assert (empty.present, empty.voltage, empty.cell_voltage, empty.location) == (False, 0.0, [], "")
    covariance = codec_of(LIBRARY.message("sensor_msgs/msg/Imu")).complete({}).orientation_covariance
    assert covariance == [0.0] * 9


def test_elements_that_are_none_are_zero_and_messages_can_be_sent_again() -> None:
    codec = codec_of(GOAL_STATUS_ARRAY)
    made = codec.complete({"status_list": [None, {"status": 4}]})
    assert [each.status for each in made.status_list] == [0, 4]
    assert codec.complete(vars(made)) == made
    assert made.status_list[0].goal_info.goal_id.uuid == bytes(16)


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e38, -0.0, math.inf, 3])
def test_a_float32_is_the_nearest_one_there_is(value: float) -> None:
    (nearest,) = struct.unpack("<f", struct.pack("<f", value))
    assert codec_of(one("float32")).complete({"x": value}).x == nearest


def test_not_a_number_is_carried() -> None:
    assert math.isnan(codec_of(FLOAT64).complete({"data": math.nan}).data)


WHOLE = ("int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "byte", "char")


@pytest.mark.parametrize("kind", WHOLE)
def test_whole_numbers_keep_to_the_range_of_their_type(kind: str, wording: Wording) -> None:
    numbers = Primitive(kind).integers
    for value in (numbers[0], numbers[-1]):
        assert codec_of(one(kind)).complete({"x": value}).x == value
    for value in (numbers[0] - 1, numbers[-1] + 1):
        with wording.raises(BadValueError):
            codec_of(one(kind)).encode({"x": value})


@pytest.mark.parametrize(
    ("definition", "value"),
    [
        *product((one("int8"), one("float32")), (1.5j, "1", True, [])),
        *product((one("bool"), one("string")), (1.5j, 1, [])),
        (one("string"), "a\0b"),
        (one("string"), "\ud800"),
        (one("string", bound=3), "äöü"),
        (one("float32"), 3.5e38),
        (one("float32"), 1e-60),
        (one("float64"), 2**1024),
        (one("float64"), 2**53 + 1),
        (one("float32"), 2**24 + 1),
        (several(Primitive("uint8"), 2), [1, 2, 3]),
        (several(Primitive("uint8"), 2, is_array=True), [1]),
        (several(Primitive("string")), "text"),
        (several(Primitive("string")), 5),
        (several(Primitive("int16")), [1, 2, 40_000]),
        (several(STRING), [{"data": "a"}, {"date": "b"}]),
        (several(STRING), [{"data": "a"}, 7]),
    ],
)
def test_what_a_field_cannot_have_is_refused(definition: MessageDefinition, value: object, wording: Wording) -> None:
    with wording.raises(BadValueError):
        codec_of(definition).encode({"x": value})


def test_a_field_that_a_message_does_not_have_is_refused(wording: Wording) -> None:
    with wording.raises(BadValueError):
        codec_of(SET_BOOL.request).encode({"date": True})


HEADER = b"\x00\x01\x00\x00"
LONG_LIST = struct.pack("<I", 100_001) + b"\x01\x00\x00\x00\x00\x00\x00\x00" * 100_001


@pytest.mark.parametrize(
    ("definition", "payload"),
    [
        (STRING, b""),
        (STRING, b"\x00\x03\x00\x00" + b"\x01\x00\x00\x00\x00"),
        (STRING, HEADER),
        (STRING, HEADER + b"\x05\x00\x00\x00ab\x00"),
        (STRING, HEADER + b"\x00\x00\x00\x00"),
        (STRING, HEADER + b"\x02\x00\x00\x00ab"),
        (STRING, HEADER + b"\x02\x00\x00\x00\xff\x00"),
        (STRING, HEADER + b"\x01\x00\x00\x00\x00" + bytes(4)),
        (BOOL, HEADER),
        (BOOL, HEADER + b"\x02"),
        (INT64, HEADER + bytes(7)),
        (INT64, HEADER + bytes(12)),
        (FLOAT64, HEADER + bytes(7)),
        (several(Primitive("bool")), HEADER + b"\x01\x00\x00\x00\x07"),
        (several(Primitive("float64")), HEADER + b"\xff\xff\xff\xff" + bytes(20)),
        (several(Primitive("int8"), 2), HEADER + b"\x03\x00\x00\x00\x01\x02\x03"),
        (several(STRING), HEADER + LONG_LIST),
    ],
)
def test_bytes_that_are_no_message_are_refused(definition: MessageDefinition, payload: bytes, wording: Wording) -> None:
    with wording.raises(BadPayloadError):
        codec_of(definition).decode(payload)


@pytest.mark.longer
def test_a_list_of_a_million_numbers_is_read() -> None:
    numbers = list(map(float, range(1_000_000)))
    payload = HEADER + struct.pack("<Ixxxx1000000d", 1_000_000, *numbers)
    tracemalloc.start()
    try:
        read = codec_of(several(Primitive("float64"))).decode(payload)
        assert tracemalloc.get_traced_memory()[1] < 6 * len(payload)
    finally:
        tracemalloc.stop()
    assert read.x == numbers


def test_any_cut_of_a_message_is_refused_or_read() -> None:
    definition = LIBRARY.message("diagnostic_msgs/msg/DiagnosticArray")
    payload = codec_of(definition).encode(random_value(definition, Random(5)))
    for length in range(len(payload) - 4):
        with pytest.raises(BadPayloadError):
            codec_of(definition).decode(payload[:length])
