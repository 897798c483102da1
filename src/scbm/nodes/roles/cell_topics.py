"""The topics of a cell, and the ids of its runs and nodes."""

from __future__ import annotations

import os
import socket
from dataclasses import dataclass
from time import monotonic_ns, time_ns
from typing import TYPE_CHECKING
from uuid import uuid4

from scbm.nodes.buses.bus import Topic
from scbm.nodes.node_messages import VERSION, Status

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from scbm.model import BehaviorModel
    from scbm.nodes.buses.bus import Bus


@dataclass(frozen=True, slots=True)
class NodeContext:
    """What every node of a cell is made from.

    Attributes:
        bus: carries its messages; the code that opened it closes it.
        model: the model of the cell.
        status: the first status that the node publishes.
        warn: gets a sentence about each message that cannot be taken.
        report: gets a line about each change of the node, for its log.
        now_ns: the clock that the bus stamps messages by, and that the event loop goes by.
    """

    bus: Bus
    model: BehaviorModel
    status: Status
    warn: Callable[[str], None]
    report: Callable[[str], None] = lambda _: None
    now_ns: Callable[[], int] = monotonic_ns


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
    """Whether a tester made this run id, so that the tester decides the reactions to its requests."""
    return run.startswith(_RUN)


def new_status(role: str, model: BehaviorModel, digest: str, resources: Iterable[str] = ()) -> Status:
    """Return the first status of a node."""
    words = f"process {os.getpid()} on {socket.gethostname()}"
    return Status(role, uuid4().hex, VERSION, model.name, digest, tuple(resources), (), (), time_ns(), words)
