"""The topics of a cell, the ids of its runs and nodes, and its members.

Each node publishes its status on one latched topic, again and again, and receives that of the others.
"""

from __future__ import annotations

import asyncio
import os
import socket
from contextlib import suppress
from dataclasses import dataclass
from time import monotonic_ns, time_ns
from typing import TYPE_CHECKING
from uuid import uuid4

from msgspec import Struct, structs

from scbm.model.json_reader import JsonError
from scbm.nodes.buses.bus import BusError, Topic
from scbm.nodes.node_messages import VERSION, Status, decode, encode

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from scbm.model import BehaviorModel
    from scbm.nodes.buses.bus import Bus, Received
    from scbm.nodes.node_messages import Trouble


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


class CellTopics(Struct, frozen=True):
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
    return Status(role, uuid4().hex, VERSION, model.name, digest, tuple(resources), (), time_ns(), words)


UNIQUE = ("controller", "tester")
"""A cell has one of each."""


STATUS_PERIOD_S = 0.1
"""Period in which each node repeats its status: three of them are short beside the start of a process."""

_ALONE_S = 5.0
"""Time after which a node reports that it has found no other: others are started one after the other, by hand."""

_SILENT_S = 1.0
"""Time after which a status that takes no effect is reported."""

REPETITIONS = 3
"""A status takes effect once its publisher, which is still there, has repeated it in so many periods."""


class _NewStatus(Struct):
    """A status that has not taken effect; the number of its repetitions, and when the last one came."""

    status: Status
    repetitions: int
    stamp_ns: int


class Membership:
    """The status of a node, and the statuses that it received.

    A status that comes once takes no effect: any program of the domain can publish one, and an older controller or
    tester ends the others. What a node lacks changes at once.

    Attributes:
        own: this node.
        settles_s: the time of the event loop by which statuses of nodes that were there before take effect.
        changed: called whenever a node comes or leaves.
    """

    def __init__(self, bus: Bus, topics: CellTopics, own: Status) -> None:
        self.own = own
        self.settles_s = asyncio.get_running_loop().time() + (REPETITIONS + 2) * STATUS_PERIOD_S
        self.changed: Callable[[], None] = lambda: None
        self._others: dict[int, Status] = {}
        self._new: dict[int, _NewStatus] = {}
        self._unreadable: dict[int, str] = {}
        self._texts: dict[int, str] = {}
        self._own_text = encode(own)
        self._publisher = bus.publisher(topics.status)
        self._publisher.publish({"data": self._own_text})
        self._timer = self._repeat_later()
        self._alone: asyncio.TimerHandle | None = None
        bus.subscribe(topics.status, self._receive, left=self._lose)

    def close(self) -> None:
        """Repeat the status no more. The caller closes the bus."""
        self._timer.cancel()
        if self._alone is not None:
            self._alone.cancel()

    def report_if_alone(self, words: str | None, report: Callable[[str], None]) -> None:
        """Report `words` if there are any, and no other node of the cell is found for a while."""
        if words is not None:
            look = lambda: None if self._others or self._new else report(words)  # noqa: E731 - a callback of one line
            self._alone = asyncio.get_running_loop().call_later(_ALONE_S, look)

    def _repeat_later(self) -> asyncio.TimerHandle:
        return asyncio.get_running_loop().call_later(STATUS_PERIOD_S, self._repeat)

    def _repeat(self) -> None:
        with suppress(BusError):  # the next repetition may be taken
            self._publisher.publish({"data": self._own_text})
        self._timer = self._repeat_later()

    def publish_troubles(self, troubles: tuple[Trouble, ...]) -> None:
        """Publish what this node lacks. Raises `BusError`."""
        own = structs.replace(self.own, troubles=troubles)
        if own != self.own:
            self._publisher.publish({"data": (text := encode(own))})
            self.own, self._own_text = own, text

    @property
    def others(self) -> tuple[Status, ...]:
        """Return the other nodes, in the order of their arrival."""
        return tuple(self._others.values())

    @property
    def unreadable(self) -> tuple[str, ...]:
        """Return why statuses take no effect: nodes of another version, or other programs."""
        since_ns = (asyncio.get_running_loop().time() - _SILENT_S) * 1e9
        once = [new.status.words for new in self._new.values() if new.stamp_ns < since_ns]
        return (*self._unreadable.values(), *(f"the status of {words} is not repeated" for words in once))

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
        if self._texts.get(received.source) == received.message.data:
            return  # a repetition: most are
        try:
            message = decode(received.message.data)
        except JsonError as error:
            is_new = self._unreadable.setdefault(received.source, str(error)) == str(error)
        else:
            is_new = isinstance(message, Status) and self._takes_effect(message, received)
        if is_new:
            self.changed()

    def _takes_effect(self, status: Status, received: Received) -> bool:
        """Keep a status; return whether others are different from before."""
        source = received.source
        self._unreadable.pop(source, None)
        known, new = self._others.get(source), self._new.get(source)
        if known is None or not _is_same_node(status, known):
            if new is None or not _is_same_node(status, new.status):
                self._new[source] = _NewStatus(status, 0, received.stamp_ns)
                return False
            if received.stamp_ns - new.stamp_ns >= STATUS_PERIOD_S * 1e9 / 2:  # of a burst one counts
                self._new[source] = new = _NewStatus(status, new.repetitions + 1, received.stamp_ns)
            if new.repetitions < REPETITIONS:
                return False
        self._new.pop(source, None)
        self._others[source], self._texts[source] = status, received.message.data
        return status != known

    def _lose(self, source: int) -> None:
        self._others.pop(source, None)
        self._new.pop(source, None)
        self._texts.pop(source, None)
        self._unreadable.pop(source, None)
        self.changed()


def _is_same_node(status: Status, other: Status) -> bool:
    """Return whether two statuses differ at most in what the node lacks."""
    return structs.replace(status, troubles=other.troubles) == other


def _age(status: Status) -> tuple[int, str]:
    """Of two nodes, all nodes agree which one is older: each publishes once when it began.

    With a wrong clock the first node may have to leave; never do both or neither of them leave.
    """
    return status.since_ns, status.node
