"""Types, paths and readings of ROS 2 in few words, for tests."""

from __future__ import annotations

from collections.abc import Mapping

from scbm.model import Value
from scbm.nodes.bindings.ros_binding import Interval, Reading, ServiceCall
from scbm.nodes.types.definitions import (
    STRING,
    TRIGGER,
    FieldShape,
    MessageDefinition,
    Primitive,
    Scalar,
    ServiceDefinition,
)
from scbm.nodes.types.field_paths import FieldPath, read_path


def service_type(
    name: str, request: Mapping[str, str] | None = None, response: Mapping[str, str] | None = None
) -> ServiceDefinition:
    """Return a type of services whose fields are primitive: `{"a": "int64"}`."""
    halves: list[tuple[tuple[str, FieldShape], ...]] = [
        tuple((field, Primitive(kind)) for field, kind in (fields or {}).items()) for fields in (request, response)
    ]
    return ServiceDefinition.of(name, *halves)


def path_to(definition: MessageDefinition, text: str = "data") -> FieldPath:
    found = read_path(definition, text, f"`{definition}`")
    assert isinstance(found, FieldPath)
    return found


def reading(
    variable: str,
    definition: MessageDefinition = STRING,
    field: str = "data",
    ranges: tuple[tuple[Value, Interval], ...] = (),
    meanings: tuple[tuple[Scalar, Value], ...] = (),
) -> Reading:
    return Reading(variable, path_to(definition, field), ranges, meanings)


SUCCESS = ((path_to(TRIGGER.response, "success"), True),)


def trigger(name: str) -> ServiceCall:
    """Return a call of a service of type Trigger."""
    return ServiceCall(name, TRIGGER, succeeded=SUCCESS)
