"""A silent participant of a DDS domain: tests wait for messages that the nodes of a cell send each other."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Condition, Event, Thread
from typing import Any

from scbm.model import BehaviorModel
from scbm.nodes.buses.bus import Received
from scbm.nodes.buses.dds import open_dds
from scbm.nodes.roles.cell_topics import CellTopics
from support.loops import GUARD_S


class Overheard:
    """The overheard messages as JSON."""

    def __init__(self) -> None:
        self._overheard: list[dict[str, Any]] = []
        self._news = Condition()

    def hear(self, received: Received) -> None:
        with self._news:
            self._overheard.append(json.loads(str(received.message.data)))
            self._news.notify_all()

    def until(self, is_meant: Callable[[dict[str, Any]], bool], guard_s: float = GUARD_S) -> dict[str, Any]:
        """The first such message; it is waited for, if it has not come yet."""
        with self._news:
            self._news.wait_for(lambda: any(map(is_meant, self._overheard)), guard_s)
            found = next(filter(is_meant, self._overheard), None)
            assert found is not None, f"no such message within {guard_s} s: {self._overheard[-20:]}"
            return found

    def status(self, role: str) -> dict[str, Any]:
        """What a node of a role says of itself."""
        return self.until(lambda message: message.get("kind") == "status" and message["role"] == role)

    def kind(self, kind: str) -> dict[str, Any]:
        """A message of a kind."""
        return self.until(lambda message: message.get("kind") == kind)

    def cancel(self) -> str:
        """The id of a request that is cancelled."""
        return str(self.until(lambda message: message.get("cancel") is True)["id"])


@contextmanager
def overhearing(domain: int, model: BehaviorModel) -> Iterator[Overheard]:
    """Listens to the cell of a model: all but the replies, as who hears them would be taken for a controller."""
    heard, is_there = Overheard(), Event()
    loops: list[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = []

    async def listen() -> None:
        bus, topics, is_over = open_dds("listener", domain, print), CellTopics.of(model), asyncio.Event()
        requests = [topics.request(resource.name) for resource in model.resources]
        for topic in (topics.status, topics.case, topics.run, *requests):
            bus.subscribe(topic, heard.hear)
        loops.append((asyncio.get_running_loop(), is_over))
        is_there.set()
        await is_over.wait()
        await bus.close()

    thread = Thread(target=asyncio.run, args=(listen(),), name="listener")
    thread.start()
    assert is_there.wait(GUARD_S)
    try:
        yield heard
    finally:
        loop, is_over = loops[0]
        loop.call_soon_threadsafe(is_over.set)
        thread.join(GUARD_S)
