"""What was called back, for tests that wait for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Kept(Generic[T]):
    """A callback that keeps what it gets, in its order. Made on the loop; `support.loops.run` is the guard."""

    def __init__(self) -> None:
        self.all: list[T] = []
        self._changed = asyncio.Event()

    def __call__(self, what: T) -> None:
        self.all.append(what)
        self._changed.set()

    async def until(self, is_enough: Callable[[list[T]], bool]) -> list[T]:
        """Waits until it is enough."""
        while not is_enough(self.all):
            self._changed.clear()
            await self._changed.wait()
        return self.all

    async def first(self, count: int) -> list[T]:
        """The first of them, once there are so many."""
        return (await self.until(lambda kept: len(kept) >= count))[:count]

    async def ends_with(self, last: T) -> list[T]:
        """All of them, once this is the last."""
        return await self.until(lambda kept: kept[-1:] == [last])
