"""Links: how requests of a controller reach one resource, and replies come back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from scbm.cases.trace import Changes
    from scbm.nodes.buses.bus import Unmatched


@dataclass(frozen=True, slots=True)
class Correlation:
    """The identity of a request: its run and its number."""

    run: str
    number: int


@dataclass(frozen=True, slots=True)
class Reply:
    """A reply to a request; `stamp_ns` is its time of arrival, by the clock of the bus."""

    request: Correlation
    succeeded: bool
    measured: Changes
    stamp_ns: int


@dataclass(frozen=True, slots=True)
class Measurement:
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

    def why_unmatched(self) -> Unmatched | None:
        """Return why the resource is missing, if it is known."""
        ...
