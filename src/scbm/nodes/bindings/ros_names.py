"""Names of topics and services in ROS 2, and how the resources of a model share them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.files.codec.key_types import ScalarType
from scbm.model import Place, Slug
from scbm.nodes.bindings.type_names import look_up
from scbm.nodes.types.definitions import STRING

if TYPE_CHECKING:
    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.nodes.bindings.ros_binding import RosBinding
    from scbm.nodes.types.definitions import ActionDefinition, MessageDefinition, ServiceDefinition
    from scbm.nodes.types.type_library import TypeLibrary

    _Definition: TypeAlias = MessageDefinition | ServiceDefinition | ActionDefinition

_MAX_CHARACTERS = 247
"""The maximum length of a name: 255 in DDS, less a prefix and a suffix of ROS 2."""

_RESERVED = "scbm"
"""The first word of all topics of the nodes themselves; drivers cannot use it."""

_NAME = re.compile(r"(/(?!\w*__)[A-Za-z_]\w*)+", re.ASCII)


# names


def read_ros_name(reader: ValueReader, node: YamlNode, text: str) -> str | None:
    """Return the name of a topic or of a service."""
    if len(text) > _MAX_CHARACTERS:
        message = f"a name in ROS 2 has {_MAX_CHARACTERS} characters at most, and this one {len(text)}"
        reader.add(Slug.BAD_ROS_NAME, message, node.place)
    elif not _NAME.fullmatch(text):
        message = f"`{text}` is not a name in ROS 2" if text else "a name is missing"
        reader.add(Slug.BAD_ROS_NAME, message, node.place, _remedy(text))
    elif text.split("/")[1] == _RESERVED:
        message = f"names below `/{_RESERVED}` are reserved for the nodes of scbm, and this is `{text}`"
        reader.add(Slug.BAD_BINDING, message, node.place, f"write a name that does not begin with `/{_RESERVED}`")
    else:
        return text
    return None


def _remedy(written: str) -> str:
    levels = [re.sub(r"[^A-Za-z0-9]+", "_", level).strip("_") for level in written.split("/")]
    fixed = "".join(f"/{level}" for level in levels if level)
    if _NAME.fullmatch(fixed) and written.isascii():
        return f"write `{fixed}`"
    return "names are words behind slashes, such as `/scanner/scan`"


ROS_NAME = ScalarType(
    "name in ROS 2",
    "a name such as `/scanner/scan`",
    {
        "type": "string",
        "description": "A name of ROS 2, from the root.",
        "pattern": r"^(?!/scbm(/|$))(/[A-Za-z_][A-Za-z0-9_]*)+$",
    },
    read_ros_name,
)

# names that resources share


class _TopicUse(Struct, frozen=True):
    """The first use of a topic: its place, if that is in this file, and whether it carries requests or replies."""

    where: str
    is_of_pair: bool
    place: Place | None = None


class SharedNames:
    """The topics and services of all bindings of a model, and errors about those that contradict each other.

    One name has one type in a model. A topic that carries requests or replies is used once: a message of a driver does
    not say where it comes from, so on a shared topic each resource would take what is meant for the other one.
    """

    def __init__(self, reader: ValueReader, library: TypeLibrary) -> None:
        self._reader = reader
        self._library = library
        self._types: dict[tuple[str, str], tuple[_Definition, str]] = {}
        self._uses: dict[str, _TopicUse] = {}

    def message(self, node: YamlNode) -> MessageDefinition | None:
        """Return the message that a scalar names; `None` after an error."""
        return look_up(self._reader, node, self._library.message)

    def service(self, node: YamlNode) -> ServiceDefinition | None:
        """Return the service that a scalar names; `None` after an error."""
        return look_up(self._reader, node, self._library.service)

    def action(self, node: YamlNode) -> ActionDefinition | None:
        """Return the action that a scalar names; `None` after an error."""
        return look_up(self._reader, node, self._library.action)

    def include(self, resource: str, binding: RosBinding) -> None:
        """Include the names of a binding that stands elsewhere."""
        where = f"for `{resource}`"
        for call in binding.calls:
            self._types.setdefault(("service", call.name), (call.type, where))
        for action in () if binding.requests is None else binding.requests.actions:
            self._types.setdefault(("action", action.name), (action.type, where))
        pair = () if binding.requests is None else binding.requests.topics
        for name, kind in binding.topics():
            self._types.setdefault(("topic", name), (kind, where))
            if kind == STRING:
                self._uses.setdefault(name, _TopicUse(where, name in pair))

    def note_use(self, name: str, place: Place, *, is_of_pair: bool) -> None:
        """Note a use of a topic of texts; an error if it is shared and cannot be.

        Topics of other types need not be noted: their type differs from that of requests and replies, an error anyway.
        """
        before = self._uses.get(name)
        if before is None:
            self._uses[name] = _TopicUse(f"in line {place.line}", is_of_pair, place)
        elif before.is_of_pair or is_of_pair:
            carries = "carries requests or replies" if before.is_of_pair else "is a measured topic"
            remedy = "a topic of requests or replies carries nothing else: name another topic"
            if before.place == place:
                message = f"several resources that are written here have the topic `{name}` for requests or replies"
                remedy = "write a topic for each: `{r}` in it stands for the object of a parameter `r`"
                self._reader.add(Slug.BAD_BINDING, message, place, remedy)
                return
            self._reader.add(Slug.BAD_BINDING, f"`{name}` {carries} {before.where}, too", place, remedy)

    def note(self, what: str, name: str, kind: _Definition, place: Place) -> None:
        """Note a `topic`, `service` or `action`; an error if it has another type elsewhere."""
        before, where = self._types.setdefault((what, name), (kind, f"in line {place.line}"))
        if before == kind:
            return
        there = f"of {before.name}" if before.name != kind.name else "of a type of this name with other fields"
        message = f"the {what} `{name}` is of type {kind.name} here, and {there} {where}"
        self._reader.add(Slug.TYPES_DIFFER, message, place, f"a {what} has one type")
