"""The interface of engines, and the limits of an exploration.

The choice of an engine changes the time of an answer and nothing else. Limits count states and bytes, never time, so
that an answer is the same on every machine.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.reduced_system import ReducedSystem, StateCodes


class Engine(Protocol):
    """Explores a reduced system. Every method raises `LimitExceededError` where it would exceed the limits."""

    layout: StateCodes

    def __init__(self, system: ReducedSystem, limits: ExplorationLimits) -> None: ...

    def reach(self) -> States:
        """Return all states that are reachable from the initial states, these included."""
        ...


class States(Protocol):
    """A set of states that is closed under the moves."""

    def __len__(self) -> int: ...

    def __contains__(self, code: object) -> bool: ...

    def __iter__(self) -> Iterator[int]:
        """Yield the codes in ascending order."""
        ...

    def first(self, condition: NormalForm) -> int | None:
        """Return the least code of a state of the set in which the form holds."""
        ...

    def distances(self, goal: NormalForm) -> CodeDistances:
        """Return the distance of each state of the set from the goal."""
        ...


class CodeDistances(Protocol):
    """The distances of states from a goal, and the first moves towards it."""

    def distance(self, code: int) -> int | None:
        """Return the minimum number of moves to the goal from a state of the set; `None` if no path exists."""
        ...

    def first_move(self, code: int) -> tuple[int, int] | None:
        """Return the least index of a move that leads closer, and its successor; `None` if there is none."""
        ...


class ExplorationBound(StrEnum):
    """The resource that an exploration had too little of."""

    STATES = "states"
    BYTES = "bytes"


class ExplorationLimits(Struct, frozen=True):
    """The limits of an exploration.

    Attributes:
        states: the maximum number of states; for initial regions, the maximum number of combinations of values.
        bytes: the maximum memory of sets of states, masks and edges, as estimated before they are allocated.
    """

    states: int = 5_000_000
    bytes: int = 1 << 30


class Exceeded(Struct, frozen=True):
    """Unknown: a limit ended the exploration.

    Attributes:
        bound: the resource that ran out.
        limit: how much of it was allowed.
    """

    bound: ExplorationBound
    limit: int


class LimitExceededError(Exception):
    """An engine met a limit. `Exploration` catches it and answers `Exceeded`."""

    def __init__(self, bound: ExplorationBound, limit: int) -> None:
        super().__init__(f"more than {limit} {bound} are needed")
        self.exceeded = Exceeded(bound, limit)


def check_states(states: int, limits: ExplorationLimits) -> None:
    """Raise `LimitExceededError` if this number of states exceeds the limit."""
    if states > limits.states:
        raise LimitExceededError(ExplorationBound.STATES, limits.states)


def check_bytes(size: int, limits: ExplorationLimits) -> None:
    """Raise `LimitExceededError` if this number of bytes exceeds the limit."""
    if size > limits.bytes:
        raise LimitExceededError(ExplorationBound.BYTES, limits.bytes)
