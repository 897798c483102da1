"""Faults of the network between the runner and the resources."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True, slots=True)
class Partition:
    """A partition: the network loses all messages sent between `at_ns` and `at_ns + for_ns`.

    Attributes:
        at_ns: when it begins, in time of the run.
        for_ns: its duration.
        resource: the resource that is cut off; `None` cuts off all resources.
    """

    at_ns: int
    for_ns: int
    resource: str | None = None


@dataclass(frozen=True, slots=True)
class Restart:
    """A restart: a resource is down between `at_ns` and `at_ns + for_ns`, and loses its requests.

    Attributes:
        resource: the name of the resource.
        at_ns: when it goes down, in time of the run.
        for_ns: how long it is down; messages that arrive during this time are lost.
    """

    resource: str
    at_ns: int
    for_ns: int = 0


@dataclass(frozen=True, slots=True)
class Network:
    """How the network delivers requests and cancellations to a resource, and replies from it.

    Faults of different messages are independent. Messages of one resource in one direction arrive in the order in which
    they were sent, except those that `reordering` delays.

    Attributes:
        latency_ns: the latency of each message.
        jitter_ns: maximum additional latency, uniformly distributed.
        loss: the probability that a message is lost.
        duplication: the probability that a message arrives twice, the second time up to `held_back_ns` later.
        reordering: the probability that a message is delayed, so that later messages overtake it.
        held_back_ns: maximum delay by `duplication` and `reordering`.
        partitions: the times at which all messages are lost.
        restarts: the times at which resources are down.
    """

    latency_ns: int = 0
    jitter_ns: int = 0
    loss: Fraction = Fraction(0)
    duplication: Fraction = Fraction(0)
    reordering: Fraction = Fraction(0)
    held_back_ns: int = 100_000_000
    partitions: tuple[Partition, ...] = ()
    restarts: tuple[Restart, ...] = ()

    @property
    def draws(self) -> bool:
        """Whether the delivery of a message is drawn at random."""
        return bool(self.jitter_ns or self.loss or self.duplication or self.reordering)
