"""A listener of links that keeps what it hears, and waits for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field

from scbm.nodes.links.link import Measurement, Reply


@dataclass
class Heard:
    """The callbacks of links. Made on the loop of the links."""

    replies: list[tuple[str, Reply]] = field(default_factory=list)
    values: list[tuple[str, Measurement]] = field(default_factory=list)
    presence: list[tuple[str, bool]] = field(default_factory=list)
    _news: asyncio.Event = field(default_factory=asyncio.Event)

    def on_reply(self, resource: str, reply: Reply) -> None:
        self.replies.append((resource, reply))
        self._news.set()

    def on_values(self, resource: str, measurement: Measurement) -> None:
        self.values.append((resource, measurement))
        self._news.set()

    def on_presence(self, resource: str, *, is_there: bool) -> None:
        self.presence.append((resource, is_there))
        self._news.set()

    async def until(self, is_heard: Callable[[], bool]) -> None:
        """Waits for something to be heard; `support.loops.run` is the guard."""
        while not is_heard():
            self._news.clear()
            await self._news.wait()

    def numbers(self) -> list[tuple[int, bool]]:
        """Which requests were answered, and how."""
        return [(reply.request.number, reply.succeeded) for _, reply in self.replies]
