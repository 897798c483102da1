"""How far an exploration may go: in states and in bytes, never in time, so that an answer is the same everywhere."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Bound(StrEnum):
    """What an exploration had too little of."""

    STATES = "states"
    BYTES = "bytes"


@dataclass(frozen=True, slots=True)
class Limits:
    """How far an exploration may go.

    Attributes:
        states: the most states that may be found; of the regions to start from, the most combinations of values.
        bytes: the most memory that sets of states, masks and edges may take, as estimated before they are made.
    """

    states: int = 5_000_000
    bytes: int = 1 << 30


@dataclass(frozen=True, slots=True)
class Exceeded:
    """Neither an answer nor its contrary: a limit ended the exploration.

    Attributes:
        bound: what there would have to be more of.
        limit: how much of it was allowed.
    """

    bound: Bound
    limit: int


class LimitExceededError(Exception):
    """How an engine gives up. The door of the room catches it and answers `Exceeded`."""

    def __init__(self, bound: Bound, limit: int) -> None:
        super().__init__(f"more than {limit} {bound} are needed")
        self.exceeded = Exceeded(bound, limit)


def check_states(states: int, limits: Limits) -> None:
    """Raises `LimitExceededError` if so many states are too many."""
    if states > limits.states:
        raise LimitExceededError(Bound.STATES, limits.states)


def check_bytes(size: int, limits: Limits) -> None:
    """Raises `LimitExceededError` if so many bytes are too many."""
    if size > limits.bytes:
        raise LimitExceededError(Bound.BYTES, limits.bytes)
