"""The checker's own rules of `no_orphan` and `ready_again` (semantics 7.12): what a model may still do about a request.

They share no code with `scbm.testing.request_protocol`. Where a question takes too many valuations, the answer is the
one that proves less.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.model import Assign, Constant, OperationState, PlanState, RequestState, Role
from scbm.model.sources import outside_values, replied
from scbm.proofcheck.checked_run import MomentKind
from scbm.proofcheck.valuations import TooManyStepsError, is_satisfiable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.model import Action, BehaviorModel, Operation, Predicate, Resource, Transition, Value
    from scbm.proofcheck.checked_run import CheckedMoment
    from scbm.proofcheck.guarded_parts import Values

    RequestMemory: TypeAlias = tuple[tuple[tuple[str, str], ...], str]
    """The operation that made each trigger true, and the last operation that ended if it failed or timed out."""
    Allowed: TypeAlias = dict[str, tuple[Value, ...]]

_BETWEEN = (MomentKind.BECOMES_CURRENT, MomentKind.ASKS_PLAN, MomentKind.REACHES_GOAL)
_WRONG = (OperationState.FAILED, OperationState.TIMEDOUT)
_ANSWERED = (RequestState.SUCCEEDED, RequestState.FAILED)
_NO_OPERATION_UNDER_WAY = {
    Role.OPERATION_STATE: (OperationState.INITIAL.value, OperationState.DISABLED.value),
    Role.CURRENT_STATE: (OperationState.INITIAL.value, OperationState.DISABLED.value),
    Role.PLAN_STATE: (PlanState.PLANNING.value, PlanState.EXECUTING.value),
}


class RequestRule:
    """Follows the requests of runs, and finds the moments that violate one built-in requirement.

    Attributes:
        start: what is remembered before the first moment.
    """

    start: RequestMemory = ((), "")

    def __init__(self, model: BehaviorModel, *, asks_ready: bool) -> None:
        """`asks_ready`: whether `ready_again` is asked, and not `no_orphan`."""
        self._model = model
        self._asks_ready = asks_ready
        self._operations = {operation.name: operation for operation in model.operations}
        self._automatic = model.automatic_transitions
        self._known: dict[tuple[object, ...], bool] = {}

    def noted(self, moments: Iterable[CheckedMoment]) -> tuple[CheckedMoment, ...]:
        """Return all moments."""
        return tuple(moments)

    def followed(self, memory: RequestMemory, moments: Sequence[CheckedMoment]) -> tuple[RequestMemory, bool]:
        """Return what is remembered after some moments, and whether one of them violates the requirement."""
        owners, went_wrong = dict(memory[0]), memory[1]
        for moment in moments:
            match moment.kind:
                case MomentKind.TRIGGERS:
                    owners[moment.about] = moment.operation
                case MomentKind.ENDS_OPERATION:
                    went_wrong = moment.operation if moment.about in _WRONG else ""
                case MomentKind.STATE:
                    for resource in self._model.resources:
                        if not moment.values[resource.trigger]:
                            owners.pop(resource.name, None)
                case _ if moment.kind in _BETWEEN and self._is_violated(moment, owners, went_wrong):
                    return memory, True
                case _:
                    pass
        return (tuple(sorted(owners.items())), went_wrong), False

    def _is_violated(self, moment: CheckedMoment, owners: dict[str, str], went_wrong: str) -> bool:
        if not self._asks_ready:
            return any(self._is_orphan(resource, owners, moment.values) for resource in self._model.resources)
        if moment.kind is not MomentKind.ASKS_PLAN or not went_wrong:
            return False
        used = self._uses(self._operations[went_wrong])
        judged = (resource for resource in used if not self._is_orphan(resource, owners, moment.values))
        return any(not self._is_ready(resource, moment.values) for resource in judged)

    def _is_orphan(self, resource: Resource, owners: dict[str, str], values: Values) -> bool:
        owner = owners.get(resource.name)
        if owner is None or not values[resource.trigger]:
            return False
        key = (owner, resource.name, tuple(values.values()))
        if key not in self._known:
            self._known[key] = not self._may_outlive(self._operations[owner], resource, values)
        return self._known[key]

    # no_orphan

    def _may_outlive(self, operation: Operation, resource: Resource, values: Values) -> bool:
        """Return whether another part of the model is there to end a request after its operation."""
        if any(_sets(each.running_actions, resource) for each in self._automatic):
            return True
        reported = (resource.request_state, *resource.measures, *resource.publishes)
        post = operation.post
        awaits = _clears(post.running_actions, resource) or any(n in reported for n in post.running_guard.reads())
        others = (_actions(each) for each in self._model.operations if each.name != operation.name)
        elsewhere = [*others, *(each.running_actions for each in self._automatic)]
        is_started = _sets(_actions(operation), resource) and not awaits
        if is_started and any(_clears(actions, resource) for actions in elsewhere):
            return True
        if any(self._acknowledges(each, resource) for each in self._model.operations):
            return True
        return self._may_assign(resource.trigger, False, values)

    @staticmethod
    def _acknowledges(operation: Operation, resource: Resource) -> bool:
        actions, read = _actions(operation), operation.pre.running_guard.reads()
        if not _clears(actions, resource) or _sets(actions, resource):
            return False
        return resource.trigger in read or resource.request_state in read

    # ready_again

    def _uses(self, operation: Operation) -> tuple[Resource, ...]:
        """Return the resources that an operation uses; those that only automatic transitions use belong to each one."""
        return tuple(r for r in self._model.resources if _names(operation, r) or self._is_automatic(r))

    def _is_automatic(self, resource: Resource) -> bool:
        is_sent_to = any(_sets(each.running_actions, resource) for each in self._automatic)
        return is_sent_to and not any(_names(operation, resource) for operation in self._model.operations)

    def _is_ready(self, resource: Resource, values: Values) -> bool:
        value = values[resource.request_state]
        if value not in _ANSWERED:
            return True
        ever = self._reachable(values, self._model.actions)
        if self._is_automatic(resource):
            runner = {v.name: v.domain.values for v in self._model.running_space if v.role.is_runner}
            ever = {**runner, **ever}
            here = {**ever, resource.request_state: (value,)}
            resets = (t for t in self._automatic if any(a.target == resource.request_state for a in t.running_actions))
            senders = [t for t in self._automatic if _sets(t.running_actions, resource)]
            return any(self._is_possible(t.running_guard, here) for t in resets) or not any(
                self._is_possible(t.running_guard, ever, unknown=True) for t in senders
            )
        senders_of = (o for o in self._model.operations if _sets(_actions(o), resource))
        return (
            any(self._can_start(operation, resource, value) for operation in self._model.operations)
            or self._may_assign(resource.request_state, RequestState.INITIAL.value, values)
            or not any(self._is_possible(o.pre.running_guard, ever, unknown=True) for o in senders_of)
        )

    def _can_start(self, operation: Operation, resource: Resource, value: Value) -> bool:
        name, guard = resource.request_state, operation.pre.g
        is_named = name in guard.reads() or any(each.target == name for each in operation.pre.running_actions)
        return is_named and self._is_possible(guard, {name: (value,)})

    # what is possible while no operation is under way

    def _may_assign(self, name: str, value: Value, values: Values) -> bool:
        """Return whether automatic transitions may bring about that one of them assigns a value."""
        action = Assign(name, Constant(value))
        actions = [each for transition in self._automatic for each in transition.running_actions]
        allowed = {**self._reachable(values, actions), name: (values[name],)}
        return any(
            action in each.running_actions and self._is_possible(each.running_guard, allowed)
            for each in self._automatic
        )

    def _reachable(self, values: Values, actions: Iterable[Action]) -> Allowed:
        """Return the values that variables may get by actions, replies and from outside, whatever the guards."""
        space = self._model.space
        found = {v.name: [values[v.name]] if v.name in values else list(v.domain.values) for v in space}
        states = tuple(state.value for state in RequestState)
        reported = {**outside_values(self._model), **{n: space[n].domain.values for n in replied(self._model)}}
        for name, more in (*reported.items(), *((r.request_state, states) for r in self._model.resources)):
            found[name] += more
        for action in actions:
            if action.target in found:
                is_constant = isinstance(action, Assign) and isinstance(action.source, Constant)
                found[action.target] += [action.value({})] if is_constant else space[action.target].domain.values
        return {name: tuple(dict.fromkeys(known)) for name, known in found.items()}

    def _is_possible(self, guard: Predicate, allowed: Allowed, *, unknown: bool = False) -> bool:
        space = self._model.running_space
        choices = {
            name: allowed.get(name) or _NO_OPERATION_UNDER_WAY.get(space[name].role) or space[name].domain.values
            for name in guard.reads()
        }
        try:
            return is_satisfiable(guard, choices)
        except TooManyStepsError:
            return unknown


def _transitions(operation: Operation) -> Iterator[Transition]:
    yield from (operation.pre, operation.post)
    if operation.failed is not None:
        yield operation.failed


def _actions(operation: Operation) -> tuple[Action, ...]:
    own = (action for transition in _transitions(operation) for action in transition.running_actions)
    return (*own, *operation.timedout)


def _names(operation: Operation, resource: Resource) -> bool:
    """Return whether an operation reads or assigns the trigger or the request state of a resource."""
    read = [name for transition in _transitions(operation) for name in transition.running_guard.reads()]
    named = (*read, *(action.target for action in _actions(operation)))
    return resource.trigger in named or resource.request_state in named


def _sets(actions: Iterable[Action], resource: Resource) -> bool:
    """Return whether an action may make the trigger of a resource true."""
    off = Assign(resource.trigger, Constant(False))
    return any(each.target == resource.trigger and each != off for each in actions)


def _clears(actions: Iterable[Action], resource: Resource) -> bool:
    """Return whether an action may make the trigger of a resource false."""
    on = Assign(resource.trigger, Constant(True))
    return any(each.target == resource.trigger and each != on for each in actions)
