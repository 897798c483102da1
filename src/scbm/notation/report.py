"""Where errors are collected while a text is read, so that all of them are told at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Sequence

MOST_ERRORS = 100
"""So many errors of one file are told; a file with more has one cause that explains most of them."""

_MOST_CHARACTERS = 400
"""So long may a message be; names and domains can be of any length."""


class Report:
    """The diagnostics of one text so far."""

    def __init__(self, source_lines: Sequence[str]) -> None:
        self._source_lines = source_lines
        self._found: dict[tuple[Place, Slug, str], Diagnostic] = {}

    def add(self, slug: Slug, message: str, place: Place, remedy: str | None = None) -> None:
        """Note one error. The same error at the same place is noted once: an alias is read as often as it is used.

        Raises:
            InputError: there are so many already that no more would be told.
        """
        source_line = self._source_lines[place.line - 1] if 0 < place.line <= len(self._source_lines) else None
        shown = _shown(message)
        diagnostic = Diagnostic(slug, shown, place, _shown(remedy) if remedy else None, source_line)
        self._found.setdefault((place, slug, shown), diagnostic)
        if len(self._found) >= MOST_ERRORS:
            raise self.error()

    def copy(self) -> Report:
        """Another report with the same diagnostics: a text that is parsed once may be built more than once."""
        copied = Report(self._source_lines)
        copied._found.update(self._found)
        return copied

    def __len__(self) -> int:
        return len(self._found)

    def raise_any(self) -> None:
        """Raises `InputError` with everything found, from the top of the text to its end; else does nothing."""
        if self._found:
            raise self.error()

    def error(self) -> InputError:
        """Everything found, from the top of the text to its end."""
        ordered = sorted(self._found.values(), key=lambda diagnostic: diagnostic.order)
        return InputError(ordered)


def _shown(words: str) -> str:
    """The words on one line that is not too long, with nothing in it that would move the cursor of a terminal."""
    if len(words) > _MOST_CHARACTERS:
        words = f"{words[: _MOST_CHARACTERS // 2]} … {words[-_MOST_CHARACTERS // 2 :]}"
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in words)
