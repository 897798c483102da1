"""Bindings: how the requests and measured values of a resource reach a real driver, in the terms of ROS 2."""

from __future__ import annotations

from math import isnan
from typing import TYPE_CHECKING, Any, TypeAlias

from msgspec import Struct

from scbm.model import Reference
from scbm.model.bindings import Binding
from scbm.nodes.buses.bus import BusError
from scbm.nodes.types.definitions import STRING, Scalar

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.cases.trace import Changes
    from scbm.model import Resource
    from scbm.model.values import Value
    from scbm.nodes.types.definitions import ActionDefinition, MessageDefinition, ServiceDefinition
    from scbm.nodes.types.field_paths import FieldPath


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
    """How a field of a message is converted into a value of a variable.

    Attributes:
        variable: the variable.
        path: the field.
        ranges: for numbers, the ranges with their values; no two overlap.
        meanings: values of the field with those of the variable. Without ranges and meanings, the field has the value.
    """

    variable: str
    path: FieldPath
    ranges: tuple[tuple[Value, Interval], ...] = ()
    meanings: tuple[tuple[Scalar, Value], ...] = ()


class MeasuredTopic(Struct, frozen=True):
    """A topic with values of one variable.

    Attributes:
        topic: its absolute name: `/scanner/distance`.
        type: the type of its messages.
        reading: how messages are converted into values.
        is_best_effort: whether best-effort publishers match as well.
    """

    topic: str
    type: MessageDefinition
    reading: Reading
    is_best_effort: bool = False


class MappedVariable(Struct, frozen=True):
    """What a field of a request gets for each value of a variable that the request carries."""

    variable: str
    values: tuple[tuple[Value, Scalar], ...]


Content: TypeAlias = "Scalar | Reference | MappedVariable | tuple[Content, ...]"
"""What a field of a request gets: a constant, a variable that the request carries, or a list of these."""

RequestFields: TypeAlias = "tuple[tuple[FieldPath, Content], ...]"
"""The fields of a request with what they get; all others are zero, empty or false."""


def request_values(fields: RequestFields, values: Mapping[str, Value]) -> dict[str, Any]:
    """Return the fields of a request that carries these values."""
    made: dict[str, Any] = {}
    for path, content in fields:
        path.put(made, _filled(content, values))
    return made


def _filled(content: Content, values: Mapping[str, Value]) -> object:
    if isinstance(content, tuple):
        return [_filled(each, values) for each in content]
    if isinstance(content, MappedVariable):
        return dict(content.values)[values[content.variable]]
    return values[content.name] if isinstance(content, Reference) else content


class RequestBinding(Struct, frozen=True):
    """The destination of the requests of a resource. Its subclasses are the kinds of bindings."""

    @property
    def services(self) -> tuple[ServiceCall, ...]:
        """All services that requests go to, in order."""
        return ()

    @property
    def actions(self) -> tuple[ActionCall, ...]:
        """All actions that goals go to, in order."""
        return ()

    @property
    def topics(self) -> tuple[str, ...]:
        """All topics that carry requests or replies as texts."""
        return ()

    @property
    def readings(self) -> tuple[Reading, ...]:
        """How fields of replies are converted into values."""
        return tuple(reading for call in (*self.services, *self.actions) for reading in call.readings)

    def call_for(self, _: Changes) -> RequestBinding | None:
        """Return where a request goes that carries these values; `None` if it cannot be sent."""
        return self


class ServiceCall(RequestBinding, frozen=True):
    """A service, and how a request is converted into a call of it.

    Attributes:
        name: the absolute name of the service: `/scanner/scan`.
        type: its type.
        request: the fields of its request.
        succeeded: the fields of a response that means success, with their values; any other response means failure.
        measured: how fields of a successful response are measured.
    """

    name: str
    type: ServiceDefinition
    request: RequestFields = ()
    succeeded: tuple[tuple[FieldPath, Scalar], ...] = ()
    measured: tuple[Reading, ...] = ()

    @property
    def services(self) -> tuple[ServiceCall, ...]:
        """A tuple with this service alone."""
        return (self,)

    @property
    def readings(self) -> tuple[Reading, ...]:
        """How fields of responses are converted into values."""
        return self.measured


class ActionCall(RequestBinding, frozen=True):
    """An action, and how a request is converted into a goal of it.

    Attributes:
        name: the absolute name of the action: `/gantry/follow_joint_trajectory`.
        type: its type.
        goal: the fields of its goal.
        succeeded: the fields of a result that means success, beside the status; any other result means failure.
        measured: how fields of a result that means success are measured.
        feedback: how fields of feedback are measured, of variables that the resource publishes.
    """

    name: str
    type: ActionDefinition
    goal: RequestFields = ()
    succeeded: tuple[tuple[FieldPath, Scalar], ...] = ()
    measured: tuple[Reading, ...] = ()
    feedback: tuple[Reading, ...] = ()

    @property
    def actions(self) -> tuple[ActionCall, ...]:
        """A tuple with this action alone."""
        return (self,)

    @property
    def readings(self) -> tuple[Reading, ...]:
        """How fields of results and feedback are converted into values."""
        return (*self.measured, *self.feedback)


class CallChoice(RequestBinding, frozen=True):
    """A service or an action for each value of a variable that the request carries; other values cannot be sent."""

    variable: str
    calls: tuple[tuple[Value, ServiceCall | ActionCall], ...]

    @property
    def services(self) -> tuple[ServiceCall, ...]:
        """The services of all values."""
        return tuple(call for _, call in self.calls if isinstance(call, ServiceCall))

    @property
    def actions(self) -> tuple[ActionCall, ...]:
        """The actions of all values."""
        return tuple(call for _, call in self.calls if isinstance(call, ActionCall))

    def call_for(self, values: Changes) -> RequestBinding | None:
        """Return the service or action for the value of the variable; `None` if there is none."""
        return dict(self.calls).get(dict(values)[self.variable])


class TopicPair(RequestBinding, frozen=True):
    """A topic of requests and a topic of replies, with the protocol of drivers."""

    request: str
    reply: str

    @property
    def topics(self) -> tuple[str, ...]:
        """Both topics."""
        return (self.request, self.reply)


class RosBinding(Binding, frozen=True):
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

    @property
    def readings(self) -> tuple[Reading, ...]:
        """How replies and messages are converted into values."""
        of_replies = () if self.requests is None else self.requests.readings
        return (*of_replies, *(measured.reading for measured in self.measured))

    def topics(self) -> Iterator[tuple[str, MessageDefinition]]:
        """Yield all topics, each as often as the binding names it."""
        for topic in () if self.requests is None else self.requests.topics:
            yield topic, STRING
        for measured in self.measured:
            yield measured.topic, measured.type


NO_BINDING = RosBinding({})
"""The binding of a resource that is not bound."""


def binding_of(resource: Resource) -> RosBinding:
    """Return the binding of a resource, which may be none; raise `BusError` if nothing could check it."""
    if resource.binding is None:
        return NO_BINDING
    if not isinstance(resource.binding, RosBinding):
        raise BusError(f"the binding of `{resource.name}` is not checked: rosbags is not installed", _REMEDY)
    return resource.binding


_REMEDY = "pip install 'scbm[dds]'"
