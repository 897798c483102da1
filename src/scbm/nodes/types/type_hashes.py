"""Hashes of types (REP 2011, version 1), as endpoints of ROS 2 carry them in their user data."""

from __future__ import annotations

import json
from functools import cache
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from scbm.nodes.types.definitions import ListShape, MessageDefinition, Primitive

if TYPE_CHECKING:
    from scbm.nodes.types.definitions import FieldShape

_IDS = {"int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9,
        "float32": 10, "float64": 11, "char": 3, "bool": 15, "byte": 16, "string": 17}  # fmt: skip
"""The numbers of types in `type_description_interfaces/msg/FieldType`; a `char` of ROS 2 is a `uint8`."""

_MESSAGE, _BOUNDED_TEXT, _ARRAY, _BOUNDED_LIST, _LIST = 1, 21, 48, 96, 144


@cache
def type_hash(definition: MessageDefinition) -> str:
    """Return the hash of a message: `RIHS01_` and 64 digits."""
    found: dict[str, MessageDefinition] = {}
    waiting = [*definition.nested()]
    while waiting:
        nested = waiting.pop()
        if nested.name not in found:
            found[nested.name] = nested
            waiting += nested.nested()
    described = {
        "type_description": _described(definition),
        "referenced_type_descriptions": [_described(found[name]) for name in sorted(found)],
    }
    return f"RIHS01_{sha256(json.dumps(described).encode()).hexdigest()}"


def _described(definition: MessageDefinition) -> dict[str, Any]:
    fields = [{"name": name, "type": _type(shape)} for name, shape in definition.on_wire]
    return {"type_name": definition.name, "fields": fields}


def _type(shape: FieldShape) -> dict[str, Any]:
    element, kind, capacity = shape, 0, 0
    if isinstance(shape, ListShape):
        element, capacity = shape.element, shape.size
        kind = _ARRAY if shape.is_array else _BOUNDED_LIST if shape.size else _LIST
    text_bound, nested = 0, ""
    if isinstance(element, MessageDefinition):
        kind, nested = kind + _MESSAGE, element.name
    elif isinstance(element, Primitive):
        kind, text_bound = kind + (_BOUNDED_TEXT if element.bound else _IDS[element.name]), element.bound
    return {"type_id": kind, "capacity": capacity, "string_capacity": text_bound, "nested_type_name": nested}


def user_data(definition: MessageDefinition, identity: str = "") -> bytes:
    """Return the user data of an endpoint: an identity such as `clientid=…;`, and the hash of what passes there."""
    return f"{identity}typehash={type_hash(definition)};".encode()
