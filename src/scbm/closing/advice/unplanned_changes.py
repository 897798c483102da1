"""Changes that happen while a run has no plan: automatic transitions, and changes from outside (semantics 5.1 and 9.2).

A run without a plan waits for them (semantics 5.6), and starts no operation before there is a plan. So a goal is out of
reach only if no plan leads to it from any state that such changes make. `with_unplanned_changes` makes one planning
problem of both: the changes are operations that come first, and the operations of the model follow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.closing.distinguished_values import distinguishing_values
from scbm.model import (
    Assign,
    Constant,
    Domain,
    Equal,
    Operation,
    Reference,
    RequestState,
    Transition,
    Variable,
    VariableSource,
    conjunction,
)
from scbm.model.predicates import TRUE, conjuncts
from scbm.model.sources import free_groups, inputs
from scbm.model.variables import PLAN_STATE
from scbm.testing.request_protocol import sets

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import Action, BehaviorModel, Predicate, Resource

PLANNED = "an operation of the plan has started"
"""The variable of the planning problem that ends the changes; no variable of a model has such a name."""


def with_unplanned_changes(model: BehaviorModel) -> BehaviorModel:
    """Return a model whose plans begin with unplanned changes. It serves planning only."""
    changes = [
        Operation(
            f"change {number}",
            Transition("", conjunction((Equal(Reference(PLANNED), Constant(False)), guard)), a=actions),
            Transition("", TRUE),
        )
        for number, (guard, actions) in enumerate(_changes(model))
    ]
    begins = Assign(PLANNED, Constant(True))
    planned = [replace(each, pre=replace(each.pre, a=(*each.pre.a, begins))) for each in model.operations]
    phase = Variable(PLANNED, Domain.boolean(), False, (False,))
    return replace(model, variables=(*model.variables, phase), operations=(*planned, *changes))


def _changes(model: BehaviorModel) -> Iterator[tuple[Predicate, tuple[Action, ...]]]:
    """Yield the guard and the actions of each change; the planner takes the runner's variables as at rest."""
    for transition in model.automatic_transitions:
        # One that fails an operation is not taken while none executes, and one that aborts ends the run.
        if not any(model.running_space[action.target].role.is_runner for action in transition.running_actions):
            parts = [part for part in conjuncts(transition.running_guard) if PLAN_STATE not in part.reads()]
            yield conjunction(parts), transition.running_actions
    for each in model.environment:
        yield each.guard, each.actions
    doubtful = _perhaps_forgotten(model)
    for name, values in (each for group in free_groups(model) for each in group.values if each[0] not in doubtful):
        for value in distinguishing_values(model, name, values):
            yield TRUE, (Assign(name, Constant(value)),)
    for resource in model.resources:
        if any(sets(each.running_actions, resource) for each in model.automatic_transitions):
            yield from _replies(resource, model)


def _perhaps_forgotten(model: BehaviorModel) -> dict[str, None]:
    """Return the variables that count as inputs although the model may just lack what assigns them.

    Their source is not declared, and the planner reads them.
    """
    planned = [guard for each in model.operations for guard in (each.pre.g, each.post.g)]
    read = dict.fromkeys(name for each in (*planned, *(goal for _, goal in model.goals)) for name in each.reads())
    declared = [variable.name for variable in model.variables if variable.source is VariableSource.INPUT]
    return dict.fromkeys(name for name in inputs(model) if name in read and name not in declared)


def _replies(resource: Resource, model: BehaviorModel) -> Iterator[tuple[Predicate, tuple[Action, ...]]]:
    """Yield the changes of a request that automatic transitions trigger: sent, measured, answered (semantics 6.2)."""
    state = resource.request_state
    initial, executing, *ended = (Constant(each.value) for each in RequestState)
    sent, waits = (Equal(Reference(state), each) for each in (initial, executing))
    yield conjunction((Equal(Reference(resource.trigger), Constant(True)), sent)), (Assign(state, executing),)
    for name in resource.measures:
        for value in distinguishing_values(model, name, resource.sends(model.space[name])):
            yield waits, (Assign(name, Constant(value)),)
    for end in ended:
        yield waits, (Assign(state, end),)
