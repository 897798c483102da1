"""Passes work from the threads of a middleware to the event loop: in order, with one wake-up for a burst."""

from __future__ import annotations

import os
import sys
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop
    from collections.abc import Callable


class HandOver:
    """Queues work of any thread for the loop. The queue has no bound, so a slow loop loses nothing."""

    def __init__(self, loop: AbstractEventLoop) -> None:
        self._loop = loop
        self._bell = _Bell(loop, self._do)
        self._work: deque[Callable[[], None]] = deque()
        self._is_woken = False
        self._is_open = True

    def __call__(self, work: Callable[[], None]) -> None:
        """Queue work for the loop."""
        self._work.append(work)
        if not self._is_woken:
            self._is_woken = True
            self._bell.ring()

    def stop(self) -> None:
        """Stop; queued work is dropped. Called on the loop."""
        self._is_open = False

    def close(self) -> None:
        """Close. Called on the loop, when no thread queues work any more."""
        self._bell.close()

    def _do(self) -> None:
        # The flag first: work that is queued from here on wakes the loop again, even if it is done in this round.
        self._is_woken = False
        for _ in range(len(self._work)):
            work = self._work.popleft()
            if self._is_open:
                self._do_one(work)

    def _do_one(self, work: Callable[[], None]) -> None:
        try:
            work()
        except Exception as error:  # noqa: BLE001 - as asyncio does it: one failure does not take others with it
            self._loop.call_exception_handler({"message": "a callback of a bus failed", "exception": error})


class _ThreadsafeBell:
    """Wakes the loop on any system."""

    def __init__(self, loop: AbstractEventLoop, call: Callable[[], None]) -> None:
        self._loop = loop
        self._call = call

    def ring(self) -> None:
        """Wake the loop. Called on any thread."""
        # A closed loop calls nothing any more, and this thread has no caller that could handle the error.
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._call)

    def close(self) -> None:
        """Do nothing."""


if sys.platform == "linux":

    class _Bell:
        """Wakes the loop by an eventfd of Linux: a round trip is a tenth shorter (benchmarks/round_trip.py)."""

        def __init__(self, loop: AbstractEventLoop, call: Callable[[], None]) -> None:
            self._loop = loop
            self._call = call
            self._event = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
            loop.add_reader(self._event, self._rung)

        def ring(self) -> None:
            """Wake the loop. Called on any thread."""
            os.eventfd_write(self._event, 1)

        def close(self) -> None:
            """Stop waking the loop."""
            self._loop.remove_reader(self._event)
            os.close(self._event)

        def _rung(self) -> None:
            os.eventfd_read(self._event)
            self._call()

else:
    _Bell = _ThreadsafeBell
