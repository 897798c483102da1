"""Links: how requests of a controller reach one resource, and replies come back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.cases.trace import Changes
    from scbm.model import Resource
    from scbm.nodes.buses.bus import Bus, Unmatched
    from scbm.testing.real_drivers import GoalFate


CANCELLED_WITHIN_S = 10.0
"""A goal of an operation without a deadline that runs for so long after its cancellation has ignored it."""


class Correlation(Struct, frozen=True):
    """The identity of a request: its run and its number."""

    run: str
    number: int


class Reply(Struct, frozen=True):
    """A reply to a request; `stamp_ns` is its time of arrival, by the clock of the bus."""

    request: Correlation
    succeeded: bool
    measured: Changes
    stamp_ns: int


class Measurement(Struct, frozen=True):
    """Values that a resource published; `stamp_ns` is their time of arrival, by the clock of the bus."""

    values: Changes
    stamp_ns: int


class LinkListener(Protocol):
    """Gets what comes through a link."""

    def on_reply(self, resource: str, reply: Reply) -> None:
        """Handle a reply, perhaps to a request of another run."""
        ...

    def on_values(self, resource: str, measurement: Measurement) -> None:
        """Handle values that the resource published."""
        ...

    def on_presence(self, resource: str, *, is_there: bool) -> None:
        """Handle that the resource came, or was lost."""
        ...


class LinkContext(Struct, frozen=True):
    """The arguments of every link to a real driver.

    Attributes:
        bus: carries its messages.
        resource: a resource with a binding.
        listener: gets replies and changes of presence.
        warn: gets a sentence about each message that cannot be taken or sent.
        now_ns: the clock of the bus.
        count: gets what becomes of the goal of a request.
        within_s: returns how long the goal of a request may go on after it is cancelled.
    """

    bus: Bus
    resource: Resource
    listener: LinkListener
    warn: Callable[[str], None]
    now_ns: Callable[[], int]
    count: Callable[[Correlation, GoalFate], None] = lambda *_: None
    within_s: Callable[[Correlation], float] = lambda _: CANCELLED_WITHIN_S


class PresenceMonitor:
    """Reports to a listener each time that a resource comes, or is lost; a new resource counts as lost."""

    def __init__(self, resource: str, listener: LinkListener, is_there: Callable[[], bool]) -> None:
        """Made once for each link.

        Args:
            resource: the name of the resource.
            listener: gets the changes.
            is_there: returns whether the resource is there now.
        """
        self._resource = resource
        self._listener = listener
        self._is_there = is_there
        self._was_there = False

    def update(self) -> bool:
        """Report a change since the last call, if any; return whether the resource has just come."""
        is_there = self._is_there()
        if is_there == self._was_there:
            return False
        self._was_there = is_there
        self._listener.on_presence(self._resource, is_there=is_there)
        return is_there


class Link(Protocol):
    """Reaches one resource. It sends each request at most once, and passes on at most one reply to it."""

    @property
    def is_there(self) -> bool:
        """Whether requests reach the resource, and its replies come back."""
        ...

    @property
    def missing(self) -> tuple[str, ...]:
        """The services and topics without a peer; none while the resource is there."""
        ...

    def send(self, request: Correlation, values: Changes) -> None:
        """Send a request; it waits until the resource is there."""
        ...

    def cancel(self, request: Correlation) -> None:
        """Cancel a request; one that still waits here is dropped."""
        ...

    def end_run(self) -> bool:
        """Cancel what a run that is over has left at the driver; return whether some of it still goes on."""
        ...

    def why_unmatched(self) -> Unmatched | None:
        """Return why the resource is missing, if it is known."""
        ...
