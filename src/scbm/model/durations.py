"""Durations: whole nanoseconds inside the program, a number with a unit for people."""

from __future__ import annotations

from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

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

_MAX_STABLE = 9_999
"""The largest whole number in the stable notation, which has decimals of a larger unit otherwise: `12.345 s`."""

_DECIMAL_UNITS = ("s", "ms", "us")
"""The units in which the stable notation has decimals."""

_IS_STABLE: ContextVar[bool] = ContextVar("is_stable", default=False)


def format_moment(time_ns: int) -> str:
    """Return a moment of a run, in seconds with three decimals."""
    return f"{time_ns / 1e9:.3f} s"


def format_duration(duration_ns: int) -> str:
    """Return the exact duration in the largest unit in which it is at least 1: `1.5 s`, `200 ms`, `523.123 ms`.

    Hours and minutes are written only if their number is whole: `90 min`, but `90.5 s`.
    """
    if not duration_ns:
        return "0 s"
    if _IS_STABLE.get():
        return _stable(duration_ns)
    units = (
        unit
        for unit, size_ns in UNITS_NS.items()
        if duration_ns >= size_ns and (unit not in _WHOLE_UNITS or duration_ns % size_ns == 0)
    )
    return _in_unit(duration_ns, next(units))


@contextmanager
def stable_durations() -> Iterator[None]:
    """Let `format_duration` return the notation of digests and keys, which never changes.

    The digest of a model and the key of a stored case are hashes of texts with durations. With another notation all
    certificates, stores and event logs would belong to another model.
    """
    token = _IS_STABLE.set(True)
    try:
        yield
    finally:
        _IS_STABLE.reset(token)


def _stable(duration_ns: int) -> str:
    """Return a duration in the largest unit that gives a whole number; with decimals if that number were long."""
    unit, size_ns = next((unit, size_ns) for unit, size_ns in UNITS_NS.items() if duration_ns % size_ns == 0)
    if duration_ns // size_ns > _MAX_STABLE and size_ns < UNITS_NS["s"]:
        unit = next(larger for larger in _DECIMAL_UNITS if duration_ns >= UNITS_NS[larger])
    return _in_unit(duration_ns, unit)


def _in_unit(duration_ns: int, unit: str) -> str:
    """Return a duration in a unit, with all decimals that it needs; decimals are exact in units up to seconds."""
    number, rest_ns = divmod(duration_ns, UNITS_NS[unit])
    decimals = str(rest_ns).rjust(len(str(UNITS_NS[unit])) - 1, "0").rstrip("0") if rest_ns else ""
    return f"{number}.{decimals} {unit}" if decimals else f"{number} {unit}"
