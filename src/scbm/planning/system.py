"""A model as a system of moves, as the planner sees it.

An operation is one move of two parts (semantics 3.3): enabled in S when `pre.g` holds in S and `post.g` in
S' = `pre.a`(S); it leads to `post.a`(S').
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.exploring import Move, Part, System

if TYPE_CHECKING:
    from scbm.model import BehaviorModel, Operation


def system_of(model: BehaviorModel) -> System:
    """The operations as moves, over all variables; those of the runner stand still, at rest, wherever one starts."""
    return System(model.running_space, tuple(map(_move, model.operations)))


def _move(operation: Operation) -> Move:
    halves = (operation.pre, operation.post)
    return Move(operation.name, tuple(Part(half.g, half.a) for half in halves))
