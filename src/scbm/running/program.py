"""A model compiled for running: every guard a test, every transition an update, on packed integers.

Made once for a model and shared by all its runners; what it says never changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model import (
    Action,
    Assign,
    BehaviorModel,
    Constant,
    Equal,
    Operation,
    OperationState,
    Packing,
    PlanState,
    Predicate,
    Reference,
    RequestState,
    Resource,
    Role,
    Transition,
    Truth,
    conjunction,
)
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE, operation_state_name

if TYPE_CHECKING:
    from scbm.cases import Injection
    from scbm.model.packing import Test, Update


@dataclass(frozen=True, slots=True)
class CompiledStep:
    """A transition as the runner takes it: `g && gr`, and `a` and `ar` at once.

    Attributes:
        name: the transition's.
        test: whether the guard holds.
        update: the state after the actions; `None` if they would leave a domain.
        cube: `(mask, bits)` with `state & mask == bits` wherever the guard holds.
        fails_operation: whether the actions fail the current operation.
    """

    name: str
    test: Test
    update: Update
    cube: tuple[int, int]
    fails_operation: bool = False

    def take(self, state: int) -> int | None:
        """The state afterwards, or `None` if the transition cannot be taken in `state`."""
        return self.update(state) if self.test(state) else None


@dataclass(frozen=True, slots=True)
class RunnableOperation:
    """An operation as the runner runs it.

    Attributes:
        become: for each state, `(keep, bits)` that put the operation into it (and out of the queue for `initial`).
        take_current: `(keep, bits)` that make it the current operation.
    """

    name: str
    pre: CompiledStep
    post: CompiledStep
    failed: CompiledStep | None
    timedout: Update
    deadline_ns: int | None
    disabled_deadline_ns: int | None
    become: dict[OperationState, tuple[int, int]]
    take_current: tuple[int, int]


@dataclass(frozen=True, slots=True)
class RequestLine:
    """What the runner watches to send requests to one resource, as masks and bits of packed states.

    Attributes:
        watched: the bits of trigger and request state.
        ready: those bits where the trigger is true and the state initial.
        trigger: the bit of the trigger.
        executing, cleared, succeeded, failed: `(keep, bits)` of the state; `cleared` resets the trigger as well.
        idle: `(keep, bits)` that make the state initial and leave the trigger.
        occupied: the watched bits where the trigger is true and the state executing.
        payload: the variables that a request carries.
    """

    resource: Resource
    watched: int
    ready: int
    trigger: int
    executing: tuple[int, int]
    succeeded: tuple[int, int]
    failed: tuple[int, int]
    idle: tuple[int, int]
    cleared: tuple[int, int]
    occupied: int

    def given_up(self, state: int) -> int:
        """The state without a request that was asked for or answered; what occupies the resource is left alone."""
        if not state & self.trigger:
            return state
        if state & self.watched == self.occupied:
            return state & ~self.trigger
        keep, bits = self.cleared
        return state & keep | bits


class Program:
    """The compiled model."""

    def __init__(self, model: BehaviorModel) -> None:
        self.model = model
        self.packing = Packing(model.running_space)
        self._tests: dict[Predicate, Test] = {}
        self.operations = {operation.name: self._operation(operation) for operation in model.operations}
        self.automatic = tuple(self._automatic(transition) for transition in model.automatic_transitions)
        self.automatic_cubes = tuple((*step.cube, step) for step in self.automatic)
        self.requests = tuple(self._request_line(resource) for resource in model.resources)
        self.plan_states = {s: self.packing.assignment({PLAN_STATE: s.value}) for s in PlanState}
        self.aborted = self.packing.cube(Equal(Reference(PLAN_STATE), Constant(PlanState.ABORTED.value)))
        self.measured = tuple(dict.fromkeys(name for resource in model.resources for name in resource.measures))

    def injection(self, injection: Injection) -> CompiledStep:
        """An injection, which acts like an automatic transition."""
        assign = tuple(Assign(name, Constant(value)) for name, value in injection.assign)
        return self._automatic(Transition(injection.name, injection.when or Truth(True), a=assign))

    def test(self, predicate: Predicate) -> Test:
        """A predicate as a function of packed states; compiled once, as goals come back case after case."""
        if predicate not in self._tests:
            self._tests[predicate] = self.packing.test(predicate)
        return self._tests[predicate]

    def _operation(self, operation: Operation) -> RunnableOperation:
        own = operation_state_name(operation.name)
        become = {
            state: self.packing.assignment({own: state.value, CURRENT_STATE: state.value}) for state in OperationState
        }
        initial = OperationState.INITIAL
        become[initial] = self.packing.assignment({own: initial, CURRENT_STATE: initial, CURRENT_NAME: NO_OPERATION})
        return RunnableOperation(
            operation.name,
            self._step(operation.pre),
            self._step(operation.post),
            None if operation.failed is None else self._step(operation.failed),
            self.packing.update(operation.timedout),
            operation.deadline_ns,
            operation.disabled_deadline_ns,
            become,
            self.packing.assignment({CURRENT_NAME: operation.name, CURRENT_STATE: initial}),
        )

    def _step(self, transition: Transition) -> CompiledStep:
        guard = transition.running_guard
        update = self.packing.update(transition.running_actions)
        return CompiledStep(transition.name, self.packing.test(guard), update, self.packing.cube(guard))

    def _automatic(self, transition: Transition) -> CompiledStep:
        """An automatic transition; one that fails an operation can be taken only while that one executes."""
        failing = [action for action in transition.running_actions if self._is_operation_state(action)]
        if not failing:
            return self._step(transition)
        executing = Constant(OperationState.EXECUTING.value)
        guards = [transition.running_guard, *(Equal(Reference(action.target), executing) for action in failing)]
        # Whichever name of the operation's state the file assigns, `current.state` follows it here, and the rest
        # of the runner's variables when the runner fails its current operation.
        failed = Assign(CURRENT_STATE, Constant(OperationState.FAILED.value))
        others = tuple(action for action in transition.running_actions if action.target != CURRENT_STATE)
        guard = conjunction(guards)
        update = self.packing.update((*others, failed))
        return CompiledStep(
            transition.name, self.packing.test(guard), update, self.packing.cube(guard), fails_operation=True
        )

    def _is_operation_state(self, action: Action) -> bool:
        role = self.packing.space[action.target].role
        return role in (Role.OPERATION_STATE, Role.CURRENT_STATE)

    def _request_line(self, resource: Resource) -> RequestLine:
        packing = self.packing
        trigger, state = packing[resource.trigger], packing[resource.request_state]
        initial = RequestState.INITIAL.value
        return RequestLine(
            resource,
            watched=trigger.mask | state.mask,
            ready=trigger.bits(True) | state.bits(initial),
            trigger=trigger.mask,
            executing=packing.assignment({resource.request_state: RequestState.EXECUTING.value}),
            succeeded=packing.assignment({resource.request_state: RequestState.SUCCEEDED.value}),
            failed=packing.assignment({resource.request_state: RequestState.FAILED.value}),
            idle=packing.assignment({resource.request_state: initial}),
            cleared=packing.assignment({resource.request_state: initial, resource.trigger: False}),
            occupied=trigger.bits(True) | state.bits(RequestState.EXECUTING.value),
        )
