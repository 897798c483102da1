"""Words that reports share."""

from __future__ import annotations


def counted(count: int, singular: str, plural: str | None = None) -> str:
    """`1 error`, `2 errors`."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


def seconds(time_ns: int) -> str:
    """A moment of a run, in seconds with three decimals."""
    return f"{time_ns / 1e9:.3f} s"
