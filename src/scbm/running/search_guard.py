"""Limits of wall time and memory on a search: for `scbm plan` and controllers, whose plans no test has to repeat.

Built-in planners read no clock. They ask at intervals whether they may go on, and a guard answers that.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from scbm.planning import Limit, LimitReached, SearchCancelledError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from scbm.model import Predicate, Value
    from scbm.planning import Answer, PlanLimits


class MakesPlans(Protocol):
    """The interface of `Planner` and `PlanCache`."""

    def plan(
        self,
        state: Mapping[str, Value],
        goal: Predicate,
        limits: PlanLimits = ...,
        should_continue: Callable[[], bool] = ...,
    ) -> Answer:
        """Return the answer to a planning problem."""
        ...


def plan_guarded(
    plans: MakesPlans,
    state: Mapping[str, Value],
    goal: Predicate,
    limits: PlanLimits,
    should_continue: Callable[[], bool] = lambda: True,
) -> Answer:
    """Return the answer to a planning problem within all limits, also those of time and memory.

    Raises:
        SearchCancelledError: `should_continue` returned `False`.
    """
    guard = _SearchGuard(limits, should_continue)
    try:
        return plans.plan(state, goal, limits, guard)
    except SearchCancelledError:
        if guard.exceeded is None:
            raise
        return LimitReached(guard.exceeded, 0)


class _SearchGuard:
    """Returns whether a search may go on; `exceeded` is the limit that it exceeded, if it did."""

    def __init__(self, limits: PlanLimits, should_continue: Callable[[], bool]) -> None:
        self.exceeded: Limit | None = None
        self._limits = limits
        self._should_continue = should_continue
        self._began_ns = time.monotonic_ns()

    def __call__(self) -> bool:
        limits = self._limits
        if limits.time_ns is not None and time.monotonic_ns() - self._began_ns > limits.time_ns:
            self.exceeded = Limit.TIME
        elif limits.memory_bytes is not None and memory_bytes() > limits.memory_bytes:
            self.exceeded = Limit.MEMORY
        return self.exceeded is None and self._should_continue()


def memory_bytes() -> int:
    """Return the memory that this process uses; its maximum so far where the system does not report the present use."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return _maximum_memory_bytes()
    import resource  # noqa: PLC0415 - not on Windows

    return pages * resource.getpagesize()


def _maximum_memory_bytes() -> int:
    try:
        import resource  # noqa: PLC0415 - not on Windows
    except ImportError:
        return 0
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used if sys.platform == "darwin" else used * 1024
