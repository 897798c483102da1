"""The layout of messages and services, next to `rosbags`, which encodes CDR on its own."""

from __future__ import annotations

import math
import struct
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl import types as idl_types
from cyclonedds.idl.annotations import final
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from scbm.nodes.buses.bus import SET_BOOL, TRIGGER, FieldType, MessageType, Scalar, ServiceType
from scbm.nodes.buses.dds import message_types
from support.wording import Wording

ADD = ServiceType(
    "example_interfaces/srv/AddTwoInts",
    (("a", FieldType.INT64), ("b", FieldType.INT64)),
    (("sum", FieldType.INT64),),
)

BITS = {
    FieldType.INT8: (-(2**7), 2**7 - 1),
    FieldType.INT16: (-(2**15), 2**15 - 1),
    FieldType.INT32: (-(2**31), 2**31 - 1),
    FieldType.INT64: (-(2**63), 2**63 - 1),
    FieldType.UINT8: (0, 2**8 - 1),
    FieldType.UINT16: (0, 2**16 - 1),
    FieldType.UINT32: (0, 2**32 - 1),
    FieldType.UINT64: (0, 2**64 - 1),
}

TEXTS = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]))
VALUES: dict[FieldType, st.SearchStrategy[Scalar]] = {
    FieldType.BOOL: st.booleans(),
    FieldType.STRING: TEXTS,
    FieldType.FLOAT32: st.floats(width=32, allow_nan=False),
    FieldType.FLOAT64: st.floats(allow_nan=False),
    **{type_: st.integers(*ends) for type_, ends in BITS.items()},
}
FIELDS = st.lists(st.sampled_from(list(FieldType)), max_size=6).map(
    lambda found: tuple((f"field_{index}", type_) for index, type_ in enumerate(found))
)


def values_of(fields: message_types.Fields) -> st.SearchStrategy[dict[str, Scalar]]:
    return st.fixed_dictionaries({name: VALUES[type_] for name, type_ in fields})


SERVICES = FIELDS.flatmap(lambda fields: st.tuples(st.just(fields), values_of(fields)))


class Other:
    """`rosbags`, with one type of messages."""

    def __init__(self, fields: message_types.Fields) -> None:
        self._store = get_typestore(Stores.ROS2_JAZZY)
        lines = [f"{type_.value} {name}" for name, type_ in fields]
        self._store.register(get_types_from_msg("\n".join(lines), "some/msg/Thing"))

    def encoded(self, values: dict[str, Scalar]) -> bytes:
        return bytes(self._store.serialize_cdr(SimpleNamespace(**values), "some/msg/Thing"))


def padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


HEADER: message_types.Fields = (("guid", FieldType.UINT64), ("seq", FieldType.INT64))


def test_a_request_is_laid_out_as_ros_2_does() -> None:
    request = message_types.request(ADD, 0x1122334455667788, 1, {"a": 41, "b": 1})

    assert request.serialize(use_version_2=False).hex(" ", -4) == (
        "00010000 88776655 44332211 01000000 00000000 29000000 00000000 01000000 00000000"
    )


def test_no_fields_at_all_are_one_byte() -> None:
    request = message_types.request(TRIGGER, 2, 3, {})

    assert request.serialize(use_version_2=False).hex(" ", -4) == "00010000 02000000 00000000 03000000 00000000 00"


def test_types_have_the_names_of_ros_2() -> None:
    request, response = message_types.service_classes(SET_BOOL)

    assert request.__idl_typename__ == "std_srvs::srv::dds_::SetBool_Request_"
    assert response.__idl_typename__ == "std_srvs::srv::dds_::SetBool_Response_"
    assert message_types.message_class(MessageType.BOOL).__idl_typename__ == "std_msgs::msg::dds_::Bool_"
    assert message_types.PARTICIPANT_ENTITIES.__idl_typename__ == "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"


def test_a_class_is_made_once() -> None:
    assert message_types.message_class(MessageType.STRING) is message_types.message_class(MessageType.STRING)
    assert message_types.service_classes(TRIGGER) == message_types.service_classes(ServiceType(*_parts(TRIGGER)))


def _parts(type_: ServiceType) -> tuple[str, message_types.Fields, message_types.Fields]:
    return type_.name, type_.request, type_.response


@pytest.mark.parametrize("type_", list(MessageType))
@given(data=st.data())
def test_messages_are_what_rosbags_makes_of_them(type_: MessageType, data: st.DataObject) -> None:
    field = FieldType(type_.value.rpartition("/")[2].lower())
    other = Other((("data", field),))
    value = data.draw(VALUES[field])
    class_: Any = message_types.message_class(type_)

    encoded = class_(data=value).serialize(use_version_2=False)

    assert padded(encoded) == padded(other.encoded({"data": value}))
    assert class_.deserialize(other.encoded({"data": value})).data == value


@given(SERVICES, SERVICES, VALUES[FieldType.UINT64], VALUES[FieldType.INT64])
def test_services_are_what_rosbags_makes_of_them(
    request: tuple[message_types.Fields, dict[str, Scalar]],
    response: tuple[message_types.Fields, dict[str, Scalar]],
    guid: int,
    seq: int,
) -> None:
    service = ServiceType("some_srvs/srv/Some", request[0], response[0])
    classes = message_types.service_classes(service)

    for make, class_, (fields, values) in zip(
        (message_types.request, message_types.response), classes, (request, response), strict=True
    ):
        header = {"guid": guid, "seq": seq}
        nothing = {} if fields else {"structure_needs_at_least_one_member": 0}
        other = Other((*HEADER, *(fields or (("structure_needs_at_least_one_member", FieldType.UINT8),))))
        encoded = make(service, guid, seq, values).serialize(use_version_2=False)
        theirs = other.encoded({**header, **values, **nothing})

        assert padded(encoded) == padded(theirs)
        decoded = class_.deserialize(theirs)
        assert message_types.call_of(decoded) == (guid, seq)
        assert message_types.fields_of(decoded, fields) == values


@given(st.binary(min_size=16, max_size=16), st.lists(st.binary(min_size=16, max_size=16), max_size=3))
def test_what_a_participant_says_of_its_nodes_is_what_rosbags_makes_of_it(gid: bytes, others: list[bytes]) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    gid_class = store.types["rmw_dds_common/msg/Gid"]
    gids = [gid_class(np.frombuffer(other, np.uint8)) for other in others]
    node = store.types["rmw_dds_common/msg/NodeEntitiesInfo"]("/cell", "tester", gids[:1], gids[1:])
    theirs = store.types["rmw_dds_common/msg/ParticipantEntitiesInfo"](gid_class(np.frombuffer(gid, np.uint8)), [node])

    ours = message_types.participant_entities(
        gid, [message_types.NodeEntities("/cell", "tester", tuple(others[:1]), tuple(others[1:]))]
    )

    encoded = bytes(store.serialize_cdr(theirs, "rmw_dds_common/msg/ParticipantEntitiesInfo"))
    assert padded(ours.serialize(use_version_2=False)) == padded(encoded)


def one(type_: FieldType) -> ServiceType:
    return ServiceType("some_srvs/srv/One", (("x", type_),))


@pytest.mark.parametrize("type_", list(BITS))
def test_an_integer_out_of_range_is_refused(type_: FieldType, wording: Wording) -> None:
    least, most = BITS[type_]
    for value in (least, most):
        sample = message_types.request(one(type_), 0, 0, {"x": value})
        assert message_types.fields_of(sample, one(type_).request) == {"x": value}

    for value in (least - 1, most + 1):
        with wording.raises(ValueError) as raised:
            message_types.request(one(type_), 0, 0, {"x": value})
        assert all(str(number) in str(raised.value) for number in (least, most, value))


@pytest.mark.parametrize(
    ("type_", "value"),
    [
        *((type_, 1.0) for type_ in BITS),
        *((type_, True) for type_ in (*BITS, FieldType.FLOAT32, FieldType.FLOAT64, FieldType.STRING)),
        *((type_, "1") for type_ in (*BITS, FieldType.FLOAT32, FieldType.FLOAT64, FieldType.BOOL)),
        (FieldType.BOOL, 1),
        (FieldType.STRING, 1),
    ],
)
def test_a_value_of_another_type_is_refused(type_: FieldType, value: Scalar, wording: Wording) -> None:
    with wording.raises(ValueError):
        message_types.request(one(type_), 0, 0, {"x": value})


@pytest.mark.parametrize("text", ["a\0", "\0", "\ud800"])
def test_text_that_the_wire_cannot_carry_is_refused(text: str, wording: Wording) -> None:
    with wording.raises(ValueError):
        message_types.request(one(FieldType.STRING), 0, 0, {"x": text})


@pytest.mark.parametrize(
    ("type_", "value"),
    [
        (FieldType.FLOAT32, 3.5e38),
        (FieldType.FLOAT32, -1e300),
        (FieldType.FLOAT32, 1e-60),
        (FieldType.FLOAT64, 2**1024),
        (FieldType.FLOAT64, 2**53 + 1),
        (FieldType.FLOAT32, 2**24 + 1),
    ],
)
def test_a_number_that_a_float_does_not_have_is_refused(type_: FieldType, value: float, wording: Wording) -> None:
    with wording.raises(ValueError):
        message_types.request(one(type_), 0, 0, {"x": value})


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e38, -0.0, math.inf, 3])
def test_a_float32_is_the_nearest_one_there_is(value: float) -> None:
    class_ = message_types.service_classes(one(FieldType.FLOAT32))[0]

    sample = class_.deserialize(message_types.request(one(FieldType.FLOAT32), 0, 0, {"x": value}).serialize())

    assert message_types.fields_of(sample, one(FieldType.FLOAT32).request) == {
        "x": struct.unpack("<f", struct.pack("<f", value))[0]
    }


def test_not_a_number_is_carried() -> None:
    class_ = message_types.service_classes(one(FieldType.FLOAT64))[0]

    sample = class_.deserialize(message_types.request(one(FieldType.FLOAT64), 0, 0, {"x": math.nan}).serialize())

    assert math.isnan(float(message_types.fields_of(sample, one(FieldType.FLOAT64).request)["x"]))


def test_fields_that_are_missing_or_unknown_are_refused(wording: Wording) -> None:
    with wording.raises(ValueError):
        message_types.request(ADD, 0, 0, {"a": 1})
    with wording.raises(ValueError):
        message_types.response(ADD, 0, 0, {"sum": 1, "total": 1})
    with wording.raises(ValueError):
        message_types.request(TRIGGER, 0, 0, {"data": True})


ODD_NAMES = ("class", "from", "self", "serialize", "deserialize", "sample_info", "guid", "seq")


@pytest.mark.parametrize("names", [(name,) for name in ODD_NAMES] + [ODD_NAMES])
def test_fields_may_be_called_what_python_and_the_middleware_call_other_things(names: tuple[str, ...]) -> None:
    fields = tuple((name, FieldType.INT64) for name in names)
    values: dict[str, Scalar] = {name: number for number, name in enumerate(names)}
    odd = ServiceType("some_srvs/srv/Odd", fields, fields)
    plain = ServiceType("some_srvs/srv/Odd", *[tuple((f"a{name}", type_) for name, type_ in fields)] * 2)
    others = {f"a{name}": value for name, value in values.items()}

    for make, class_ in zip(
        (message_types.request, message_types.response), message_types.service_classes(odd), strict=True
    ):
        encoded = _encoded(make(odd, 5, 6, values))
        decoded = class_.deserialize(encoded)

        assert encoded == _encoded(make(plain, 5, 6, others))
        assert message_types.call_of(decoded) == (5, 6)
        assert message_types.fields_of(decoded, fields) == values


def _encoded(sample: IdlStruct) -> bytes:
    return type(sample).serialize(sample, use_version_2=False)


def test_a_type_is_the_same_for_peers_that_compare_members() -> None:
    theirs = {"guid": idl_types.uint64, "seq": idl_types.int64, "a": idl_types.int64, "b": idl_types.int64}
    name = "example_interfaces::srv::dds_::AddTwoInts_Request_"
    made_by_others = final(make_idl_struct("AddTwoInts_Request_", name, theirs))

    assert message_types.service_classes(ADD)[0].__idl__.get_type_info() == made_by_others.__idl__.get_type_info()


@pytest.mark.parametrize("name", ["", "a-b", "1a", "a_", "a__b", "A"])
def test_a_field_that_cannot_have_its_name_is_refused(name: str, wording: Wording) -> None:
    with wording.raises(ValueError):
        message_types.service_classes(ServiceType("some_srvs/srv/One", (), ((name, FieldType.BOOL),)))


def test_two_fields_of_one_name_are_refused(wording: Wording) -> None:
    twice = (("a", FieldType.BOOL), ("a", FieldType.INT8))
    with wording.raises(ValueError):
        message_types.service_classes(ServiceType("some_srvs/srv/One", twice))
