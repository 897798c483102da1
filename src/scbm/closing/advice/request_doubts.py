"""Doubts about requests: ends of operations that leave a trigger true, and values that no operation says.

The first are what the text of a model shows of the built-in requirement `no_orphan` (semantics 7.12). A request carries
a value by mistake if no line of the operation says it (semantics 3.5): it then has what the operation before has left,
or always the same value. An operation may leave a value to its guard, to the environment, or to another part of the
model that assigns it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.advice.doubts import Doubt
from scbm.model import Assign, Constant, OperationState, Slug, VariableSource, format_value
from scbm.model.predicates import conjuncts
from scbm.model.requirements import BuiltIn
from scbm.model.sources import changed_from_outside, replied
from scbm.running.lifecycle import guard_and_actions, parts_by_end
from scbm.testing.request_protocol import RequestProtocol, assigns, clears, sets, transitions_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import Action, BehaviorModel, Operation, Predicate, Resource, Transition, Variable


_VERBS = {
    OperationState.COMPLETED: "completes",
    OperationState.FAILED: "fails",
    OperationState.TIMEDOUT: "times out",
}
"""The verb for the end of an operation in each of its last states."""


def doubts_about_requests(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield a doubt for each end of an operation that surely leaves a request behind that nothing ends."""
    if BuiltIn.NO_ORPHAN.value in dict(model.requirements_off):
        return
    protocol = RequestProtocol(model)
    for operation in model.operations:
        for resource in model.resources:
            if Assign(resource.trigger, Constant(True)) in operation.pre.running_actions:
                yield from _doubts_about_ends(operation, resource, protocol)
    for transition in model.automatic_transitions:
        yield from _doubts_about_failures(transition, model, protocol)


def _doubts_about_ends(operation: Operation, resource: Resource, protocol: RequestProtocol) -> Iterator[Doubt]:
    for state, part in parts_by_end().items():
        found = guard_and_actions(operation, part)
        if found is not None and _leaves(operation, resource, state, found[1], protocol):
            message = f"{operation.name} leaves {resource.trigger} true when it {_VERBS[state]}"
            yield _doubt(message, ("operations", operation.name, part.key), resource, f"`{part.key}`")


def _doubts_about_failures(transition: Transition, model: BehaviorModel, protocol: RequestProtocol) -> Iterator[Doubt]:
    """Yield the doubts about an automatic transition that fails some operations, and no others."""
    failed = [each for each in model.operations if protocol.fails(transition, each)]
    if len(failed) == len(model.operations) > 1:
        return  # it is about the state of a request, and not about operations
    for operation in failed:
        for resource in model.resources:
            asks = Assign(resource.trigger, Constant(True)) in operation.pre.running_actions
            actions = transition.running_actions
            if asks and _leaves(operation, resource, OperationState.FAILED, actions, protocol):
                what = f"{transition.name} fails {operation.name} and leaves {resource.trigger} true"
                yield _doubt(what, ("automatic_transitions", transition.name), resource, "its actions")


def _leaves(
    operation: Operation,
    resource: Resource,
    state: OperationState,
    actions: tuple[Action, ...],
    protocol: RequestProtocol,
) -> bool:
    is_cleared = clears(actions, resource) or sets(actions, resource)
    return not is_cleared and not protocol.may_be_ended(operation, resource, state)


def _doubt(what: str, path: tuple[str, ...], resource: Resource, where: str) -> Doubt:
    message = f"{what}, and nothing else clears it: the request may outlive the operation"
    return Doubt(Slug.REQUEST_NOT_CLEARED, message, path, f"add `{resource.trigger} <- false` to {where}")


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
