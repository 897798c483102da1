"""What is explored: a space of variables, moves between its states, and regions of states to start from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model.predicates import TRUE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import Action, Predicate, StateSpace, Value


@dataclass(frozen=True, slots=True)
class MovePart:
    """One half of a move, or all of it: where the guard holds, the actions are taken at once.

    A part whose actions would leave a domain cannot be taken (semantics 2.4).
    """

    guard: Predicate
    actions: tuple[Action, ...] = ()


@dataclass(frozen=True, slots=True)
class Move:
    """One step of a system: all its parts, one after the other, or none of them.

    Attributes:
        name: what plans call it.
        parts: each looks at the state that the one before it has left.
    """

    name: str
    parts: tuple[MovePart, ...]


@dataclass(frozen=True, slots=True)
class TransitionSystem:
    """A system of moves.

    Attributes:
        space: every variable that a guard or an action names.
        moves: their order decides between plans of one length, as the order of operations does (semantics 4.2).
    """

    space: StateSpace
    moves: tuple[Move, ...]


@dataclass(frozen=True, slots=True)
class Region:
    """A set of states that needs no list: all combinations of some values that satisfy a predicate.

    Attributes:
        values: for every variable of the system the values that it may have.
        where: what the states satisfy besides.
    """

    values: Mapping[str, tuple[Value, ...]]
    where: Predicate = TRUE

    @staticmethod
    def of(state: Mapping[str, Value]) -> Region:
        """The region of this one state."""
        return Region({name: (value,) for name, value in state.items()})

    @staticmethod
    def everywhere(space: StateSpace) -> Region:
        """The region of all states."""
        return Region({variable.name: variable.domain.values for variable in space})
