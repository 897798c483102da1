"""The types of messages in the layout of ROS 2: XCDR version 1, final, without keys.

`IdlStruct` reads annotations while the program runs, so this module has no `from __future__ import annotations`.
"""

import re
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

from cyclonedds.idl import IdlStruct, make_idl_struct, types
from cyclonedds.idl.annotations import final

from scbm.nodes.buses.bus import FieldType, MessageType, Scalar, ServiceType
from scbm.nodes.buses.dds import dds_names

Fields: TypeAlias = tuple[tuple[str, FieldType], ...]

_IDL_TYPES: dict[FieldType, object] = {
    FieldType.BOOL: bool,
    FieldType.INT8: types.int8,
    FieldType.INT16: types.int16,
    FieldType.INT32: types.int32,
    FieldType.INT64: types.int64,
    FieldType.UINT8: types.uint8,
    FieldType.UINT16: types.uint16,
    FieldType.UINT32: types.uint32,
    FieldType.UINT64: types.uint64,
    FieldType.FLOAT32: types.float32,
    FieldType.FLOAT64: types.float64,
    FieldType.STRING: str,
}

_RANGES: dict[FieldType, range] = {
    FieldType.INT8: range(-(2**7), 2**7),
    FieldType.INT16: range(-(2**15), 2**15),
    FieldType.INT32: range(-(2**31), 2**31),
    FieldType.INT64: range(-(2**63), 2**63),
    FieldType.UINT8: range(2**8),
    FieldType.UINT16: range(2**16),
    FieldType.UINT32: range(2**32),
    FieldType.UINT64: range(2**64),
}

_DATA: dict[MessageType, FieldType] = {
    MessageType.STRING: FieldType.STRING,
    MessageType.BOOL: FieldType.BOOL,
    MessageType.INT64: FieldType.INT64,
    MessageType.FLOAT64: FieldType.FLOAT64,
}

_HEADER: Fields = (("guid", FieldType.UINT64), ("seq", FieldType.INT64))
"""The fields that rmw_cyclonedds puts before requests and responses: the client, and the number of its call.

A service may have such fields of its own. The header is called `guid_` and `seq_` then, as no field in ROS 2 is: the
layout is the same, and ROS 2 does not send the names of members.
"""

_NOTHING: Fields = (("structure_needs_at_least_one_member", FieldType.UINT8),)
"""The field of a type without fields, as IDL has no empty structures."""

_FIELD_NAME = re.compile(r"[a-z](_?[a-z0-9])*")


@cache
def message_class(type_: MessageType) -> type[IdlStruct]:
    """Return the class of the messages of a topic, with the field `data`."""
    return _class(dds_names.message_type(type_.value), (("data", _DATA[type_]),))


@cache
def service_classes(type_: ServiceType) -> tuple[type[IdlStruct], type[IdlStruct]]:
    """Return the classes of requests and responses, with the header of the call before the fields.

    Raises `ValueError` if a field has a name that no field has, or that of another.
    """
    for name, fields in (
        (f"the request of {type_.name}", type_.request),
        (f"the response of {type_.name}", type_.response),
    ):
        _check_names(name, [field_name for field_name, _ in fields])
    request = _class(dds_names.request_type(type_.name), _with_header(type_.request))
    response = _class(dds_names.response_type(type_.name), _with_header(type_.response))
    return request, response


def _with_header(fields: Fields) -> Fields:
    own = [name for name, _ in fields]
    header = tuple((f"{name}_" if name in own else name, type_) for name, type_ in _HEADER)
    return (*header, *(fields or _NOTHING))


def _check_names(of: str, field_names: list[str]) -> None:
    for position, name in enumerate(field_names):
        if not _FIELD_NAME.fullmatch(name):
            raise ValueError(f"{of} cannot have a field `{name}`")
        if name in field_names[:position]:
            raise ValueError(f"{of} has two fields `{name}`")


def request(type_: ServiceType, guid: int, seq: int, values: Mapping[str, Scalar]) -> IdlStruct:
    """Return a request: the call `seq` of the client `guid`. Raises `ValueError` for values of other fields."""
    made = _values(f"the request of {type_.name}", type_.request, values)
    return _call(service_classes(type_)[0], guid, seq, made)


def response(type_: ServiceType, guid: int, seq: int, values: Mapping[str, Scalar]) -> IdlStruct:
    """Return the response to such a request. Raises `ValueError` if the values are not those of the fields."""
    made = _values(f"the response of {type_.name}", type_.response, values)
    return _call(service_classes(type_)[1], guid, seq, made)


def _call(class_: type[IdlStruct], guid: int, seq: int, values: Mapping[str, Scalar]) -> IdlStruct:
    which = zip(class_.__annotations__, (guid, seq), strict=False)
    return _sample(class_, {**dict(which), **values})


def call_of(sample: IdlStruct) -> tuple[int, int]:
    """Return the client and the call of a request or a response."""
    guid, seq, *_ = vars(sample).values()
    return guid, seq


def fields_of(sample: IdlStruct, fields: Fields) -> dict[str, Scalar]:
    """Return the values of the fields of a request or a response."""
    values = vars(sample)
    return {name: values[name] for name, _ in fields}


def _values(of: str, fields: Fields, values: Mapping[str, Scalar]) -> dict[str, Scalar]:
    names_ = [name for name, _ in fields]
    unknown = [name for name in values if name not in names_]
    missing = [name for name in names_ if name not in values]
    if unknown:
        raise ValueError(f"{of} has no field {_quoted(unknown)}")
    if missing:
        raise ValueError(f"{of} lacks {_quoted(missing)}")
    made = {name: checked(values[name], type_, f"`{name}` of {of}") for name, type_ in fields}
    return made or dict.fromkeys((name for name, _ in _NOTHING), 0)


def _quoted(names_: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names_)


def checked(value: Scalar, type_: FieldType, what: str) -> Scalar:
    """Return the value as the type holds it: an integer becomes a float if no digit is lost.

    A float for `float32` becomes the nearest one there is, which is what this type means.
    Raises `ValueError`, with `what` in its sentence, if the value is not of the type or out of its range.
    """
    if type_ is FieldType.BOOL:
        if isinstance(value, bool):
            return value
    elif type_ is FieldType.STRING:
        if isinstance(value, str):
            return _checked_text(value, what)
    elif isinstance(value, bool | str):
        pass
    elif type_ in _RANGES:
        if isinstance(value, int):
            return _checked_integer(value, type_, what)
    elif isinstance(value, int | float):
        return _checked_float(value, type_, what)
    raise ValueError(f"{what} is {type_.value}, not {value!r}")


def _checked_text(value: str, what: str) -> str:
    if "\0" in value:
        raise ValueError(f"{what} has a NUL character, at which its encoding would end")
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise ValueError(f"{what} is no text: {error.reason}") from error
    return value


def _checked_integer(value: int, type_: FieldType, what: str) -> int:
    numbers = _RANGES[type_]
    if value not in numbers:
        raise ValueError(f"{what} is {type_.value}, from {numbers[0]} to {numbers[-1]}, not {value}")
    return value


def _checked_float(value: float, type_: FieldType, what: str) -> float:
    try:
        wide = float(value)
        narrow = struct.unpack("<f", struct.pack("<f", wide))[0] if type_ is FieldType.FLOAT32 else wide
    except OverflowError as error:
        raise ValueError(f"{what} is {type_.value}, for which {value} is too large") from error
    if isinstance(value, int) and narrow != value:
        raise ValueError(f"{what} is {type_.value}, which cannot represent {value}")
    if wide != 0 and narrow == 0:
        raise ValueError(f"{what} is {type_.value}, for which {value} is too small")
    return wide


@cache
def _class(dds_type: str, fields: Fields) -> type[IdlStruct]:
    """Make a class that is no dataclass: those cannot have every field that ROS 2 can, such as `class` or `self`."""
    idl_types = {name: _IDL_TYPES[type_] for name, type_ in fields}
    class_ = make_idl_struct(dds_type.rpartition("::")[2], dds_type, idl_types, dataclassify=False)
    class_.__init__ = _have  # type: ignore[assignment, method-assign]  # cyclonedds gives it no types
    return final(class_)


def _have(sample: IdlStruct, /, **values: object) -> None:
    vars(sample).update(values)


def _sample(class_: type[IdlStruct], values: Mapping[str, object]) -> IdlStruct:
    return class_(**values)


GID_BYTES = 16
"""Of the ids of participants and endpoints in rmw_dds_common, from ROS 2 Iron on: their GUIDs."""


def _array(of: object, length: int) -> object:
    return types.array[of, length]  # type: ignore[misc]  # cyclonedds does not tell mypy that this can be indexed


def _sequence(of: object) -> object:
    return types.sequence[of]  # type: ignore[misc]  # as in `_array`


def _bounded_text(length: int) -> object:
    return types.bounded_str[length]  # type: ignore[misc]  # as in `_array`


def _rmw_class(name: str, idl_types: dict[str, object]) -> type[IdlStruct]:
    return final(make_idl_struct(name, f"rmw_dds_common::msg::dds_::{name}", idl_types))


_GID = _rmw_class("Gid_", {"data": _array(types.uint8, GID_BYTES)})

_NODE_ENTITIES = _rmw_class(
    "NodeEntitiesInfo_",
    {
        "node_namespace": _bounded_text(256),
        "node_name": _bounded_text(256),
        "reader_gid_seq": _sequence(_GID),
        "writer_gid_seq": _sequence(_GID),
    },
)

PARTICIPANT_ENTITIES = _rmw_class(
    "ParticipantEntitiesInfo_", {"gid": _GID, "node_entities_info_seq": _sequence(_NODE_ENTITIES)}
)
"""The class of the messages that say which endpoints belong to which node."""


@dataclass(frozen=True, slots=True)
class NodeEntities:
    """A node and the ids of its endpoints, of `GID_BYTES` each."""

    namespace: str
    name: str
    readers: tuple[bytes, ...] = ()
    writers: tuple[bytes, ...] = ()


def participant_entities(participant: bytes, nodes: Iterable[NodeEntities]) -> IdlStruct:
    """Return a message that says which nodes a participant has."""
    return _sample(
        PARTICIPANT_ENTITIES, {"gid": _gid(participant), "node_entities_info_seq": [_node(node) for node in nodes]}
    )


def _node(node: NodeEntities) -> IdlStruct:
    values = {
        "node_namespace": node.namespace,
        "node_name": node.name,
        "reader_gid_seq": [_gid(reader) for reader in node.readers],
        "writer_gid_seq": [_gid(writer) for writer in node.writers],
    }
    return _sample(_NODE_ENTITIES, values)


def _gid(data: bytes) -> IdlStruct:
    return _sample(_GID, {"data": data})
