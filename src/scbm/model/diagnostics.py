"""Diagnostics: what is wrong, where, and what would be right; and the exceptions that carry them.

There is one family of exceptions. Every error that a user can cause is an `InputError`.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import force_setattr

from scbm.model.slugs import Slug
from scbm.model.struct_classes import PartlyCompared
from scbm.model.visible_text import printable

if TYPE_CHECKING:
    from collections.abc import Sequence

_EXCERPT_WIDTH = 100
"""Maximum number of columns of a source line that are shown; longer lines are cut around the caret."""


class Severity(StrEnum):
    """The severity of a diagnostic: an error ends the command, a warning does not, and a note is no doubt at all."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


class Place(PartlyCompared, frozen=True):
    """A range of one line of a text.

    Attributes:
        file: the path as the user wrote it, or the option with the text (`--goal`).
        line: counted from 1; 0 means the whole text.
        column: counted from 1, in characters; 0 means the whole line.
        length: the number of characters that the caret underlines.
        user: where the text is used, if that is elsewhere: the alias of an anchor, the word of a part that an argument
            stands for, the use of a part. It may have a user itself. Places with different users are equal.
    """

    file: str
    line: int = 0
    column: int = 0
    length: int = 1
    user: Place | None = None
    uncompared = ("user",)

    def __lt__(self, other: Place) -> bool:
        return self._compared() < other._compared()

    def _compared(self) -> tuple[str, int, int, int]:
        return self.file, self.line, self.column, self.length

    def used_at(self, user: Place) -> Place:
        """Return the place of the same text, whose last user is used at `user`."""
        whole = user if self.user is None else self.user.used_at(user)
        return Place(self.file, self.line, self.column, self.length, whole)

    def __str__(self) -> str:
        if not self.line:
            return self.file
        return f"{self.file}:{self.line}:{self.column}" if self.column else f"{self.file}:{self.line}"


class Diagnostic(Struct, frozen=True):
    """One error or warning.

    Attributes:
        slug: its stable identifier, which `scbm help SLUG` explains.
        message: one sentence, lower case, without a full stop.
        place: where it is.
        remedy: what to write instead, if known.
        source_line: the line of text at `place`, for the caret.
        severity: an error by default.
    """

    slug: Slug
    message: str
    place: Place
    remedy: str | None = None
    source_line: str | None = None
    severity: Severity = Severity.ERROR

    def __post_init__(self) -> None:
        """Make both texts printable: they quote files, options and peers."""
        force_setattr(self, "message", printable(self.message))
        force_setattr(self, "remedy", None if self.remedy is None else printable(self.remedy))

    def __str__(self) -> str:
        """Return `file:line:column: error[slug]: message`, the line with a caret, and the remedy."""
        lines = [f"{printable(str(self.place))}: {self.severity}[{self.slug}]: {self.message}"]
        if self.source_line is not None and self.place.column:
            lines += _excerpt(self.source_line, self.place)
        if self.remedy:
            lines.append(f"    = {self.remedy}")
        return "\n".join(lines)

    @property
    def order(self) -> tuple[int, int]:
        """The sort key of diagnostics of one file: from the top."""
        return (self.place.line, self.place.column)


def _excerpt(source_line: str, place: Place) -> list[str]:
    """Return the source line and a caret line, both cut to `_EXCERPT_WIDTH` around the caret."""
    begin = 0
    if len(source_line) > _EXCERPT_WIDTH:
        begin = max(0, place.column - 1 - _EXCERPT_WIDTH // 2)
    shown = source_line[begin : begin + _EXCERPT_WIDTH]
    offset = place.column - 1 - begin
    # The caret line repeats tabs, so that both lines are indented alike on every terminal.
    indent = "".join("\t" if character == "\t" else " " for character in shown[:offset]).ljust(offset)
    caret = "^" + "~" * (min(place.length, max(1, len(shown) - offset)) - 1)
    printable = "".join(c if c.isprintable() or c == "\t" else "\ufffd" for c in shown)
    return [f"    {printable}".rstrip(), f"    {indent}{caret}"]


class ScbmError(Exception):
    """The base class of exceptions of `scbm`. Carries at least one diagnostic."""

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        super().__init__("\n".join(str(diagnostic) for diagnostic in self.diagnostics))


class InputError(ScbmError):
    """A file, an option or a value from the user is wrong. Carries all diagnostics about it."""


_MAX_VERSION = 10**9
"""Versions beyond it are not shown; no format has as many."""


def refuse_other_version(noun: str, found: object, known: int, place: Place, remedy: str) -> None:
    """Raise `InputError` unless a file has the only version of its format that this scbm reads (decision 56).

    Args:
        noun: the kind of the file in words.
        found: its version, as the file says it.
        known: the version that is read.
        place: where the file says its version.
        remedy: what to do with a file of another version.
    """
    number = found if type(found) is int and abs(found) < _MAX_VERSION else None
    if number == known:
        return
    shown = "no known version" if number is None else f"version {number}"
    message = f"this {noun} has {shown} of its format, and this scbm reads version {known} alone"
    advice = f"update scbm, or {remedy}" if number is not None and number > known else remedy
    raise InputError([Diagnostic(Slug.FORMAT_VERSION, message, place, advice)])
