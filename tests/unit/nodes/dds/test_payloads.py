from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from scbm.nodes.buses.bus import BusError, MessageType, Scalar
from scbm.nodes.buses.dds.message_types import message_class
from scbm.nodes.buses.dds.payloads import BadPayloadError, decode, encode
from support.wording import Wording

ROS = get_typestore(Stores.ROS2_JAZZY)

TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"))
VALUES: st.SearchStrategy[tuple[MessageType, Scalar]] = st.one_of(
    st.tuples(st.just(MessageType.STRING), TEXTS),
    st.tuples(st.just(MessageType.BOOL), st.booleans()),
    st.tuples(st.just(MessageType.INT64), st.integers(-(2**63), 2**63 - 1)),
    st.tuples(st.just(MessageType.FLOAT64), st.floats(allow_nan=False)),
)


@given(VALUES)
def test_payloads_are_those_of_cyclonedds(value: tuple[MessageType, Scalar]) -> None:
    type_, data = value
    sample = message_class(type_)(data=data)  # type: ignore[call-arg]  # the class is made at run time
    theirs = sample.serialize(use_version_2=False)
    assert encode(type_, data) == theirs + bytes(-len(theirs) % 4)


@given(VALUES)
def test_payloads_are_read_by_others_and_theirs_here(value: tuple[MessageType, Scalar]) -> None:
    type_, data = value
    read = ROS.deserialize_cdr(encode(type_, data), type_.value)
    assert read.data == data  # type: ignore[attr-defined]  # rosbags makes the class at run time
    for is_little in (True, False):
        theirs = bytes(ROS.serialize_cdr(read, type_.value, little_endian=is_little))
        came = decode(type_, theirs)
        assert came == data
        assert type(came) is type(data)


@pytest.mark.parametrize("encoding", [6, 7])
def test_version_2_is_read_too(encoding: int) -> None:
    body = struct.pack("<q" if encoding % 2 else ">q", -5)
    assert decode(MessageType.INT64, bytes((0, encoding, 0, 0)) + body) == -5


@pytest.mark.parametrize(
    ("type_", "data"),
    [
        (MessageType.STRING, 5),
        (MessageType.STRING, "a\0b"),
        (MessageType.STRING, "\ud800"),
        (MessageType.BOOL, 1),
        (MessageType.INT64, True),
        (MessageType.INT64, 2**63),
        (MessageType.FLOAT64, "0.5"),
    ],
)
def test_what_a_type_cannot_carry_is_refused(type_: MessageType, data: Scalar, wording: Wording) -> None:
    with pytest.raises(BusError) as raised:
        encode(type_, data)
    assert type_.value in raised.value.message
    wording(raised.value.message)


HEADER = b"\x00\x01\x00\x00"


@pytest.mark.parametrize(
    ("type_", "payload"),
    [
        (MessageType.STRING, b""),
        (MessageType.STRING, b"\x00\x03\x00\x00" + b"\x01\x00\x00\x00\x00"),
        (MessageType.STRING, HEADER),
        (MessageType.STRING, HEADER + b"\x05\x00\x00\x00ab\x00"),
        (MessageType.STRING, HEADER + b"\x00\x00\x00\x00"),
        (MessageType.STRING, HEADER + b"\x02\x00\x00\x00ab"),
        (MessageType.STRING, HEADER + b"\x02\x00\x00\x00\xff\x00"),
        (MessageType.STRING, HEADER + b"\x01\x00\x00\x00\x00" + bytes(4)),
        (MessageType.BOOL, HEADER),
        (MessageType.BOOL, HEADER + b"\x02"),
        (MessageType.INT64, HEADER + bytes(7)),
        (MessageType.INT64, HEADER + bytes(12)),
        (MessageType.FLOAT64, HEADER + bytes(7)),
    ],
)
def test_bytes_that_are_no_value_are_refused(type_: MessageType, payload: bytes, wording: Wording) -> None:
    with wording.raises(BadPayloadError):
        decode(type_, payload)
