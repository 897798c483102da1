"""How much of something was visited. A figure is a value; it never rounds up to all or down to nothing."""

from __future__ import annotations

from dataclasses import dataclass

_SMALLEST = 0.01
"""The last digit that is shown, in per cent."""


@dataclass(frozen=True, slots=True)
class Figure:
    """`visited` of `of`."""

    visited: int
    of: int

    @property
    def percent(self) -> float | None:
        """With two digits behind the point; `None` if there is nothing to measure (semantics 8.3)."""
        if not self.of:
            return None
        if self.visited in (0, self.of):
            return 100.0 * (self.visited == self.of)
        rounded = round(100 * self.visited / self.of, 2)
        return min(max(rounded, _SMALLEST), 100 - _SMALLEST)

    @property
    def is_complete(self) -> bool:
        """Whether all was visited."""
        return self.visited == self.of

    def __str__(self) -> str:
        return "not measurable" if self.percent is None else f"{self.percent:.2f} %"
