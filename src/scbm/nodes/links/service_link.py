"""A resource that is reached by services: each request is a call, and the response is its reply."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from msgspec import Struct, field

from scbm.nodes.bindings.ros_binding import ServiceCall, binding_of, request_values
from scbm.nodes.buses.bus import BusError, Service, Unmatched, UnmatchedKind
from scbm.nodes.links.link import PresenceMonitor, Reply
from scbm.nodes.links.measured_topics import outcome_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.cases.trace import Changes
    from scbm.nodes.buses.bus import Answered, Bus, Client
    from scbm.nodes.links.link import Correlation, LinkContext


class ServiceLink:
    """Calls services, and passes their responses on as replies.

    - A request waits until its own service is there, unless it is cancelled before; then it is called, once.
    - A service with several servers counts as not there: each of them would carry out the request.
    - Services of ROS 2 cannot be cancelled: after `cancel` the driver goes on, and its response is dropped.
    - A server that is lost with a call under way gives no reply: whether it did the work is unknown, and the call is
      not repeated. The deadlines of the model decide.
    - A request that carries a value without a service has failed: no driver can carry it out. No action of the model
      sends such a one, but an initial state or an injection may.
    """

    def __init__(self, context: LinkContext) -> None:
        """Made once for each resource that is bound to services, on the event loop of the bus."""
        binding = binding_of(context.resource)
        self._context = context
        self._resource = context.resource.name
        assert binding.requests is not None  # noqa: S101 - checked by the caller
        self._requests = binding.requests
        self._presence = PresenceMonitor(self._resource, context.listener, lambda: self.is_there)
        services = dict.fromkeys(Service(call.name, call.type) for call in binding.calls)
        self._lines = {service.name: _CallQueue(service, self._answered, self._lost) for service in services}
        for line in self._lines.values():
            line.open(context.bus, self._presence.update)

    @property
    def is_there(self) -> bool:
        """Whether all services have exactly one server."""
        return all(line.is_there for line in self._lines.values())

    @property
    def missing(self) -> tuple[str, ...]:
        """The services without a server."""
        return tuple(service.name for service in self._lonely())

    def send(self, request: Correlation, values: Changes) -> None:
        """Call the service of a request, as soon as it has a server."""
        call = self._requests.call_for(values)
        if not isinstance(call, ServiceCall):
            reply = Reply(request, succeeded=False, measured=(), stamp_ns=self._context.now_ns())
            # Later, as every reply: the sender does not expect a callback while it sends.
            asyncio.get_running_loop().call_soon(self._context.listener.on_reply, self._resource, reply)
        else:
            self._lines[call.name].send(_PendingCall(request, call, request_values(call.request, dict(values))))

    def cancel(self, request: Correlation) -> None:
        """Cancel a request: it is not called, or its response is dropped."""
        for line in self._lines.values():
            if line.forget(request) and (doubt := line.first_doubt()) is not None:
                self._context.warn(f"request {request.number} to `{self._resource}` got no response: {doubt}")

    def end_run(self) -> bool:
        """Return that nothing goes on: the run cancels its requests."""
        return False

    def why_unmatched(self) -> Unmatched | None:
        """Return why a service has no server, if it is known, or that it has several."""
        crowded = [line.why_crowded() for line in self._lines.values()]
        return Unmatched.by_all([*crowded, *map(self._context.bus.why_unmatched, self._lonely())])

    def _lonely(self) -> list[Service]:
        return [line.service for line in self._lines.values() if not line.has_server]

    def _answered(self, asked: _PendingCall, answered: Answered) -> None:
        succeeded, measured = outcome_of(asked.call, answered.message)
        reply = Reply(asked.request, succeeded, measured, answered.stamp_ns)
        self._context.listener.on_reply(self._resource, reply)

    def _lost(self, asked: _PendingCall, error: BusError) -> None:
        self._context.warn(f"request {asked.request.number} to `{self._resource}` is lost: {error.message}")


class _PendingCall(Struct, frozen=True):
    """A request with its service call.

    Attributes:
        request: which.
        call: the service, and how its response is read.
        fields: what the call says.
    """

    request: Correlation
    call: ServiceCall
    fields: dict[str, object]


class _CallQueue(Struct):
    """One service with its waiting requests and open calls.

    Attributes:
        service: the service.
        answered: gets a request that is still wanted, and the response to its call.
        lost: gets a request that the bus does not take, and why; it keeps none of those behind it.
        waiting: in the order in which they came.
        called: by the number of the call.
        client: what calls it.
        is_understood: whether the server has answered; `None` before the first call that is answered or cancelled.
    """

    service: Service
    answered: Callable[[_PendingCall, Answered], None]
    lost: Callable[[_PendingCall, BusError], None]
    waiting: dict[Correlation, _PendingCall] = field(default_factory=dict)
    called: dict[int, _PendingCall] = field(default_factory=dict)
    client: Client | None = None
    is_understood: bool | None = None

    @property
    def is_there(self) -> bool:
        return self.client is not None and self.client.peers == 1

    @property
    def has_server(self) -> bool:
        return self.client is not None and self.client.peers > 0

    def why_crowded(self) -> Unmatched | None:
        """Return that the service has several servers, with their names; `None` if it has not."""
        if self.client is None or self.client.peers <= 1:
            return None
        names = ", ".join(self.client.server_names())
        why = f"`{self.service.name}` has {self.client.peers} servers, and each would carry out every request"
        return Unmatched(f"{why}: {names}" if names else why, UnmatchedKind.CROWDED)

    def open(self, bus: Bus, matched: Callable[[], object]) -> None:
        def call_and_report(_: int) -> None:
            self._call_waiting()
            matched()

        self.client = bus.client(self.service, self._receive, call_and_report)

    def send(self, asked: _PendingCall) -> None:
        self.waiting[asked.request] = asked
        self._call_waiting()

    def forget(self, request: Correlation) -> bool:
        """Drop a request; return whether its call was under way."""
        self.waiting.pop(request, None)
        before = len(self.called)
        self.called = {number: asked for number, asked in self.called.items() if asked.request != request}
        return len(self.called) < before

    def first_doubt(self) -> str | None:
        """Return why the server may not understand calls, if none was answered, and once; else `None`."""
        if self.client is None or self.is_understood is not None:
            return None
        self.is_understood = False
        return self.client.why_doubtful()

    def _call_waiting(self) -> None:
        while self.waiting and self.client is not None and self.is_there:
            asked = self.waiting.pop(next(iter(self.waiting)))
            try:
                self.called[self.client.call(asked.fields)] = asked
            except BusError as error:
                self.lost(asked, error)

    def _receive(self, answered: Answered) -> None:
        asked = self.called.pop(answered.call, None)
        if asked is not None:
            self.is_understood = True
            self.answered(asked, answered)
