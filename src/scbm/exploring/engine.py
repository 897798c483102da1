"""What every engine does. Which one answers changes how long it takes and nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.exploring.box import Box
    from scbm.exploring.conditions import Condition
    from scbm.exploring.layout import Layout
    from scbm.exploring.limits import Limits


class Engine(Protocol):
    """How a box is explored. Every method raises `LimitExceededError` where the limits are too narrow for it."""

    layout: Layout

    def __init__(self, box: Box, limits: Limits) -> None: ...

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

    def first(self, condition: Condition) -> int | None:
        """The least code of a state of the set in which the condition holds."""
        ...

    def distances(self, goal: Condition) -> CodeDistances:
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
