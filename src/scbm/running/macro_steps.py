"""Memoized macro-steps: the micro-steps after an event that follow from the packed state and the queue alone.

A campaign repeats a few macro-steps many thousand times. The first time the runner takes the micro-steps one by one and
keeps what they did. Later it writes the same records again, with the new time, and takes over the state.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.cases.trace import Changes, Record
    from scbm.running.program import RequestLine, RunnableOperation

MAX_MACRO_STEPS = 50_000
"""Maximum number of macro-steps that are memoized for one goal: some 50 MB."""

MAX_TAKEN = 50
"""Maximum number of automatic transitions in a macro-step; where they repeat without end, the runner takes over."""


@dataclass(frozen=True, slots=True, eq=False)
class PlanQueue:
    """The operations of a plan that are still to come, as a linked list. `Program.queue` makes equal ones identical.

    Attributes:
        first: the next operation; `None` if there is none.
        rest: the queue behind it; `None` if there is no next operation.
    """

    first: RunnableOperation | None = None
    rest: PlanQueue | None = None

    def __iter__(self) -> Iterator[RunnableOperation]:
        queue: PlanQueue | None = self
        while queue is not None and queue.first is not None:
            yield queue.first
            queue = queue.rest


_TimelessRecord: TypeAlias = "tuple[Callable[..., Record], tuple[Any, ...]]"
"""A kind of record, and all fields behind its time."""


class TimelessRequest(NamedTuple):
    """A request that was sent, without its number and its time."""

    line: RequestLine
    payload: Changes
    changes: Changes


class MacroStep(NamedTuple):
    """The result of a macro-step.

    Attributes:
        records: its records, without the one of the request.
        request: the request that it ended with; `None` if it sent none.
        after: the packed state afterwards.
        queue: the queue afterwards.
        sets_timer: whether it set or stopped the timer of the current operation.
        timer_ns: the time that the timer has from now on; `None` if it does not run.
        taken: the automatic transitions, each with the packed state after it.
        settles: whether no other micro-step follows, unless a goal waits.
    """

    records: tuple[_TimelessRecord, ...]
    request: TimelessRequest | None
    after: int
    queue: PlanQueue
    sets_timer: bool
    timer_ns: int | None
    taken: tuple[tuple[str, int], ...]
    settles: bool


def without_time(records: Sequence[Record]) -> tuple[_TimelessRecord, ...]:
    """Return records without their time, which is the first field of each kind."""
    return tuple(
        (type(record), tuple(getattr(record, name) for name in record.__struct_fields__[1:])) for record in records
    )
