"""Somebody in a DDS domain who only listens: what the nodes of a cell say to each other, for tests to wait for."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import Empty, Queue
from threading import Event, Thread
from typing import Any

from scbm.model import BehaviorModel
from scbm.realtime.bus import Received
from scbm.realtime.cell import CellTopics
from scbm.realtime.dds import open_dds
from support.loops import GUARD_S


class Overheard:
    """What is said, in the order in which it came.

    Attributes:
        all: the messages so far, each as JSON has it.
    """

    def __init__(self) -> None:
        self.all: list[dict[str, Any]] = []
        self._messages: Queue[dict[str, Any]] = Queue()

    def hear(self, received: Received) -> None:
        message = json.loads(str(received.data))
        self.all.append(message)
        self._messages.put(message)

    def until(self, is_meant: Callable[[dict[str, Any]], bool], guard_s: float = GUARD_S) -> dict[str, Any]:
        """Waits for a message; those before it are left behind."""
        try:
            while not is_meant(message := self._messages.get(timeout=guard_s)):
                pass
        except Empty:
            raise AssertionError(f"for {guard_s} s nothing like it was said: {self.all[-20:]}") from None
        return message

    def status(self, role: str) -> dict[str, Any]:
        """Waits until a node of a role says who it is."""
        return self.until(lambda message: message.get("kind") == "status" and message["role"] == role)

    def kind(self, kind: str) -> dict[str, Any]:
        """Waits for a message of a kind."""
        return self.until(lambda message: message.get("kind") == kind)

    def cancel(self) -> str:
        """Waits until a request is cancelled; its id."""
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
