"""Results that begin in this process, and go on in several once they take long enough to pay for processes."""

from __future__ import annotations

import os
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar

from msgspec import Struct

from scbm.testing.batches.campaign_runs import InProcess

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable

    from scbm.testing.batches.campaign_runs import BatchPlan, BatchResult

_Result = TypeVar("_Result")

_TRIAL_S = 1.0
"""Wall time after which the time for the rest is estimated."""

_WORTH_S = 3.0
"""The least estimated wall time of the rest that is worth starting processes."""


def core_count() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def on_cores(
    results: Iterable[_Result],
    total: int,
    jobs: int | None,
    rest: Callable[[int, int], Iterable[_Result]],
    size: Callable[[_Result], int] = lambda _: 1,
) -> Generator[_Result, None, None]:
    """Yield results in their order, from this process or from several.

    Args:
        results: computes all results in this process.
        total: the number of items.
        jobs: the number of worker processes. `None` for none at first, and for all cores once the rest takes long.
        rest: computes, after a number of items, the results of the others with a number of processes.
        size: the number of items of a result.
    """
    count = min(core_count() if jobs is None else jobs, total)
    begun_s, done = perf_counter(), 0
    if jobs is None or count <= 1:
        for result in results:
            yield result
            done += size(result)
            passed_s = perf_counter() - begun_s
            if count > 1 and passed_s >= _TRIAL_S and passed_s / max(done, 1) * (total - done) >= _WORTH_S:
                break
    if done < total:
        yield from rest(done, count)


class Cores(Struct, frozen=True):
    """Runs batches on this machine, with the number of worker processes of `on_cores`."""

    jobs: int | None = None

    def results(self, plan: BatchPlan) -> Generator[BatchResult, None, None]:
        """Yield the results of the batches."""

        def rest(done: int, count: int) -> Generator[BatchResult, None, None]:
            from scbm.testing.batches.worker_processes import WorkerProcesses  # noqa: PLC0415 - few campaigns need them

            return WorkerProcesses(count).results(plan.after(done))

        total = plan.work.count - plan.start + 1
        return on_cores(InProcess().results(plan), total, self.jobs, rest, lambda result: result.summary.count)
