"""The reaction to a request: the reply of its resource, and the delivery of its messages (semantics 6 and 7.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from scbm.cases.trace import Changes
    from scbm.model import Outcome

Delivery: TypeAlias = tuple[int, ...]
"""The latency of each copy of a message that arrives, in nanoseconds."""

AT_ONCE: Delivery = (0,)
LOST: Delivery = ()


@dataclass(frozen=True, slots=True)
class Reaction:
    """The complete reaction to one request.

    Attributes:
        resource: the resource that the request was sent to.
        outcome: success, failure, or no reply.
        latency_ns: the time from the arrival of the request to the reply.
        measured: the values that the reply carries; `None` if it fails or the resource measures nothing.
        request, reply, cancel: the delivery of each message; `None` leaves it to the network. The resource answers each
            copy of a request, and all these replies are delivered alike.
    """

    resource: str
    outcome: Outcome
    latency_ns: int
    measured: Changes | None = None
    request: Delivery | None = None
    reply: Delivery | None = None
    cancel: Delivery | None = None


@dataclass(frozen=True, slots=True)
class OutcomeRule:
    """The reaction that a case prescribes for some requests to a resource, or sent while an operation executes.

    Requests are numbered from 1, for each resource and for each operation. `None` prescribes nothing. If rules for an
    operation and for a resource apply to one request, the rule for the operation takes precedence.

    Attributes:
        subject: the name of a resource or of an operation.
        first: the number of the first request that the rule applies to.
        last: the number of the last one; `None` for all later requests.
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
