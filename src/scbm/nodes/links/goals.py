"""Goals of actions: how their ids follow from requests, and their statuses on the wire."""

from __future__ import annotations

import re
from enum import IntEnum
from typing import TYPE_CHECKING
from uuid import NAMESPACE_OID, UUID, uuid5

from msgspec import Struct

from scbm.nodes.types.cdr import BadPayloadError, header_of

if TYPE_CHECKING:
    from asyncio import TimerHandle

    from scbm.nodes.bindings.ros_binding import ActionCall
    from scbm.nodes.links.link import Correlation


class GoalStatus(IntEnum):
    """The status of a goal (action_msgs/msg/GoalStatus)."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


ACTIVE = (GoalStatus.ACCEPTED, GoalStatus.EXECUTING, GoalStatus.CANCELING)
"""The statuses of a goal that is not over."""

_ACTIVE = re.compile(b"[%s]" % bytes(ACTIVE))

CANCEL_TOO_LATE = 3
"""The return code of a cancellation of a goal that is over."""


_ENTRY = 28
"""The bytes from status to status in a message: one of status, and the id, three that pad, and the time of the next."""

_STATUS_AT, _PADDED = 24, 3


def statuses_of(payload: bytes) -> tuple[bytes, bytes]:
    """Return the statuses of the goals of a status message (CDR), and its entries for `id_at` and `position_of`.

    Nothing is built for each goal: rclpy lists those of 15 minutes in each message. Raises `BadPayloadError`.
    """
    (count,), entries = header_of(payload, "I"), payload[8:]
    if count and len(entries) <= _ENTRY * (count - 1) + _STATUS_AT:
        raise BadPayloadError(f"{count} goals do not fit into {len(payload)} bytes")
    return entries[_STATUS_AT::_ENTRY][:count], entries


def active_among(statuses: bytes) -> list[int]:
    """Return the positions of the goals that are not over."""
    return [found.start() for found in _ACTIVE.finditer(statuses)]


def id_at(entries: bytes, position: int) -> bytes:
    """Return the id of a goal in the entries of a status message."""
    begin = _ENTRY * position - _PADDED if position else 0
    return entries[begin : begin + 16]


def position_of(entries: bytes, which: bytes) -> int | None:
    """Return the position of a goal in the entries of a status message, by its id; `None` if it is not there."""
    at = entries.find(which)
    position = (at + _PADDED) // _ENTRY
    return position if at >= 0 and id_at(entries, position) == which else None


def goal_id(request: Correlation) -> UUID:
    """Return the id of the goal of a request; logs and traces have run and number, so they name the goal."""
    return uuid5(NAMESPACE_OID, f"{request.run}-{request.number}")


class Goal(Struct, eq=False):
    """A goal that is sent, or waits to be.

    Attributes:
        request: which request it carries out.
        call: the action, and how its result is read.
        values: the fields of the goal.
        id: its id on the wire.
        is_accepted: whether the server has accepted it.
        is_wanted: whether the model still waits for the reply.
        is_left: whether its run is over.
        timer: warns of a cancellation that is ignored; set once the model has cancelled the request.
    """

    request: Correlation
    call: ActionCall
    values: dict[str, object]
    id: UUID
    is_accepted: bool = False
    is_wanted: bool = True
    is_left: bool = False
    timer: TimerHandle | None = None

    @property
    def words(self) -> str:
        """The goal, in words."""
        return f"goal {self.id} of request {self.request.number}"
