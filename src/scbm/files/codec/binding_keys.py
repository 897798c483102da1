"""The shape of bindings: what stands under `ros` of a resource, and the file beside a model that says the same.

What the texts inside say is not checked here but in `binding_builder`.
"""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import Field, WithJsonSchema

from scbm.files.codec.key_types import Editors, FileType, Name, Shape, scalar, scalar_or_mapping, text_schema
from scbm.model.bindings import SET_BOOL, TRIGGER, FieldType, MessageType

_SCALAR: dict[str, Any] = {"type": ["boolean", "number", "string"]}
_ROS_NAME = r"^(?!/scbm(/|$))(/[A-Za-z_][A-Za-z0-9_]*)+$"

RosName: TypeAlias = Annotated[
    Any, scalar("a name such as `/scanner/scan`"), text_schema("A name of ROS 2, from the root.", pattern=_ROS_NAME)
]
FieldTypeName: TypeAlias = Annotated[
    Any, scalar("a type such as `int64`"), WithJsonSchema({"enum": [kind.value for kind in FieldType]})
]
MessageTypeName: TypeAlias = Annotated[
    Any, scalar("a type such as `std_msgs/msg/Bool`"), WithJsonSchema({"enum": [kind.value for kind in MessageType]})
]
FieldValue: TypeAlias = Annotated[Any, scalar("a value"), WithJsonSchema(_SCALAR)]
Argument: TypeAlias = Annotated[Any, scalar("a value, or a variable that the request carries"), WithJsonSchema(_SCALAR)]
Range: TypeAlias = Annotated[
    Any,
    scalar("a range such as `0.5..2`"),
    text_schema("`low..high`, from `low` on and below `high`; either may be left out.", pattern=r"\.\."),
]
Symbol: TypeAlias = Annotated[Any, scalar("a value"), WithJsonSchema(_SCALAR)]
Truth: TypeAlias = Annotated[Any, scalar("`true` or `false`"), WithJsonSchema({"type": "boolean"})]


class ServiceTypeFile(FileType):
    """A type of services, with its fields in their order."""

    name: Name
    """As ROS 2 writes it: `example_interfaces/srv/AddTwoInts`."""
    request: dict[str, FieldTypeName] = Field(default_factory=dict)
    """The fields of requests."""
    response: dict[str, FieldTypeName] = Field(default_factory=dict)
    """The fields of responses."""


ServiceType_: TypeAlias = Annotated[
    ServiceTypeFile,
    scalar_or_mapping(f"`{TRIGGER.name}`, `{SET_BOOL.name}`, or a mapping with `name`, `request` and `response`"),
    Editors(lambda mapping: {"anyOf": [{"enum": [TRIGGER.name, SET_BOOL.name]}, mapping]}),
]


class FieldReadingFile(FileType):
    """A field of a response, and how it is read."""

    field: Name
    ranges: dict[str, Range] = Field(default_factory=dict)
    """For numbers: which of them mean which value."""
    values: dict[str, Symbol] = Field(default_factory=dict)
    """For texts: which of them mean which value."""


FieldReading: TypeAlias = Annotated[
    FieldReadingFile,
    scalar_or_mapping("a field, or a mapping such as `{field: distance, ranges: {near: ..0.5}}`"),
    Editors(lambda mapping: {"anyOf": [{"type": "string"}, mapping]}),
]


class ServiceFile(FileType):
    """A service, and how requests become calls of it."""

    name: RosName
    type: ServiceType_
    request: dict[str, Argument] = Field(default_factory=dict)
    """What each field of the request gets: a value, or a variable that the request carries."""
    succeeded: dict[str, FieldValue] = Field(default_factory=dict)
    """The fields of a response that says succeeded; `{success: true}`, if this is missing and there is such a field."""
    measured: dict[str, FieldReading] = Field(default_factory=dict)
    """For each variable that a response measures, the field."""


class TopicsFile(FileType):
    """A pair of topics with the protocol of drivers."""

    request: RosName
    reply: RosName


class MeasuredTopicFile(FileType):
    """A topic of the values of one variable."""

    topic: RosName
    type: MessageTypeName
    best_effort: Truth = False
    """Whether publishers are heard that do not repeat what was lost, as those of sensor data."""
    ranges: dict[str, Range] = Field(default_factory=dict)
    """For numbers: which of them mean which value."""
    values: dict[str, Symbol] = Field(default_factory=dict)
    """For texts: which of them mean which value."""


class RosFile(FileType):
    """How a resource is reached when it is real: by `service`, `services` or `topics`; and what it measures by."""

    service: ServiceFile = None  # type: ignore[assignment] # only the shape of what is there is ever looked at
    """One service for every request."""
    services: dict[str, dict[str, ServiceFile]] = Field(default_factory=dict)
    """For one variable that requests carry, a service for each value."""
    topics: TopicsFile = None  # type: ignore[assignment] # the same
    """A topic of requests, and one of replies."""
    measured: dict[str, MeasuredTopicFile] = Field(default_factory=dict)
    """For each variable that is measured by a topic, that topic."""


class BindingsFile(FileType):
    """The bindings of the resources of a model, in a file of their own."""

    bindings_of: Name
    """The name of the model."""
    resources: dict[str, RosFile]


BINDINGS_SHAPE = Shape(
    "bindings",
    BindingsFile,
    ((RosFile, "a resource"), (ServiceFile, "a service"), (MeasuredTopicFile, "a measured topic")),
)
