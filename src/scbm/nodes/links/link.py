"""The way of requests from a controller to one resource, and of replies back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from scbm.cases.trace import Changes
    from scbm.nodes.buses.bus import Unmatched


@dataclass(frozen=True, slots=True)
class Correlation:
    """Which request of which run."""

    run: str
    number: int


@dataclass(frozen=True, slots=True)
class Reply:
    """A resource answered a request; `stamp_ns` says when that came, by the clock of the bus."""

    request: Correlation
    succeeded: bool
    measured: Changes
    stamp_ns: int


@dataclass(frozen=True, slots=True)
class Measurement:
    """A resource published values unasked; `stamp_ns` says when that came, by the clock of the bus."""

    values: Changes
    stamp_ns: int


class LinkListener(Protocol):
    """Gets what comes through a link."""

    def on_reply(self, resource: str, reply: Reply) -> None:
        """A reply came, perhaps to a request of another run."""
        ...

    def on_values(self, resource: str, measurement: Measurement) -> None:
        """Values came unasked."""
        ...

    def on_presence(self, resource: str, *, is_there: bool) -> None:
        """The resource came, or was lost."""
        ...


class Link(Protocol):
    """Reaches one resource. It never sends a request twice, and never two replies to one request."""

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
        """Why the resource is not there, if it shows."""
        ...
