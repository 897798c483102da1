"""Scalars that are made from others: each of their characters has a place in the text that people wrote."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.files.yaml.source_text import Scalar

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import Place


@dataclass(frozen=True, slots=True)
class Piece:
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
