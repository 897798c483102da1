"""A story of one bus over DDS, and what it called back."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from scbm.nodes.buses.bus import Answered, Bus, Received
from scbm.nodes.buses.dds import open_dds
from support.loops import GUARD_S, run


class BusCallbacks:
    """What a bus called back, in its order, and a way to wait for it."""

    def __init__(self) -> None:
        self.answers: list[Answered] = []
        self.messages: list[Received] = []
        self.complaints: list[str] = []
        self._changed = asyncio.Event()

    def answered(self, answer: Answered) -> None:
        self.answers.append(answer)
        self._changed.set()

    def received(self, message: Received) -> None:
        self.messages.append(message)
        self._changed.set()

    def matched(self, _: int) -> None:
        self._changed.set()

    def complained(self, what: str) -> None:
        self.complaints.append(what)
        self._changed.set()

    async def until_answers(self, count: int) -> None:
        await self.until(lambda: len(self.answers) >= count)

    async def until(self, is_so: Callable[[], bool]) -> None:
        while not is_so():
            self._changed.clear()
            await self._changed.wait()


def over_bus(
    domain: int, story: Callable[[Bus, BusCallbacks], Coroutine[Any, Any, None]], guard_s: float = GUARD_S
) -> None:
    """Runs a story with a bus of a domain, whose node is `tester`, without a complaint."""

    async def play() -> None:
        callbacks = BusCallbacks()
        bus = open_dds("tester", domain, callbacks.complained)
        try:
            await story(bus, callbacks)
        finally:
            await bus.close()
        assert callbacks.complaints == []

    run(play(), guard_s)
