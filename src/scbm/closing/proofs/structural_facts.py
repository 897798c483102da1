"""Facts of the model file that make obligations uncoverable: no deadline, no way to fail, a precondition that is true.

Each operation is taken by itself; nothing that happens in runs is used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases.coverage import Aspect, Obligation
from scbm.model import Not, StateSpace
from scbm.model.satisfiability import is_satisfiable
from scbm.model.variables import CURRENT_STATE, operation_state_name
from scbm.planning.engines import may_leave
from scbm.proofcheck import Fact

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Operation


def structural_facts(model: BehaviorModel) -> tuple[tuple[Obligation, Fact, str], ...]:
    """Return the obligations that facts of the model file settle, each with its fact and a sentence for people.

    They are in the order of the operations; of one operation *disabled*, *failed*, *timedout*.
    """
    return tuple(found for operation in model.operations for found in _facts(operation, model))


def failing_transitions(operation: Operation, model: BehaviorModel) -> tuple[str, ...]:
    """Return the names of all transitions that may fail an operation: its own `failed`, then automatic ones."""
    own = [operation.failed.name] if operation.failed is not None else []
    states = (operation_state_name(operation.name), CURRENT_STATE)
    automatic = [
        transition.name
        for transition in model.automatic_transitions
        if any(action.target in states for action in transition.running_actions)
    ]
    return (*own, *automatic)


def _facts(operation: Operation, model: BehaviorModel) -> Iterator[tuple[Obligation, Fact, str]]:
    name = operation.name
    if _is_always_enabled(operation, model.running_space):
        why = f"the precondition of {name} always holds, so it is never disabled"
        yield Obligation(name, Aspect.DISABLED), Fact.ALWAYS_ENABLED, why
    if not failing_transitions(operation, model):
        why = f"{name} has no `failed` transition and no automatic transition assigns its state, so it never fails"
        yield Obligation(name, Aspect.FAILED), Fact.CANNOT_FAIL, why
    if operation.deadline_ns is None:
        yield Obligation(name, Aspect.TIMEDOUT), Fact.NO_DEADLINE, f"{name} has no `deadline`, so it never times out"


def _is_always_enabled(operation: Operation, space: StateSpace) -> bool:
    """Return whether the precondition is enabled in every state; `False` also if that is unknown."""
    if any(may_leave(action, space) for action in operation.pre.running_actions):
        return False
    guard = operation.pre.running_guard
    read = StateSpace(space[name] for name in guard.reads())
    return is_satisfiable(Not(guard), read) is False
