"""Facts that do not change during runs: types with their objects, and tables over these."""

from __future__ import annotations

import re
from itertools import chain
from typing import TYPE_CHECKING

from msgspec import Struct, field

from scbm.files.expansion.stage_keys import shared_section
from scbm.files.language.grammar import QUANTIFIERS, keywords
from scbm.files.language.scope import name_fault
from scbm.files.spelling import nearest, suggestion
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.model import ObjectLists, Place

WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
"""The syntax of the names of types, tables, objects and parameters: without dots, which join ground names."""

_RANGE = re.compile(r"\s*(\d{1,9})\s*\.\.\s*(\d{1,9})\s*")

_NUMBER = re.compile(r"\d{1,9}", re.ASCII)

MAX_OBJECTS = 10_000
"""The maximum number of objects that the types of a file list: as many as an entry may have instances."""

MAX_TYPES = 200
"""The maximum number of types of a file; each may have the objects of all others."""

_TABLE_KEYS = ("of", "rows")

_SUFFIXES = ("state", "name")
"""The last parts of the names of variables that the runner keeps, such as `scan.state` and `current.name`."""


def integers_of(node: YamlNode) -> range | None:
    """Return the integers of a type that is a range, such as `1..4`; `None` for other types."""
    match = _RANGE.fullmatch(node.text or "")
    return None if match is None else range(int(match[1]), int(match[2]) + 1)


class ObjectTable(Struct, frozen=True):
    """A relation between objects.

    Attributes:
        name: its name.
        types: the types of its columns.
        rows: the objects for which it holds, as keys in the order of the file.
    """

    name: str
    types: tuple[str, ...]
    rows: Mapping[tuple[str, ...], None]


class StaticFacts(Struct, frozen=True):
    """The types and the tables of a model file.

    Attributes:
        types: the objects of each type in order: its own, then those of its subtypes.
        tables: the tables by name.
        places: where each object is first named.
        is_whole: whether all types could be read; if not, an unknown object is no error.
        misses_names: whether a section or a file could not be read; an unknown type or table is no error then.
        unread: the tables that could not be read; no use of them is an error.
        integers: the objects that are integers.
        own: the objects of each type without those of its subtypes.
        parents: the parent of each subtype.
    """

    types: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    tables: Mapping[str, ObjectTable] = field(default_factory=dict)
    places: Mapping[str, Place] = field(default_factory=dict)
    is_whole: bool = True
    misses_names: bool = False
    unread: Mapping[str, None] = field(default_factory=dict)
    integers: Mapping[str, None] = field(default_factory=dict)
    own: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    parents: Mapping[str, str] = field(default_factory=dict)

    def objects(self, kind: str) -> tuple[str, ...]:
        """Return the objects of a type; none for an unknown one."""
        return self.types.get(kind, ())

    def is_unread(self, kind: str) -> bool:
        """Return whether a type has no objects because of an error, which explains what follows from that."""
        return not self.objects(kind) and (not self.is_whole or kind not in self.types)

    def is_of_integers(self, kind: str) -> bool:
        """Return whether the objects of a type are integers."""
        return self.objects(kind)[:1] != () and self.objects(kind)[0].isdecimal()


def read_facts(document: YamlNode, report: ErrorCollector) -> StaticFacts:
    """Return the types and tables of a model file; note everything that is wrong with them."""
    types, tables = document.get("types"), document.get("tables")
    misses_names = document.incomplete or any(
        section is not None and (section.incomplete or not isinstance(section.plain, dict))
        for section in (types, tables)
    )
    misses_names = misses_names or any(shared_section(key) not in (None, key) for key in document.items)
    return _FactsReader(report, misses_names=misses_names).facts(types, tables)


class _FactsReader:
    def __init__(self, report: ErrorCollector, *, misses_names: bool) -> None:
        self._report = report
        self._misses_names = misses_names
        self._reserved = (*keywords(), *QUANTIFIERS)
        self._own: dict[str, dict[str, None]] = {}
        self._listed = 0
        self._members: dict[str, frozenset[str]] = {}
        self._parents: dict[str, str] = {}
        self._places: dict[str, Place] = {}
        self._unread: dict[str, None] = {}
        self._is_whole = True
        self._errors = len(report)

    def facts(self, types: YamlNode | None, tables: YamlNode | None) -> StaticFacts:
        named = self._entries(types, "types", "{zone: [a, b]}")
        rejected = self._rejected(types)  # so that their objects are checked, and uses of their names are no errors
        for name, node in chain(named, rejected.items()):
            if self._is_too_large(node, _key(types, name)):
                break
            self._read_type(name, node)
        self._check_parents(types)
        self._is_whole = len(self._report) == self._errors and not self._misses_names
        own = {name: tuple(listed) for name, listed in self._own.items()}
        objects = _with_subtypes(own, self._parents)
        self._members = {name: frozenset(found) for name, found in objects.items()}
        read: dict[str, ObjectTable] = {}
        for name, node in self._entries(tables, "tables", "{near: {of: [zone, zone], rows: [[a, b]]}}"):
            if name in objects:
                self._add(Slug.DUPLICATE_NAME, f"`{name}` is a type, and also a table", _key(tables, name))
            table = self._table(name, node, objects)
            if table is None:
                self._unread[name] = None
            else:
                read[name] = table
        return StaticFacts(
            objects,
            read,
            self._places,
            self._is_whole,
            self._misses_names,
            self._unread,
            _integers(objects),
            own,
            self._parents,
        )

    def _rejected(self, types: YamlNode | None) -> dict[str, YamlNode]:
        """Return the types that cannot have their names, which is noted with the other names."""
        entries = types.items.items() if types is not None else ()
        return {
            name: node
            for name, node in entries
            if name_fault(name) is not None or name in QUANTIFIERS or not WORD.fullmatch(name)
        }

    def _entries(self, section: YamlNode | None, key: str, example: str) -> Iterator[tuple[str, YamlNode]]:
        """Yield the entries of a section whose keys are names; note others."""
        if section is None:
            return
        if not isinstance(section.plain, dict):
            if not section.condemned:
                self._add(Slug.WRONG_SHAPE, f"`{key}` is a mapping of names", section.place, f"write `{example}`")
            return
        for name, node in section.items.items():
            if self._is_word(name, section.key_places[name], "a name here"):
                yield name, node

    def _is_word(self, text: str, place: Place, what: str) -> bool:
        if not WORD.fullmatch(text):
            message = f"`{text}` is not {what}"
            self._add(Slug.BAD_NAME, message, place, "write letters, digits and `_`, and begin with a letter")
        elif text in self._reserved:
            self._add(Slug.RESERVED_NAME, f"`{text}` is a reserved word", place, "choose another word")
        else:
            return True
        return False

    # types

    def _is_too_large(self, node: YamlNode, place: Place) -> bool:
        """Return whether a type is one too many, or lists too many objects, which is noted before they are read."""
        listed = node.get("objects") or node
        integers = integers_of(listed)
        self._listed += len(listed.elements)
        self._listed += 0 if integers is None else abs(integers.stop - integers.start)
        for count, most, noun in ((len(self._own) + 1, MAX_TYPES, "types"), (self._listed, MAX_OBJECTS, "objects")):
            if count > most:
                message = f"`types` lists more than {most:,} {noun}"
                self._add(Slug.TOO_MANY_INSTANCES, message, place, f"use fewer {noun}")
                self._misses_names = True
                return True
        return False

    def _read_type(self, name: str, node: YamlNode) -> None:
        self._own[name] = {}
        listed: YamlNode | None = node
        if isinstance(node.plain, dict):
            for key in node.items:
                if key not in ("objects", "of"):
                    remedy = suggestion(key, ("objects", "of"), "the keys here are")
                    self._add(Slug.UNKNOWN_KEY, f"unknown key `{key}`", node.key_places[key], remedy)
            listed = node.get("objects")
            parent = node.get("of")
            if parent is not None:
                self._read_parent(name, parent, node.key_places["of"])
        if listed is None or listed.condemned:
            return
        integers = integers_of(node)
        if integers is not None:
            self._own[name] = dict.fromkeys(map(str, integers or range(integers.stop - 1, integers.start + 1)))
            if not integers:  # uses of the integers that are meant are no further errors
                message = f"`{node.text}` has no integers"
                self._add(Slug.BAD_DOMAIN, message, node.place, "begin with the smaller number: `1..4`")
            return
        if not isinstance(listed.plain, list) or _numbers(listed):
            self._refuse_objects(name, listed)
            return
        for element in listed.elements:
            self._read_object(name, element)

    def _refuse_objects(self, name: str, listed: YamlNode) -> None:
        """Note what is neither a list of words nor a range; uses of integers that are meant are no further errors."""
        numbers = _numbers(listed) or integers_of(listed) or ()
        self._own[name] = dict.fromkeys(map(str, sorted(numbers)))
        message = f"the objects of `{name}` are a list of words, or a range of integers"
        remedy = f"write `{name}: [a, b]`, or `{name}: 1..4` for integers"
        if numbers:
            remedy = f"write `{name}: {min(numbers)}..{max(numbers)}`"
        self._add(Slug.WRONG_SHAPE, message, listed.place, remedy)

    def _read_parent(self, name: str, parent: YamlNode, place: Place) -> None:
        if parent.text and parent.plain is not None:
            self._parents[name] = parent.text
        elif not parent.condemned:
            message = f"a type is part of one other type, and `of` in `{name}` names none"
            self._add(Slug.WRONG_SHAPE, message, place, "write the name of one type: `of: robot`")

    def _read_object(self, name: str, element: YamlNode) -> None:
        text = element.text
        if element.condemned:
            return
        if not text or element.plain is None:
            self._add(Slug.WRONG_SHAPE, "an object is a word", element.place, "write for example `[a, b]`")
        elif text in _SUFFIXES:
            message = f"`{text}` ends the names of variables that the runner keeps, such as `scan.{text}`"
            self._add(Slug.RESERVED_NAME, message, element.place, "choose another word")
        elif text in self._own[name]:
            self._add(Slug.DUPLICATE_VALUE, f"`{text}` is listed twice", element.place)
        elif self._is_word(text, element.place, "an object: their names join to ground names"):
            self._own[name][text] = None
            self._places.setdefault(text, element.place)

    def _check_parents(self, types: YamlNode | None) -> None:
        """Note unknown parents and types that are subtypes of themselves; leave both parents out."""
        for name, parent in list(self._parents.items()):
            place = types.items[name].items["of"].place if types is not None else None
            if place is not None and parent not in self._own:
                remedy = suggestion(parent, [other for other in self._own if other != name], "the types are")
                if not self._misses_names:
                    self._add(Slug.UNKNOWN_TYPE, f"there is no type `{parent}`", place, remedy)
                del self._parents[name]
            elif place is not None and name in (chain := self._ancestors(name)):
                shown = " of ".join(f"`{one}`" for one in (name, *chain))
                self._add(
                    Slug.TYPE_CYCLE, f"a type cannot be a subtype of itself: {shown}", place, "leave out one `of`"
                )
                del self._parents[name]

    def _ancestors(self, name: str) -> list[str]:
        """Return the parent of a type, its parent and so on; up to the first that repeats."""
        found: dict[str, None] = {}
        parent = self._parents.get(name)
        while parent is not None and parent not in found:
            found[parent] = None
            parent = self._parents.get(parent)
        return list(found)

    # tables

    def _table(self, name: str, node: YamlNode, objects: Mapping[str, tuple[str, ...]]) -> ObjectTable | None:
        """Return a table; `None` if its types or its rows are no lists, which is noted."""
        types, rows = node.get("of"), node.get("rows")
        for key in node.items:
            if key not in _TABLE_KEYS:
                remedy = suggestion(key, _TABLE_KEYS, "the keys here are")
                self._add(Slug.UNKNOWN_KEY, f"unknown key `{key}`", node.key_places[key], remedy)
        if not _is_list(types) or not _is_list(rows):
            if not node.condemned and not self._has_misspelt_key(node):
                message = f"the table `{name}` needs its types under `of`, and a list of `rows`"
                remedy = f"write `{name}: {{of: [zone, zone], rows: [[a, b]]}}`"
                self._add(Slug.WRONG_SHAPE, message, node.place, remedy)
            return None
        assert types is not None  # noqa: S101 - a list
        assert rows is not None  # noqa: S101 - a list
        kinds = [element.text or "" for element in types.elements]
        for kind, element in zip(kinds, types.elements, strict=True):
            if kind not in objects and not element.condemned and not self._misses_names:
                remedy = suggestion(kind, objects, "the types are")
                self._add(Slug.UNKNOWN_TYPE, f"there is no type `{kind}`", element.place, remedy)
        places: dict[tuple[str, ...], Place] = {}
        for node_of_row in rows.elements:
            row = self._row(name, node_of_row, kinds, objects)
            if row is not None and row in places:
                self._refuse_row(name, row, node_of_row.place, places[row])
            elif row is not None:
                places[row] = node_of_row.place
        return ObjectTable(name, tuple(kinds), dict.fromkeys(places))

    def _has_misspelt_key(self, table: YamlNode) -> bool:
        """Return whether an unknown key, which is noted, probably means a key of tables that is missing."""
        missing = [key for key in _TABLE_KEYS if key not in table.items]
        return any(nearest(key, _TABLE_KEYS) in missing for key in table.items if key not in _TABLE_KEYS)

    def _refuse_row(self, name: str, row: tuple[str, ...], place: Place, first: Place) -> None:
        """Note a row that is listed twice."""
        message = f"the row `{', '.join(row)}` of `{name}` is listed twice, first in line {first.line}"
        self._add(Slug.DUPLICATE_VALUE, message, place, "remove one of them")

    def _row(
        self, name: str, row: YamlNode, kinds: list[str], objects: Mapping[str, tuple[str, ...]]
    ) -> tuple[str, ...] | None:
        """Return a row; a table of one column may list its objects without brackets."""
        cells = row.elements if isinstance(row.plain, list) else [row]
        if len(cells) != len(kinds):
            found = f"{len(cells)} object{'s' if len(cells) != 1 else ''}"
            message = f"a row of `{name}` has {len(kinds)} objects ({', '.join(kinds)}), and this has {found}"
            self._add(Slug.WRONG_ROW, message, row.place)
            return None
        is_right = True
        for cell, kind in zip(cells, kinds, strict=True):
            if cell.condemned:
                is_right = False
            elif kind in objects and cell.text not in self._members[kind] and self._is_whole:
                remedy = suggestion(cell.text or "", objects[kind], "its objects are")
                message = f"`{cell.text}` is not an object of the type `{kind}`"
                self._add(Slug.UNKNOWN_OBJECT, message, cell.place, remedy)
                is_right = False
        return tuple(cell.text or "" for cell in cells) if is_right else None

    def _add(self, slug: Slug, message: str, place: Place, remedy: str | None = None) -> None:
        self._report.add(slug, message, place, remedy)


def _numbers(listed: YamlNode) -> list[int]:
    """Return the elements of a list that has whole numbers alone; none for another list."""
    texts = [element.text or "" for element in listed.elements]
    return [int(text) for text in texts] if all(_NUMBER.fullmatch(text) for text in texts) else []


def _is_list(node: YamlNode | None) -> bool:
    return node is not None and isinstance(node.plain, list)


def _key(section: YamlNode | None, name: str) -> Place:
    assert section is not None  # noqa: S101 - it has an entry with this name
    return section.key_places[name]


def _with_subtypes(own: Mapping[str, Iterable[str]], parents: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Return the objects of each type: its own, then those of its subtypes in the order of the file."""
    subtypes: dict[str, list[str]] = {name: [] for name in own}
    for name in own:
        if name in parents:
            subtypes[parents[name]].append(name)
    found: dict[str, tuple[str, ...]] = {}
    for name in own:
        objects: dict[str, None] = {}
        open_types = [name]
        while open_types:
            other = open_types.pop()
            objects |= dict.fromkeys(own[other])
            open_types += reversed(subtypes[other])
        found[name] = tuple(objects)
    return found


def facts_of(objects: ObjectLists, place: Place) -> StaticFacts:
    """Return the types and the tables of a model whose file is not at hand.

    Args:
        objects: the objects and tables of the model.
        place: where its objects count as named.
    """
    own, parents = dict(objects.types), dict(objects.parents)
    types = _with_subtypes(own, parents)
    tables = {name: ObjectTable(name, columns, dict.fromkeys(rows)) for name, columns, rows in objects.tables}
    places = {name: place for _, names in objects.types for name in names}
    return StaticFacts(types, tables, places, integers=_integers(types), own=own, parents=parents)


def _integers(types: Mapping[str, tuple[str, ...]]) -> dict[str, None]:
    return {each: None for objects in types.values() for each in objects if each.isdecimal()}


def joined(names: Iterable[str]) -> str:
    """Return the objects of a choice as they end a ground name: `.r1.a.b`."""
    return "".join(f".{name}" for name in names)
