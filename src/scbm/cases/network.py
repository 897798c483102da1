"""Faults of the network between runner and resources, as one value."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True, slots=True)
class Partition:
    """No message that is sent between `at_ns` and `at_ns + for_ns` arrives.

    Attributes:
        at_ns: when it begins, in time of the run.
        for_ns: how long it lasts.
        resource: which resource is cut off; `None` cuts off all of them.
    """

    at_ns: int
    for_ns: int
    resource: str | None = None


@dataclass(frozen=True, slots=True)
class Restart:
    """A resource is down between `at_ns` and `at_ns + for_ns`; then it knows nothing of earlier requests.

    Attributes:
        resource: which one.
        at_ns: when it goes down, in time of the run.
        for_ns: how long it is down; messages that arrive meanwhile are lost.
    """

    resource: str
    at_ns: int
    for_ns: int = 0


@dataclass(frozen=True, slots=True)
class Network:
    """How messages travel: requests and their cancellations to a resource, replies back.

    Every message has its own fate. Messages of one resource in one direction arrive in the order in which they were
    sent, but for those that `reordering` holds back.

    Attributes:
        latency_ns: how long each message is under way.
        jitter_ns: up to so much longer, all values between alike.
        loss: the probability that a message does not arrive.
        duplication: the probability that it arrives twice, the second time up to `held_back_ns` later.
        reordering: the probability that it is held back, so that later messages overtake it.
        held_back_ns: how long it is held back at most.
        partitions: when messages do not arrive at all.
        restarts: when resources are down and forget.
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
        """Whether the fate of a message is a matter of chance."""
        return bool(self.jitter_ns or self.loss or self.duplication or self.reordering)
