"""The topics of a cell, the ids of its runs and nodes, and its members.

Each node publishes its status on one latched topic, and receives that of the others.
"""

from __future__ import annotations

import os
import socket
from dataclasses import dataclass, replace
from time import monotonic_ns, time_ns
from typing import TYPE_CHECKING
from uuid import uuid4

from scbm.nodes.buses.bus import Topic
from scbm.nodes.node_messages import VERSION, NotAMessageError, Status, decode, encode

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from scbm.model import BehaviorModel
    from scbm.nodes.buses.bus import Bus, Received


START_WITHIN_S = 10.0
"""Longer than a tester waits for the nodes that prepare its run."""


@dataclass(frozen=True, slots=True)
class NodeContext:
    """The arguments of every node of a cell.

    Attributes:
        bus: carries its messages; the code that opened it closes it.
        model: the model of the cell.
        status: the first status that the node publishes.
        warn: gets a sentence about each message that cannot be taken.
        report: gets a line about each change of the node, for its log.
        now_ns: the clock that the bus stamps messages by, and that the event loop goes by.
        start_within_s: the time after which controller and resources drop a tester that prepared a run and has not
            started it.
    """

    bus: Bus
    model: BehaviorModel
    status: Status
    warn: Callable[[str], None]
    report: Callable[[str], None] = lambda _: None
    now_ns: Callable[[], int] = monotonic_ns
    start_within_s: float = START_WITHIN_S


@dataclass(frozen=True, slots=True)
class CellTopics:
    """The topics of the cell of a model.

    Attributes:
        root: what all their names begin with.
    """

    root: str

    @staticmethod
    def of(model: BehaviorModel) -> CellTopics:
        """Return the topics of a model; dots in names become levels, as ROS 2 has no dots."""
        return CellTopics(f"/scbm/{_segment(model.name)}")

    @property
    def status(self) -> Topic:
        """The topic on which each node publishes its status."""
        return Topic(f"{self.root}/status", is_latched=True)

    @property
    def case(self) -> Topic:
        """The topic from the tester to all nodes."""
        return Topic(f"{self.root}/case")

    @property
    def run(self) -> Topic:
        """The topic from the controller to the tester."""
        return Topic(f"{self.root}/run")

    @property
    def simulated(self) -> Topic:
        """The topic from simulated resources to the tester."""
        return Topic(f"{self.root}/simulated")

    def request(self, resource: str) -> Topic:
        """Return the topic from the controller to a simulated resource."""
        return Topic(f"{self.root}/{_segment(resource)}/request")

    def reply(self, resource: str) -> Topic:
        """Return the topic from a simulated resource to the controller."""
        return Topic(f"{self.root}/{_segment(resource)}/reply")


def _segment(name: str) -> str:
    return name.replace(".", "/")


GIVEN_UP = "given up"
"""The injection by which a controller ends a run that it cannot go on with. None of a case has such a name."""

_RUN = "run_"


def new_run() -> str:
    """Return a unique id of a run. It is in no trace."""
    return f"{_RUN}{uuid4().hex}"


def is_of_tester(run: str) -> bool:
    """Return whether a tester made this run id, so that the tester decides the reactions to its requests."""
    return run.startswith(_RUN)


def new_status(role: str, model: BehaviorModel, digest: str, resources: Iterable[str] = ()) -> Status:
    """Return the first status of a node."""
    words = f"process {os.getpid()} on {socket.gethostname()}"
    return Status(role, uuid4().hex, VERSION, model.name, digest, tuple(resources), (), (), time_ns(), words)


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
