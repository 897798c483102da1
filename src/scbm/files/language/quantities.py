"""Durations and shares: from text to number, and back.

Durations are a number and a unit: `10 s`, `1.5 seconds`, `500 ms`. Shares are `2 %`, `0.5 %`, or a number from 0 to 1.
"""

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
"""Durations as a pattern for the JSON Schema."""


def parse_duration(text: str) -> int | None:
    """Return a duration in nanoseconds; `None` if the text is not a duration of whole nanoseconds."""
    match = _DURATION.fullmatch(text.strip())
    size_ns = _SIZE_NS.get(match["unit"]) if match else None
    if match is None or size_ns is None:
        return None
    exact = Fraction(match["number"]) * size_ns
    return int(exact) if exact.denominator == 1 else None


_SHARE = re.compile(r"(\d{1,40}(?:\.\d{0,40})?|\.\d{1,40})\s*(%?)", re.ASCII)


def parse_share(text: str) -> Fraction | None:
    """Return a share; `None` if the text is not a share from 0 to 1."""
    match = _SHARE.fullmatch(text.strip())
    if match is None:
        return None
    share = Fraction(match[1]) / (100 if match[2] else 1)
    return share if share <= 1 else None


def format_share(share: Fraction) -> str:
    """Return a share in per cent. Raises `ValueError` if its decimal expansion is infinite."""
    return f"{format_decimal(share * 100)} %"


def format_decimal(number: Fraction) -> str:
    """Return a non-negative number with all its decimals. Raises `ValueError` if these are infinite."""
    decimals = 0
    while (number * 10**decimals).denominator != 1:
        decimals += 1
        if decimals > number.denominator.bit_length():
            raise ValueError(f"{number} has no end as a decimal number")
    digits = str(int(number * 10**decimals)).rjust(decimals + 1, "0")
    return f"{digits[:-decimals]}.{digits[-decimals:]}" if decimals else digits
