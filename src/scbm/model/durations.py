"""How long something takes: whole nanoseconds inside, a number with a unit where people look."""

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


def format_duration(duration_ns: int) -> str:
    """The duration in the largest unit that gives a whole number, as `10 s` or `1500 ms`."""
    for unit, size_ns in UNITS_NS.items():
        if duration_ns and duration_ns % size_ns == 0:
            return f"{duration_ns // size_ns} {unit}"
    return "0 s"
