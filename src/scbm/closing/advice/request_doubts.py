"""Doubts about requests that outlive their operation: ends of operations that leave a trigger true.

They are what the text of a model shows of the built-in requirement `no_orphan` (semantics 7.12).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.advice.doubts import Doubt
from scbm.model import Assign, Constant, OperationState, Slug
from scbm.model.requirements import BuiltIn
from scbm.running.lifecycle import guard_and_actions, parts_by_end
from scbm.testing.request_protocol import RequestProtocol, clears, sets

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import Action, BehaviorModel, Operation, Resource, Transition

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
