"""The nodes of a cell: each publishes its status on one latched topic, and receives that of the others."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.nodes.node_messages import NotAMessageError, Status, decode, encode

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.nodes.buses.bus import Bus, Received
    from scbm.nodes.roles.cell_topics import CellTopics

UNIQUE = ("controller", "tester")
"""A cell has one of each."""


class Membership:
    """The status of a node, and the statuses that it received.

    Attributes:
        own: this node.
        changed: called whenever a node comes or leaves.
    """

    def __init__(self, bus: Bus, topics: CellTopics, own: Status) -> None:
        self.own = own
        self.changed: Callable[[], None] = lambda: None
        self._others: dict[int, Status] = {}
        self._unreadable: dict[int, str] = {}
        self._publisher = bus.publisher(topics.status)
        self._publisher.publish(encode(own))
        bus.subscribe(topics.status, self._receive, left=self._lose)

    def publish_troubles(self, troubles: tuple[str, ...], mismatched: tuple[str, ...] = ()) -> None:
        """Publish what this node lacks, and which of it needs a change of code. Raises `BusError`."""
        own = replace(self.own, troubles=troubles, mismatched=mismatched)
        if own != self.own:
            self._publisher.publish(encode(own))
            self.own = own

    @property
    def others(self) -> tuple[Status, ...]:
        """Return the other nodes, in the order of their arrival."""
        return tuple(self._others.values())

    @property
    def unreadable(self) -> tuple[str, ...]:
        """Return why statuses could not be parsed: nodes of another version, or other programs."""
        return tuple(self._unreadable.values())

    def controller(self) -> Status | None:
        """Return the controller, if there is one: the oldest, as the others have to leave."""
        return min(self._of("controller"), key=_age, default=None)

    def node_of(self, resource: str) -> Status | None:
        """Return the oldest node that simulates a resource, if there is one."""
        return min((other for other in self._of("resources") if resource in other.resources), key=_age, default=None)

    def _of(self, role: str) -> list[Status]:
        return [other for other in self._others.values() if other.role == role]

    def rival(self) -> Status | None:
        """Return an older node that excludes this one, which then has to leave."""
        return next((other for other in self._others.values() if self._is_rival(other)), None)

    def _is_rival(self, other: Status) -> bool:
        own = self.own
        if other.role != own.role or _age(other) > _age(own):
            return False
        return own.role in UNIQUE or any(resource in other.resources for resource in own.resources)

    def _receive(self, received: Received) -> None:
        try:
            message = decode(received.data)
        except NotAMessageError as error:
            self._unreadable[received.source] = str(error)
        else:
            if isinstance(message, Status):
                self._others[received.source] = message
                self._unreadable.pop(received.source, None)
        self.changed()

    def _lose(self, source: int) -> None:
        self._others.pop(source, None)
        self._unreadable.pop(source, None)
        self.changed()


def _age(status: Status) -> tuple[int, str]:
    """Of two nodes, all nodes agree which one is older: each publishes once when it began.

    With a wrong clock the first node may have to leave; never do both or neither of them leave.
    """
    return status.since_ns, status.node
