"""The time of a run: wall time since it began, some times faster (decision 26)."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True, slots=True)
class Clock:
    """Turns readings of `time.monotonic_ns` into time of a run, and back.

    Attributes:
        start_ns: the reading at which the run began.
        scale: how many seconds of the run pass in one of the wall; greater than 0.
    """

    start_ns: int
    scale: Fraction = Fraction(1)

    def of_run_ns(self, stamp_ns: int) -> int:
        """The time of the run at a reading; never negative."""
        return max(0, int((stamp_ns - self.start_ns) * self.scale))

    def wall_ns(self, at_ns: int) -> int:
        """The first reading at which that time of the run has come."""
        return self.start_ns - int(-at_ns / self.scale // 1)

    def lasts_ns(self, duration_ns: int) -> int:
        """How long a duration of the run takes by the wall."""
        return -int(-duration_ns / self.scale // 1)
