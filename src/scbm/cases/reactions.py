"""What happens to a request: how its resource reacts, and how its messages travel (semantics 6 and 7.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from scbm.cases.trace import Changes
    from scbm.model import Outcome

Delivery: TypeAlias = tuple[int, ...]
"""For each copy of a message that arrives, how many nanoseconds it was under way."""

AT_ONCE: Delivery = (0,)
LOST: Delivery = ()


@dataclass(frozen=True, slots=True)
class Reaction:
    """What happens to one request, all of it.

    Attributes:
        resource: where the request goes.
        outcome: a reply that says succeeded, one that says failed, or no reply.
        latency_ns: the time from the arrival of the request to the reply.
        measured: values that the reply carries; `None` if it fails or the resource measures nothing.
        request, reply, cancel: how these messages travel, as far as it is decided; `None` leaves it to the network.
            Each copy of a request is answered, and all these answers travel alike.
    """

    resource: str
    outcome: Outcome
    latency_ns: int
    measured: Changes | None = None
    request: Delivery | None = None
    reply: Delivery | None = None
    cancel: Delivery | None = None


@dataclass(frozen=True, slots=True)
class Forced:
    """What a case says of some requests of a resource, or of those sent while an operation executes.

    Requests are counted from 1, for each resource and for each operation. `None` leaves open what it stands for. Where
    a rule for the operation and one for the resource speak of one request, the operation's goes first.

    Attributes:
        subject: the name of a resource or of an operation.
        first: the first request that it speaks of.
        last: the last one; `None` for all that follow.
        outcome, latency_ns, measured, request, reply, cancel: as in `Reaction`.
    """

    subject: str
    first: int
    last: int | None
    outcome: Outcome | None = None
    latency_ns: int | None = None
    measured: Changes | None = None
    request: Delivery | None = None
    reply: Delivery | None = None
    cancel: Delivery | None = None
