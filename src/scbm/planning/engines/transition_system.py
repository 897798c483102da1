"""Transition systems: a space of variables, moves between its states, and regions of initial states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model.predicates import TRUE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import Action, Predicate, StateSpace, Value


@dataclass(frozen=True, slots=True)
class MovePart:
    """A guard with actions that happen at once where it holds. A move has one part or more.

    A part whose actions would leave a domain is not enabled (semantics 2.4).
    """

    guard: Predicate
    actions: tuple[Action, ...] = ()


@dataclass(frozen=True, slots=True)
class Move:
    """One step of a system: all its parts, one after the other, or none of them.

    Attributes:
        name: the name of the move in plans.
        parts: each part reads the state after the part before it.
    """

    name: str
    parts: tuple[MovePart, ...]


@dataclass(frozen=True, slots=True)
class TransitionSystem:
    """A space of variables and the moves between its states.

    Attributes:
        space: every variable that a guard or an action names.
        moves: their order decides between plans of the same length, like the order of operations (semantics 4.2).
    """

    space: StateSpace
    moves: tuple[Move, ...]


@dataclass(frozen=True, slots=True)
class Region:
    """A set of states given by values and a predicate, without a list of the states.

    Attributes:
        values: for every variable of the system the values that it may have.
        where: a predicate that the states satisfy.
    """

    values: Mapping[str, tuple[Value, ...]]
    where: Predicate = TRUE

    @staticmethod
    def of(state: Mapping[str, Value]) -> Region:
        """Return the region of this one state."""
        return Region({name: (value,) for name, value in state.items()})

    @staticmethod
    def everywhere(space: StateSpace) -> Region:
        """Return the region of all states."""
        return Region({variable.name: variable.domain.values for variable in space})
