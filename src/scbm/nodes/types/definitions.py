"""Definitions of types of ROS 2, complete in themselves: a definition contains those of all nested messages."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Iterator

Scalar: TypeAlias = bool | int | float | str
"""The value of a field that is no list and no message."""

CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
"""The primitive types of fixed size, with their codes in `struct`."""

MAX_BYTES = 2**24
"""Maximum size of what a definition makes necessary: the zeros of all arrays of a message."""


class Primitive(Struct, frozen=True):
    """A number, a truth value or a text.

    Attributes:
        name: as in definitions: `uint8`, `string`.
        bound: of a text, the maximum length in bytes; 0 for none.
    """

    name: str
    bound: int = 0

    @property
    def is_float(self) -> bool:
        """Whether it holds numbers with fractions."""
        return self.name in ("float32", "float64")

    @property
    def is_number(self) -> bool:
        """Whether it holds numbers."""
        return self.name not in ("bool", "string")

    @property
    def integers(self) -> range:
        """The whole numbers that it holds, if it holds no others."""
        if not self.is_number or self.is_float:
            return range(0)
        bits = 8 * self.size
        return range(-(2 ** (bits - 1)), 2 ** (bits - 1)) if CODES[self.name].islower() else range(2**bits)

    @property
    def size(self) -> int:
        """The number of bytes; of a text, those of its length and its end."""
        return struct.calcsize("=" + CODES[self.name]) if self.name in CODES else 5

    def fault(self, value: object) -> str | None:
        """Return what to do about a value that a field cannot have; `None` for a right one.

        A text with a NUL would end there on the wire, a number too close to 0 would become 0, and a whole number with
        too many digits another one.
        """
        if self.name == "bool":
            return None if isinstance(value, bool) else "write `true` or `false`"
        if self.name == "string":
            return self._text_fault(value)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return "write a number" if self.is_float else self._range_words
        if not self.is_float:
            return None if isinstance(value, int) and value in self.integers else self._range_words
        return self._float_fault(value)

    def _float_fault(self, value: float) -> str | None:
        try:
            (held,) = struct.unpack("<" + CODES[self.name], struct.pack("<" + CODES[self.name], value))
        except (OverflowError, struct.error):
            return "it is too large for the type"
        if value and not held:
            return "it is too small for the type"
        return "it has too many digits for the type" if isinstance(value, int) and held != value else None

    @property
    def _range_words(self) -> str:
        return f"write a whole number from {self.integers[0]} to {self.integers[-1]}"

    def _text_fault(self, value: object) -> str | None:
        if not isinstance(value, str):
            return "write a text"
        if "\0" in value:
            return "it has a NUL, where it would end"
        try:
            length = len(value.encode())
        except UnicodeEncodeError:
            return "it is no text in Unicode"
        return f"it has {length} bytes, and the type at most {self.bound}" if 0 < self.bound < length else None

    def __str__(self) -> str:
        return f"{self.name}<={self.bound}" if self.bound else self.name


class ListShape(Struct, frozen=True):
    """A list.

    Attributes:
        element: the type of its elements.
        size: their number in an array, the maximum number in a bounded list; 0 for none.
        is_array: whether it has so many always.
    """

    element: Primitive | MessageDefinition
    size: int = 0
    is_array: bool = False

    def __str__(self) -> str:
        bound = f"<={self.size}" if self.size and not self.is_array else str(self.size or "")
        return f"{self.element}[{bound}]"


class MessageDefinition(Struct, frozen=True):
    """A message, or a part of a service or of an action.

    Attributes:
        name: such as `sensor_msgs/msg/JointState`, `std_srvs/srv/Trigger_Request`.
        fields: the fields in their order.
        constants: the constants, with their values.
    """

    name: str
    fields: tuple[tuple[str, FieldShape], ...] = ()
    constants: tuple[tuple[str, Scalar], ...] = ()

    def __hash__(self) -> int:
        return hash(self.name)

    def __str__(self) -> str:
        return self.name

    @property
    def on_wire(self) -> tuple[tuple[str, FieldShape], ...]:
        """The fields that are sent: a message without fields has one, as IDL has no empty structures."""
        return self.fields or (("structure_needs_at_least_one_member", Primitive("uint8")),)

    def nested(self) -> Iterator[MessageDefinition]:
        """Yield the messages among its fields, and those among their elements; each as often as it occurs."""
        for _, shape in self.fields:
            element = shape.element if isinstance(shape, ListShape) else shape
            if isinstance(element, MessageDefinition):
                yield element


FieldShape: TypeAlias = "Primitive | ListShape | MessageDefinition"
"""The type of a field."""


class ServiceDefinition(Struct, frozen=True):
    """A service, with its name such as `std_srvs/srv/Trigger`."""

    name: str
    request: MessageDefinition
    response: MessageDefinition

    @staticmethod
    def of(
        name: str, request: tuple[tuple[str, FieldShape], ...], response: tuple[tuple[str, FieldShape], ...]
    ) -> ServiceDefinition:
        """Return a service without constants."""
        halves = MessageDefinition(f"{name}_Request", request), MessageDefinition(f"{name}_Response", response)
        return ServiceDefinition(name, *halves)


class ActionDefinition(Struct, frozen=True):
    """An action, with its name such as `control_msgs/action/FollowJointTrajectory`."""

    name: str
    goal: MessageDefinition
    result: MessageDefinition
    feedback: MessageDefinition

    @property
    def send_goal(self) -> ServiceDefinition:
        """The service that takes goals."""
        response = (("accepted", Primitive("bool")), ("stamp", TIME))
        return ServiceDefinition.of(f"{self.name}_SendGoal", (("goal_id", UUID), ("goal", self.goal)), response)

    @property
    def get_result(self) -> ServiceDefinition:
        """The service that answers once a goal is over."""
        response = (("status", Primitive("int8")), ("result", self.result))
        return ServiceDefinition.of(f"{self.name}_GetResult", (("goal_id", UUID),), response)

    @property
    def feedback_message(self) -> MessageDefinition:
        """What is sent on the topic of feedback."""
        return MessageDefinition(f"{self.name}_FeedbackMessage", (("goal_id", UUID), ("feedback", self.feedback)))


# definitions that nodes, services and actions need themselves

_DATA = {"String": "string", "Bool": "bool", "Int64": "int64", "Float64": "float64"}
STRING, BOOL, INT64, FLOAT64 = (
    MessageDefinition(f"std_msgs/msg/{name}", (("data", Primitive(data)),)) for name, data in _DATA.items()
)
_DONE: tuple[tuple[str, FieldShape], ...] = (("success", Primitive("bool")), ("message", Primitive("string")))
TRIGGER = ServiceDefinition.of("std_srvs/srv/Trigger", (), _DONE)
SET_BOOL = ServiceDefinition.of("std_srvs/srv/SetBool", (("data", Primitive("bool")),), _DONE)

TIME = MessageDefinition("builtin_interfaces/msg/Time", (("sec", Primitive("int32")), ("nanosec", Primitive("uint32"))))
UUID = MessageDefinition("unique_identifier_msgs/msg/UUID", (("uuid", ListShape(Primitive("uint8"), 16, True)),))
GOAL_INFO = MessageDefinition("action_msgs/msg/GoalInfo", (("goal_id", UUID), ("stamp", TIME)))
_STATUSES = ("UNKNOWN", "ACCEPTED", "EXECUTING", "CANCELING", "SUCCEEDED", "CANCELED", "ABORTED")
GOAL_STATUS = MessageDefinition(
    "action_msgs/msg/GoalStatus",
    (("goal_info", GOAL_INFO), ("status", Primitive("int8"))),
    tuple((f"STATUS_{name}", number) for number, name in enumerate(_STATUSES)),
)
GOAL_STATUS_ARRAY = MessageDefinition("action_msgs/msg/GoalStatusArray", (("status_list", ListShape(GOAL_STATUS)),))
CANCEL_GOAL = ServiceDefinition(
    "action_msgs/srv/CancelGoal",
    MessageDefinition("action_msgs/srv/CancelGoal_Request", (("goal_info", GOAL_INFO),)),
    MessageDefinition(
        "action_msgs/srv/CancelGoal_Response",
        (("return_code", Primitive("int8")), ("goals_canceling", ListShape(GOAL_INFO))),
        tuple(
            (f"ERROR_{name}", n) for n, name in enumerate(("NONE", "REJECTED", "UNKNOWN_GOAL_ID", "GOAL_TERMINATED"))
        ),
    ),
)

_GID = MessageDefinition("rmw_dds_common/msg/Gid", (("data", ListShape(Primitive("char"), 16, True)),))
_NODE = MessageDefinition(
    "rmw_dds_common/msg/NodeEntitiesInfo",
    (
        ("node_namespace", Primitive("string", 256)),
        ("node_name", Primitive("string", 256)),
        ("reader_gid_seq", ListShape(_GID)),
        ("writer_gid_seq", ListShape(_GID)),
    ),
)
PARTICIPANT_ENTITIES = MessageDefinition(
    "rmw_dds_common/msg/ParticipantEntitiesInfo", (("gid", _GID), ("node_entities_info_seq", ListShape(_NODE)))
)
"""What says which endpoints belong to which node; ids have 16 bytes from ROS 2 Iron on."""

KNOWN: dict[str, MessageDefinition | ServiceDefinition] = {
    known.name: known
    for known in (
        STRING, BOOL, INT64, FLOAT64, TRIGGER, SET_BOOL, TIME, UUID, GOAL_INFO, GOAL_STATUS, GOAL_STATUS_ARRAY,
        CANCEL_GOAL, PARTICIPANT_ENTITIES,
    )
}  # fmt: skip
"""The definitions that need no look-up, by their names."""
