"""Declarations of the keys of files: type, help text, default and source.

Each key is declared once, and all that is known of it comes from that declaration.

A subclass of `Keys` declares one sort of mapping: an operation, a case, the network of a case. Each of its keys is a
`Key` with a type, a help text and, where it has one, a default. From this come

- the shape check, which notes unknown keys, missing keys and values of the wrong YAML sort (`check_shape`),
- reading: an instance is bound to a node, and its attributes are the values of the keys,
- writing: `Keys.write` gives the data of a value,
- the JSON Schema for editors (`json_schema`), and the tables of the documentation (`key_table`).

Reading accepts trees of any shape, and passes over what the shape check reports: one error never hides another.
"""

from __future__ import annotations

import json
import re
from abc import abstractmethod
from inspect import cleandoc
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeAlias, TypeVar, overload

from msgspec import Struct

from scbm.files.spelling import nearest, suggestion
from scbm.files.yaml.yaml_writer import FlowMapping
from scbm.model import Place, Slug
from scbm.model.struct_classes import AbstractStruct

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import Plain, YamlNode
    from scbm.files.yaml.error_collector import ErrorCollector

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
Data: TypeAlias = Any
"""The written form of a value: scalars, lists and mappings, as in YAML and JSON."""


# the shape check


class Spot(Struct, frozen=True):
    """A node under check, and how messages locate it.

    Attributes:
        node: the node.
        place: its key, which is found more easily than what stands behind the key; else the node itself.
        section: the last key on the way to the node; `None` for the whole file.
        is_element: whether the node is an element of a list.
    """

    node: YamlNode
    place: Place
    section: str | None = None
    is_element: bool = False

    @property
    def shown(self) -> str:
        """The words of messages for the node."""
        return f"this element of `{self.section}`" if self.is_element else f"`{self.section}`"

    @property
    def is_scalar(self) -> bool:
        """Whether the node is a scalar with a value."""
        return self.node.plain is not None and not isinstance(self.node.plain, (dict, list))

    def entries(self) -> Iterable[tuple[str, Spot]]:
        """Yield the entries of a mapping, by key."""
        for key, node in self.node.items.items():
            yield key, Spot(node, self.node.key_places[key], key)

    def elements(self) -> Iterable[Spot]:
        """Return the elements of a list."""
        return (Spot(element, element.place, self.section, is_element=True) for element in self.node.elements)


class ShapeCheck:
    """Notes deviations from the declared keys in a report."""

    def __init__(self, report: ErrorCollector, owners: Sequence[tuple[type[Keys], str]]) -> None:
        """Made once for a file.

        Args:
            report: where errors go.
            owners: mappings of such a file and what messages call them: an unknown key may belong to one of these.
        """
        self._report = report
        self._owners = owners

    def wrong_shape(self, spot: Spot, expected: str, remedy: str | None = None) -> None:
        """Note that a node has the wrong YAML sort, unless an error of its own explains that."""
        if not spot.node.condemned:
            where = f" under `{spot.section}`" if spot.section is not None else ""
            message = f"expected {expected}, found {_found(spot.node.plain)}{where}"
            is_cut = any(_QUANTIFIER.search(key) for key in spot.node.items)
            remedy = remedy or (_CUT if is_cut else None)
            self._report.add(Slug.WRONG_SHAPE, message, spot.place, remedy)

    def unknown_key(self, key: str, place: Place, known: Sequence[str]) -> None:
        """Note an unknown key. One that belongs elsewhere shows that a line above it is lost or badly indented."""
        remedy = _with_colon(key, known) or suggestion(key, known, "the keys here are")
        owner = next((called for keys, called in self._owners if key in keys.declared), None)
        if owner is not None and nearest(key, known) is None:
            remedy = f"`{key}` belongs to {owner}; the keys here are: {', '.join(known)}"
        self._report.add(Slug.UNKNOWN_KEY, f"unknown key `{key}`", place, remedy)

    def missing_key(self, key: str, spot: Spot, known: Sequence[str]) -> None:
        """Note a missing key, unless the mapping has an unknown one that probably means it."""
        if spot.node.condemned or spot.node.incomplete:
            return
        if all(nearest(other, known) != key for other in spot.node.items if other not in known):
            whose = f" in {spot.shown}" if spot.section is not None else ""
            self._report.add(Slug.MISSING_KEY, f"`{key}` is missing{whose}", spot.place)


_QUANTIFIER = re.compile(r"\b(?:forall|exists|count|sum|min|max)\s+\w+\Z", re.ASCII)
"""The beginning of a text with a quantifier, up to the colon that makes it a key of YAML."""

_CUT = "write `in` for the colon, or put the whole text into quotes"

_KEY_AND_VALUE = re.compile(r"(\w+)(?:\s*[=:]\s*|\s+(?=[\d.]))(\S.*)")
"""A key with its value, but without the colon and the blank that YAML needs: `loss=10 %`, `loss:10 %`, `loss 10 %`."""


def _with_colon(key: str, known: Sequence[str]) -> str | None:
    """Return the remedy for a text that is a known key and its value; `None` for any other text."""
    match = _KEY_AND_VALUE.fullmatch(key)
    meant = nearest(match[1], known) if match is not None else None
    return None if match is None or meant is None else f"write `{meant}: {match[2]}`"


def check_shape(
    document: YamlNode, report: ErrorCollector, root: type[Keys], owners: Sequence[tuple[type[Keys], str]]
) -> None:
    """Note every unknown key, every missing key, and every value of the wrong YAML sort."""
    root.check(Spot(document, document.place), ShapeCheck(report, owners))


def _found(value: Plain) -> str:
    match value:
        case None:
            return "nothing"
        case dict():
            return "a mapping"
        case list():
            return "a list"
        case _:
            return f"`{str(value).lower() if isinstance(value, bool) else str(value)[:40]}`"


# keys


class Definitions:
    """The mappings that a JSON Schema refers to."""

    def __init__(self) -> None:
        self._schemas: dict[str, dict[str, Data]] = {}

    def reference(self, keys: type[Keys]) -> dict[str, Data]:
        """Return a reference to the schema of a mapping."""
        title = keys.title()
        if title not in self._schemas:
            self._schemas[title] = {}  # so that a mapping may contain itself
            self._schemas[title] = {**keys.schema(self), "title": title, "description": cleandoc(keys.__doc__ or "")}
        return {"$ref": f"#/$defs/{title}"}

    def sorted(self) -> dict[str, dict[str, Data]]:
        """Return the schemas by name."""
        return {title: self._schemas[title] for title in sorted(self._schemas)}


class KeyType(Struct, Generic[T_co], frozen=True, metaclass=AbstractStruct):
    """The type of the value under a key.

    Attributes:
        has_title: whether its JSON Schema gets a title.
    """

    has_title: ClassVar[bool] = True

    @property
    @abstractmethod
    def words(self) -> str:
        """The words of the documentation for it; subclasses have them as a field."""

    @abstractmethod
    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note everything that has the wrong YAML sort."""

    @abstractmethod
    def read(self, node: YamlNode, reader: ValueReader) -> T_co:
        """Return the value; `None` if it is wrong, for which an error is noted here or by the shape check."""

    @abstractmethod
    def write(self, value: object) -> Data:
        """Return the value as data."""

    @abstractmethod
    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema."""

    def mappings(self) -> tuple[type[Keys], ...]:
        """Return the mappings with known keys that may stand there."""
        return ()


class Key(Generic[T]):
    """One key of a mapping. As an attribute of `Keys` it is the value in the file; `None` if absent or wrong."""

    def __init__(  # noqa: PLR0913 - the declaration of a key is one call
        self,
        kind: KeyType[T | None],
        help_text: str = "",
        *,
        default: T | None = None,
        required: bool = False,
        name: str = "",
        absent: str = "",
        shown: Data = None,
        source: str | Callable[[Any], object] | None = None,
        always_written: bool = False,
    ) -> None:
        """Declare a key.

        Args:
            kind: what stands under it.
            help_text: what it means; one sentence or more for editors and for the documentation.
            default: its value where it is absent or wrong.
            required: whether it must be there.
            name: its name, if that is not the name of the attribute.
            absent: what the documentation says of a file without it.
            shown: the default as the JSON Schema and the documentation show it, if `default` is none.
            source: the attribute of the value that is written, with dots, or a function of it; by default its name.
            always_written: whether it is written even where it says no more than its default.
        """
        self.kind = kind
        self.help_text = help_text
        self.default = default
        self.required = required
        self.name = name
        self.absent = absent
        self.shown = shown
        self.always_written = always_written or required
        self._attribute = ""
        self._source: Callable[[Any], object] | None = attrgetter(source) if isinstance(source, str) else source

    def __set_name__(self, owner: type, attribute: str) -> None:
        """Take the name of the attribute."""
        self._attribute = attribute
        self.name = self.name or attribute
        self._source = self._source or attrgetter(attribute)

    @overload
    def __get__(self, keys: None, owner: type) -> Self: ...
    @overload
    def __get__(self, keys: Keys, owner: type) -> T | None: ...
    def __get__(self, keys: Keys | None, owner: type) -> Self | T | None:
        """Return the value in the file, or the declaration itself if asked of the class."""
        if keys is None:
            return self
        node = keys.node.get(self.name)
        value = None if node is None else self.kind.read(node, keys.reader)
        value = self.default if value is None else value
        vars(keys)[self._attribute] = value  # found there from now on, so that a key is read once
        return value

    def entry(self, value: object) -> dict[str, Data]:
        """Return the key with its data, or nothing if `value` says no more than the default."""
        part = self._source(value) if self._source is not None else None
        if part is None:
            return {}
        data = self.kind.write(part)
        says_nothing = not self.always_written and (part == self.default or data in ({}, []))
        return {} if says_nothing else {self.name: data}

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema of the value, with help, default and title."""
        schema = self.kind.schema(definitions)
        schema |= {"description": self.help_text} if self.help_text else {}
        if self._written_default is not None:
            schema["default"] = self._written_default
        return schema | ({"title": self.name.replace("_", " ").title()} if self.kind.has_title else {})

    @property
    def _written_default(self) -> Data:
        return self.shown if self.default in (None, ()) else self.kind.write(self.default)

    def row(self) -> str:
        """Return the row of the key in a Markdown table: name, type, default, help."""
        absent = "required" if self.required else self.absent
        if not absent and self._written_default is not None:
            absent = f"`{json.dumps(self._written_default)}`".replace('"', "")
        cells = (f"`{self.name}`", self.kind.words, absent or "none", self.help_text or self.kind.words)
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


class DefaultKey(Key[T]):
    """A key with a default, which is its value where it is absent or wrong."""

    @overload
    def __get__(self, keys: None, owner: type) -> Self: ...
    @overload
    def __get__(self, keys: Keys, owner: type) -> T: ...
    def __get__(self, keys: Keys | None, owner: type) -> Self | T:
        """Return the value in the file, or the declaration itself if asked of the class."""
        value = super().__get__(keys, owner) if keys is not None else self
        assert value is not None  # noqa: S101 - the default is not
        return value


class Keys:
    """A mapping with known keys, bound to the node where it stands. Each subclass declares one sort of mapping.

    Attributes:
        declared: the keys by name, in the order in which they are written.
        in_flow: whether such a mapping is written on one line.
        node: where the mapping stands; of any shape.
        reader: reads the values, and has the report and the names in scope.
    """

    declared: ClassVar[Mapping[str, Key[Any]]] = {}
    in_flow: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        """Collect the keys of the class, its own first, then inherited ones; a class may give `declared` itself."""
        if "declared" in vars(cls):
            return
        own = {part.name: part for part in vars(cls).values() if isinstance(part, Key)}
        cls.declared = {**own, **cls.declared}

    def __init__(self, node: YamlNode, reader: ValueReader) -> None:
        self.node = node
        self.reader = reader

    def place(self, key: str) -> Place:
        """Return where a key stands that is there."""
        return self.node.key_places[key]

    def has(self, key: str) -> bool:
        """Return whether a key is there."""
        return key in self.node.items

    def value_of(self, key: str) -> Any:  # noqa: ANN401 - keys have values of many types
        """Return the value of a declared key, as its attribute does."""
        return self.declared[key].__get__(self, type(self))

    @property
    def is_clear(self) -> bool:
        """Whether no other key is there than the declared ones: an unknown key may mean one that seems missing."""
        is_whole = isinstance(self.node.plain, dict) and not self.node.incomplete
        return is_whole and self.node.items.keys() <= self.declared.keys()

    @classmethod
    def check(cls, spot: Spot, check: ShapeCheck) -> None:
        """Note unknown keys, missing keys and everything of the wrong YAML sort."""
        known = list(cls.declared)
        if not isinstance(spot.node.plain, dict):
            check.wrong_shape(spot, "a mapping", f"its keys are: {', '.join(known)}")
            return
        children = dict(spot.entries())
        for name, key in cls.declared.items():
            if name in children:
                key.kind.check(children[name], check)
            elif key.required:
                check.missing_key(name, spot, known)
        for name, child in children.items():
            if name not in cls.declared and not child.node.condemned:
                check.unknown_key(name, child.place, known)

    @classmethod
    def write(cls, value: object) -> dict[str, Data]:
        """Return the data of a value: every key that says more than its default."""
        written = {name: data for key in cls.declared.values() for name, data in key.entry(value).items()}
        return FlowMapping(written) if cls.in_flow else written

    @classmethod
    def schema(cls, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema of the mapping."""
        required = [key.name for key in cls.declared.values() if key.required]
        return {
            "type": "object",
            "additionalProperties": False,
            "properties": {name: key.schema(definitions) for name, key in cls.declared.items()},
            **({"required": required} if required else {}),
        }

    @classmethod
    def title(cls) -> str:
        """Return what the JSON Schema calls the mapping; published schemas have these names."""
        return f"{cls.__name__.removesuffix('Keys')}File"
