"""Names of topics and services in ROS 2, their types, and how the resources of a model share them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from scbm.files.codec.key_types import NamesType, ScalarOrMappingType, ScalarType, scalar_node
from scbm.files.codec.keys import Key, Keys
from scbm.files.spelling import nearest, suggestion
from scbm.model import Place, Slug
from scbm.model.bindings import SET_BOOL, TRIGGER, FieldType, MessageType, ServiceType

if TYPE_CHECKING:
    from scbm.files.codec.value_reader import Entry, ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model.bindings import Binding

_MAX_CHARACTERS = 247
"""The maximum length of a name: 255 in DDS, less a prefix and a suffix of ROS 2."""

_RESERVED = "scbm"
"""The first word of all topics of the nodes themselves; drivers cannot use it."""

_NAME = re.compile(r"(/(?!\w*__)[A-Za-z_]\w*)+", re.ASCII)
_TYPE = re.compile(r"[a-z](_?[a-z0-9])*/srv/[A-Z][A-Za-z0-9]*", re.ASCII)
_FIELD = re.compile(r"[a-z](_?[a-z0-9])*", re.ASCII)
_KNOWN = {known.name: known for known in (TRIGGER, SET_BOOL)}


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


# types


def _message_type(reader: ValueReader, node: YamlNode, text: str) -> MessageType | None:
    known = [kind.value for kind in MessageType]
    if text in known:
        return MessageType(text)
    remedy = suggestion(text, known, "the types are")
    reader.add(Slug.BAD_ROS_TYPE, f"`{text}` is no type of measured topics", node.place, remedy)
    return None


def _refuse_service_type(reader: ValueReader, node: YamlNode, text: str) -> None:
    """Note that a service type without its fields is unknown."""
    near = nearest(text, _KNOWN)
    is_type = _TYPE.fullmatch(text) is not None
    described = f"write `{{name: {text if is_type else '<package>/srv/<Type>'}, request: {{…}}, response: {{…}}}}`"
    message = f"the fields of `{text}` are not known" if is_type else f"`{text}` is no type of services"
    reader.add(Slug.BAD_ROS_TYPE, message, node.place, f"did you mean `{near}`?" if near else described)


def _enumeration(values: list[str]) -> dict[str, Any]:
    return {"enum": values}


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
MESSAGE_TYPE = ScalarType(
    "type of message",
    "a type such as `std_msgs/msg/Bool`",
    _enumeration([kind.value for kind in MessageType]),
    _message_type,
    lambda kind: kind.value,
)
_FIELD_TYPE = ScalarType(
    "type of field",
    "a type such as `int64`",
    _enumeration([kind.value for kind in FieldType]),
    scalar_node,
    lambda kind: kind.value,
)
_TYPE_NAME = ScalarType("type of service", "a name", {"type": "string"}, scalar_node)


class ServiceTypeKeys(Keys):
    """A type of services, with its fields in their order."""

    name = Key(_TYPE_NAME, "The name of the type: `example_interfaces/srv/AddTwoInts`.", required=True)
    request = Key(NamesType(_FIELD_TYPE, "field → type of field"), "The fields of requests.")
    response = Key(NamesType(_FIELD_TYPE, "field → type of field"), "The fields of responses.")

    def service_type(self, shared: SharedNames) -> ServiceType | None:
        """Return the type that a name or a mapping describes; note one that differs from another of this name."""
        node = self.node
        if not isinstance(node.plain, dict):
            if node.text is not None and node.plain is not None and node.text not in _KNOWN:
                _refuse_service_type(self.reader, node, node.text)
            return None if node.plain is None else _KNOWN.get(node.text or "")
        request, response = self._fields("request", self.request), self._fields("response", self.response)
        named = self.name
        if named is None or named.text is None:
            return None
        if not _TYPE.fullmatch(named.text):
            remedy = "write a name such as `example_interfaces/srv/AddTwoInts`"
            self.reader.add(Slug.BAD_ROS_TYPE, f"`{named.text}` is no type of services", named.place, remedy)
            return None
        if request is None or response is None:
            return None
        described = ServiceType(named.text, request, response)
        if _KNOWN.get(named.text, described) == described:
            shared.note_type(described, named.place)
            return described
        message = f"`{named.text}` has other fields than these"
        self.reader.add(Slug.BAD_ROS_TYPE, message, named.place, f"write `type: {named.text}`")
        return None

    def _fields(
        self, key: str, entries: tuple[Entry[YamlNode | None], ...] | None
    ) -> tuple[tuple[str, FieldType], ...] | None:
        """Return the fields of a request or of a response; `None` if one of them is wrong."""
        node = self.node.get(key)
        if node is None or entries is None:
            return ()
        fields: list[tuple[str, FieldType]] = []
        known = [kind.value for kind in FieldType]
        for entry in entries:
            text = entry.value.text if entry.value is not None else None
            if not _FIELD.fullmatch(entry.name):
                how = "names of fields are words of small letters and digits, joined by `_`, such as `item_2`"
                self.reader.add(Slug.BAD_ROS_NAME, f"`{entry.name}` is no name of a field", entry.place, how)
            elif text is not None and text not in known:
                remedy = suggestion(text, known, "the types are")
                self.reader.add(Slug.BAD_ROS_TYPE, f"`{text}` is no type of fields", entry.node.place, remedy)
            elif text is not None:
                fields.append((entry.name, FieldType(text)))
        is_whole = isinstance(node.plain, dict) and not node.incomplete and len(fields) == len(entries)
        return tuple(fields) if is_whole else None


def _service_type_data(kind: ServiceType) -> str | dict[str, Any]:
    return kind.name if kind in _KNOWN.values() else ServiceTypeKeys.write(kind)


SERVICE_TYPE = ScalarOrMappingType(
    ServiceTypeKeys,
    f"`{TRIGGER.name}`, `{SET_BOOL.name}`, or a mapping",
    f"`{TRIGGER.name}`, `{SET_BOOL.name}`, or a mapping with `name`, `request` and `response`",
    _enumeration(list(_KNOWN)),
    _service_type_data,
)


# names that resources share


class _TopicUse(Struct, frozen=True):
    """The first use of a topic: its place, if that is in this file, and whether it carries requests or replies."""

    where: str
    is_of_pair: bool
    place: Place | None = None


class SharedNames:
    """The topics, services and types of all bindings of a model, and errors about those that contradict each other.

    One name has one type in a model. A topic that carries requests or replies is used once: a message of a driver does
    not say where it comes from, so on a shared topic each resource would take what is meant for the other one.
    """

    def __init__(self, reader: ValueReader) -> None:
        self._reader = reader
        self._types: dict[tuple[str, str], tuple[MessageType | ServiceType, str]] = {}
        self._uses: dict[str, _TopicUse] = {}

    def include(self, resource: str, binding: Binding) -> None:
        """Include the names of a binding that stands elsewhere."""
        where = f"for `{resource}`"
        for call in binding.calls:
            self._types.setdefault(("type", call.type.name), (call.type, where))
            self._types.setdefault(("service", call.name), (call.type, where))
        pair = () if binding.requests is None else binding.requests.topics
        for name, kind in binding.topics():
            self._types.setdefault(("topic", name), (kind, where))
            if kind is MessageType.STRING:
                self._uses.setdefault(name, _TopicUse(where, name in pair))

    def note_topic(self, name: str, kind: MessageType, place: Place) -> None:
        """Note a topic; an error if it has another type elsewhere."""
        self._note("topic", name, kind, place)

    def note_service(self, name: str, kind: ServiceType, place: Place) -> None:
        """Note a service; an error if it has another type elsewhere."""
        if self._types.get(("type", kind.name), (kind, ""))[0] == kind:
            self._note("service", name, kind, place)

    def note_type(self, kind: ServiceType, place: Place) -> None:
        """Note a type of services; an error if it has other fields elsewhere."""
        self._note("type", kind.name, kind, place)

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

    def _note(self, what: str, name: str, kind: MessageType | ServiceType, place: Place) -> None:
        before, where = self._types.setdefault((what, name), (kind, f"in line {place.line}"))
        if before == kind:
            return
        if what == "type":
            message = f"`{name}` has other fields {where}"
        else:
            message = f"the {what} `{name}` is of type {_named(kind)} here, and of {_named(before)} {where}"
        self._reader.add(Slug.TYPES_DIFFER, message, place, f"a {what} has one type" if what != "type" else None)


def _named(kind: MessageType | ServiceType) -> str:
    return kind.name if isinstance(kind, ServiceType) else kind.value
