"""The one family of exceptions. Everything that a user can cause is an `InputError`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.errors.diagnostics import Diagnostic


class ScbmError(Exception):
    """Anything that `scbm` itself raises. Carries at least one diagnostic."""

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        super().__init__("\n".join(str(diagnostic) for diagnostic in self.diagnostics))


class InputError(ScbmError):
    """A file, an option or a value that the user gave is wrong. Holds all that is wrong with it."""
