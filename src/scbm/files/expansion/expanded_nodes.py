"""YAML nodes and scalars made of others: each of their characters has a place in the text that people wrote."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct
from msgspec.structs import replace

from scbm.files.yaml.document import YamlNode, plain_value
from scbm.files.yaml.source_text import Scalar

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from lark import Token, Tree

    from scbm.model import Place


class Piece(Struct, frozen=True):
    """A part of a rewritten scalar: a copy of some characters of a source scalar, or a text in their place.

    Attributes:
        text: the part.
        source: the scalar that it comes from; that may be rewritten itself.
        begin: the first character in the text of the source that it stands for.
        end: the end of these characters.
    """

    text: str
    source: Scalar
    begin: int
    end: int

    @staticmethod
    def copy(source: Scalar, begin: int = 0, end: int | None = None) -> Piece:
        """Return the characters `begin..end` of a scalar, by default all; each keeps its own place."""
        stop = len(source.text) if end is None else end
        return Piece(source.text[begin:stop], source, begin, stop)

    @staticmethod
    def instead(text: str, source: Scalar, begin: int = 0, end: int | None = None) -> Piece:
        """Return a text that stands for the characters `begin..end` of a scalar; errors underline all of these."""
        return Piece(text, source, begin, len(source.text) if end is None else end)

    @property
    def is_copy(self) -> bool:
        """Whether each character has a place of its own."""
        return self.text == self.source.text[self.begin : self.end]

    def first(self, offset: int) -> int:
        """Return where in the source the character at an offset begins."""
        return self.begin + offset if self.is_copy else self.begin

    def last(self, offset: int) -> int:
        """Return where in the source the character at an offset ends."""
        return self.begin + offset + 1 if self.is_copy else self.end


class RewrittenScalar(Scalar):
    """A scalar that consists of pieces of others: names are replaced in it, or several texts are joined."""

    __slots__ = ("_pieces", "_starts")

    def __init__(self, pieces: Sequence[Piece]) -> None:
        """Take the pieces, at least one of which has characters."""
        self._pieces = tuple(piece for piece in pieces if piece.text)
        self._starts: list[int] = []
        length = 0
        for piece in self._pieces:
            self._starts.append(length)
            length += len(piece.text)
        self.text = "".join(piece.text for piece in self._pieces)
        self.style = ""
        self.begin = self._pieces[0].source.begin
        self.end = self._pieces[-1].source.end

    def stretch(self, begin: int, end: int) -> Place:
        """Return the place of the characters `begin..end` in the source, within one source scalar and one line."""
        first, offset = self._piece_at(begin)
        last, last_offset = self._piece_at(max(end - 1, begin))
        start = first.first(offset)
        stop = last.last(last_offset)
        if last.source is not first.source or stop <= start:
            stop = first.end
        return first.source.stretch(start, stop)

    def _piece_at(self, index: int) -> tuple[Piece, int]:
        """Return the piece with the character at an index, and its offset there; the last piece beyond the end."""
        number = bisect_right(self._starts, index) - 1
        return self._pieces[number], index - self._starts[number]


class ParsedScalar(Scalar):
    """A scalar whose syntax tree is known: that of a lifted text for one choice of objects."""

    __slots__ = ("_written", "syntax")

    def __init__(self, written: Scalar, syntax: Tree[Token]) -> None:
        """Take the scalar as it is written, and a tree whose tokens have their places there."""
        self._written = written
        self.syntax = syntax
        self.text = written.text
        self.begin = written.begin
        self.end = written.end
        self.style = written.style

    def stretch(self, begin: int, end: int) -> Place:
        """Return the place of the characters `begin..end` where they are written."""
        return self._written.stretch(begin, end)


class PlacedScalar(Scalar):
    """A scalar that is generated for one place of the text, such as a key."""

    __slots__ = ("_place",)

    def __init__(self, text: str, place: Place) -> None:
        self.text = text
        self.style = ""
        self.begin = self.end = 0
        self._place = place

    def stretch(self, begin: int, end: int) -> Place:  # noqa: ARG002 - all characters have one place
        """Return the place that the text is generated for."""
        return self._place


class MappingEntry(NamedTuple):
    """An entry of a mapping.

    Attributes:
        key: its key.
        place: where the key is written, or what it is generated from.
        node: its value.
        end: where in the text the value ends; reports on lines show the lines from the key to this end, and the line of
            the key alone for 0.
    """

    key: str
    place: Place
    node: YamlNode
    end: int


def entries_of(node: YamlNode) -> Iterator[MappingEntry]:
    """Yield the entries of a mapping; none for other nodes."""
    for key, child in node.items.items():
        yield MappingEntry(key, node.key_places[key], child, node.value_ends[key])


def with_entries(node: YamlNode, entries: Iterable[MappingEntry]) -> YamlNode:
    """Return a mapping with other entries that stands where `node` stands; the last entry of a key counts."""
    listed = {entry.key: entry for entry in entries}
    return replace(
        node,
        plain={key: entry.node.plain for key, entry in listed.items()},
        items={key: entry.node for key, entry in listed.items()},
        key_places={key: entry.place for key, entry in listed.items()},
        value_ends={key: entry.end for key, entry in listed.items()},
        size=1 + sum(1 + entry.node.size for entry in listed.values()),
    )


def mapping_node(entries: Iterable[MappingEntry], place: Place, end: int, origin: str | None = None) -> YamlNode:
    """Return a new mapping that stands for the text from `place` to the index `end`."""
    return with_entries(YamlNode({}, place, end=end, origin=origin), entries)


def list_node(elements: Iterable[YamlNode], place: Place, end: int) -> YamlNode:
    """Return a new list that stands for the text from `place` to the index `end`."""
    listed = list(elements)
    size = 1 + sum(element.size for element in listed)
    return YamlNode([element.plain for element in listed], place, elements=listed, size=size, end=end)


def scalar_node(scalar: Scalar, place: Place, end: int) -> YamlNode:
    """Return a new node with a scalar that stands for the text from `place` to the index `end`."""
    plain = scalar.text if scalar.style else plain_value(scalar.text)
    return YamlNode(plain, place, scalar, end=end)


def text_node(text: str, place: Place, end: int) -> YamlNode:
    """Return a new node with a generated text; errors in it underline `place`."""
    return scalar_node(PlacedScalar(text, place), place, end)
