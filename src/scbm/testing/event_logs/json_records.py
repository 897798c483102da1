"""Records that cross a process, a file or a wire: JSON objects with known fields and limits, as msgspec structs.

The type of a record says which JSON is accepted. What it cannot say, such as names of a model, the code checks that
uses the record.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from msgspec import Meta, Struct, ValidationError, convert

from scbm.model.json_reader import JsonError

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_COUNT = 2**63 - 1
"""The largest number that a clock can hold, and a field of a message."""

Count: TypeAlias = Annotated[int, Meta(ge=0, le=MAX_COUNT)]
"""A whole number from 0 on that a clock can hold."""

Text: TypeAlias = Annotated[str, Meta(max_length=1_000)]
"""A name, or a few words."""

MAX_LONG_TEXT = 100_000
LongText: TypeAlias = Annotated[str, Meta(max_length=MAX_LONG_TEXT)]
"""A predicate, sentences, or a value that a driver sent."""

Names: TypeAlias = Annotated[tuple[Text, ...], Meta(max_length=100_000)]
"""A list of names, such as a plan."""

Values: TypeAlias = Annotated[
    dict[Text, bool | Annotated[int, Meta(ge=-MAX_COUNT - 1, le=MAX_COUNT)] | LongText], Meta(max_length=10_000)
]
"""Variables and their values; a model need not know them."""

_MAX_REASON = 100
"""Maximum number of characters of a reason that repeats words of the data."""

_PLACE = re.compile(r"(.*?)(?: - at (`key` in )?`\$\.?(.*)`)?", re.DOTALL)
_EXPECTED: dict[str, str] = {}
"""What a text that matches a pattern is, in words, by the pattern."""


class JsonRecord(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A JSON object with its fields and no others. A field with a default value is left out if it has this value."""


def matching(pattern: str, words: str) -> Meta:
    """Return the constraint of texts that match a regular expression as a whole; `words` say what such a text is."""
    whole = rf"^(?:{pattern})\Z"
    _EXPECTED[whole] = words
    return Meta(pattern=whole)


def one_of(words: Iterable[str]) -> Meta:
    """Return the constraint of texts that are one of some words."""
    known = tuple(words)
    return matching("|".join(map(re.escape, known)), f"one of {', '.join(known)}")


def read_record(data: object, kind: Any, what: str) -> Any:  # noqa: ANN401 - a record of this kind, or of a union
    """Return plain data, as `read_json` returns it, as a record.

    Args:
        data: the data.
        kind: the class of the record, or a union of classes with tags.
        what: the name of the data in errors.

    Raises:
        JsonError: the data is no such record; the message names the field.
    """
    try:
        return convert(data, kind, strict=True)
    except ValidationError as error:
        raise JsonError(_located(str(error), what)) from None


def _located(message: str, what: str) -> str:
    """Return a message of msgspec with its place in words, on one line and of bounded length."""
    match = _PLACE.fullmatch(message)
    assert match is not None  # noqa: S101 - all texts match
    reason, key, path = match.groups()
    place = f"{'a key of ' if key else ''}`{path}` of {what}" if path else what
    for pattern, words in _EXPECTED.items():
        reason = reason.replace(f"`str` matching regex {pattern!r}", words)
    if len(reason) > _MAX_REASON and not reason.startswith("Expected"):
        reason = f"{reason[:_MAX_REASON]}…"
    return f"{place}: {reason[0].lower()}{''.join(c if c.isprintable() else '?' for c in reason[1:])}"
