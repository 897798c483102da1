"""Relevance: which variables decide what is possible. States that differ only in other variables behave alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import Action, Add, Assign, Reference, StateSpace
from scbm.planning.engines.transition_system import Move, MovePart, TransitionSystem

if TYPE_CHECKING:
    from collections.abc import Iterable


def relevant(system: TransitionSystem, observed: Iterable[str] = ()) -> StateSpace:
    """Return the relevant variables, in order: the least set that is closed under these rules.

    Relevant are the variables `observed`, those that a guard reads, those whose actions may leave a domain, and those
    that
    an action of another relevant variable reads.
    """
    parts = [part for move in system.moves for part in move.parts]
    actions = [action for part in parts for action in part.actions]
    found = dict.fromkeys([*observed, *(name for part in parts for name in part.guard.reads())])
    found.update((action.target, None) for action in actions if may_leave(action, system.space))
    known = 0
    while known < len(found):
        known = len(found)
        found.update((name, None) for action in actions if action.target in found for name in action.reads())
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
    if not isinstance(action.source, Reference):
        return False
    target = space[action.target].domain
    return any(value not in target for value in space[action.source.name].domain.values)
