"""Transition systems: variables, moves between states, regions of initial states, and which variables are relevant.

Relevant variables decide what is possible: states that differ only in other variables behave alike.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.model import Action, Add, Assign, Constant, Reference, StateSpace
from scbm.model.predicates import TRUE, bounds

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from scbm.model import Predicate, Value


class MovePart(Struct, frozen=True):
    """A guard with actions that happen at once where it holds. A move has one part or more.

    A part whose actions would leave a domain is not enabled (semantics 2.4).
    """

    guard: Predicate
    actions: tuple[Action, ...] = ()


class Move(Struct, frozen=True):
    """One step of a system: all its parts, one after the other, or none of them.

    Attributes:
        name: the name of the move in plans.
        parts: each part reads the state after the part before it.
    """

    name: str
    parts: tuple[MovePart, ...]


class TransitionSystem(Struct, frozen=True):
    """A space of variables and the moves between its states.

    Attributes:
        space: every variable that a guard or an action names.
        moves: their order decides between plans of the same length, like the order of operations (semantics 4.2).
    """

    space: StateSpace
    moves: tuple[Move, ...]


class Region(Struct, frozen=True):
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


Influence: TypeAlias = "tuple[tuple[str, ...], tuple[str, ...]]"
"""Variables that something changes, and the variables that it reads."""


def influencing(names: Iterable[str], influences: Sequence[Influence]) -> dict[str, None]:
    """Return the variables `names` and all that can influence them: the least set closed under `influences`."""
    found = dict.fromkeys(names)
    known = -1
    while known < len(found):
        known = len(found)
        for changed, read in influences:
            if not found.keys().isdisjoint(changed):
                found.update(dict.fromkeys(read))
    return found


def relevant(system: TransitionSystem, observed: Iterable[str] = ()) -> StateSpace:
    """Return the relevant variables, in order: the least set that is closed under these rules.

    Relevant are the variables `observed`, those that a guard reads, those whose actions may leave a domain, and those
    that an action of another relevant variable reads.
    """
    parts = [part for move in system.moves for part in move.parts]
    actions = [action for part in parts for action in part.actions]
    read = [name for part in parts for name in part.guard.reads()]
    leaving = [action.target for action in actions if may_leave(action, system.space)]
    influences = [((action.target,), action.reads()) for action in actions]
    found = influencing([*observed, *read, *leaving], influences)
    return StateSpace(variable for variable in system.space if variable.name in found)


def narrowed(system: TransitionSystem, space: StateSpace) -> TransitionSystem:
    """Return the same system over `space`, which has all relevant variables."""
    return TransitionSystem(space, tuple(_narrowed(move, space) for move in system.moves))


def _narrowed(move: Move, space: StateSpace) -> Move:
    parts = (MovePart(part.guard, tuple(a for a in part.actions if a.target in space)) for part in move.parts)
    return Move(move.name, tuple(parts))


def may_leave(action: Action, space: StateSpace) -> bool:
    """Return whether the action can leave its domain, so that it decides whether a move is enabled."""
    if isinstance(action, Add):
        return True
    assert isinstance(action, Assign)  # noqa: S101 - for the reader: there are two kinds of actions
    if isinstance(action.source, Constant):
        return False
    target = space[action.target].domain
    if isinstance(action.source, Reference):
        return any(value not in target for value in space[action.source.name].domain.values)
    low, high = bounds(action.source, {name: space[name].domain for name in action.reads()})
    return low not in target or high not in target
