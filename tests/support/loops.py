"""An event loop for a test, in a thread of its own: the main thread may have one already, of the browser's."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from threading import Thread
from typing import Any, TypeVar

T = TypeVar("T")

GUARD_S = 600.0
"""After so long something hangs, on a busy machine too. No test waits for it."""

LINE_GUARD_S = 120.0
"""After so long a process does not print the line that a test expects. A test that fails waits for it."""

PAGE_GUARD_S = 120.0
"""After so long a page has not what a test expects. A test that fails waits for it, so it is shorter."""


def run(coroutine: Coroutine[Any, Any, T], guard_s: float = GUARD_S) -> T:
    """What the coroutine returns. Raises what it raises, and `TimeoutError` if it hangs."""
    results: list[T] = []
    raised: list[BaseException] = []

    def work() -> None:
        try:
            results.append(asyncio.run(asyncio.wait_for(coroutine, guard_s)))
        except BaseException as error:  # noqa: BLE001 - it is raised where the test is
            raised.append(error)

    thread = Thread(target=work, name="loop of a test")
    thread.start()
    thread.join()
    if raised:
        raise raised[0]
    return results[0]
