"""The limits of a runner. Times are the runner's own: simulated ones in a simulation."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RunnerOptions:
    """When a runner gives up, and what it may wait for.

    Attributes:
        time_limit_ns: how long one goal may be pursued.
        plan_limit: how many plans may be asked for, for one goal.
        livelock_bound: how many automatic transitions one settling may take (semantics 5.1).
        instant_bound: how many events may come at one moment. Where resources answer in no time, requests can be sent
            and answered for ever, and no time limit ends that.
        awaits_measurements: whether a measured value may still arrive unasked, so that a goal which cannot be
            planned for is waited for (semantics 5.6).
    """

    time_limit_ns: int = 3_600_000_000_000
    plan_limit: int = 100
    livelock_bound: int = 1_000
    instant_bound: int = 10_000
    awaits_measurements: bool = False
