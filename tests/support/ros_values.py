"""Random values of types of ROS 2, and `rosbags` as an independent encoder of them."""

from __future__ import annotations

from random import Random
from typing import Any, TypeAlias

import numpy as np
from rosbags.typesys import Stores, get_typestore

from scbm.nodes.types.definitions import FieldShape, ListShape, MessageDefinition, Primitive

Data: TypeAlias = Any
"""A value of any type: a number, a list, a message."""

STORE = get_typestore(Stores.ROS2_JAZZY)
_NO_FIELD = "structure_needs_at_least_one_member"


def random_value(shape: FieldShape, random: Random) -> Data:
    if isinstance(shape, ListShape):
        length = shape.size if shape.is_array else random.randrange(min(4, shape.size + 1 if shape.size else 4))
        return [random_value(shape.element, random) for _ in range(length)]
    if isinstance(shape, MessageDefinition):
        return {name: random_value(part, random) for name, part in shape.fields}
    if shape.name == "bool":
        return random.random() < 0.5
    if shape.name == "string":
        return "".join(random.choice("abcäß€🤖 \n") for _ in range(random.randrange(9)))
    if shape.is_float:
        return random.choice([0.0, -0.0, 1.5, -2.25, 1024.0, float("inf")])
    return random.choice([shape.integers[0], shape.integers[-1], random.randrange(100)])


def plain(shape: FieldShape, message: Data) -> Data:
    """Return a decoded message as mappings and lists."""
    if isinstance(shape, ListShape):
        return [plain(shape.element, element) for element in message]
    if isinstance(shape, MessageDefinition):
        return {name: plain(part, getattr(message, name)) for name, part in shape.fields}
    return message


def by_rosbags(definition: MessageDefinition, values: Data) -> bytes:
    """Return the bytes that `rosbags` makes of a message."""
    return bytes(STORE.serialize_cdr(_of_rosbags(definition, values), definition.name))


def _of_rosbags(shape: FieldShape, value: Data) -> Data:
    if isinstance(shape, MessageDefinition):
        class_ = STORE.types[shape.name]
        if not shape.fields and STORE.fielddefs[shape.name][1]:
            return class_(**{_NO_FIELD: 0})
        return class_(**{name: _of_rosbags(part, value[name]) for name, part in shape.fields})
    if isinstance(shape, ListShape):
        element = shape.element
        if isinstance(element, Primitive) and element.name != "string":
            kind = "uint8" if element.name in ("byte", "char") else element.name
            return np.array(value, kind)
        return [_of_rosbags(element, each) for each in value]
    # rosbags takes a `byte` for a number with a sign
    return value - 256 if shape.name == "byte" and value > 127 else value
