"""Bindings: how the requests and measured values of a resource reach a real driver, in the terms of ROS 2."""

from __future__ import annotations

from enum import StrEnum
from math import isnan
from sys import float_info
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.model.values import ValueKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.predicates import Reference
    from scbm.model.values import Value

Scalar: TypeAlias = bool | int | float | str
"""The value of a field of a message or a service."""

_FLOAT32_MAX = (2 - 2**-23) * 2.0**127
_FLOAT32_MIN = 2.0**-149


class MessageType(StrEnum):
    """The supported types of topics; each has one field, `data`."""

    STRING = "std_msgs/msg/String"
    BOOL = "std_msgs/msg/Bool"
    INT64 = "std_msgs/msg/Int64"
    FLOAT64 = "std_msgs/msg/Float64"

    @property
    def data(self) -> FieldType:
        """The type of the field."""
        return _DATA[self]


class FieldType(StrEnum):
    """The supported types of fields of services."""

    BOOL = "bool"
    INT8 = "int8"
    INT16 = "int16"
    INT32 = "int32"
    INT64 = "int64"
    UINT8 = "uint8"
    UINT16 = "uint16"
    UINT32 = "uint32"
    UINT64 = "uint64"
    FLOAT32 = "float32"
    FLOAT64 = "float64"
    STRING = "string"

    @property
    def is_float(self) -> bool:
        """Whether the type holds numbers with fractions."""
        return self in (FieldType.FLOAT32, FieldType.FLOAT64)

    @property
    def is_number(self) -> bool:
        """Whether the type holds numbers."""
        return self not in (FieldType.BOOL, FieldType.STRING)

    @property
    def kind(self) -> ValueKind | None:
        """The kind of variable whose values the type holds unchanged; `None` for numbers with fractions."""
        match self:
            case FieldType.BOOL:
                return ValueKind.BOOLEAN
            case FieldType.STRING:
                return ValueKind.SYMBOL
            case _:
                return None if self.is_float else ValueKind.INTEGER

    @property
    def integers(self) -> range:
        """The whole numbers that the type holds, if it holds no others."""
        if self.kind is not ValueKind.INTEGER:
            return range(0)
        bits = int(self.value.partition("int")[2])
        return range(2**bits) if self.value.startswith("u") else range(-(2 ** (bits - 1)), 2 ** (bits - 1))

    def holds(self, value: Scalar) -> bool:
        """Return whether a field of this type can have the value. A whole number is also a number with fraction 0.

        A text with a NUL would end there on the wire; a number too close to 0 for a `float32` would become 0.
        """
        if isinstance(value, bool):
            return self is FieldType.BOOL
        if isinstance(value, str):
            return self is FieldType.STRING and "\0" not in value
        if self is FieldType.FLOAT32:
            return value == 0 or _FLOAT32_MIN <= abs(value) <= _FLOAT32_MAX
        if self is FieldType.FLOAT64:
            return abs(value) <= float_info.max
        return isinstance(value, int) and value in self.integers


_DATA = {
    MessageType.STRING: FieldType.STRING,
    MessageType.BOOL: FieldType.BOOL,
    MessageType.INT64: FieldType.INT64,
    MessageType.FLOAT64: FieldType.FLOAT64,
}


class ServiceType(Struct, frozen=True):
    """A service type with scalar fields.

    Attributes:
        name: as in ROS 2: `std_srvs/srv/Trigger`.
        request, response: the fields in their order.
    """

    name: str
    request: tuple[tuple[str, FieldType], ...] = ()
    response: tuple[tuple[str, FieldType], ...] = ()


_RESULT = (("success", FieldType.BOOL), ("message", FieldType.STRING))
TRIGGER = ServiceType("std_srvs/srv/Trigger", (), _RESULT)
"""The service type whose request carries nothing."""

SET_BOOL = ServiceType("std_srvs/srv/SetBool", (("data", FieldType.BOOL),), _RESULT)
"""The service type whose request carries a boolean."""


class Interval(Struct, frozen=True):
    """The numbers from `low` (inclusive) to `high` (exclusive), in units of a message; `None` is an open end."""

    low: int | float | None
    high: int | float | None

    def __contains__(self, number: int | float) -> bool:  # noqa: PYI041 - both are meant: whole numbers stay exact
        from_low = self.low is None or self.low <= number
        return from_low and (self.high is None or number < self.high) and not isnan(number)

    @property
    def is_empty(self) -> bool:
        """Whether the interval contains no number."""
        return self.low is not None and self.high is not None and self.low >= self.high

    def overlaps(self, other: Interval) -> bool:
        """Return whether a number lies in both intervals; neither is empty."""
        lows = [end for end in (self.low, other.low) if end is not None]
        highs = [end for end in (self.high, other.high) if end is not None]
        return not lows or not highs or max(lows) < min(highs)

    def __str__(self) -> str:
        return f"{'' if self.low is None else self.low}..{'' if self.high is None else self.high}"


class Reading(Struct, frozen=True):
    """How data is converted into a value of a variable.

    Attributes:
        variable: the variable.
        ranges: for numbers, the ranges with their values; no two overlap.
        texts: for texts, the texts with their values. Without texts and ranges, data is the value itself.
    """

    variable: str
    ranges: tuple[tuple[Value, Interval], ...] = ()
    texts: tuple[tuple[str, Value], ...] = ()


class MeasuredTopic(Struct, frozen=True):
    """A topic with values of one variable.

    Attributes:
        topic: its absolute name: `/scanner/distance`.
        type: the type of its messages.
        reading: how messages are converted into values.
        is_best_effort: whether best-effort publishers match as well.
    """

    topic: str
    type: MessageType
    reading: Reading
    is_best_effort: bool = False


class RequestBinding(Struct, frozen=True):
    """The destination of the requests of a resource. Its subclasses are the kinds of bindings."""

    @property
    def services(self) -> tuple[ServiceCall, ...]:
        """All services that requests go to, in order."""
        return ()

    @property
    def topics(self) -> tuple[str, ...]:
        """All topics that carry requests or replies as texts."""
        return ()


class ServiceCall(RequestBinding, frozen=True):
    """A service, and how a request is converted into a call of it.

    Attributes:
        name: the absolute name of the service: `/scanner/scan`.
        type: its type.
        request: each field of its request in the order of the type, with its content: a constant, or the value of a
            variable that the request carries.
        succeeded: the fields of a response that means success, with their values; any other response means failure.
        measured: the fields of a successful response that are measured, and how they are converted.
    """

    name: str
    type: ServiceType
    request: tuple[tuple[str, Scalar | Reference], ...] = ()
    succeeded: tuple[tuple[str, Scalar], ...] = ()
    measured: tuple[tuple[str, Reading], ...] = ()

    @property
    def services(self) -> tuple[ServiceCall, ...]:
        """A tuple with this service alone."""
        return (self,)


class ServiceChoice(RequestBinding, frozen=True):
    """One service for each value of a variable that the request carries. A value without a service cannot be sent."""

    variable: str
    calls: tuple[tuple[Value, ServiceCall], ...]

    @property
    def services(self) -> tuple[ServiceCall, ...]:
        """The services of all values."""
        return tuple(call for _, call in self.calls)


class TopicPair(RequestBinding, frozen=True):
    """A topic of requests and a topic of replies, with the protocol of drivers."""

    request: str
    reply: str

    @property
    def topics(self) -> tuple[str, ...]:
        """Both topics."""
        return (self.request, self.reply)


class Binding(Struct, frozen=True):
    """How a real resource is reached.

    Attributes:
        requests: the target of requests; `None` for a resource that only measures.
        measured: the topics with its measured values.
    """

    requests: RequestBinding | None = None
    measured: tuple[MeasuredTopic, ...] = ()

    @property
    def calls(self) -> tuple[ServiceCall, ...]:
        """All services that requests call, in order."""
        return () if self.requests is None else self.requests.services

    def topics(self) -> Iterator[tuple[str, MessageType]]:
        """Yield all topics, each as often as the binding names it."""
        for topic in () if self.requests is None else self.requests.topics:
            yield topic, MessageType.STRING
        for measured in self.measured:
            yield measured.topic, measured.type
