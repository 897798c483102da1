"""Real drivers: the links to those resources that a controller reaches as the model binds them (decision 27)."""

from __future__ import annotations

import asyncio
from time import monotonic_ns
from typing import TYPE_CHECKING

from scbm.model import TopicPair
from scbm.realtime.bus import Topic
from scbm.realtime.links import Reply
from scbm.realtime.measured import MeasuredTopics
from scbm.realtime.service_link import ServiceLink
from scbm.realtime.topic_link import TopicLink

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model import Resource
    from scbm.realtime.bus import Bus
    from scbm.realtime.links import Correlation, Hearer, Link
    from scbm.trace import Changes


def bound_link(bus: Bus, resource: Resource, hearer: Hearer, complain: Callable[[str], None]) -> Link:
    """The link to a real driver, which also hears what that measures.

    Args:
        bus: what drivers are reached by.
        resource: one with a binding.
        hearer: whom it tells what comes.
        complain: gets a sentence about each message that cannot be taken.
    """
    assert resource.binding is not None  # noqa: S101 - whoever calls has looked
    measured = MeasuredTopics(bus, resource, hearer)
    requests = resource.binding.requests
    if requests is None:
        return _OnlyMeasures(resource.name, measured, hearer)
    if isinstance(requests, TopicPair):
        topics = (Topic(requests.request), Topic(requests.reply))
        return TopicLink(bus, resource.name, topics, hearer, complain)
    return ServiceLink(bus, resource, hearer)


class _OnlyMeasures:
    """A resource that takes no requests; one that is sent all the same has failed, as nobody can carry it out."""

    def __init__(self, resource: str, measured: MeasuredTopics, hearer: Hearer) -> None:
        self._resource = resource
        self._measured = measured
        self._hearer = hearer

    @property
    def is_there(self) -> bool:
        return self._measured.is_there

    def send(self, request: Correlation, values: Changes) -> None:  # noqa: ARG002 - nobody hears them
        reply = Reply(request, succeeded=False, measured=(), stamp_ns=monotonic_ns())
        asyncio.get_running_loop().call_soon(self._hearer.heard_reply, self._resource, reply)

    def cancel(self, request: Correlation) -> None:
        """It has failed already."""

    def why_alone(self) -> str | None:
        return self._measured.why_alone()
