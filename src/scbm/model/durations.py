"""Durations: whole nanoseconds inside the program, a number with a unit for people."""

from __future__ import annotations

UNITS_NS = {
    "h": 3_600_000_000_000,
    "min": 60_000_000_000,
    "s": 1_000_000_000,
    "ms": 1_000_000,
    "us": 1_000,
    "ns": 1,
}
"""The size of each unit, largest first."""


_MAX_WHOLE = 9_999
"""The largest whole number that is easier to read than decimals of a larger unit: `1500 ms`, but `523.123 ms`."""

_DECIMAL_UNITS = ("s", "ms", "us")
"""The units in which nanoseconds are written as decimals."""


def format_moment(time_ns: int) -> str:
    """Return a moment of a run, in seconds with three decimals."""
    return f"{time_ns / 1e9:.3f} s"


def format_duration(duration_ns: int) -> str:
    """Return the exact duration: `10 s` or `1500 ms` in the largest unit that gives a whole number, or `523.123 ms`.

    If the whole number would be long, it is a decimal number in the largest unit in which it is at least 1.
    """
    if not duration_ns:
        return "0 s"
    unit, size_ns = next((unit, size_ns) for unit, size_ns in UNITS_NS.items() if duration_ns % size_ns == 0)
    whole = duration_ns // size_ns
    if whole <= _MAX_WHOLE or size_ns >= UNITS_NS["s"]:
        return f"{whole} {unit}"
    larger = next(larger for larger in _DECIMAL_UNITS if duration_ns >= UNITS_NS[larger])
    number, rest_ns = divmod(duration_ns, UNITS_NS[larger])
    decimals = str(rest_ns).rjust(len(str(UNITS_NS[larger])) - 1, "0").rstrip("0")
    return f"{number}.{decimals} {larger}"
