"""Durations as people write them: a number and a unit, `10 s`, `1.5 seconds`, `500 ms`."""

from __future__ import annotations

import re
from fractions import Fraction

from scbm.model.durations import UNITS_NS

_SPELLINGS = {
    "h": ("h", "hour", "hours"),
    "min": ("min", "minute", "minutes"),
    "s": ("s", "sec", "second", "seconds"),
    "ms": ("ms", "millisecond", "milliseconds"),
    "us": ("us", "µs", "microsecond", "microseconds"),
    "ns": ("ns", "nanosecond", "nanoseconds"),
}
_SIZE_NS = {spelling: UNITS_NS[unit] for unit, spellings in _SPELLINGS.items() for spelling in spellings}
_DURATION = re.compile(r"(?P<number>\d{1,15}(?:\.\d{1,9})?)\s*(?P<unit>[a-zµ]+)", re.ASCII)

DURATION_PATTERN = (
    r"^\d+(\.\d+)?\s*(h|hours?|min|minutes?|s|sec|seconds?|ms|milliseconds?|[uµ]s|microseconds?|ns|nanoseconds?)$"
)
"""The same as a pattern for the JSON Schema."""


def parse_duration(text: str) -> int | None:
    """The duration in nanoseconds, or `None` if the text is no duration of whole nanoseconds."""
    match = _DURATION.fullmatch(text.strip())
    size_ns = _SIZE_NS.get(match["unit"]) if match else None
    if match is None or size_ns is None:
        return None
    exact = Fraction(match["number"]) * size_ns
    return int(exact) if exact.denominator == 1 else None
