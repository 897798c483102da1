"""Edits of a YAML text that keep the rest, and the positions of its lines and parts."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct, field
from ruamel.yaml import YAML
from ruamel.yaml.events import (
    AliasEvent,
    CollectionStartEvent,
    DocumentEndEvent,
    MappingEndEvent,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceEndEvent,
)

from scbm.files.yaml.source_text import SourceText
from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ruamel.yaml.events import Event

_LINE_END = re.compile(r"\r\n|\r|\n")


class TextEdit(NamedTuple):
    """Replaces one stretch of a text."""

    begin: int
    end: int
    text: str


def with_edits(text: str, edits: Iterable[TextEdit]) -> str:
    """Return a text after edits that do not overlap; insertions at one position stand in their order."""
    parts: list[str] = []
    index = 0
    for edit in sorted(edits, key=lambda edit: edit[:2]):
        parts += [text[index : edit.begin], edit.text]
        index = edit.end
    return "".join((*parts, text[index:]))


class TextLines:
    """The lines of a text.

    Attributes:
        text: the text.
        line_end: the most frequent line end.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        ends = _LINE_END.findall(text)
        self.line_end = max(dict.fromkeys(ends), key=ends.count) if ends else "\n"

    def line_begin(self, index: int) -> int:
        """Return where the line of a character begins."""
        return max(self.text.rfind("\n", 0, index), self.text.rfind("\r", 0, index)) + 1

    def line_stop(self, index: int) -> int:
        """Return where the line of a character ends."""
        match = _LINE_END.search(self.text, index)
        return match.start() if match else len(self.text)


class YamlPiece(Struct):
    """A node of a text, and its position.

    Attributes:
        begin: the index of its first character, or of its anchor.
        end: the index after its last character, without blanks and comments.
        entries: the keys and values of a mapping.
        is_flow: whether it is a mapping in braces.
        is_block: whether it is a mapping of lines.
    """

    begin: int
    end: int
    entries: list[tuple[YamlPiece, YamlPiece]] = field(default_factory=list)
    is_flow: bool = False
    is_block: bool = False


class YamlLayout(TextLines):
    """Positions of the parts of a text that is read without errors.

    Attributes:
        limit: the latest end of its mapping: the end of the text, or of the document.
        root: the mapping.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.limit = len(text)
        self._names: dict[int, str] = {}
        self._events: Iterator[Event] = YAML(typ="safe", pure=True).parse(text)
        root: YamlPiece | None = None
        for event in self._events:
            if isinstance(event, NodeEvent):
                root = self._piece(event)
            elif isinstance(event, DocumentEndEvent) and event.explicit:
                self.limit = event.start_mark.index
        assert root is not None  # noqa: S101 - the text has been read as a model
        self.root = root

    def _piece(self, event: Event) -> YamlPiece:
        begin, end = event.start_mark.index, event.end_mark.index
        if isinstance(event, CollectionStartEvent):
            return self._collection(event)
        if isinstance(event, ScalarEvent):
            self._names[begin] = str(event.value)
            if event.style in ("|", ">"):
                end = begin + len(self.text[begin:end].rstrip())
        else:
            assert isinstance(event, AliasEvent)  # noqa: S101 - there are no other nodes
        return YamlPiece(begin, end)

    def _collection(self, event: CollectionStartEvent) -> YamlPiece:
        piece = YamlPiece(event.start_mark.index, event.end_mark.index)
        children: list[YamlPiece] = []
        while not isinstance(child := next(self._events), (MappingEndEvent, SequenceEndEvent)):
            children.append(self._piece(child))
        if isinstance(event, MappingStartEvent):
            piece.entries = list(zip(children[::2], children[1::2], strict=True))
            piece.is_flow, piece.is_block = bool(event.flow_style), not event.flow_style
        if event.flow_style:
            piece.end = child.end_mark.index
        elif children:
            piece.end = max(child.end for child in children)
        return piece

    def key(self, name: str) -> YamlPiece | None:
        """Return a key of the root mapping; `None` if it is absent."""
        return next((key for key, _ in self.root.entries if self._names.get(key.begin) == name), None)

    def section(self, name: str) -> YamlPiece | None:
        """Return the value of a key of the root mapping; `None` if it is absent."""
        sought = self.key(name)
        return next((value for key, value in self.root.entries if key is sought), None)

    def error(self, name: str, file: str, message: str, remedy: str) -> InputError:
        """Return the error for a layout that does not allow an edit of a section."""
        source, key = SourceText(self.text, file), self.key(name)
        place = Place(file) if key is None else source.stretch(key.begin, key.end)
        line = source.lines[place.line - 1] if place.line else None
        return InputError([Diagnostic(Slug.WRONG_SHAPE, message, place, remedy, line)])

    def indentation(self, piece: YamlPiece) -> str | None:
        """Return the blanks before a piece in its line; `None` if there is more than blanks."""
        before = self.text[self.line_begin(piece.begin) : piece.begin]
        return before if not before.strip(" ") else None

    def has_blank_line(self, begin: int, end: int) -> bool:
        """Return whether there is a blank line between two positions."""
        lines = _LINE_END.split(self.text[begin:end])
        return any(not line.strip() for line in lines[1:-1])

    def behind_comments(self, index: int, column: int) -> int:
        """Return the end of the line, or of the comments after it that are indented as far as `column`."""
        stop = self.line_stop(index)
        while match := _LINE_END.match(self.text, stop):
            line = self.text[match.end() : self.line_stop(match.end())]
            if not line.lstrip(" ").startswith("#") or len(line) - len(line.lstrip(" ")) < column:
                break
            stop = self.line_stop(match.end())
        return stop
