"""Run batches in worker processes on this machine (`-j`).

Workers are spawned, not forked. A fork copies a process with threads, such as that of a progress bar, whose locks
stay locked in the copy. Spawning works the same on every system, and costs each worker about half a second.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
from collections import deque
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

from msgspec import Struct

from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.testing.batches.campaign_runs import BatchSizes, run_batch, tester_of

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator

    from scbm.testing.batches.campaign_runs import BatchPlan, BatchRequest, BatchResult
    from scbm.testing.batches.campaign_work import CampaignWork
    from scbm.testing.tester import Tester

_Request = TypeVar("_Request")
_Result = TypeVar("_Result")

_WINDOW = 4
"""Maximum number of unfinished batches for each worker: enough that none waits, few enough to keep memory small."""

_MAX_LOSSES = 5
"""Number of times that workers may be lost during one batch before the campaign ends with an error."""


class WorkerProcesses:
    """Runs batches in worker processes that end with the campaign, or with this process."""

    def __init__(self, count: int) -> None:
        """Take the number of worker processes."""
        self._count = count

    def results(self, plan: BatchPlan) -> Generator[BatchResult, None, None]:
        """Yield the results of the batches.

        Raises:
            InputError: workers were lost again and again during one batch.
        """
        workers = WorkerPool(_take_campaign, pickle.dumps(plan.work), self._count)
        pending: deque[_Pending] = deque()
        sizes, first, losses = BatchSizes(), plan.start, 0
        try:
            while pending or first <= plan.work.count:
                while len(pending) < _WINDOW * self._count and first <= plan.work.count:
                    request = plan.request(first, sizes.next())
                    pending.append(_Pending(request, workers.submit(_run_in_worker, request)))
                    first = request.last + 1
                try:
                    result = pending[0].future.result()
                except BrokenProcessPool:
                    losses += 1
                    if losses == _MAX_LOSSES:
                        raise _lost(pending[0].request) from None
                    workers.restart()
                    for each in pending:
                        if each.is_lost:
                            each.future = workers.submit(_run_in_worker, each.request)
                    continue
                pending.popleft()
                losses = 0
                sizes.observe(result.summary.count, result.seconds)
                yield result
        finally:
            workers.kill()


class _Pending(Struct):
    """A batch that is not merged yet."""

    request: BatchRequest
    future: Future[BatchResult]

    @property
    def is_lost(self) -> bool:
        """Whether the batch ended with its worker, or with another one: a pool that lost one ends all."""
        return self.future.done() and isinstance(self.future.exception(), BrokenProcessPool)


class WorkerPool:
    """A pool of worker processes, each with a value that was sent once. Workers end with this process."""

    def __init__(self, begin: Callable[[bytes], None], sent: bytes, count: int) -> None:
        """Take the function that prepares a worker, its argument, and the number of workers."""
        self._begin = begin
        self._sent = sent
        self._count = count
        self._others = frozenset(process.pid for process in multiprocessing.active_children())
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        spawn = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(self._count, spawn, _begin_worker, (self._begin, self._sent))

    def submit(self, function: Callable[[_Request], _Result], request: _Request) -> Future[_Result]:
        """Queue a request. Raise no error for lost workers; the result does."""
        try:
            with _without_interrupts():  # a request may start a process
                return self._pool.submit(function, request)
        except BrokenProcessPool as error:
            failed: Future[_Result] = Future()
            failed.set_exception(error)
            return failed

    def results(
        self, function: Callable[[_Request], _Result], requests: Iterable[_Request], done: str, again: str
    ) -> Generator[_Result, None, None]:
        """Yield the results of all requests in their order, and then end the workers.

        Args:
            function: what a worker does with a request.
            requests: the requests.
            done: what workers do, in the past tense, for the message about a lost worker.
            again: the same as an imperative, for its remedy.

        Raises:
            InputError: a worker process was lost.
        """
        try:
            pending = [self.submit(function, request) for request in requests]
            for future in pending:
                yield future.result()
        except BrokenProcessPool:
            message, remedy = f"a worker process ended while it {done}", f"was the memory used up? {again} with `-j 1`"
            raise InputError([Diagnostic(Slug.WORKERS_LOST, message, Place("-j"), remedy)]) from None
        finally:
            self.kill()

    def restart(self) -> None:
        """Start new workers in place of all others."""
        self.kill()
        self._pool = self._new_pool()

    def kill(self) -> None:
        """End all workers at once: their results are no longer needed, and a request may take long."""
        for process in multiprocessing.active_children():
            if process.pid not in self._others:
                process.kill()
        self._pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Hold Ctrl-C and SIGTERM back, and handle them at the end of the block.

    A process that starts reads what this one writes, and shows a traceback if that ends in the middle. Processes that
    are started in the block never get Ctrl-C. A mask alone does not hold a signal back: other threads may get it, and
    Python handles it in the main thread.
    """
    held: list[int] = []
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    handled = [number for number, handler in before.items() if handler not in (signal.SIG_IGN, None)]
    if threading.current_thread() is not threading.main_thread():  # which alone sets handlers, and handles signals
        handled = []
    for number in handled:
        signal.signal(number, lambda number, _: held.append(number))
    try:
        with _inherited_mask():
            yield
    finally:
        for number in handled:
            signal.signal(number, before[number])
        if held:
            signal.raise_signal(held[0])


@contextmanager
def _inherited_mask() -> Iterator[None]:
    """Block Ctrl-C for this thread, and for the processes that it starts in the block for as long as they run."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _lost(request: BatchRequest) -> InputError:
    message = f"worker processes ended {_MAX_LOSSES} times while they ran cases {request.first} to {request.last}"
    remedy = "was the memory used up? run with `-j 1` to see the case"
    return InputError([Diagnostic(Slug.WORKERS_LOST, message, Place("-j"), remedy)])


# in a worker

_campaigns: list[tuple[CampaignWork, Tester]] = []
"""The campaign of this worker process, with its tester, which keeps plans for later cases."""


def _begin_worker(begin: Callable[[bytes], None], sent: bytes) -> None:
    """Prepare a worker process, which ends with its parent however that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where Ctrl-C cannot be held back
    threading.Thread(target=_end_with_parent, daemon=True).start()
    begin(sent)


def _take_campaign(sent: bytes) -> None:
    work: CampaignWork = pickle.loads(sent)  # noqa: S301 - from our own parent
    _campaigns[:] = [(work, tester_of(work))]


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run_in_worker(request: BatchRequest) -> BatchResult:
    ((work, tester),) = _campaigns
    return run_batch(work, tester, request)
