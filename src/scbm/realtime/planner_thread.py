"""The thread in which a controller plans: a process that ends does not wait for it."""

from __future__ import annotations

from concurrent.futures import Executor, Future
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


class PlannerThread(Executor):
    """Does one thing after another.

    At its end Python waits for the threads of its own executors, and a plan that nobody wants any more may take long.
    """

    def __init__(self) -> None:
        self._work: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        Thread(target=self._do, name="planner", daemon=True).start()

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401 - as in `Executor`
        """Queues a call."""
        future: Future[T] = Future()
        self._work.put(lambda: _answer(future, fn, *args, **kwargs))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002, FBT001, FBT002 - the same
        """Ends the thread behind what is queued; nobody waits for that."""
        self._work.put(None)

    def _do(self) -> None:
        while (work := self._work.get()) is not None:
            work()


def _answer(future: Future[T], fn: Callable[..., T], *args: Any, **kwargs: Any) -> None:  # noqa: ANN401 - as in `Executor`
    if not future.set_running_or_notify_cancel():
        return
    try:
        future.set_result(fn(*args, **kwargs))
    except BaseException as error:  # noqa: BLE001 - whoever awaits it gets it
        future.set_exception(error)
