"""Errors about options and their values."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

_Value = TypeVar("_Value")


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


class OptionReader:
    """Reads several options, so that a command reports the errors of all of them at once."""

    def __init__(self) -> None:
        self._wrong: list[Diagnostic] = []

    def read(self, read: Callable[[], _Value], default: _Value) -> _Value:
        """Return what `read` returns; note its errors, and return the default instead."""
        try:
            return read()
        except InputError as error:
            self._wrong += error.diagnostics
            return default

    def last(self, read: Callable[[], _Value]) -> _Value:
        """Return what `read` returns. Raise `InputError` with its errors and those that were noted before."""
        try:
            value = read()
        except InputError as error:
            raise InputError([*self._wrong, *error.diagnostics]) from None
        if self._wrong:
            raise InputError(self._wrong)
        return value
