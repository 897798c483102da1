"""Writes names with an index as names of instances: `at.r1` for `at[r1]`. Each character keeps its place."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Container

INDEXED = re.compile(r"(?<![\w.])([A-Za-z_][\w.]*)\[\s*(\w+(?:\s*,\s*\w+)*)\s*\](_\w+)?", re.ASCII)
"""A name with an index of objects; the index may stand before the end of a variable of a resource."""


class DottedPiece(NamedTuple):
    """A part of a ground text, and the characters `begin..end` of the written text that it stands for."""

    text: str
    begin: int
    end: int
    is_copy: bool


class DottedText:
    """A text without indices, and where its characters stand in the text as it is written.

    Attributes:
        written: the text as it is written.
        pieces: the parts of the ground text.
        text: the ground text.
    """

    def __init__(self, written: str, variables: Container[str]) -> None:
        """Make the ground text.

        Args:
            written: the text as it is written.
            variables: the names of variables: `pump_req_state[p1]` is `pump.p1_req_state` if that is a variable.
        """
        self.written = written
        self.pieces = _pieces(written, variables)
        self.text = "".join(piece.text for piece in self.pieces)

    def span(self, begin: int, end: int) -> tuple[int, int]:
        """Return the characters of the written text for the characters `begin..end` of the ground text."""
        return self._place(begin)[0], max(self._place(max(end - 1, begin))[1], self._place(begin)[0] + 1)

    def _place(self, index: int) -> tuple[int, int]:
        """Return where the character at an index begins and ends in the written text."""
        for piece in self.pieces:
            if index < len(piece.text):
                return (piece.begin + index, piece.begin + index + 1) if piece.is_copy else (piece.begin, piece.end)
            index -= len(piece.text)
        return len(self.written) + index, len(self.written) + index + 1


def _pieces(written: str, variables: Container[str]) -> list[DottedPiece]:
    pieces: list[DottedPiece] = []
    copied = 0
    for index in INDEXED.finditer(written):
        if copied < index.start():
            pieces.append(DottedPiece(written[copied : index.start()], copied, index.start(), is_copy=True))
        pieces.append(DottedPiece(_instance(index, variables), *index.span(), is_copy=False))
        copied = index.end()
    if copied < len(written):
        pieces.append(DottedPiece(written[copied:], copied, len(written), is_copy=True))
    return pieces


def _instance(index: re.Match[str], variables: Container[str]) -> str:
    """Return the name of an instance for its index, which stands before the end of a name of a resource."""
    objects = ".".join(part.strip() for part in index[2].split(","))
    base, end = index[1], index[3] or ""
    usual = f"{base}{end}.{objects}"
    ends = (suffix for suffix in ("_req_state", "_req_trigger") if f"{base}{end}".endswith(suffix))
    inner = next((f"{f'{base}{end}'.removesuffix(suffix)}.{objects}{suffix}" for suffix in ends), usual)
    return inner if inner in variables else usual
