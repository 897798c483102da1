"""Doubts about request protocols that are written line by line and lack one line (semantics 3.5).

Only what has all other lines of the protocol is doubted: operations and failures that follow a protocol of their own
raise no doubt. A transition that replaces a generated one, as it has its name, needs all its lines.
Triggers that ends of operations leave true, and values of requests that nothing says, are doubts of `request_doubts`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.advice.doubts import Doubt
from scbm.closing.advice.instant_operations import completes_at_once
from scbm.closing.advice.request_doubts import doubts_about_commands
from scbm.model import Assign, Constant, Equal, OperationState, Reference, RequestState, Slug
from scbm.model.predicates import conjuncts
from scbm.model.variables import CURRENT_STATE, operation_state_name
from scbm.testing.request_protocol import assigns, clears, sets

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel, Operation, Predicate, Resource, Transition, Value


_HABIT = 2
"""Minimum number of operations that do the same, so that a further one which does not is doubtful."""


def doubts_about_handshakes(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield a doubt for each operation, and each transition for a failed reply, that lacks one line of the protocol."""
    instant = [each.name for each in model.operations if _asks(each, model) and completes_at_once(each, model)]
    for operation in model.operations:
        for resource in model.resources:
            yield from _doubts_about_operation(operation, resource, model, waits=operation.name not in instant)
    for resource in model.resources:
        yield from _doubts_about_triggers(resource, model, instant)
    yield from doubts_about_commands(model)
    for resource in model.resources:
        for path, transition in _failures(model):
            yield from _doubts_about_failure(path, transition, resource, model)


# operations


def _asks(operation: Operation, model: BehaviorModel) -> bool:
    return any(sets(operation.pre.running_actions, resource) for resource in model.resources)


def _doubts_about_operation(
    operation: Operation, resource: Resource, model: BehaviorModel, *, waits: bool
) -> Iterator[Doubt]:
    here = ("operations", operation.name)
    before, after = operation.pre, operation.post
    triggers = sets(before.running_actions, resource)
    lines = {
        "trigger": triggers,
        "free": resource.request_state in before.running_guard.reads(),
        "reply": waits,
        "reset": assigns(after.running_actions, resource.request_state),
        "clear": clears(after.running_actions, resource),
    }
    missing = [line for line, is_there in lines.items() if not is_there]
    match missing:
        case ["trigger"] if _is(before.running_guard, resource.request_state, RequestState.INITIAL.value):
            message = f"{operation.name} waits for the reply of {resource.name}, and does not trigger the request"
            yield _doubt(message, (*here, "pre", "a"), f"add `{resource.trigger} <- true` to `a` of `pre`")
        case ["free"]:
            message = f"{operation.name} triggers a request, and no guard says that {resource.name} is free"
            free = f"{resource.request_state} == initial"
            if resource.trigger not in before.running_guard.reads():
                free += f" && {resource.trigger} == false"
            yield _doubt(message, (*here, "pre", "g"), f"add `{free}` to `g` of `pre`")
        case [*_] if triggers and not waits and lines["clear"]:
            message = (
                f"{operation.name} completes in the instant in which it starts, so it cancels its own request to "
                f"{resource.name}"
            )
            yield _doubt(
                message, (*here, "post", "gr"), f"add `{resource.request_state} == succeeded` to `gr` of `post`"
            )
        case ["reset"] if not _is_reset_elsewhere(resource, RequestState.FAILED, after, model):
            message = (
                f"{operation.name} leaves {resource.request_state} at succeeded, so {resource.name} stays occupied"
            )
            yield _doubt(message, (*here, "post", "a"), f"add `{resource.request_state} <- initial` to `a` of `post`")
        case _:
            pass


def _doubts_about_triggers(resource: Resource, model: BehaviorModel, instant: Sequence[str]) -> Iterator[Doubt]:
    """Yield a doubt for each operation that reads the request state of a resource before it starts, not the trigger.

    The operation has all other lines of the protocol, or all others of the resource read the trigger, at least two.
    """
    users = [operation for operation in model.operations if sets(operation.pre.running_actions, resource)]
    unguarded = [each for each in users if resource.trigger not in each.pre.running_guard.reads()]
    for operation in unguarded:
        is_expected = operation.name not in instant and _follows(operation, resource, model)
        is_expected = is_expected or _is_odd_one(unguarded, users)
        if is_expected and resource.request_state in operation.pre.running_guard.reads():
            message = (
                f"{operation.name} triggers a request, and no guard reads {resource.trigger}: "
                f"{resource.request_state} alone does not show a request that is triggered and not sent yet"
            )
            path = ("operations", operation.name, "pre", "g")
            yield _doubt(message, path, f"add `{resource.trigger} == false` to `g` of `pre`")


def _follows(operation: Operation, resource: Resource, model: BehaviorModel) -> bool:
    """Return whether an operation that waits for the reply to its request leaves the resource free."""
    after = operation.post
    is_reset = assigns(after.running_actions, resource.request_state)
    is_free = is_reset or _is_reset_elsewhere(resource, RequestState.FAILED, after, model)
    return is_free and clears(after.running_actions, resource)


def _is_odd_one(odd: Sequence[Operation], users: Sequence[Operation]) -> bool:
    return len(odd) == 1 and len(users) > _HABIT


# failed replies


def _failures(model: BehaviorModel) -> Iterator[tuple[tuple[str, ...], Transition]]:
    """Yield the transitions that can take a failed reply, with their places in the file."""
    for operation in model.operations:
        if operation.failed is not None:
            yield ("operations", operation.name, "failed"), operation.failed
    for transition in model.automatic_transitions:
        yield ("automatic_transitions", transition.name), transition


def _doubts_about_failure(
    path: tuple[str, ...], transition: Transition, resource: Resource, model: BehaviorModel
) -> Iterator[Doubt]:
    is_named = _stands_for_generated(path, resource, model)
    if not _is(transition.running_guard, resource.request_state, RequestState.FAILED.value):
        if is_named and resource.request_state not in transition.running_guard.reads():
            message = f"{transition.name} has the name of the transition that takes failed replies, and takes none"
            yield _doubt(
                message, path, f"add `{resource.request_state} == failed` to its guard, or choose another name"
            )
        return
    actions = transition.running_actions
    states = (CURRENT_STATE, *(operation_state_name(operation.name) for operation in model.operations))
    executing = OperationState.EXECUTING.value
    fails = path[0] == "operations" or any(assigns(actions, state) for state in states)
    lines = {
        "fail": fails or not (is_named or any(_is(transition.running_guard, state, executing) for state in states)),
        "reset": assigns(actions, resource.request_state),
        "clear": clears(actions, resource),
    }
    missing = [line for line, is_there in lines.items() if not is_there]
    if path[0] != "operations" and (is_named or (fails and not missing)):
        yield from _doubts_about_executing(path, transition, resource, states)
    if len(missing) > 1 and not is_named:
        return
    if "fail" in missing:
        message = f"{transition.name} takes the failed reply of {resource.name}, and the operation goes on waiting"
        yield _doubt(message, path, "add `current.state <- failed` to its actions")
    if "reset" in missing and not _is_reset_elsewhere(resource, RequestState.SUCCEEDED, transition, model):
        message = f"{transition.name} leaves {resource.request_state} at failed, so {resource.name} stays occupied"
        yield _doubt(message, path, f"add `{resource.request_state} <- initial` to its actions")
    if "clear" in missing and ("fail" in missing or not _names_operation(transition, model)):
        message = f"{transition.name} leaves {resource.trigger} true, so the request is sent again at once"
        yield _doubt(message, path, f"add `{resource.trigger} <- false` to its actions")


def _doubts_about_executing(
    path: tuple[str, ...], transition: Transition, resource: Resource, states: Sequence[str]
) -> Iterator[Doubt]:
    """Yield a doubt if the guard of an automatic transition says nothing about the states of operations.

    Where the transition assigns `failed`, runs are the same without the line: the runner takes it only while the
    operation executes (semantics 1.3).
    """
    if any(state in transition.running_guard.reads() for state in states):
        return
    if any(assigns(transition.running_actions, state) for state in states):
        message = (
            f"{transition.name} fails an operation, and no guard says that the operation executes: "
            f"the runner takes {transition.name} only then all the same"
        )
    else:
        message = f"{transition.name} takes failed replies of {resource.name} also while no operation executes"
    yield _doubt(message, (*path, "g"), "add `current.state == executing` to its guard")


def _stands_for_generated(path: tuple[str, ...], resource: Resource, model: BehaviorModel) -> bool:
    """Return whether a transition by hand replaces the one that handshakes with a resource get (semantics 3.5).

    It has its name, such as `arm_failed`, or `arm_failed.r1` for the resource `arm.r1`. If an operation does not wait
    for the resource as handshakes do, or another transition takes its failed replies, the name means nothing.
    """
    name = resource.name
    ends = [index for index, character in enumerate(name) if character == "."]
    if path[0] != "automatic_transitions" or path[1] not in {
        f"{name[:end]}_failed{name[end:]}" for end in (*ends, len(name))
    }:
        return False
    failed = RequestState.FAILED.value
    others = (transition for other, transition in _failures(model) if other != path)
    if any(_is(other.running_guard, resource.request_state, failed) for other in others):
        return False
    users = [operation for operation in model.operations if sets(operation.pre.running_actions, resource)]
    return any(_waits_for(operation, resource) for operation in users)


def _waits_for(operation: Operation, resource: Resource) -> bool:
    """Return whether an operation begins with a free resource and ends with its reply."""
    before, after = operation.pre.running_guard, operation.post.running_guard
    is_free = _is(before, resource.request_state, RequestState.INITIAL.value) and _is(before, resource.trigger, False)
    return is_free and _is(after, resource.request_state, RequestState.SUCCEEDED.value)


def _names_operation(transition: Transition, model: BehaviorModel) -> bool:
    """Return whether a transition is about one operation: `request_doubts` looks at what such a failure leaves."""
    read = transition.running_guard.reads()
    return len(model.operations) == 1 or any(operation_state_name(each.name) in read for each in model.operations)


# lines


def _is(guard: Predicate, name: str, value: Value) -> bool:
    """Return whether a guard says that a variable has a value, apart from other conditions."""
    return Equal(Reference(name), Constant(value)) in conjuncts(guard)


def _is_reset_elsewhere(resource: Resource, other: RequestState, here: Transition, model: BehaviorModel) -> bool:
    """Return whether another part of the model makes the request state initial, and not only from the `other` one."""
    initial = Assign(resource.request_state, Constant(RequestState.INITIAL.value))
    return any(
        initial in each.running_actions and not _is(each.running_guard, resource.request_state, other.value)
        for each in (*model.automatic_transitions, *(operation.pre for operation in model.operations))
        if each is not here
    )


def _doubt(message: str, path: tuple[str, ...], remedy: str) -> Doubt:
    return Doubt(Slug.HANDSHAKE_INCOMPLETE, message, path, remedy)
