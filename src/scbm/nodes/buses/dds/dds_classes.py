"""Classes for Cyclone DDS, made at run time: they tell other participants the types of topics, and encode nothing.

`IdlStruct` reads annotations while the program runs, so this module has no `from __future__ import annotations`.
"""

from functools import cache

from cyclonedds.idl import IdlStruct, make_idl_struct, types
from cyclonedds.idl.annotations import final

from scbm.nodes.types.definitions import FieldShape, MessageDefinition, Primitive

_IDL_TYPES: dict[str, object] = {
    "bool": bool,
    "byte": types.uint8,
    "char": types.uint8,
    "float32": types.float32,
    "float64": types.float64,
    **{f"{sign}int{bits}": getattr(types, f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)},
}

_HEADER = {"guid": types.uint64, "seq": types.int64}
"""The fields that rmw_cyclonedds puts before requests and responses: the client, and the number of its call.

A service may have such fields of its own. The header is called `guid_` and `seq_` then, as no field in ROS 2 is.
"""


@cache
def message_class(definition: MessageDefinition, *, is_call: bool = False) -> type[IdlStruct]:
    """Return the class of a message; with `is_call`, of one with the header of a call before its fields.

    It is no dataclass: those cannot have every field that ROS 2 can, such as `class` or `self`.
    """
    package, kind, short = definition.name.split("/")
    own = {name: _idl_type(shape) for name, shape in definition.on_wire}
    header = {f"{name}_" if name in own else name: type_ for name, type_ in _HEADER.items()} if is_call else {}
    dds_name = f"{package}::{kind}::dds_::{short}_"
    class_ = make_idl_struct(f"{short}_", dds_name, {**header, **own}, dataclassify=False)
    class_.__init__ = _have  # type: ignore[assignment, method-assign]  # cyclonedds gives it no types
    return final(class_)


def _have(sample: IdlStruct, /, **values: object) -> None:
    vars(sample).update(values)


def _idl_type(shape: FieldShape) -> object:
    if isinstance(shape, MessageDefinition):
        return message_class(shape)
    if isinstance(shape, Primitive):
        if shape.name != "string":
            return _IDL_TYPES[shape.name]
        return types.bounded_str[shape.bound] if shape.bound else str  # type: ignore[misc]  # mypy cannot index it
    element = _idl_type(shape.element)
    if shape.is_array:
        return types.array[element, shape.size]  # type: ignore[misc]  # the same
    bounded = (element, shape.size) if shape.size else element
    return types.sequence[bounded]  # type: ignore[misc]  # the same
