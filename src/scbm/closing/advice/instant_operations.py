"""Operations that complete in the instant in which they start: their postconditions hold in each state there.

Such an operation waits for nothing. If it triggers a request, the runner sends the request in that instant, so that the
request state is executing when the postcondition is evaluated (semantics 5 and 6.2).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import (
    And,
    Assign,
    Constant,
    Equal,
    Not,
    OperationState,
    PlanState,
    Reference,
    RequestState,
    conjunction,
)
from scbm.model.predicates import conjuncts
from scbm.model.satisfiability import is_satisfiable
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, PLAN_STATE, Role, operation_state_name
from scbm.testing.request_protocol import sets

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import BehaviorModel, Operation, Resource, Value


def completes_at_once(operation: Operation, model: BehaviorModel) -> bool:
    """Return whether the postcondition surely holds as soon as the operation has started, so that it never waits.

    An automatic transition may fail the operation before. Then it does not wait, either.
    """
    post, space = operation.post.running_guard, model.running_space
    values = _values_after_start(operation, model)
    written = (
        *(action.target for action in operation.pre.running_actions),
        *(r.request_state for r in model.resources),
    )
    changed = dict.fromkeys((*values, *written))
    kept = conjuncts(operation.pre.running_guard)
    while True:
        kept = tuple(part for part in kept if changed.keys().isdisjoint(part.reads()))
        if is_satisfiable(conjunction((*kept, Not(post))), space, values) is not False:
            return False
        possible = [
            each
            for each in model.automatic_transitions
            if is_satisfiable(conjunction((*kept, each.running_guard)), space, values) is not False
        ]
        assigned = dict.fromkeys(action.target for each in possible for action in each.running_actions)
        unsure = [n for n in assigned if not space[n].role.is_runner and (n in values or n not in changed)]
        if not unsure:
            return True
        changed |= dict.fromkeys(unsure)
        values = {name: known for name, known in values.items() if name not in unsure}


def _values_after_start(operation: Operation, model: BehaviorModel) -> dict[str, Sequence[Value]]:
    """Return the values of some variables when an operation has started, and the runner has sent its requests."""
    actions = operation.pre.running_actions
    values: dict[str, Sequence[Value]] = {
        action.target: (action.source.constant,)
        for action in actions
        if isinstance(action, Assign) and isinstance(action.source, Constant)
    }
    states = [variable.name for variable in model.running_space if variable.role is Role.OPERATION_STATE]
    values |= dict.fromkeys(states, (OperationState.INITIAL.value,))
    values |= dict.fromkeys((operation_state_name(operation.name), CURRENT_STATE), (OperationState.EXECUTING.value,))
    values |= {CURRENT_NAME: (operation.name,), PLAN_STATE: (PlanState.EXECUTING.value,)}
    for resource in (resource for resource in model.resources if sets(actions, resource)):
        values[resource.request_state] = _request_states(operation, resource, values, model)
    return values


def _request_states(
    operation: Operation, resource: Resource, values: dict[str, Sequence[Value]], model: BehaviorModel
) -> Sequence[Value]:
    """Return the possible states of a request that an operation has triggered, and that is sent if it was initial."""
    name, guard = resource.request_state, operation.pre.running_guard
    before = values.get(name) or [
        state.value
        for state in RequestState
        if is_satisfiable(And((guard, Equal(Reference(name), Constant(state.value)))), model.running_space) is not False
    ]
    initial, executing = RequestState.INITIAL.value, RequestState.EXECUTING.value
    return [executing if state == initial else state for state in before]
