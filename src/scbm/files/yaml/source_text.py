"""The text of a file, places in it, and the source position of each character of a scalar."""

from __future__ import annotations

import re
from bisect import bisect_right
from typing import TYPE_CHECKING

from scbm.model import Place

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lark import Token, Tree

_LINE_END = re.compile(r"\r\n|\r|\n")
"""The line ends that editors know; `str.splitlines` knows seven more."""

_JOINT = re.compile(r"(?:\\(?:\r\n|\r|\n)\s*)+")
"""Escaped line ends in a double-quoted scalar, which add no character to it."""

_ESCAPE_LENGTHS = {"x": 4, "u": 6, "U": 10}
"""Lengths of escapes in a double-quoted scalar with their backslash; all others have two characters."""


class SourceText:
    """The text of a file, and the places in it."""

    def __init__(self, text: str, file: str) -> None:
        self.text = text
        self.file = file
        self.lines: Sequence[str] = _LINE_END.split(text)
        self._starts = [0, *(match.end() for match in _LINE_END.finditer(text))]

    def place(self, index: int, length: int = 1) -> Place:
        """Return the place of the character at `index`; the end of the text is that of its last non-empty line."""
        line = bisect_right(self._starts, index) - 1
        while line and not self.lines[line] and index >= len(self.text):
            line -= 1
        column = min(index - self._starts[line], len(self.lines[line]))
        return Place(self.file, line + 1, column + 1, length)

    def index(self, place: Place) -> int:
        """Return the index of the character at a place that is known in line and column."""
        return self._starts[place.line - 1] + place.column - 1

    def stretch(self, begin: int, end: int) -> Place:
        """Return the place of the characters `begin..end`, cut to their first line."""
        place = self.place(begin)
        rest = len(self.lines[place.line - 1]) - (place.column - 1)
        return Place(place.file, place.line, place.column, max(1, min(end - begin, rest)))


class Scalar:
    """A scalar in a source.

    Attributes:
        text: the text of the scalar.
        begin: where its content begins in the source: its first character, its quote, or `|` or `>`.
        end: where it ends.
        style: its YAML style: a quote, `|`, `>`, or nothing.
        syntax: the syntax tree of a text that is parsed already; `None` for all others.
    """

    syntax: Tree[Token] | None = None

    __slots__ = ("_offsets", "_source", "begin", "end", "style", "text")

    def __init__(self, source: SourceText, text: str, begin: int, end: int, style: str) -> None:
        self._source = source
        self.text = text
        self.begin = begin
        self.end = end
        self.style = style
        self._offsets: list[int] = []

    def stretch(self, begin: int, end: int) -> Place:
        """Return the place of the characters `begin..end` of the text, cut to their first line."""
        if not self._offsets:
            self._offsets = self._align()
        last = len(self._offsets) - 1
        first_index = self._offsets[min(begin, last)]
        last_index = self._offsets[min(max(end - 1, begin), last)]
        return self._source.stretch(first_index, last_index + (self._escape(last_index) or 1))

    def used_at(self, user: Callable[[], Place]) -> Scalar:
        """Return the same scalar, whose places have a user; `user` is called for the first place."""
        return UsedScalar(self, user)

    def _align(self) -> list[int]:
        """Return the source index of each character of the scalar, then the index of its last one.

        Quotes, indentation, folded line ends and escapes make text and source differ. The characters are searched in
        the source in their order; white space matches any white space.
        """
        text = self._source.text
        index = self._content()
        offsets: list[int] = []
        for character in self.text:
            joint = _JOINT.match(text, index) if self.style == '"' else None
            index = joint.end() if joint is not None else index
            length = self._escape(index)
            if not length and not character.isspace():
                index = self._find(character, index)
                length = self._escape(index) or 1
            elif not length:
                length = index < self.end and text[index].isspace()
            offsets.append(min(index, self.end))
            index += length
        return [*offsets, max(self.begin, min(index, self.end) - 1)]

    def _content(self) -> int:
        """Return where the first character of the text can be."""
        if self.style in ("|", ">"):
            match = _LINE_END.search(self._source.text, self.begin)
            return match.end() if match else self.end
        return self.begin + len(self.style)

    def _find(self, character: str, index: int) -> int:
        """Return the next index of a character, or of an escape that encodes it."""
        text = self._source.text
        while index < self.end and text[index] != character and not self._escape(index):
            index += 1
        return index

    def _escape(self, index: int) -> int:
        """Return the length of the escape at an index of a double-quoted scalar; 0 if there is none."""
        text = self._source.text
        if self.style != '"' or index >= self.end or text[index] != "\\":
            return 0
        return _ESCAPE_LENGTHS.get(text[index + 1], 2)


class UsedScalar(Scalar):
    """A scalar that is used elsewhere than where it is written; its places name that use."""

    __slots__ = ("_scalar", "_user")

    def __init__(self, scalar: Scalar, user: Callable[[], Place]) -> None:
        """Take the scalar as it is written, and a function that returns where it is used."""
        self._scalar = scalar
        self._user = user
        self.text = scalar.text
        self.begin = scalar.begin
        self.end = scalar.end
        self.style = scalar.style

    def stretch(self, begin: int, end: int) -> Place:
        """Return the place of the characters `begin..end` where they are written, with its user."""
        return self._scalar.stretch(begin, end).used_at(self._user())
