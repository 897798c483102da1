"""Doubts about requests that carry a value by mistake: no line of the operation says it (semantics 3.5).

An operation may leave a value to its guard, to the environment, or to another part of the model that assigns it. All
else is doubted: the request then carries what the operation before has left, or always the same value.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.advice.doubts import Doubt
from scbm.model import Assign, Constant, Slug, VariableSource, format_value
from scbm.model.predicates import conjuncts
from scbm.model.sources import changed_from_outside, replied
from scbm.testing.request_protocol import assigns, sets, transitions_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import Action, BehaviorModel, Operation, Predicate, Resource, Variable


def doubts_about_commands(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield a doubt for each value that a request carries, and that its operation should say and does not say."""
    outside = dict.fromkeys((*changed_from_outside(model), *replied(model)))
    for variable in model.variables:
        carriers = [resource for resource in model.resources if variable.name in resource.request]
        is_free = variable.name in outside or variable.source in (VariableSource.INPUT, VariableSource.CONSTANT)
        if carriers and not is_free and len(variable.domain) > 1 and not _is_meant(variable, carriers, model):
            yield from _doubts_about_value(variable, carriers, model)


def _doubts_about_value(variable: Variable, carriers: Sequence[Resource], model: BehaviorModel) -> Iterator[Doubt]:
    name = variable.name
    senders = [each for each in model.operations if _sends(each.pre.running_actions, carriers)]
    naming = [each for each in senders if assigns(each.pre.running_actions, name)]
    usual = frozenset(part for each in naming for part in conjuncts(each.pre.running_guard))
    silent = [
        each
        for each in senders
        if not assigns(each.pre.running_actions, name) and not _guard_decides(each, name, usual)
    ]
    is_assigned = naming or any(_sends(part, carriers) and assigns(part, name) for part in _action_lists(model))
    if is_assigned:
        for operation in silent:
            yield _left_by_another(operation, name, _resource_of(operation, carriers))
    elif silent and len(dict.fromkeys(variable.random)) == 1:
        yield _always_initial(silent, variable, _resource_of(silent[0], carriers))


def _left_by_another(operation: Operation, name: str, resource: Resource) -> Doubt:
    message = (
        f"{operation.name} does not say which {name} it sends to {resource.name}, "
        "so it sends what an earlier operation has left"
    )
    remedy = f"add `{name} <- <value>` to `a` of `pre`; `{name} <- {name}` sends the value that it has"
    return Doubt(Slug.HANDSHAKE_INCOMPLETE, message, ("operations", operation.name, "pre", "a"), remedy)


def _always_initial(silent: Sequence[Operation], variable: Variable, resource: Resource) -> Doubt:
    """Return the doubt about a value that nothing changes: at its operation, or at the variable if several send it."""
    name, initial = variable.name, format_value(variable.initial)
    ends = f"nothing changes {name}, so each request carries the value `{initial}`"
    otherwise = "if that is meant, declare `source: constant`"
    if len(silent) == 1:
        message = f"{silent[0].name} does not say which {name} it sends to {resource.name}, and {ends}"
        path = ("operations", silent[0].name, "pre", "a")
        return Doubt(Slug.HANDSHAKE_INCOMPLETE, message, path, f"add `{name} <- <value>` to `a` of `pre`; {otherwise}")
    message = f"{len(silent)} operations do not say which {name} they send to {resource.name}, and {ends}"
    remedy = f"add `{name} <- <value>` to `a` of `pre` of each of these operations; {otherwise}"
    return Doubt(Slug.HANDSHAKE_INCOMPLETE, message, ("variables", name), remedy)


def _guard_decides(operation: Operation, name: str, usual: frozenset[Predicate]) -> bool:
    """Return whether an operation starts only with certain values: by a condition that is not a `usual` one."""
    return any(name in part.reads() and part not in usual for part in conjuncts(operation.pre.running_guard))


def _is_meant(variable: Variable, carriers: Sequence[Resource], model: BehaviorModel) -> bool:
    """Return whether a part of the model that sends no request assigns a value, and not only the initial one."""
    reset = Assign(variable.name, Constant(variable.initial))
    return any(
        action.target == variable.name and action != reset
        for part in _action_lists(model)
        if not _sends(part, carriers)
        for action in part
    )


def _action_lists(model: BehaviorModel) -> Iterator[tuple[Action, ...]]:
    """Yield the actions that the runner takes together, for each transition and each timeout."""
    for operation in model.operations:
        for transition in transitions_of(operation):
            yield transition.running_actions
        yield operation.timedout
    for transition in model.automatic_transitions:
        yield transition.running_actions


def _sends(actions: tuple[Action, ...], carriers: Sequence[Resource]) -> bool:
    return any(sets(actions, resource) for resource in carriers)


def _resource_of(operation: Operation, carriers: Sequence[Resource]) -> Resource:
    """Return the first resource to which an operation sends the value."""
    return next(resource for resource in carriers if sets(operation.pre.running_actions, resource))
