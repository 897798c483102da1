"""The executor that begins in this process, and goes on in several once a campaign takes long."""

from __future__ import annotations

import os
from time import perf_counter
from typing import TYPE_CHECKING

from scbm.testing.batches.campaign_runs import InProcess

if TYPE_CHECKING:
    from collections.abc import Generator

    from scbm.testing.batches.campaign_runs import BatchPlan, BatchResult

TRIAL_S = 1.0
"""Wall time after which `AllCores` estimates how long the rest of a campaign takes."""

WORTH_S = 3.0
"""The least estimated wall time of the rest of a campaign that is worth starting processes."""


def core_count() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class AllCores:
    """Runs in this process at first, and on several cores if the rest takes long enough to pay for processes."""

    def __init__(self, count: int | None = None) -> None:
        """Take the number of worker processes; by default one for each core."""
        self._count = core_count() if count is None else count

    def results(self, plan: BatchPlan) -> Generator[BatchResult, None, None]:
        """Yield the results of the batches."""
        begun_s, done = perf_counter(), 0
        for result in InProcess().results(plan):
            yield result
            done += result.summary.count
            passed_s = perf_counter() - begun_s
            rest_s = passed_s / max(done, 1) * (plan.work.count - plan.start + 1 - done)
            if self._count > 1 and passed_s >= TRIAL_S and rest_s >= WORTH_S:
                break
        else:
            return
        from scbm.testing.batches.worker_processes import WorkerProcesses  # noqa: PLC0415 - few campaigns are so long

        yield from WorkerProcesses(self._count).results(plan.after(done))
