"""The request protocol of a model: which requests may outlive their operation, and when a resource is ready again.

The built-in requirements `no_orphan` and `ready_again` are about this protocol (semantics 6.2 and 7.12).
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from scbm.model import Assign, Constant, OperationState, PlanState
from scbm.model.normal_form import normal_form
from scbm.model.satisfiability import satisfiable
from scbm.model.sources import outside_values, replied
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, RequestState, Role, operation_state_name
from scbm.running.compiled_steps import OperationPart
from scbm.running.lifecycle import states_trying

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from scbm.model import Action, BehaviorModel, Operation, Predicate, Resource, Transition, Value

_AT_REST = tuple(state.value for state in states_trying(OperationPart.PRE))
"""The states of operations between the end of one operation and the start of the next one."""

_GOING_ON = (PlanState.PLANNING.value, PlanState.EXECUTING.value)
"""The values of `plan.state` while a run goes on."""


class RequestProtocol:
    """The use of requests by the operations and automatic transitions of one model.

    Attributes:
        triggers: the resource of each trigger, by the name of the variable.
        states: the resource of each request state, by the name of the variable.
        at_rest: the value of each trigger and request state while nothing is requested.
    """

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        self.triggers = {resource.trigger: resource for resource in model.resources}
        self.states = {resource.request_state: resource for resource in model.resources}
        self.at_rest: dict[str, Value] = dict.fromkeys(self.triggers, False)
        self.at_rest |= dict.fromkeys(self.states, RequestState.INITIAL.value)

    def may_outlive(self, operation: Operation, resource: Resource, state: Mapping[str, Value]) -> bool:
        """Return whether a request that an operation has triggered need not end with the operation.

        That is so if the operation completes without awaiting the reply, and another action clears the trigger; if an
        operation that reads the request or its trigger acknowledges it; or if an automatic transition can still end it.

        Args:
            operation: the operation that made the trigger true.
            resource: the resource of the trigger.
            state: the state in which no operation is under way, and the trigger is true.
        """
        return self._is_handed_over(operation, resource) or self._may_be_assigned(resource.trigger, False, state)

    def may_be_ended(self, operation: Operation, resource: Resource, end: OperationState) -> bool:
        """Return whether something may end a request that an operation has triggered, as far as the text shows it.

        Other than for `may_outlive`, no state is known but the last state of the operation.

        Args:
            operation: the operation that made the trigger true.
            resource: the resource of the trigger.
            end: the last state of the operation: completed, failed or timedout.
        """
        if self._is_handed_over(operation, resource):
            return True
        known: dict[str, tuple[Value, ...]] = {
            resource.trigger: (True,),
            operation_state_name(operation.name): (end.value, *_AT_REST),
            CURRENT_STATE: (end.value, *_AT_REST),
        }
        return any(
            clears(each.running_actions, resource) and self._is_possible(each.running_guard, known)
            for each in self._model.automatic_transitions
        )

    def fails(self, transition: Transition, operation: Operation) -> bool:
        """Return whether an automatic transition may fail an operation, as far as its guard shows it."""
        states = (CURRENT_STATE, operation_state_name(operation.name))
        if not any(action.target in states for action in transition.running_actions):
            return False
        executing = (OperationState.EXECUTING.value,)
        known: dict[str, tuple[Value, ...]] = dict.fromkeys(states, executing)
        return self._is_possible(transition.running_guard, known | {CURRENT_NAME: (operation.name,)})

    def is_ready(self, resource: Resource, state: Mapping[str, Value]) -> bool:
        """Return whether a resource whose last request was answered can be used again, or never will be.

        Args:
            resource: the resource.
            state: the state in which no operation is under way.
        """
        value = state[resource.request_state]
        if value not in (RequestState.SUCCEEDED.value, RequestState.FAILED.value):
            return True
        if resource in self._of_automatic_transitions:
            return self._may_ever_be_reset(resource, state)
        initial = RequestState.INITIAL.value
        return (
            any(self._can_start(operation, resource, value) for operation in self._model.operations)
            or self._may_be_assigned(resource.request_state, initial, state)
            or not self._may_be_used_again(resource, state)
        )

    def uses(self, operation: Operation) -> tuple[Resource, ...]:
        """Return the resources that an operation sends requests to, or whose requests it reads or assigns.

        Resources that only automatic transitions use belong to each operation.
        """
        own = self._used_by(operation)
        return tuple(r for r in self._model.resources if r in own or r in self._of_automatic_transitions)

    def _used_by(self, operation: Operation) -> tuple[Resource, ...]:
        named = dict.fromkeys((*_reads(operation), *(action.target for action in _actions(operation))))
        return tuple(r for r in self._model.resources if r.trigger in named or r.request_state in named)

    @cached_property
    def _of_automatic_transitions(self) -> tuple[Resource, ...]:
        """The resources to which automatic transitions send requests, and which no operation uses."""
        used = [resource for operation in self._model.operations for resource in self._used_by(operation)]
        automatic = self._model.automatic_transitions
        sent_to = (r for r in self._model.resources if any(sets(each.running_actions, r) for each in automatic))
        return tuple(resource for resource in sent_to if resource not in used)

    def _may_ever_be_reset(self, resource: Resource, state: Mapping[str, Value]) -> bool:
        """Return whether an automatic transition may reset a request state at any time, or none sends requests again.

        Other than for the resources of operations, it may do so while an operation executes.
        """
        space = self._model.running_space
        values = {variable.name: variable.domain.values for variable in space if variable.role.is_runner}
        values |= self._values_after(state, self._model.actions)
        known = values | {resource.request_state: (state[resource.request_state],)}
        automatic = self._model.automatic_transitions
        resets = (each for each in automatic if assigns(each.running_actions, resource.request_state))
        senders = (each for each in automatic if sets(each.running_actions, resource))
        return any(self._is_possible(each.running_guard, known) for each in resets) or not any(
            self._is_possible(each.running_guard, values) for each in senders
        )

    def _is_handed_over(self, operation: Operation, resource: Resource) -> bool:
        """Return whether another part of the model is there to end what an operation has triggered."""
        if any(sets(each.running_actions, resource) for each in self._model.automatic_transitions):
            return True
        is_ended = self._only_starts(operation, resource) and self._is_cleared_elsewhere(operation, resource)
        return is_ended or self._is_acknowledged(resource)

    @staticmethod
    def _only_starts(operation: Operation, resource: Resource) -> bool:
        """Return whether an operation triggers a request and completes without waiting for what comes of it."""
        post = operation.post
        reported = (resource.request_state, *resource.measures, *resource.publishes)
        reads = dict.fromkeys(post.running_guard.reads())
        is_cleared = clears(post.running_actions, resource)
        return sets(_actions(operation), resource) and not is_cleared and not any(name in reads for name in reported)

    def _is_cleared_elsewhere(self, operation: Operation, resource: Resource) -> bool:
        others = (each for each in self._model.operations if each.name != operation.name)
        automatic = self._model.automatic_transitions
        return any(clears(_actions(each), resource) for each in others) or any(
            clears(each.running_actions, resource) for each in automatic
        )

    def _is_acknowledged(self, resource: Resource) -> bool:
        """Return whether an operation that never triggers requests clears the trigger, and has a guard about it."""
        for operation in self._model.operations:
            actions = _actions(operation)
            if clears(actions, resource) and not sets(actions, resource):
                read = operation.pre.running_guard.reads()
                if resource.trigger in read or resource.request_state in read:
                    return True
        return False

    def _can_start(self, operation: Operation, resource: Resource, value: Value) -> bool:
        """Return whether an operation is meant to start in a request state: its guard names it, or it assigns it."""
        name, guard = resource.request_state, operation.pre.g
        is_assigned = any(action.target == name for action in operation.pre.running_actions)
        if not is_assigned and name not in guard.reads():
            return False
        return self._is_possible(guard, {name: (value,)})

    def _may_be_assigned(self, name: str, value: Value, state: Mapping[str, Value]) -> bool:
        """Return whether an automatic transition may yet assign a value while no operation is under way."""
        wanted = [
            each
            for each in self._model.automatic_transitions
            if any(_is_assignment(action, name, value) for action in each.running_actions)
        ]
        if not wanted:
            return False
        automatic = (action for each in self._model.automatic_transitions for action in each.running_actions)
        values = self._values_after(state, automatic) | {name: (state[name],)}
        return any(self._is_possible(each.running_guard, values) for each in wanted)

    def _may_be_used_again(self, resource: Resource, state: Mapping[str, Value]) -> bool:
        """Return whether an operation that triggers requests to a resource may ever start again."""
        values = self._values_after(state, self._model.actions)
        return any(
            sets(_actions(operation), resource) and self._is_possible(operation.pre.running_guard, values)
            for operation in self._model.operations
        )

    def _values_after(self, state: Mapping[str, Value], actions: Iterable[Action]) -> dict[str, tuple[Value, ...]]:
        """Return for each variable of the model the values that it may get, as if each action could be taken."""
        found = {variable.name: dict.fromkeys((state[variable.name],)) for variable in self._model.space}
        for name, values in self._reported.items():
            found[name].update(dict.fromkeys(values))
        for action in actions:
            if action.target in found:
                found[action.target].update(dict.fromkeys(self._assigned(action)))
        return {name: tuple(values) for name, values in found.items()}

    def _assigned(self, action: Action) -> tuple[Value, ...]:
        if isinstance(action, Assign) and isinstance(action.source, Constant):
            return (action.source.constant,)
        return self._model.space[action.target].domain.values

    @cached_property
    def _reported(self) -> dict[str, tuple[Value, ...]]:
        """The values that replies, resources and the environment give to variables, without any action of the model."""
        states = {resource.request_state: tuple(s.value for s in RequestState) for resource in self._model.resources}
        measured = {name: self._model.space[name].domain.values for name in replied(self._model)}
        return {**outside_values(self._model), **measured, **states}

    def _is_possible(self, guard: Predicate, values: Mapping[str, tuple[Value, ...]]) -> bool:
        """Return whether a guard can hold while no operation is under way; a search that gives up counts as yes."""
        space = self._model.running_space
        allowed = []
        for variable, all_values in zip(space, space.all_values, strict=True):
            among = values.get(variable.name, _at_rest(variable.role))
            bits = (1 << i for i, value in enumerate(variable.domain.values) if among is not None and value in among)
            allowed.append(all_values if among is None else sum(bits))
        return satisfiable(normal_form(guard, space), allowed) is not False


def _at_rest(role: Role) -> tuple[Value, ...] | None:
    """Return the values of a variable of the runner while no operation is under way; `None` for all values."""
    match role:
        case Role.OPERATION_STATE | Role.CURRENT_STATE:
            return _AT_REST
        case Role.PLAN_STATE:
            return _GOING_ON
        case _:
            return None


def transitions_of(operation: Operation) -> Iterator[Transition]:
    """Yield the transitions of an operation."""
    yield operation.pre
    yield operation.post
    if operation.failed is not None:
        yield operation.failed


def _actions(operation: Operation) -> tuple[Action, ...]:
    own = (action for transition in transitions_of(operation) for action in transition.running_actions)
    return (*own, *operation.timedout)


def _reads(operation: Operation) -> Iterator[str]:
    for transition in transitions_of(operation):
        yield from transition.running_guard.reads()


def assigns(actions: Iterable[Action], name: str) -> bool:
    """Return whether an action assigns a variable."""
    return any(action.target == name for action in actions)


def sets(actions: Iterable[Action], resource: Resource) -> bool:
    """Return whether an action can make the trigger of a resource true."""
    return any(each.target == resource.trigger and not _is_assignment(each, each.target, False) for each in actions)


def clears(actions: Iterable[Action], resource: Resource) -> bool:
    """Return whether an action can make the trigger of a resource false."""
    return any(each.target == resource.trigger and not _is_assignment(each, each.target, True) for each in actions)


def _is_assignment(action: Action, name: str, value: Value) -> bool:
    return action == Assign(name, Constant(value))
