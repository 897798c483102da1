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


_WHOLE_UNITS = ("h", "min")
"""The units of which only whole numbers are written: `90 min`, and not `1.5 h`."""


def format_moment(time_ns: int) -> str:
    """Return a moment of a run, in seconds with three decimals."""
    return f"{time_ns / 1e9:.3f} s"


def format_duration(duration_ns: int) -> str:
    """Return the exact duration in the largest unit in which it is at least 1: `1.5 s`, `200 ms`, `523.123 ms`.

    Hours and minutes are written only if their number is whole: `90 min`, but `90.5 s`.
    """
    if not duration_ns:
        return "0 s"
    units = (
        unit
        for unit, size_ns in UNITS_NS.items()
        if duration_ns >= size_ns and (unit not in _WHOLE_UNITS or duration_ns % size_ns == 0)
    )
    return _in_unit(duration_ns, next(units))


def _in_unit(duration_ns: int, unit: str) -> str:
    """Return a duration in a unit, with all decimals that it needs; decimals are exact in units up to seconds."""
    number, rest_ns = divmod(duration_ns, UNITS_NS[unit])
    decimals = str(rest_ns).rjust(len(str(UNITS_NS[unit])) - 1, "0").rstrip("0") if rest_ns else ""
    return f"{number}.{decimals} {unit}" if decimals else f"{number} {unit}"
