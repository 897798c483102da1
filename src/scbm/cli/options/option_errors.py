"""Errors about options and their values."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Mapping


def option_error(
    option: str, message: str, remedy: str | None = None, text: str | None = None, slug: Slug = Slug.BAD_OPTION
) -> InputError:
    """Return the error for an option, or for its value if `text` is that value."""
    place = Place(option) if text is None else Place(option, 1, 1, max(1, len(text)))
    return InputError([Diagnostic(slug, message, place, remedy, text)])


def refuse_given(options: Mapping[str, object], message: str, remedy: str) -> None:
    """Raise `InputError` with an error for each option that is not `None`."""
    wrong = [
        Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy)
        for option, value in options.items()
        if value is not None
    ]
    if wrong:
        raise InputError(wrong)
