"""The keys that say how fields of messages are read: which numbers or texts mean which value of a variable."""

from __future__ import annotations

import re
from math import isfinite
from typing import TYPE_CHECKING

from scbm.files.codec.key_types import NAME_NODE, NamesType, ScalarOrMappingType, ScalarType, scalar_node
from scbm.files.codec.keys import DefaultKey, Key, Keys
from scbm.files.spelling import suggestion
from scbm.model import Place, Slug
from scbm.model.values import format_value
from scbm.model.variables import Role
from scbm.nodes.bindings.field_values import (
    CONTENT,
    FieldReader,
    key_node,
    kind_of_values,
    read_variable_value,
)
from scbm.nodes.bindings.ros_binding import Interval, MeasuredTopic, Reading
from scbm.nodes.bindings.ros_names import ROS_NAME
from scbm.nodes.bindings.type_names import TYPE_NAME
from scbm.nodes.types.definitions import STRING, Primitive

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model.resources import Resource
    from scbm.model.values import Value
    from scbm.model.variables import Variable
    from scbm.nodes.bindings.ros_names import SharedNames
    from scbm.nodes.types.definitions import MessageDefinition, Scalar
    from scbm.nodes.types.field_paths import FieldPath

_END = r"[-+]?\d{1,30}(?:\.\d{1,30})?(?:e[-+]?\d{1,3})?"
_RANGE = re.compile(rf"({_END})?\s*\.\.\s*({_END})?", re.ASCII | re.IGNORECASE)
_WHOLE = re.compile(r"[-+]?\d+", re.ASCII)

_INTERVAL = ScalarType(
    "range",
    "a range such as `0.5..2`",
    {
        "type": "string",
        "description": "`low..high`, from `low` on and below `high`; either may be left out.",
        "pattern": r"\.\.",
    },
    scalar_node,
    str,
)


class ReadingKeys(Keys):
    """How a field becomes a value. Without `ranges` and `values`, the field has the value itself."""

    ranges = Key(
        NamesType(_INTERVAL, "value → range"),
        "For numbers: the range that stands for each value. `low..high` is from `low` on and below "
        "`high`; either may be left out.",
    )
    values = Key(
        NamesType(CONTENT, "value of the field → value"),
        "For texts, whole numbers and truth values: the value that each stands for. A constant of the message is "
        "written by its name.",
    )

    def reading(  # noqa: PLR0913 - a variable, a field, and their places
        self,
        name: str,
        resource: Resource,
        path: FieldPath,
        fields: FieldReader,
        place: Place,
        *,
        is_published: bool = False,
    ) -> Reading:
        """Return how a field of a reply becomes a value of a variable; valid only if no error is noted.

        Args:
            name: the name of the variable.
            resource: the resource that measures it.
            path: the field.
            fields: reads fields of the same message.
            place: where the name stands.
            is_published: whether the field comes without a request, as in feedback.
        """
        variable = self._variable(name, resource, place, is_published=is_published)
        return self._reading(name, variable, path, fields, place)

    def _reading(
        self, name: str, variable: Variable | None, path: FieldPath, fields: FieldReader, place: Place
    ) -> Reading:
        kind = path.shape
        assert isinstance(kind, Primitive)  # noqa: S101 - only such paths are read
        if not self.has("ranges") and not self.has("values") and variable is not None:
            self._refuse_unlike(variable, kind, place)
        if self.has("ranges") and not kind.is_number:
            self._refuse_words("`ranges` are for numbers", kind, self.place("ranges"))
        if self.has("values") and kind.is_float:
            self._refuse_words("`values` are for texts and whole numbers", kind, self.place("values"))
        if self.has("ranges") and self.has("values"):
            message, remedy = "a field has `ranges` or `values`, and this has both", "keep one of them"
            self.reader.add(Slug.BAD_BINDING, message, self.place("values"), remedy)
        return Reading(name, path, tuple(self._ranges(variable, kind)), tuple(self._meanings(variable, path, fields)))

    def _variable(self, name: str, resource: Resource, place: Place, *, is_published: bool) -> Variable | None:
        word, names = ("publish", resource.publishes) if is_published else ("measure", resource.measures)
        if name not in names:
            message = f"this resource does not {word} `{name}`"
            remedy = suggestion(name, names, f"it {word}es" if is_published else "it measures")
            remedy = remedy or f"add `{'publishes' if is_published else 'measures'}: [{name}]` to the resource"
            self.reader.add(Slug.UNKNOWN_VARIABLE, message, place, remedy)
            return None
        return self.reader.scope.variables.get(name)

    def _refuse_unlike(self, variable: Variable, kind: Primitive, place: Place) -> None:
        """Note data that is no value of the variable by itself."""
        if kind_of_values(kind) is variable.domain.kind:
            return
        message = f"`{variable.name}` has the domain {variable.domain}, and the data is {_words(kind)}"
        example = format_value(variable.domain.values[-1])
        if kind.is_number:
            remedy = f"say which numbers mean which value: `ranges: {{{example}: 5..}}`"
        elif kind.name == "string":
            remedy = f"say which text means which value: `values: {{<text>: {example}}}`"
        else:
            remedy = "measure a variable with the domain `bool`"
        self.reader.add(Slug.WRONG_TYPE, message, place, remedy)

    def _refuse_words(self, what: str, kind: Primitive, place: Place) -> None:
        self.reader.add(Slug.WRONG_TYPE, f"{what}, and the data is {_words(kind)}", place)

    # ranges

    def _ranges(self, variable: Variable | None, kind: Primitive) -> Iterator[tuple[Value, Interval]]:
        self._refuse_none("ranges")
        before: list[tuple[str, Interval]] = []
        for entry in self.ranges or ():
            value = read_variable_value(self.reader, entry.name, variable, entry.place)
            interval = None if entry.value is None else self._interval(entry.value, whole=not kind.is_float)
            if interval is None:
                continue
            other = next((other for other, earlier in before if earlier.overlaps(interval)), None)
            if other is not None:
                message = f"the ranges of `{other}` and `{entry.name}` overlap"
                remedy = "the end of a range does not belong to it, so the next one may begin there"
                self.reader.add(Slug.BAD_RANGE, message, entry.node.place, remedy)
            before.append((entry.name, interval))
            if value is not None:
                yield value, interval

    def _interval(self, node: YamlNode, *, whole: bool) -> Interval | None:
        match = _RANGE.fullmatch(node.text or "")
        if match is None:
            remedy = "write `0.5..2`, `..0.5` or `2..`"
            self.reader.add(Slug.BAD_RANGE, f"`{node.text}` is not a range", node.place, remedy)
            return None
        ends = [end for end in match.groups() if end is not None]
        huge = next((end for end in ends if not isfinite(float(end))), None)
        if huge is not None:
            self.reader.add(Slug.BAD_RANGE, f"`{huge}` is larger than any number of a message", node.place)
            return None
        odd = next((end for end in ends if whole and not _WHOLE.fullmatch(end)), None)
        if odd is not None:
            message = f"`{odd}` is not a whole number, and the data consists of whole numbers"
            self.reader.add(Slug.BAD_RANGE, message, node.place)
            return None
        low, high = (None if end is None else int(end) if whole else float(end) for end in match.groups())
        interval = Interval(low, high)
        if interval.is_empty:
            message = f"no number lies in {node.text}: it begins with {match[1]} and ends before {match[2]}"
            self.reader.add(Slug.BAD_RANGE, message, node.place)
            return None
        return interval

    # texts and whole numbers

    def _meanings(
        self, variable: Variable | None, path: FieldPath, fields: FieldReader
    ) -> Iterator[tuple[Scalar, Value]]:
        self._refuse_none("values")
        seen: dict[Scalar, str] = {}
        for entry in self.values or ():
            read = fields.value(key_node(entry, path.shape), path, path.shape)
            value = None
            if variable is not None:
                value = self.reader.value(entry.node, variable.domain, variable.name, variable.domain.values)
            if read is not None and seen.setdefault(read, entry.name) != entry.name:
                message = f"`{entry.name}` is the same value of the field as `{seen[read]}`"
                self.reader.add(Slug.DUPLICATE_VALUE, message, entry.place)
            if read is not None and value is not None:
                yield read, value

    def _refuse_none(self, key: str) -> None:
        node = self.node.get(key)
        if node is not None and node.plain == {} and not node.incomplete:
            self.reader.add(Slug.EMPTY_DOMAIN, f"`{key}` has no entries, so no data has a value", node.place)


def _words(kind: Primitive) -> str:
    if kind.is_number:
        return f"a number ({kind})"
    return "text" if kind.name == "string" else "a truth value"


class FieldReadingKeys(ReadingKeys):
    """A field of a response, and how it is read."""

    field = Key(NAME_NODE, "The path to the field.", required=True)

    @property
    def field_node(self) -> YamlNode | None:
        """The scalar that names the field; the node itself may be that."""
        return self.field if isinstance(self.node.plain, dict) else NAME_NODE.read(self.node, self.reader)


FIELD_READING = ScalarOrMappingType(
    FieldReadingKeys,
    "field or reading",
    "a field, or a mapping such as `{field: distance, ranges: {near: ..0.5}}`",
    {"type": "string"},
)


def _best_effort(reader: ValueReader, node: YamlNode, text: str) -> bool:
    if not isinstance(node.plain, bool):
        reader.add(Slug.WRONG_TYPE, f"`best_effort` must be true or false, not `{text}`", node.place)
    return node.plain is True


class MeasuredTopicKeys(ReadingKeys):
    """A topic with the values of one variable."""

    topic = Key(ROS_NAME, "The name of the topic, from the root: `/scanner/distance`.", required=True)
    type = Key(TYPE_NAME, "The type of its messages, such as `sensor_msgs/msg/JointState`.", required=True)
    field = Key(
        NAME_NODE,
        "The path to the field. A message with one field that is a number, a truth value or a text needs none.",
    )
    best_effort = DefaultKey(
        ScalarType("`true` or `false`", "`true` or `false`", {"type": "boolean"}, _best_effort),
        "Whether publishers with best-effort reliability are accepted, as for sensor data.",
        default=False,
        source="is_best_effort",
    )

    def measured(
        self, name: str, resource: Resource, place: Place, shared: SharedNames, unasked: tuple[str, ...]
    ) -> MeasuredTopic | None:
        """Return the topic of a variable; `None` if its type is wrong.

        Args:
            name: the name of the variable.
            resource: the resource that the binding is for.
            place: where the name stands.
            shared: the names of topics and services so far.
            unasked: the variables that the resource publishes, and those that the environment changes.
        """
        named, topic = self.type, self.topic
        kind = None if named is None else shared.message(named)
        if kind is None:
            return None
        self._note(topic, kind, shared)
        variable = self._changing(name, resource, place, unasked)
        fields = FieldReader(self.reader, kind, f"`{kind}`")
        path = self._path(kind, fields)
        if path is None:
            return None
        reading = self._reading(name, variable, path, fields, place)
        return MeasuredTopic(topic or "", kind, reading, self.best_effort)

    def _path(self, kind: MessageDefinition, fields: FieldReader) -> FieldPath | None:
        """Return the path to the field; `None` if it is wrong."""
        if self.has("field"):
            return None if self.field is None else fields.leaf(self.field.text or "", self.field.place)
        place = self.node.items["type"].place
        if len(kind.fields) == 1 and isinstance(kind.fields[0][1], Primitive):
            return fields.leaf(kind.fields[0][0], place)
        remedy = f"its fields are: {', '.join(name for name, _ in kind.fields)}"
        self.reader.add(Slug.MISSING_KEY, f"`field` is missing: `{kind}` has more than one value", place, remedy)
        return None

    def _changing(self, name: str, resource: Resource, place: Place, unasked: tuple[str, ...]) -> Variable | None:
        """Return the variable of a name; report one whose values come only with replies."""
        variable = self.reader.scope.variables.get(name)
        if name in unasked:
            return variable
        if name in resource.measures:
            message = f"`{resource.name}` measures `{name}` in replies only, and a topic sends values without request"
            remedy = f"add `publishes: [{name}]` to the resource"
        elif variable is not None and variable.role is Role.DECLARED:
            message = f"no topic can measure `{name}`: it is no input, and `{resource.name}` does not publish it"
            remedy = f"add `publishes: [{name}]` to the resource, or `source: input` to the variable"
        else:
            message = f"`{resource.name}` does not publish `{name}`"
            known = [known for known in unasked if known in self.reader.scope.variables]
            remedy = suggestion(name, known, "it publishes") or "add `publishes: [...]` to the resource"
        self.reader.add(Slug.UNKNOWN_VARIABLE, message, place, remedy)
        return None

    def _note(self, topic: str | None, kind: MessageDefinition, shared: SharedNames) -> None:
        if topic is None:
            return
        shared.note("topic", topic, kind, self.node.items["type"].place)
        if kind == STRING:
            shared.note_use(topic, self.node.items["topic"].place, is_of_pair=False)
