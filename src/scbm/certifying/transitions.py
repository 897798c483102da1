"""Everything in a model that has a guard or actions, in one list."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model import Role, Truth

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import Action, BehaviorModel, Operation, Predicate, StateSpace, Transition, Value


@dataclass(frozen=True, slots=True)
class Part:
    """What the runner takes at once.

    Attributes:
        what: what reports call it.
        guard: `g && gr`.
        actions: `a` and `ar`.
        is_automatic: whether it is an automatic transition.
    """

    what: str
    guard: Predicate
    actions: tuple[Action, ...]
    is_automatic: bool = False


def parts_of(model: BehaviorModel) -> Iterator[Part]:
    """The parts of all operations, then the automatic transitions, in the order of the model."""
    for operation in model.operations:
        yield from _parts_of_operation(operation)
    for transition in model.automatic_transitions:
        yield Part(f"automatic transition {transition.name}", *_both(transition), is_automatic=True)


def _parts_of_operation(operation: Operation) -> Iterator[Part]:
    yield Part(f"the precondition of {operation.name}", *_both(operation.pre))
    yield Part(f"the postcondition of {operation.name}", *_both(operation.post))
    if operation.failed is not None:
        yield Part(f"the `failed` transition of {operation.name}", *_both(operation.failed))
    yield Part(f"the `timedout` actions of {operation.name}", Truth(True), operation.timedout)


def _both(transition: Transition) -> tuple[Predicate, tuple[Action, ...]]:
    return transition.running_guard, transition.running_actions


def fails_operation(action: Action, space: StateSpace) -> bool:
    """Whether the action fails the current operation (semantics 1.3)."""
    return space[action.target].role in (Role.OPERATION_STATE, Role.CURRENT_STATE)


def results(action: Action, space: StateSpace) -> Iterator[tuple[Value, Value | None]]:
    """For an action that reads a variable: each value of it, with what is assigned then; `None` outside the domain."""
    (source,) = action.reads()
    domain = space[action.target].domain
    for value in space[source].domain.values:
        assigned = action.value({source: value})
        yield value, assigned if assigned in domain else None


def may_leave(action: Action, space: StateSpace) -> bool:
    """Whether some value that the action reads makes it leave its domain (semantics 2.4)."""
    if not action.reads():
        return False
    return any(assigned is None for _, assigned in results(action, space))
