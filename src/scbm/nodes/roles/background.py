"""A thread for long work, which does not keep the process alive."""

from __future__ import annotations

from concurrent.futures import Executor, Future
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


class Background(Executor):
    """Runs one piece of work after the other.

    A `ThreadPoolExecutor` keeps the process alive until its work is done, and a thread cannot be interrupted.
    """

    def __init__(self, name: str) -> None:
        self._asked: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._waiting: list[Future[Any]] = []
        Thread(target=self._go_on, name=name, daemon=True).start()

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401 - as it is defined
        """Queue work; it starts when earlier work is done, unless it is cancelled before."""
        future: Future[T] = Future()
        self._waiting = [other for other in self._waiting if not other.done()] + [future]

        def work() -> None:
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(fn(*args, **kwargs))
                except Exception as error:  # noqa: BLE001 - the future passes it on
                    future.set_exception(error)

        self._asked.put(work)
        return future

    def shutdown(self, wait: bool = False, *, cancel_futures: bool = True) -> None:  # noqa: ARG002, FBT001, FBT002 - as it is defined
        """Stop without waiting: queued work is dropped."""
        for future in self._waiting:
            future.cancel()
        self._asked.put(None)

    def _go_on(self) -> None:
        while (work := self._asked.get()) is not None:
            work()
