"""What every engine does. Which one answers changes how long it takes and nothing else.

How far an exploration may go: in states and in bytes, never in time, so that an answer is the same everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.reduced_system import ReducedSystem, StateCodes


class Engine(Protocol):
    """How a box is explored. Every method raises `LimitExceededError` where the limits are too narrow for it."""

    layout: StateCodes

    def __init__(self, box: ReducedSystem, limits: ExplorationLimits) -> None: ...

    def reach(self) -> States:
        """All states that the moves reach from the starts, the starts among them."""
        ...


class States(Protocol):
    """A set of states that is closed under the moves."""

    def __len__(self) -> int: ...

    def __contains__(self, code: object) -> bool: ...

    def __iter__(self) -> Iterator[int]:
        """The codes, in order."""
        ...

    def first(self, condition: NormalForm) -> int | None:
        """The least code of a state of the set in which the condition holds."""
        ...

    def distances(self, goal: NormalForm) -> CodeDistances:
        """How far each state of the set is from the goal."""
        ...


class CodeDistances(Protocol):
    """How far states are from a goal, and what comes first on the way there."""

    def distance(self, code: int) -> int | None:
        """The fewest moves to the goal from a state of the set; `None` if there is no way."""
        ...

    def first_move(self, code: int) -> tuple[int, int] | None:
        """The least index of a move that leads closer, and the state that it leads to; `None` at the goal, or lost."""
        ...


class ExplorationBound(StrEnum):
    """What an exploration had too little of."""

    STATES = "states"
    BYTES = "bytes"


@dataclass(frozen=True, slots=True)
class ExplorationLimits:
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

    bound: ExplorationBound
    limit: int


class LimitExceededError(Exception):
    """How an engine gives up. The door of the room catches it and answers `Exceeded`."""

    def __init__(self, bound: ExplorationBound, limit: int) -> None:
        super().__init__(f"more than {limit} {bound} are needed")
        self.exceeded = Exceeded(bound, limit)


def check_states(states: int, limits: ExplorationLimits) -> None:
    """Raises `LimitExceededError` if so many states are too many."""
    if states > limits.states:
        raise LimitExceededError(ExplorationBound.STATES, limits.states)


def check_bytes(size: int, limits: ExplorationLimits) -> None:
    """Raises `LimitExceededError` if so many bytes are too many."""
    if size > limits.bytes:
        raise LimitExceededError(ExplorationBound.BYTES, limits.bytes)
