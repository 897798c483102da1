"""Notices that this process did not run for a while: it was stopped, or its machine slept.

Others have missed it then, and it may have missed them. What two participants of DDS know of each other after that is
not always whole again; a new participant is nobody's acquaintance.
"""

from __future__ import annotations

from threading import Event, Thread
from time import monotonic_ns
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop
    from collections.abc import Callable

_LOOK_S = 0.2
MISSED_NS = 1_000_000_000
"""Who was away for so long is missed by the others: as long as a lease."""


class AbsenceWatch:
    """Looks at the clock, in a thread of its own: a busy event loop is no absence."""

    def __init__(self, loop: AbstractEventLoop, was_away: Callable[[], None]) -> None:
        """Begins. `was_away` is called on the loop, once."""
        self._loop = loop
        self._was_away = was_away
        self._is_over = Event()
        self._last_ns = monotonic_ns()
        Thread(target=self._look, name="absence", daemon=True).start()

    @property
    def has_noticed(self) -> bool:
        """Whether there was an absence, even if nobody was called yet."""
        return monotonic_ns() - self._last_ns > MISSED_NS

    def close(self) -> None:
        """Looks no more."""
        self._is_over.set()

    def _look(self) -> None:
        while not self._is_over.wait(_LOOK_S):
            now_ns = monotonic_ns()
            if now_ns - self._last_ns > MISSED_NS:
                self._loop.call_soon_threadsafe(self._was_away)
                return
            self._last_ns = now_ns
