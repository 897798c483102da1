"""Patterns of requirements: how a form is written, with letters for predicates, durations and numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from functools import cache
from itertools import product
from typing import TYPE_CHECKING, assert_never, cast

from scbm.model.durations import format_duration

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


class PlaceholderKind(Enum):
    """The kind of value that a letter of a pattern stands for. A new kind needs a case in each match over kinds."""

    PREDICATE = "predicate"
    DURATION = "duration"
    """Whole nanoseconds, written with a unit."""
    NUMBER = "number"
    """A whole number from 0 on."""


PLACEHOLDERS: dict[str, PlaceholderKind] = {
    **dict.fromkeys("pqr", PlaceholderKind.PREDICATE),
    **dict.fromkeys("de", PlaceholderKind.DURATION),
    **dict.fromkeys("mn", PlaceholderKind.NUMBER),
}
"""The letters of patterns. All other words of a pattern stand for themselves."""

_PART = re.compile(r"\[(?P<optional>[^][]+)\]|(?P<required>[^][]+)")


@dataclass(frozen=True, slots=True)
class PatternPart:
    """Words of a pattern that are either all required or all in the same brackets, and so optional together."""

    words: tuple[str, ...]
    is_optional: bool

    @property
    def kinds(self) -> tuple[PlaceholderKind, ...]:
        """The kinds of the letters, in order."""
        return tuple(PLACEHOLDERS[word] for word in self.words if word in PLACEHOLDERS)


@cache
def pattern_parts(pattern: str) -> tuple[PatternPart, ...]:
    """Return the parts of a pattern, in order."""
    parts = ((match["required"] or match["optional"], match["optional"]) for match in _PART.finditer(pattern))
    return tuple(PatternPart(tuple(text.split()), optional is not None) for text, optional in parts if text.strip())


def kinds_of(pattern: str) -> tuple[PlaceholderKind, ...]:
    """Return the kinds of all letters of a pattern, in order."""
    return tuple(kind for part in pattern_parts(pattern) for kind in part.kinds)


def spellings(pattern: str) -> tuple[str, ...]:
    """Return all ways to write a pattern: without and with each optional part."""
    ways = ([(), part.words] if part.is_optional else [part.words] for part in pattern_parts(pattern))
    return tuple(" ".join(word for words in way for word in words) for way in product(*ways))


def written(pattern: str, values: Sequence[object]) -> str:
    """Return a pattern with values in the places of its letters; leave out optional parts whose values are `None`."""
    left = iter(values)
    return " ".join(word for part in pattern_parts(pattern) for word in _written_part(part, left))


def _written_part(part: PatternPart, left: Iterator[object]) -> Iterator[str]:
    values = [(kind, next(left)) for kind in part.kinds]
    if any(value is None for _, value in values):
        return
    texts = (_text(kind, value) for kind, value in values)
    for word in part.words:
        yield next(texts) if word in PLACEHOLDERS else word


def _text(kind: PlaceholderKind, value: object) -> str:
    match kind:
        case PlaceholderKind.PREDICATE | PlaceholderKind.NUMBER:
            return str(value)
        case PlaceholderKind.DURATION:
            return format_duration(cast("int", value))
        case _:
            assert_never(kind)
