"""A YAML text as a tree of nodes with places, down to the character inside a scalar.

Files contain only data: no tags, no merge keys, no types of Python, one document. A violation of these rules is noted,
and the rest is read nevertheless. A text that is not YAML raises `InputError`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct, field
from ruamel.yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    CollectionStartEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceEndEvent,
    StreamEndEvent,
)

from scbm.files.spelling import nearest
from scbm.files.yaml.cut_values import folded, may_be_cut, quoted, uncut_end
from scbm.files.yaml.source_text import Scalar, SourceText
from scbm.files.yaml.yaml_events import MAX_DEPTH, MAX_NODES, events_of, too_many_nodes
from scbm.model import Place, Slug

if TYPE_CHECKING:
    from ruamel.yaml.events import Event

    from scbm.files.yaml.error_collector import ErrorCollector

MAX_USED_NODES = 5_000
"""Nodes below aliases whose errors name the alias. A file with more of them would take seconds to copy: its further
errors name only the text at the anchor."""

Plain: TypeAlias = "bool | int | float | str | list[Plain] | dict[str, Plain] | None"

_NULL = re.compile(r"|~|null|Null|NULL")
_BOOLEAN = re.compile(r"true|True|TRUE|false|False|FALSE")
_INTEGER = re.compile(r"[-+]?[0-9]{1,100}")
_FLOAT = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
"""The scalars of YAML's core schema, without those that no key accepts: `0x1F` and `.inf` are texts here."""

_PROPERTY = re.compile(r"[&!]\S*(?:\s|#[^\r\n]*)*")
"""An anchor or a tag, with everything up to the next one or the content."""
_TAG = re.compile(r"(?:&\S*\s+)?(!\S*)")
_ANCHOR_NAME = re.compile(r"[\w-]+")

_Start: TypeAlias = ScalarEvent | CollectionStartEvent
"""The event that begins a node; an alias has an event of its own."""


class YamlNode(Struct):
    """One node of a document.

    Attributes:
        plain: the data of the node in Python: dictionaries, lists, strings, numbers, booleans, `None`.
        place: where the node begins.
        scalar: the text of a scalar, and where in the source each character of it is.
        items: the children of a mapping by key.
        key_places: where the keys of a mapping stand.
        value_ends: where in the text the value of each key ends; for an alias, where the alias ends.
        elements: the children of a sequence.
        size: the number of nodes in this subtree.
        condemned: whether an error is noted already that explains everything else that is wrong with the node.
        incomplete: whether entries of a mapping are missing, for which an error is noted: a key is no name, or a part
            of the model could not be read.
        end: where in the text the node ends.
        origin: the name of the lifted entry that an expanded entry of a section comes from; `None` if there is none.
        written: the lifted entry with its parameters, such as `move[r in robot]`; empty if there is none.
        user: where the model file uses the part that an entry of a section comes from; `None` for its own entries.
        flattens: whether the elements of a list of predicates are parts of one conjunction: `a && b` among them is no
            conjunction of its own. Only expanded guards do that.
    """

    plain: Plain
    place: Place
    scalar: Scalar | None = None
    items: dict[str, YamlNode] = field(default_factory=dict)
    key_places: dict[str, Place] = field(default_factory=dict)
    value_ends: dict[str, int] = field(default_factory=dict)
    elements: list[YamlNode] = field(default_factory=list)
    size: int = 1
    condemned: bool = False
    incomplete: bool = False
    end: int = 0
    origin: str | None = None
    user: Place | None = None
    flattens: bool = False
    written: str = ""

    @property
    def text(self) -> str | None:
        """The text of a scalar, whatever type it has in YAML."""
        return None if self.scalar is None else self.scalar.text

    def get(self, key: str) -> YamlNode | None:
        """Return the child under a key; `None` if the node is no mapping or lacks the key."""
        return self.items.get(key)

    def add_entries(self, other: YamlNode) -> None:
        """Add the entries of the second occurrence of a section, so that both occurrences are read."""
        for key, child in other.items.items():
            if key not in self.items and isinstance(self.plain, dict):
                self.items[key] = child
                self.key_places[key] = other.key_places[key]
                self.value_ends[key] = other.value_ends[key]
                self.plain[key] = child.plain

    def used_at(self, user: Place, levels: int = MAX_DEPTH) -> YamlNode:
        """Return the same tree, whose places name where it is used.

        Args:
            user: the alias, the use of a part, or the word that an argument stands for.
            levels: the levels of the tree that change; what is deeper has no meaning in any file.
        """
        if not levels:
            return self
        return YamlNode(
            self.plain,
            self.place.used_at(user),
            None if self.scalar is None else self.scalar.used_at(lambda: user),
            {key: child.used_at(user, levels - 1) for key, child in self.items.items()},
            {key: place.used_at(user) for key, place in self.key_places.items()},
            self.value_ends.copy(),
            [element.used_at(user, levels - 1) for element in self.elements],
            self.size,
            self.condemned,
            self.incomplete,
            self.end,
            self.origin,
            self.user,
            self.flattens,
            self.written,
        )

    def at(self, path: tuple[int | str, ...]) -> YamlNode:
        """Return the node at the end of a path, or the last existing one on the way."""
        node = self
        for step in path:
            if isinstance(step, int) and step < len(node.elements):
                node = node.elements[step]
            elif isinstance(step, str) and step in node.items:
                node = node.items[step]
            else:
                break
        return node


def read_document(source: SourceText, report: ErrorCollector, noun: str = "model") -> YamlNode | None:
    """Return the tree of a YAML text; `None` for an empty text. Note in `report` what `noun` files do not allow.

    Raises:
        InputError: the text is not YAML, or it is larger or deeper than the limits.
    """
    return _Reader(source, report, noun).document()


class _Reader:
    """Builds the tree from the events of the YAML parser; an alias counts as its whole anchored subtree."""

    def __init__(self, source: SourceText, report: ErrorCollector, noun: str) -> None:
        self._noun = noun
        self._source = source
        self._report = report
        self._events = events_of(source)
        self._anchors: dict[str, YamlNode | None] = {}
        self._count = 0
        self._used = 0  # nodes below aliases
        self._uncut_end = 0  # where the last value was meant to end that a comma cuts
        self._end = 0  # of what was read last: a block ends with its last child, not before the next key

    def document(self) -> YamlNode | None:
        """Return the first document."""
        root: YamlNode | None = None
        for event in self._events:
            if isinstance(event, DocumentStartEvent) and root is not None:
                message = f"a second document begins here, and a {self._noun} file is one"
                place = self._source.place(event.start_mark.index, 3)
                self._report.add(Slug.YAML_SYNTAX, message, place, "leave out the `---`, or write two files")
                return root
            if isinstance(event, NodeEvent):
                root = self._node(event)
            if isinstance(event, StreamEndEvent):
                break
        return root

    def _node(self, event: Event) -> YamlNode:
        begin = event.start_mark.index
        if isinstance(event, AliasEvent):
            return self._alias(event)
        assert isinstance(event, (ScalarEvent, CollectionStartEvent))  # noqa: S101 - the parser says so
        self._add_to_count(1, begin)
        if event.anchor is not None:
            self._anchors[event.anchor] = None  # until it is complete: it cannot stand inside itself
        node = self._content(event)
        node.end = self._end
        if event.tag is not None:
            self._refuse_tag(event, node)
        if event.anchor is not None:
            self._anchors[event.anchor] = node
            self._refuse_odd_anchor(event, node)
        return node

    def _content(self, event: _Start) -> YamlNode:
        begin = self._content_begin(event)
        if isinstance(event, ScalarEvent):
            self._note_end(event)
            return self._scalar(event, begin)
        place = self._source.place(begin)
        if isinstance(event, MappingStartEvent):
            return self._mapping(place)
        elements = []
        while not isinstance(child := self._next_child(), SequenceEndEvent):
            elements.append(self._node(child))
        self._note_end(child)
        size = 1 + sum(element.size for element in elements)
        return YamlNode([element.plain for element in elements], place, elements=elements, size=size)

    def _content_begin(self, event: _Start) -> int:
        """Return where the content of a node begins, after its anchor and its tag."""
        index: int = event.start_mark.index
        for written in (event.anchor, event.tag):
            match = _PROPERTY.match(self._source.text, index)
            if written is not None and match is not None:
                index = match.end()
        return min(index, event.end_mark.index) if isinstance(event, ScalarEvent) else index

    def _scalar(self, event: ScalarEvent, begin: int) -> YamlNode:
        text, end = str(event.value), event.end_mark.index
        if not event.style and may_be_cut(text):
            uncut = uncut_end(self._source.text, begin, end)
            text, end = (text, end) if uncut is None else (self._uncut(begin, end, uncut), uncut)
        scalar = Scalar(self._source, text, begin, end, event.style or "")
        place = self._source.stretch(begin, scalar.end) if scalar.style not in ("|", ">") else self._source.place(begin)
        return YamlNode(plain_value(scalar.text) if not scalar.style else scalar.text, place, scalar)

    def _uncut(self, begin: int, end: int, uncut: int) -> str:
        """Return the text that was meant by a value which a comma cuts. Note the comma as an error."""
        source = self._source.text
        cut, text = source[begin:end].rstrip(), folded(source[begin:uncut])
        message = f"a comma in `{{…}}` or `[…]` ends the value, and `{folded(cut)}` is not complete"
        shown = quoted(text)
        remedy = f"put the value into quotes{'' if shown is None else f': {shown}'}"
        self._report.add(Slug.YAML_SYNTAX, message, self._source.place(source.index(",", begin + len(cut))), remedy)
        self._end = self._uncut_end = uncut
        return text

    def _next_child(self, *, is_key: bool = False) -> Event:
        """Return the event that begins the next child, or that ends the parent; the rest of a cut value is no child."""
        while isinstance(event := next(self._events), NodeEvent) and event.start_mark.index < self._uncut_end:
            self._skip(event)
            if is_key:
                self._skip(next(self._events))
        return event

    def _skip(self, event: Event) -> None:
        depth = int(isinstance(event, CollectionStartEvent))
        while depth:
            event = next(self._events)
            depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)

    def _mapping(self, place: Place) -> YamlNode:
        node = YamlNode({}, place)
        while not isinstance(event := self._next_child(is_key=True), MappingEndEvent):
            key = self._node(event)
            value = self._node(next(self._events))
            node.size += key.size + value.size
            self._enter(node, key, value)
        self._note_end(event)
        node.plain = {key: child.plain for key, child in node.items.items()}
        return node

    def _note_end(self, event: Event) -> None:
        """Remember where a node ends; the end of a block and a missing value have no characters."""
        written = self._source.text[event.start_mark.index : event.end_mark.index].rstrip()
        if written:
            self._end = event.start_mark.index + len(written)

    def _enter(self, node: YamlNode, key: YamlNode, value: YamlNode) -> None:
        name = key.text
        if name is not None and name not in node.items and not _is_merge(name, value):
            node.items[name] = value
            node.key_places[name] = key.place
            node.value_ends[name] = self._end
            return
        if name in node.items:
            message = f"`{name}` occurs twice, first in line {node.key_places[name].line}"
            self._report.add(Slug.DUPLICATE_KEY, message, key.place)
            node.items[name].add_entries(value)
            return
        node.incomplete = True
        if name is not None:
            message = f"merge keys (`<<`) are not part of {self._noun} files"
            remedy = (
                "write the keys out; a repeated section can be a part (`parts`), or an entry with objects (`types`)"
            )
            self._report.add(
                Slug.UNKNOWN_KEY, message, key.place, remedy if self._noun == "model" else "write them out"
            )
        elif not key.condemned:
            self._report.add(Slug.WRONG_SHAPE, "a key must be a name", key.place)

    def _alias(self, event: AliasEvent) -> YamlNode:
        begin = event.start_mark.index
        self._note_end(event)
        node = self._anchors.get(event.anchor)
        place = self._source.stretch(begin, event.end_mark.index)
        if node is not None:
            self._add_to_count(node.size, begin)
            self._used += node.size
            return node.used_at(place) if self._used <= MAX_USED_NODES else node
        if event.anchor in self._anchors:
            self._report.add(Slug.YAML_SYNTAX, f"`*{event.anchor}` is inside its own anchor", place)
        else:
            near = nearest(event.anchor, self._anchors)
            remedy = f"did you mean `*{near}`?" if near else "a value that begins with `*` needs quotes"
            self._report.add(Slug.YAML_SYNTAX, f"there is no anchor `&{event.anchor}` before", place, remedy)
        return YamlNode(None, place, condemned=True)

    def _refuse_tag(self, event: _Start, node: YamlNode) -> None:
        """Note a tag as an error. Mostly it is a predicate that begins with `!`."""
        match = _TAG.match(self._source.text, event.start_mark.index)
        begin, end = match.span(1) if match else (event.start_mark.index, event.end_mark.index)
        tag = self._source.text[begin:end]
        is_value = isinstance(event, ScalarEvent) and not tag.startswith("!!")
        remedy = self._quoted(begin, event) if is_value else f"leave out `{tag}`"
        message = f"`{tag}` is read as a YAML tag, and {self._noun} files have none"
        self._report.add(Slug.YAML_TAG, message, self._source.stretch(begin, end), remedy)
        _condemn(node)

    def _refuse_odd_anchor(self, event: _Start, node: YamlNode) -> None:
        """Note an unintended anchor as an error: a predicate that begins with `&&`."""
        if _ANCHOR_NAME.fullmatch(event.anchor):
            return
        begin = self._source.text.find(f"&{event.anchor}", event.start_mark.index)
        message = f"`&{event.anchor}` is read as a YAML anchor"
        place = self._source.stretch(begin, begin + 1 + len(event.anchor))
        self._report.add(Slug.YAML_SYNTAX, message, place, self._quoted(begin, event))
        _condemn(node)

    def _quoted(self, begin: int, event: _Start) -> str:
        """Return the remedy for a value that begins with a character that is special in YAML."""
        text = self._source.text[begin : event.end_mark.index].rstrip()
        shown = f": '{text}'" if "\n" not in text and "'" not in text else ""
        return f"a value that begins with `{text[:1]}` needs quotes{shown}"

    def _add_to_count(self, size: int, index: int) -> None:
        self._count += size
        if self._count > MAX_NODES:
            raise too_many_nodes(self._source, index)


def _condemn(node: YamlNode) -> None:
    """Mark a node as explained by an error: its text is not read, and its shape is not checked."""
    node.scalar = None
    node.condemned = True


def _is_merge(name: str, value: YamlNode) -> bool:
    return name == "<<" and isinstance(value.plain, (dict, list))


def plain_value(text: str) -> Plain:
    """Return the value of an unquoted scalar in YAML 1.2."""
    if _NULL.fullmatch(text):
        return None
    if _BOOLEAN.fullmatch(text):
        return text.lower() == "true"
    if _INTEGER.fullmatch(text):
        return int(text)
    return float(text) if _FLOAT.fullmatch(text) else text
