"""A diagnostic: what is wrong, where, and what would be right. Immutable, and able to show itself.

The one family of exceptions. Everything that a user can cause is an `InputError`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model.slugs import Slug

_EXCERPT_WIDTH = 100
"""Columns of a source line that are shown; longer ones are cut around the caret."""


class Severity(StrEnum):
    """An error stops; a warning does not."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A stretch of one line of a text.

    Attributes:
        file: the path as the user wrote it, or the option whose text this is (`--goal`).
        line: counted from 1; 0 means the text as a whole.
        column: counted from 1, in characters; 0 means the line as a whole.
        length: characters that the caret underlines.
    """

    file: str
    line: int = 0
    column: int = 0
    length: int = 1

    def __str__(self) -> str:
        if not self.line:
            return self.file
        return f"{self.file}:{self.line}:{self.column}" if self.column else f"{self.file}:{self.line}"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One thing that is wrong or doubtful.

    Attributes:
        slug: its stable name, documented in `docs/reference/messages.md`.
        message: one sentence, lower case, without a full stop.
        place: where.
        remedy: what to write instead, if that is known.
        source_line: the line of text at `place`, for the caret.
        severity: an error, if nothing is said.
    """

    slug: Slug
    message: str
    place: Place
    remedy: str | None = None
    source_line: str | None = None
    severity: Severity = Severity.ERROR

    def __str__(self) -> str:
        """`file:line:column: error[slug]: message`, the line with a caret, and the remedy."""
        lines = [f"{self.place}: {self.severity}[{self.slug}]: {self.message}"]
        if self.source_line is not None and self.place.column:
            lines += _excerpt(self.source_line, self.place)
        if self.remedy:
            lines.append(f"    = {self.remedy}")
        return "\n".join(lines)

    @property
    def order(self) -> tuple[int, int]:
        """Sorts diagnostics of one file as they are read: from the top."""
        return (self.place.line, self.place.column)


def _excerpt(source_line: str, place: Place) -> list[str]:
    """The source line and a caret line under it, both cut to `_EXCERPT_WIDTH` around the caret."""
    begin = 0
    if len(source_line) > _EXCERPT_WIDTH:
        begin = max(0, place.column - 1 - _EXCERPT_WIDTH // 2)
    shown = source_line[begin : begin + _EXCERPT_WIDTH]
    offset = place.column - 1 - begin
    # The caret line repeats tabs, so that both lines are indented alike on every terminal.
    indent = "".join("\t" if character == "\t" else " " for character in shown[:offset]).ljust(offset)
    caret = "^" + "~" * (min(place.length, max(1, len(shown) - offset)) - 1)
    printable = "".join(c if c.isprintable() or c == "\t" else "\N{REPLACEMENT CHARACTER}" for c in shown)
    return [f"    {printable}".rstrip(), f"    {indent}{caret}"]


class ScbmError(Exception):
    """Anything that `scbm` itself raises. Carries at least one diagnostic."""

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        super().__init__("\n".join(str(diagnostic) for diagnostic in self.diagnostics))


class InputError(ScbmError):
    """A file, an option or a value that the user gave is wrong. Holds all that is wrong with it."""
