"""Names of topics and services, and their types: each as ROS 2 wants it, and one name with one type in a model.

Who uses which topic: one that carries requests or replies is used once in a cell.

A message of a driver does not say whom it is from. On a topic that two resources share each would hear what is meant
for the other, and a driver could not tell whose request it is asked.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.files.language.spelling import nearest, suggestion
from scbm.model import Place, Slug
from scbm.model.bindings import SET_BOOL, TRIGGER, FieldType, MessageType, ServiceType, TopicPair

if TYPE_CHECKING:
    from scbm.files.codec.common_parts import Parts
    from scbm.files.yaml.document import YamlNode
    from scbm.model.bindings import Binding

_MAX_CHARACTERS = 247
"""So long may a name be: 255 in DDS, and a prefix and a suffix of ROS 2."""

_CELLS = "scbm"
"""What the names of all topics begin with that the nodes of cells have for themselves."""

_NAME = re.compile(r"(/(?!\w*__)[A-Za-z_]\w*)+", re.ASCII)
_TYPE = re.compile(r"[a-z](_?[a-z0-9])*/srv/[A-Z][A-Za-z0-9]*", re.ASCII)
_FIELD = re.compile(r"[a-z](_?[a-z0-9])*", re.ASCII)
_KNOWN = {known.name: known for known in (TRIGGER, SET_BOOL)}


class RosNames:
    """Reads names and types, and knows which name has which type so far."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._types: dict[tuple[str, str], tuple[MessageType | ServiceType, str]] = {}

    # names

    def name(self, node: YamlNode | None) -> str | None:
        """The name of a topic or of a service."""
        if node is None or node.text is None or node.plain is None:
            return None
        if len(node.text) > _MAX_CHARACTERS:
            message = f"a name in ROS 2 has {_MAX_CHARACTERS} characters at most, and this one {len(node.text)}"
            self._parts.add(Slug.BAD_ROS_NAME, message, node.place)
        elif not _NAME.fullmatch(node.text):
            message = f"`{node.text}` is not a name in ROS 2" if node.text else "a name is missing"
            self._parts.add(Slug.BAD_ROS_NAME, message, node.place, _remedy(node.text))
        elif node.text.split("/")[1] == _CELLS:
            message = f"`{node.text}` is among the names of the nodes of cells, and no driver's"
            self._parts.add(Slug.BAD_BINDING, message, node.place, f"write a name that does not begin with `/{_CELLS}`")
        else:
            return node.text
        return None

    # types

    def message_type(self, node: YamlNode | None) -> MessageType | None:
        """The type of a measured topic."""
        if node is None or node.text is None or node.plain is None:
            return None
        known = [kind.value for kind in MessageType]
        if node.text in known:
            return MessageType(node.text)
        remedy = suggestion(node.text, known, "the types are")
        self._parts.add(Slug.BAD_ROS_TYPE, f"`{node.text}` is no type of measured topics", node.place, remedy)
        return None

    def service_type(self, node: YamlNode | None) -> ServiceType | None:
        """The type of a service, by its name or with its fields."""
        if node is None or node.plain is None:
            return None
        return self._described(node) if isinstance(node.plain, dict) else self._known(node)

    def _known(self, node: YamlNode) -> ServiceType | None:
        if node.text is None:
            return None
        if node.text in _KNOWN:
            return _KNOWN[node.text]
        near = nearest(node.text, _KNOWN)
        is_type = _TYPE.fullmatch(node.text) is not None
        described = (
            f"write `{{name: {node.text if is_type else '<package>/srv/<Type>'}, request: {{…}}, response: {{…}}}}`"
        )
        message = f"the fields of `{node.text}` are not known" if is_type else f"`{node.text}` is no type of services"
        self._parts.add(Slug.BAD_ROS_TYPE, message, node.place, f"did you mean `{near}`?" if near else described)
        return None

    def _described(self, node: YamlNode) -> ServiceType | None:
        named = node.get("name")
        request, response = self._fields(node.get("request")), self._fields(node.get("response"))
        if named is None or named.text is None or named.plain is None:
            return None
        if not _TYPE.fullmatch(named.text):
            remedy = "write a name such as `example_interfaces/srv/AddTwoInts`"
            self._parts.add(Slug.BAD_ROS_TYPE, f"`{named.text}` is no type of services", named.place, remedy)
            return None
        if request is None or response is None:
            return None
        described = ServiceType(named.text, request, response)
        if _KNOWN.get(named.text, described) != described:
            message = f"`{named.text}` has other fields than these"
            self._parts.add(Slug.BAD_ROS_TYPE, message, named.place, f"write `type: {named.text}`")
        else:
            self._note("type", described.name, described, named.place)
            return described
        return None

    def _fields(self, node: YamlNode | None) -> tuple[tuple[str, FieldType], ...] | None:
        """The fields of a request or of a response; `None` if one of them is wrong."""
        fields: list[tuple[str, FieldType]] = []
        if node is None:
            return ()
        known = [kind.value for kind in FieldType]
        for name, kind in node.items.items():
            if not _FIELD.fullmatch(name):
                how = "names of fields are words of small letters and digits, joined by `_`, such as `item_2`"
                self._parts.add(Slug.BAD_ROS_NAME, f"`{name}` is no name of a field", node.key_places[name], how)
            elif kind.text is not None and kind.plain is not None and kind.text not in known:
                remedy = suggestion(kind.text, known, "the types are")
                self._parts.add(Slug.BAD_ROS_TYPE, f"`{kind.text}` is no type of fields", kind.place, remedy)
            elif kind.text is not None and kind.text in known:
                fields.append((name, FieldType(kind.text)))
        is_whole = isinstance(node.plain, dict) and not node.incomplete and len(fields) == len(node.items)
        return tuple(fields) if is_whole else None

    # one name, one type

    def note_topic(self, name: str, kind: MessageType, place: Place) -> None:
        """A topic is used; complains if it is used with another type before."""
        self._note("topic", name, kind, place)

    def note_service(self, name: str, kind: ServiceType, place: Place) -> None:
        """A service is used; complains if it is used with another type before."""
        if self._types.get(("type", kind.name), (kind, ""))[0] == kind:
            self._note("service", name, kind, place)

    def know(self, resource: str, binding: Binding) -> None:
        """The topics and services of a binding that stands elsewhere."""
        where = f"for `{resource}`"
        for call in binding.calls:
            self._types.setdefault(("type", call.type.name), (call.type, where))
            self._types.setdefault(("service", call.name), (call.type, where))
        for name, kind in binding.topics():
            self._types.setdefault(("topic", name), (kind, where))

    def _note(self, what: str, name: str, kind: MessageType | ServiceType, place: Place) -> None:
        before, where = self._types.setdefault((what, name), (kind, f"in line {place.line}"))
        if before == kind:
            return
        if what == "type":
            message = f"`{name}` has other fields {where}"
        else:
            message = f"the {what} `{name}` is of type {_named(kind)} here, and of {_named(before)} {where}"
        self._parts.add(Slug.TYPES_DIFFER, message, place, f"a {what} has one type" if what != "type" else None)


def _named(kind: MessageType | ServiceType) -> str:
    return kind.name if isinstance(kind, ServiceType) else kind.value


def _remedy(written: str) -> str:
    levels = [re.sub(r"[^A-Za-z0-9]+", "_", level).strip("_") for level in written.split("/")]
    fixed = "".join(f"/{level}" for level in levels if level)
    if _NAME.fullmatch(fixed) and written.isascii():
        return f"write `{fixed}`"
    return "names are words behind slashes, such as `/scanner/scan`"


@dataclass(frozen=True, slots=True)
class _Use:
    """Where a topic is first used, and whether it carries requests or replies there."""

    where: str
    is_of_pair: bool


class TopicUses:
    """Notes topics, and complains of those that are shared and cannot be.

    Only topics of texts need be noted: others are of another type than requests and replies, which is told anyway.
    """

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._uses: dict[str, _Use] = {}

    def know(self, resource: str, binding: Binding) -> None:
        """The topics of a binding that stands elsewhere."""
        requests, where = binding.requests, f"for `{resource}`"
        pair = (requests.request, requests.reply) if isinstance(requests, TopicPair) else ()
        for name, kind in binding.topics():
            if kind is MessageType.STRING:
                self._uses.setdefault(name, _Use(where, name in pair))

    def note(self, name: str, place: Place, *, is_of_pair: bool) -> None:
        """A topic is used here."""
        before = self._uses.get(name)
        if before is None:
            self._uses[name] = _Use(f"in line {place.line}", is_of_pair)
        elif before.is_of_pair or is_of_pair:
            carries = "carries requests or replies" if before.is_of_pair else "is a measured topic"
            remedy = "what carries requests or replies carries nothing else: write a topic of its own"
            self._parts.add(Slug.BAD_BINDING, f"`{name}` {carries} {before.where}, too", place, remedy)
