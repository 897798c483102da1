"""An event loop in virtual time: when nothing is left to do, time jumps to the next timer.

So nodes on `loopback` run in no time at all and always alike, and a test may say when each thing happens.
"""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from threading import Thread
from typing import Any, TypeVar

T = TypeVar("T")

MAX_S = 100 * 3600
"""No run of a test takes so long; a run that does would never end."""


class HangsError(AssertionError):
    """Something is awaited that nothing will bring."""


class VirtualLoop(asyncio.SelectorEventLoop):
    """Threads take no time either: what they are given is done at once."""

    def __init__(self) -> None:
        self._jumps = _Jumps()
        super().__init__(self._jumps)

    def time(self) -> float:
        return self._jumps.now_ns / 1e9

    def now_ns(self) -> int:
        """What `time.monotonic_ns` is in wall time."""
        return self._jumps.now_ns

    def let_pass_ns(self, duration_ns: int) -> None:
        """The process is busy for so long: all timers are late."""
        self._jumps.now_ns += duration_ns

    async def settle(self, for_ns: int = 1_000) -> None:
        """Lets everything happen until this time has passed."""
        await asyncio.sleep(for_ns / 1e9)

    def run_in_executor(  # type: ignore[override] # a future of this loop
        self,
        executor: Executor | None,  # noqa: ARG002 - as asyncio has it
        func: Callable[..., T],
        *args: Any,  # noqa: ANN401 - as asyncio has it
    ) -> asyncio.Future[T]:
        future: asyncio.Future[T] = self.create_future()
        try:
            future.set_result(func(*args))
        except Exception as error:  # noqa: BLE001 - the caller that awaits it gets it
            future.set_exception(error)
        return future


class _Jumps(selectors.DefaultSelector):
    """Waits for nothing but timers."""

    now_ns = 1_000_000_000

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None:
            raise HangsError("something is awaited that nothing will bring")
        self.now_ns += round(timeout * 1e9)
        if self.now_ns > MAX_S * 10**9:
            raise HangsError(f"this is not over after {MAX_S} s")
        return []


def run_virtually(main: Callable[[VirtualLoop], Coroutine[Any, Any, T]]) -> T:
    """Return what the coroutine returns. Raise what it raises, and `HangsError` if it would never end."""
    results: list[T] = []
    raised: list[BaseException] = []

    def work() -> None:
        loop = VirtualLoop()
        try:
            results.append(loop.run_until_complete(main(loop)))
        except BaseException as error:  # noqa: BLE001 - it is raised where the test is
            raised.append(error)
        finally:
            loop.close()

    thread = Thread(target=work, name="virtual loop of a test")
    thread.start()
    thread.join()
    if raised:
        raise raised[0]
    return results[0]
