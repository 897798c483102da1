"""The types of keys: scalars, lists and mappings of several sorts, and those that files of all sorts have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from msgspec import field

from scbm.cases.trace import End
from scbm.files.codec.keys import Data, DefaultKey, Definitions, Keys, KeyType, ShapeCheck, Spot
from scbm.files.codec.value_reader import Entry, ValueReader
from scbm.files.language.quantities import DURATION_PATTERN
from scbm.files.yaml.yaml_writer import FlowList, FlowMapping
from scbm.model import Slug
from scbm.model.durations import format_duration
from scbm.model.lazy_exports import load_named
from scbm.model.predicates import Predicate, Truth
from scbm.model.requirements import FORMS, RequirementForm
from scbm.model.values import Value, format_value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from scbm.files.language.scope import Where
    from scbm.files.yaml.document import YamlNode

T = TypeVar("T")
K = TypeVar("K", bound=Keys)

# sorts of types


class TextType(KeyType[T | None], Generic[T], frozen=True):
    """A type whose values are made of scalars; its value is `None` if it is wrong.

    Attributes:
        words: what the documentation calls it.
        expected: what messages call it.
        json: its JSON Schema.
    """

    words: str
    expected: str
    json: dict[str, Data]

    def schema(self, definitions: Definitions) -> dict[str, Data]:  # noqa: ARG002 - refers to no definition
        """Return the JSON Schema."""
        return dict(self.json)


class ScalarType(TextType[T], frozen=True):
    """A scalar: `reader` reads it from a node with this text, `writer` gives its data."""

    reader: Callable[[ValueReader, YamlNode, str], T | None]
    writer: Callable[[Any], Data] = lambda value: value

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note anything but a scalar."""
        if not spot.is_scalar:
            check.wrong_shape(spot, self.expected)

    def read(self, node: YamlNode, reader: ValueReader) -> T | None:
        """Return the value of a scalar."""
        return None if node.text is None or node.plain is None else self.reader(reader, node, node.text)

    def write(self, value: object) -> Data:
        """Return the scalar."""
        return self.writer(value)


class RequirementType(ScalarType[RequirementForm], frozen=True):
    """A requirement: its JSON Schema lists the forms that there are now."""

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema."""
        patterns = ", ".join(f"`{form.pattern}`" for form in FORMS.values())
        return {**super().schema(definitions), "description": f"{patterns}."}


class ScalarOrListType(TextType[T], frozen=True):
    """A scalar, or a list of scalars, each of which messages call `expected_element`."""

    expected_element: str
    reader: Callable[[ValueReader, YamlNode], T | None]
    writer: Callable[[Any], Data] = lambda value: value
    takes_scalar: ClassVar[bool] = True

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note everything but scalars in a list, and a scalar where only lists are accepted."""
        plain = spot.node.plain
        if not isinstance(plain, list) and not (self.takes_scalar and spot.is_scalar):
            remedy = f"write `[{plain}]`" if isinstance(plain, str) else None
            check.wrong_shape(spot, self.expected, remedy)
        for element in spot.elements():
            if not element.is_scalar:
                check.wrong_shape(element, self.expected_element)

    def read(self, node: YamlNode, reader: ValueReader) -> T | None:
        """Return the value of a list, or of a scalar where that is accepted."""
        is_scalar = self.takes_scalar and node.scalar is not None and node.plain is not None
        return self.reader(reader, node) if is_scalar or isinstance(node.plain, list) else None

    def write(self, value: object) -> Data:
        """Return the scalar or the list."""
        return self.writer(value)


class ScalarListType(ScalarOrListType[T], frozen=True):
    """A list of scalars."""

    takes_scalar = False


class MappingType(KeyType[K], frozen=True):
    """A mapping with known keys. Its value is the mapping bound to its node."""

    keys: type[K]
    words: str = "mapping"
    has_title: ClassVar[bool] = False

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Check the mapping."""
        self.keys.check(spot, check)

    def read(self, node: YamlNode, reader: ValueReader) -> K:
        """Bind the keys to the node."""
        return self.keys(node, reader)

    def write(self, value: object) -> Data:
        """Return the mapping as data."""
        return self.keys.write(value)

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Refer to the definition of the mapping."""
        return definitions.reference(self.keys)

    def mappings(self) -> tuple[type[Keys], ...]:
        """Return the mapping."""
        return (self.keys,)


class NamedMappingType(KeyType["Keys | None"], frozen=True):
    """A mapping whose keys a package beside the core declares, which is named as text: `package.module:Keys`."""

    place: str
    words: str = "mapping"
    has_title: ClassVar[bool] = False

    @property
    def keys(self) -> type[Keys]:
        """The declaration, whose module is imported now."""
        declared: type[Keys] = load_named(self.place)
        return declared

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Check the mapping."""
        self.keys.check(spot, check)

    def read(self, node: YamlNode, reader: ValueReader) -> Keys:
        """Bind the keys to the node."""
        return self.keys(node, reader)

    def write(self, value: object) -> Data:
        """Return the data of the mapping, which is kept as it was written."""
        return value

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Refer to the definition of the mapping."""
        return definitions.reference(self.keys)

    def mappings(self) -> tuple[type[Keys], ...]:
        """Return the mapping."""
        return (self.keys,)


class ScalarOrMappingType(MappingType[K], frozen=True):
    """A mapping, or a scalar that stands for one.

    Attributes:
        expected: what messages call it.
        json: the JSON Schema of the scalar.
        writer: the data; that of the mapping if it is `None`.
    """

    expected: str = ""
    json: dict[str, Data] = field(default_factory=dict)
    writer: Callable[[Any], Data] | None = None

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note a list, nothing, and what is wrong in a mapping."""
        if isinstance(spot.node.plain, dict):
            self.keys.check(spot, check)
        elif not spot.is_scalar:
            check.wrong_shape(spot, self.expected)

    def write(self, value: object) -> Data:
        """Return the scalar or the mapping."""
        return super().write(value) if self.writer is None else self.writer(value)

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the schema of both."""
        return {"anyOf": [self.json, super().schema(definitions)]}


class NamesType(KeyType[tuple[Entry[T], ...]], frozen=True):
    """A mapping from names to values of the type `inner`. `in_flow` decides whether its data is written on one line."""

    inner: KeyType[T]
    words: str
    in_flow: Callable[[dict[str, Data]], bool] = lambda _: False

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note anything but a mapping, and what is wrong with its values."""
        if not isinstance(spot.node.plain, dict):
            remedy = "write `{}` for none" if spot.node.plain is None else None
            check.wrong_shape(spot, "a mapping of names", remedy)
        for _, child in spot.entries():
            self.inner.check(child, check)

    def read(self, node: YamlNode, reader: ValueReader) -> tuple[Entry[T], ...]:
        """Return the entries, in the order of the file."""
        places = node.key_places
        return tuple(Entry(name, places[name], at, self.inner.read(at, reader)) for name, at in node.items.items())

    def write(self, value: object) -> Data:
        """Return a dictionary, or pairs, as a mapping."""
        pairs: Any = value.items() if isinstance(value, dict) else value
        written = {name: self.inner.write(part) for name, part in pairs}
        return FlowMapping(written) if self.in_flow(written) else written

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema."""
        return {"type": "object", "additionalProperties": self.inner.schema(definitions)}

    def mappings(self) -> tuple[type[Keys], ...]:
        """Return the mappings that the values may be."""
        return self.inner.mappings()


class MappingListType(KeyType[tuple[K, ...]], frozen=True):
    """A list of mappings with known keys."""

    keys: type[K]
    words: str

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note anything but a list, and what is wrong with its elements."""
        if not isinstance(spot.node.plain, list):
            check.wrong_shape(spot, "a list", "write `[]` for none" if spot.node.plain is None else None)
        for element in spot.elements():
            self.keys.check(element, check)

    def read(self, node: YamlNode, reader: ValueReader) -> tuple[K, ...]:
        """Bind the keys to each element."""
        return tuple(self.keys(element, reader) for element in node.elements)

    def write(self, value: object) -> Data:
        """Return the elements as data."""
        elements: Any = value
        return [self.keys.write(element) for element in elements]

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema."""
        return {"type": "array", "items": definitions.reference(self.keys)}

    def mappings(self) -> tuple[type[Keys], ...]:
        """Return the mapping of each element."""
        return (self.keys,)


# types that files of all sorts have in common

SCALAR_SCHEMA: dict[str, Any] = {"type": ["boolean", "integer", "string"]}
"""The JSON Schema of a value of a variable."""

_TEXTS: dict[str, Any] = {"type": "array", "items": {"type": "string"}}
PREDICATE_SCHEMA: dict[str, Any] = {
    "description": (
        "A predicate: `==`, `!=`, `&&`, `||`, `!`, `->`, `in {a, b}`, `<` and its like on integers, `true`, `false`. "
        "A list is the conjunction of its elements."
    ),
    "anyOf": [{"type": ["string", "boolean"]}, {"type": "array", "items": {"type": ["string", "boolean"]}}],
}
DURATION_SCHEMA: dict[str, Any] = {"type": "string", "pattern": DURATION_PATTERN}


def node_of(_: ValueReader, node: YamlNode) -> YamlNode:
    """Return the node itself: what it means depends on others."""
    return node


def scalar_node(_: ValueReader, node: YamlNode, text: str) -> YamlNode:
    """Return the node of a scalar: what it means depends on others."""
    del text
    return node


def predicate_data(predicate: Predicate) -> bool | str:
    """Return a predicate as it is written."""
    return predicate.truth if isinstance(predicate, Truth) else str(predicate)


def predicate_type(where: Where) -> ScalarOrListType[Predicate]:
    """Return the type of predicates that may read what can be read at such a place."""
    return ScalarOrListType(
        "predicate",
        "a predicate",
        PREDICATE_SCHEMA,
        "a predicate",
        lambda reader, node: reader.predicate(node, where),
        predicate_data,
    )


MODEL_NAME = ScalarType("name", "a name", {"type": "string"}, ValueReader.model_name)
CASE_NAME_TYPE = ScalarType("name", "a name", {"type": "string"}, ValueReader.case_name)
NAME_NODE = ScalarType("name", "a name", {"type": "string"}, scalar_node)
RESOURCE_NAME = ScalarType("resource", "a name", {"type": "string"}, ValueReader.resource)
VALUE = ScalarType("value", "a value", SCALAR_SCHEMA, scalar_node)
REQUIREMENT = RequirementType("requirement", "a requirement", {"type": "string"}, ValueReader.sentence, str)
COUNT = ScalarType("1 or more", "a whole number", {"type": "integer", "minimum": 1}, ValueReader.count)
REQUIREMENTS = NamesType(REQUIREMENT, "name → requirement")
_DURATION_HELP: dict[str, Any] = {
    **DURATION_SCHEMA,
    "description": "A number with a unit: `10 s`, `500 ms`, `2 minutes`.",
}
DURATION = ScalarType("duration", "a duration such as `10 s`", _DURATION_HELP, ValueReader.duration, format_duration)
TIME = ScalarType("duration", "a duration such as `10 s`", _DURATION_HELP, ValueReader.time, format_duration)
"""A duration in a case, where a negative one has an error of its own."""


def names_type(
    words: str, reader: Callable[[ValueReader, YamlNode], T | None], writer: Callable[[Any], object] = list
) -> ScalarListType[T]:
    """Return the type of lists of names, such as operations."""
    return ScalarListType(words, "a list of names", _TEXTS, "a name", reader, writer)


VARIABLES = names_type("list of variables", ValueReader.variables)

ACTIONS = ScalarListType(
    "list of actions",
    "a list of actions",
    {
        "type": "array",
        "items": {"type": "string"},
        "description": "`v <- value`, `v <- other`, and on integers `v += 1`, `v -= 1`; all at once.",
    },
    "an action",
    node_of,
    lambda actions: [str(action) for action in actions],
)


def _read_paths(_: ValueReader, node: YamlNode) -> tuple[YamlNode, ...]:
    return tuple(element for element in node.elements if element.text is not None)


INTERFACES: DefaultKey[tuple[YamlNode, ...]] = DefaultKey(
    names_type("list of paths", _read_paths, lambda paths: flow_list(map(str, paths))),
    "Where the types of bindings are found: folders with packages of ROS 2, packages, or files `.msg`, `.srv` and "
    "`.action`; relative to this file.",
    default=(),
)

_MAX_COLUMNS = 100
"""A list or a mapping on one line is about this long at most."""


def flow_list(words: Iterable[str]) -> list[Any]:
    """Return a list that is written on one line if it is short."""
    listed = list(words)
    return FlowList(listed) if sum(len(word) + 2 for word in listed) <= _MAX_COLUMNS else listed


def is_short(values: dict[str, Value]) -> bool:
    """Return whether a mapping of values fits one line."""
    return sum(len(name) + len(format_value(value)) + 4 for name, value in values.items()) <= _MAX_COLUMNS


# the ends of runs

_VERDICT_WORDS = tuple(end.value for end in End if end not in (End.LOST, End.IMPOSSIBLE))
"""How a run can be expected to end, and be recorded; a lost run has not ended."""

_FAULTS_OF_MODELS = (End.LIVELOCK.value, End.MODEL_ERROR.value)
_EXCUSING = tuple(word for word in _VERDICT_WORDS if word not in (End.REACHED.value, *_FAULTS_OF_MODELS))


def verdict_type(what: str) -> ScalarType[End]:
    """Return the type of the ends of runs, which messages call `what`."""

    def read(reader: ValueReader, node: YamlNode, text: str) -> End | None:
        word = reader.word(node, text, _VERDICT_WORDS, what)
        return None if word is None else End(word)

    return ScalarType("end of a run", "a verdict such as `reached`", {"enum": list(_VERDICT_WORDS)}, read, str)


def _read_may_end(reader: ValueReader, node: YamlNode) -> tuple[End, ...]:
    found: dict[str, None] = {}
    for element in node.elements:
        text = element.text
        if text is None or element.plain is None:
            continue
        if text in _FAULTS_OF_MODELS:
            message = f"`{text}` is an error of the model, which `may_end` cannot excuse"
            remedy = "correct the model; one case can expect this end with `verdict`"
            reader.add(Slug.CONTRADICTION, message, element.place, remedy)
        elif text in found:
            reader.add(Slug.DUPLICATE_VALUE, f"`{text}` is listed twice", element.place)
        elif reader.word(element, text, _EXCUSING, "an end that `may_end` can list") is not None:
            found[text] = None
    return tuple(map(End, found))


MAY_END = ScalarListType(
    "list of ends",
    "a list of ends",
    {"type": "array", "items": {"enum": list(_EXCUSING)}},
    "an end of a run",
    _read_may_end,
    lambda ends: flow_list(map(str, ends)),
)
MAY_END_HELP = "Ends that excuse a missed goal, such as `aborted`; not `livelock` and `model_error`."
