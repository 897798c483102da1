"""The keys that say how measured data is read: which numbers or texts mean which value of a variable."""

from __future__ import annotations

import re
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

from scbm.files.codec.key_types import NAME_NODE, NamesType, ScalarOrMappingType, ScalarType, scalar_node
from scbm.files.codec.keys import DefaultKey, Key, Keys
from scbm.files.codec.ros_names import MESSAGE_TYPE, ROS_NAME, SharedNames
from scbm.files.language.scope import NAME
from scbm.files.spelling import suggestion
from scbm.files.yaml.yaml_writer import Quoted
from scbm.model import Place, Slug
from scbm.model.bindings import FieldType, Interval, MeasuredTopic, MessageType, Reading
from scbm.model.values import ValueKind, format_value
from scbm.model.variables import Role

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model.bindings import Scalar
    from scbm.model.resources import Resource
    from scbm.model.values import Value
    from scbm.model.variables import Variable

_END = r"[-+]?\d{1,30}(?:\.\d{1,30})?(?:e[-+]?\d{1,3})?"
_RANGE = re.compile(rf"({_END})?\s*\.\.\s*({_END})?", re.ASCII | re.IGNORECASE)
_WHOLE = re.compile(r"[-+]?\d+", re.ASCII)

SCALAR_OF_MESSAGE: dict[str, Any] = {"type": ["boolean", "number", "string"]}
"""The JSON Schema of the value of a field."""

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
_MEANT = ScalarType("value", "a value", SCALAR_OF_MESSAGE, scalar_node)


def literal_data(value: Scalar) -> Scalar:
    """Return a value as it is written: a text that is no plain word in quotes, as a driver may want any text."""
    return Quoted(value) if isinstance(value, str) and not NAME.fullmatch(value) else value


def read_variable_value(reader: ValueReader, text: str, variable: Variable | None, place: Place) -> Value | None:
    """Return the value of a variable that a key names."""
    if variable is None:
        return None
    values = {format_value(value): value for value in variable.domain.values}
    if text not in values:
        remedy = suggestion(text, values, "its values are") if variable.domain.kind is ValueKind.SYMBOL else None
        message = f"`{text}` is not a value of `{variable.name}`"
        reader.add(Slug.VALUE_OUTSIDE_DOMAIN, message, place, remedy or f"its domain is {variable.domain}")
    return values.get(text)


class ReadingKeys(Keys):
    """How measured data becomes a value. Without `ranges` and `values`, the data is the value itself."""

    ranges = Key(
        NamesType(_INTERVAL, "value → range"),
        "For numbers: the range that stands for each value. `low..high` is from `low` on and below "
        "`high`; either may be left out.",
        source=lambda measured: {format_value(value): interval for value, interval in measured.reading.ranges},
    )
    values = Key(
        NamesType(_MEANT, "text → value"),
        "For texts: the value that each text stands for.",
        source=lambda measured: {literal_data(text): value for text, value in measured.reading.texts},
    )

    def reading(self, name: str, resource: Resource, kind: FieldType, place: Place) -> Reading:
        """Return how data of a type becomes a value of a variable; valid only if no error is noted.

        Args:
            name: the name of the variable.
            resource: the resource that measures it.
            kind: the type of the data.
            place: where the name stands.
        """
        return self._reading(name, self._variable(name, resource, place), kind, place)

    def _reading(self, name: str, variable: Variable | None, kind: FieldType, place: Place) -> Reading:
        if not self.has("ranges") and not self.has("values") and variable is not None:
            self._refuse_unlike(variable, kind, place)
        if self.has("ranges") and not kind.is_number:
            self._refuse_words("`ranges` are for numbers", kind, self.place("ranges"))
        if self.has("values") and kind is not FieldType.STRING:
            self._refuse_words("`values` are for text", kind, self.place("values"))
        return Reading(name, tuple(self._ranges(variable, kind)), tuple(self._texts(variable)))

    def _variable(self, name: str, resource: Resource, place: Place) -> Variable | None:
        if name not in resource.measures:
            message = f"this resource does not measure `{name}`"
            remedy = suggestion(name, resource.measures, "it measures")
            remedy = remedy or f"add `measures: [{name}]` to the resource"
            self.reader.add(Slug.UNKNOWN_VARIABLE, message, place, remedy)
            return None
        return self.reader.scope.variables.get(name)

    def _refuse_unlike(self, variable: Variable, kind: FieldType, place: Place) -> None:
        """Note data that is no value of the variable by itself."""
        if kind.kind is variable.domain.kind:
            return
        message = f"`{variable.name}` has the domain {variable.domain}, and the data is {_words(kind)}"
        example = format_value(variable.domain.values[-1])
        if kind.is_number:
            remedy = f"say which numbers mean which value: `ranges: {{{example}: 5..}}`"
        elif kind is FieldType.STRING:
            remedy = f"say which text means which value: `values: {{<text>: {example}}}`"
        else:
            remedy = "measure a variable with the domain `bool`"
        self.reader.add(Slug.WRONG_TYPE, message, place, remedy)

    def _refuse_words(self, what: str, kind: FieldType, place: Place) -> None:
        self.reader.add(Slug.WRONG_TYPE, f"{what}, and the data is {_words(kind)}", place)

    # ranges

    def _ranges(self, variable: Variable | None, kind: FieldType) -> Iterator[tuple[Value, Interval]]:
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

    # texts

    def _texts(self, variable: Variable | None) -> Iterator[tuple[str, Value]]:
        self._refuse_none("values")
        for entry in (self.values or ()) if variable is not None else ():
            assert variable is not None  # noqa: S101 - without a variable, the loop has no entries
            value = self.reader.value(entry.node, variable.domain, variable.name, variable.domain.values)
            if value is not None:
                yield entry.name, value

    def _refuse_none(self, key: str) -> None:
        node = self.node.get(key)
        if node is not None and node.plain == {} and not node.incomplete:
            self.reader.add(Slug.EMPTY_DOMAIN, f"`{key}` has no entries, so no data has a value", node.place)


def _words(kind: FieldType) -> str:
    if kind.is_number:
        return f"a number ({kind})"
    return "text" if kind is FieldType.STRING else "a truth value"


class ResponseField(NamedTuple):
    """A field of a response, and how it is read."""

    field: str
    reading: Reading


class FieldReadingKeys(ReadingKeys):
    """A field of a response, and how it is read."""

    field = Key(NAME_NODE, "The name of the field.", required=True)

    @property
    def field_node(self) -> YamlNode | None:
        """The scalar that names the field; the node itself may be that."""
        return self.field if isinstance(self.node.plain, dict) else NAME_NODE.read(self.node, self.reader)


def _field_data(field: ResponseField) -> str | dict[str, Any]:
    is_plain = not field.reading.ranges and not field.reading.texts
    return field.field if is_plain else FieldReadingKeys.write(field)


FIELD_READING = ScalarOrMappingType(
    FieldReadingKeys,
    "field or reading",
    "a field, or a mapping such as `{field: distance, ranges: {near: ..0.5}}`",
    {"type": "string"},
    _field_data,
)


def _best_effort(reader: ValueReader, node: YamlNode, text: str) -> bool:
    if not isinstance(node.plain, bool):
        reader.add(Slug.WRONG_TYPE, f"`best_effort` must be true or false, not `{text}`", node.place)
    return node.plain is True


class MeasuredTopicKeys(ReadingKeys):
    """A topic with the values of one variable."""

    topic = Key(ROS_NAME, "The name of the topic, from the root: `/scanner/distance`.", required=True)
    type = Key(
        MESSAGE_TYPE,
        "The type of its messages: `std_msgs/msg/Bool`, `std_msgs/msg/Int64`, `std_msgs/msg/Float64` or "
        "`std_msgs/msg/String`.",
        required=True,
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
        kind, topic = self.type, self.topic
        if kind is None:
            return None
        self._note(topic, kind, shared)
        variable = self._changing(name, resource, place, unasked)
        return MeasuredTopic(topic or "", kind, self._reading(name, variable, kind.data, place), self.best_effort)

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

    def _note(self, topic: str | None, kind: MessageType, shared: SharedNames) -> None:
        if topic is None:
            return
        shared.note_topic(topic, kind, self.node.items["type"].place)
        if kind is MessageType.STRING:
            shared.note_use(topic, self.node.items["topic"].place, is_of_pair=False)
