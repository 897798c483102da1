"""Words that reports share."""

from __future__ import annotations


def counted(count: int, singular: str, plural: str | None = None) -> str:
    """`1 error`, `2 errors`."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"
