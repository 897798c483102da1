"""Where errors are collected while a text is read, so that all of them are told at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Sequence

_MOST = 100
"""So many diagnostics of one file are told; a file with more has one cause that explains most of them."""


class Report:
    """The diagnostics of one text so far."""

    def __init__(self, source_lines: Sequence[str]) -> None:
        self._source_lines = source_lines
        self._found: dict[tuple[Place, str], Diagnostic] = {}

    def add(self, slug: Slug, message: str, place: Place, remedy: str | None = None) -> None:
        """Note one error. The same error at the same place is noted once."""
        source_line = self._source_lines[place.line - 1] if 0 < place.line <= len(self._source_lines) else None
        self._found.setdefault((place, slug), Diagnostic(slug, message, place, remedy, source_line))

    def __len__(self) -> int:
        return len(self._found)

    def raise_any(self) -> None:
        """Raises `InputError` with everything found, from the top of the text to its end; else does nothing."""
        if self._found:
            raise self.error()

    def error(self) -> InputError:
        """Everything found, from the top of the text to its end."""
        ordered = sorted(self._found.values(), key=lambda diagnostic: diagnostic.order)
        return InputError(ordered[:_MOST])
