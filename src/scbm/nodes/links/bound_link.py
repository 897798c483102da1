"""Links to real drivers, as the bindings of the model describe them (decision 27).

Which real drivers are not there, and why.
"""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING

from msgspec import Struct, structs

from scbm.model.lazy_exports import load_named
from scbm.nodes.bindings.ros_binding import (
    ActionCall,
    CallChoice,
    RequestBinding,
    ServiceCall,
    TopicPair,
    binding_of,
)
from scbm.nodes.buses.bus import MISMATCHES, Unmatched, UnmatchedKind
from scbm.nodes.links.link import LinkContext, PresenceMonitor, Reply
from scbm.nodes.links.measured_topics import MeasuredTopics
from scbm.nodes.node_messages import Trouble

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.cases.trace import Changes
    from scbm.nodes.links.link import Correlation, Link, Measurement

_MAX_ANSWERED = 100
"""The number of answered requests that are kept to detect second replies, which come soon."""


class BoundLink:
    """The link to a real driver: where its requests go, if it takes any, and the topics that it measures by.

    The resource is there when all of these are. A request goes out as soon as it can be taken, whatever is measured;
    one to a driver that takes no requests has failed.

    A second reply is reported once in each run; the listener ignores it.
    """

    def __init__(self, context: LinkContext) -> None:
        """Made once for each resource, on the event loop of the bus."""
        self._resource = context.resource.name
        self._context = context
        self._presence = PresenceMonitor(self._resource, context.listener, lambda: self.is_there)
        self._answered: deque[Correlation] = deque(maxlen=_MAX_ANSWERED)
        self._answered_twice: deque[str] = deque(maxlen=_MAX_ANSWERED)
        self._measured = MeasuredTopics(context.bus, context.resource, self)
        self._requests = _requests(structs.replace(context, listener=self))

    @property
    def is_there(self) -> bool:
        """Whether all services and topics of the binding have a peer, and no service has several."""
        return not self._measured.missing and (self._requests is None or self._requests.is_there)

    @property
    def missing(self) -> tuple[str, ...]:
        """The services and topics without a peer."""
        requests = () if self._requests is None else self._requests.missing
        return (*requests, *self._measured.missing)

    def send(self, request: Correlation, values: Changes) -> None:
        """Send a request, as the binding says."""
        if self._requests is not None:
            self._requests.send(request, values)
            return
        reply = Reply(request, succeeded=False, measured=(), stamp_ns=self._context.now_ns())
        asyncio.get_running_loop().call_soon(self._context.listener.on_reply, self._resource, reply)

    def cancel(self, request: Correlation) -> None:
        """Cancel a request."""
        if self._requests is not None:
            self._requests.cancel(request)

    def end_run(self) -> bool:
        """Cancel what a run that is over has left at the driver; return whether some of it still goes on."""
        return self._requests is not None and self._requests.end_run()

    def why_unmatched(self) -> Unmatched | None:
        """Return why a peer is missing, if it is known."""
        requests = None if self._requests is None else self._requests.why_unmatched()
        return Unmatched.by_all([requests, self._measured.why_unmatched()])

    # callbacks of its parts

    def on_reply(self, resource: str, reply: Reply) -> None:
        """Handle a reply."""
        if reply.request in self._answered:
            self._report_second_reply(reply.request)
        else:
            self._answered.append(reply.request)
        self._context.listener.on_reply(resource, reply)

    def _report_second_reply(self, request: Correlation) -> None:
        if request.run not in self._answered_twice:
            self._answered_twice.append(request.run)
            which = f"a second reply of `{self._resource}` to request {request.number} is dropped"
            self._context.warn(f"{which}: a driver answers twice, or two drivers answer")

    def on_values(self, resource: str, measurement: Measurement) -> None:
        """Handle values that the resource published."""
        self._context.listener.on_values(resource, measurement)

    def on_presence(self, resource: str, *, is_there: bool) -> None:  # noqa: ARG002 - of a part alone
        """Handle a change of presence of a part."""
        self._presence.update()


LINKS: dict[type[RequestBinding], str] = {
    ActionCall: "scbm.nodes.links.action_link:ActionLink",
    ServiceCall: "scbm.nodes.links.service_link:ServiceLink",
    CallChoice: "scbm.nodes.links.service_link:ServiceLink",  # without a service or an action
    TopicPair: "scbm.nodes.links.topic_link:bound_topic_link",
}
"""What makes the link to a driver from its `LinkContext`, as `package.module:name`, for each kind of binding."""


def _requests(context: LinkContext) -> Link | None:
    """Return the link that carries requests; `None` if the resource only measures."""
    requests = binding_of(context.resource).requests
    if requests is None:
        return None
    kind = type(next(iter((*requests.services, *requests.actions)), requests))
    if kind not in LINKS:
        raise TypeError(f"no link reaches a resource by a {kind.__name__}: add one to LINKS")
    link: Link = load_named(LINKS[kind])(context)
    return link


class MissingDrivers(Struct):
    """Reports missing real resources.

    Attributes:
        links: those to real resources, by their names.
    """

    links: Mapping[str, Link]
    _suspects: tuple[str, ...] = ()

    def look(self) -> tuple[Trouble, ...]:
        """Return what is wrong with each missing resource.

        A driver that does not go with its binding may just be being replaced: it is believed at the second look.
        """
        before, self._suspects = self._suspects, ()
        troubles = []
        for name, link in self.links.items():
            if link.is_there:
                continue
            alone = link.why_unmatched() or Unmatched(f"there is no peer at {_listed(link.missing)}")
            kind = alone.kind
            if kind in MISMATCHES:
                self._suspects += (name,)
                kind = kind if name in before else UnmatchedKind.ABSENT
            troubles.append(Trouble(kind, f"`{name}` is not reached: {alone.why}"))
        return tuple(troubles)


def _listed(places: tuple[str, ...]) -> str:
    return ", ".join(f"`{place}`" for place in dict.fromkeys(places))
