"""A model compiled for running: every guard is a test and every transition an update of packed integers."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, Self

from scbm.cases import ConditionKind
from scbm.model import (
    Action,
    Assign,
    BehaviorModel,
    Constant,
    Domain,
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
from scbm.model.sources import changed_from_outside, free_groups
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE, operation_state_name
from scbm.running.compiled_steps import CompiledStep, OperationPart, RequestLine, RunnableOperation
from scbm.running.lifecycle import LifecycleState
from scbm.running.outside_changes import FreeMaker, OtherUser, OutsideChanges, TransitionMaker, free_makers

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.cases import Injection
    from scbm.model import EnvironmentTransition, Value
    from scbm.model.packing import Test
    from scbm.model.sources import FreeGroup


def _always(_: int) -> bool:
    return True


def _unchanged(state: int) -> int:
    return state


_NOTHING = CompiledStep("", _always, _unchanged)


def _have_equal_variables(model: BehaviorModel, mutant: BehaviorModel) -> bool:
    """Return whether the running spaces of a model and its mutant are equal."""
    if mutant.variables is not model.variables:
        return False
    pairs = ((model.operations, mutant.operations), (model.resources, mutant.resources))
    return all([entry.name for entry in before] == [entry.name for entry in after] for before, after in pairs)


class CompiledModel:
    """The compiled model, for one runner or many.

    Attributes:
        model: the model.
        packing: where each variable of the running space lies in a packed state.
        operations: the compiled operations by name, in the order of the model.
        automatic: the compiled automatic transitions, in the order of the model.
        automatic_cubes: the same, each after its mask and its bits.
        environment: the compiled environment transitions, in the order of the model.
        requests: the request variables of each resource, in the order of the model.
        shared: those of the resources that others use, too.
        triggers: the bits of all triggers.
        plan_states: for each value of `plan.state`, `(keep, bits)` that set it.
        aborted: `(mask, bits)` with `state & mask == bits` where `plan.state` is `aborted`.
        outside: what can change from outside at settled moments, and who makes it.
        measurable: the variables that are measured, published, or changed by the environment.
        measured: for each resource, in the order of the model, the values that its replies can carry.
    """

    def __init__(self, model: BehaviorModel) -> None:
        self.model = model
        self.packing = Packing(model.running_space)
        self._tests: dict[Predicate, Test] = {}
        self._planner_reads: dict[Predicate, int] = {}
        self.operations = {operation.name: self._operation(operation) for operation in model.operations}
        self._rest = {v.name: v.initial for v in model.running_space if v.role.is_runner}
        self._world = tuple(v.name for v in model.running_space if not v.role.is_runner)
        self.automatic = tuple(self._automatic(transition) for transition in model.automatic_transitions)
        self.automatic_cubes = tuple((*step.cube, step) for step in self.automatic)
        self.environment = tuple(self._environment(transition) for transition in model.environment)
        self.requests = tuple(self._request_line(*numbered) for numbered in enumerate(model.resources))
        self.shared = tuple(line for line in self.requests if line.resource.shared)
        self.triggers = sum(line.trigger for line in self.requests)
        self.plan_states = {s: self.packing.assignment({PLAN_STATE: s.value}) for s in PlanState}
        self.aborted = self.packing.cube(Equal(Reference(PLAN_STATE), Constant(PlanState.ABORTED.value)))
        replied = [name for resource in model.resources for name in resource.measures]
        self.measurable = tuple(dict.fromkeys((*changed_from_outside(model), *replied)))
        self.outside = self._outside(free_makers(model, self.packing))
        self.measured = [
            {name: Domain(resource.sends(model.space[name])) for name in resource.measures}
            for resource in model.resources
        ]
        self._current_mask = self.packing[CURRENT_NAME].mask | self.packing[CURRENT_STATE].mask
        self._current = dict(self._lifecycle_states(self.operations.values()))

    def of_mutant(self, mutant: BehaviorModel) -> Self:
        """Return the compiled mutant of the model; entries that both have are the same objects.

        What changes from outside is that of the model, whatever the mutant assigns: the world does not change with it.
        Entries that the mutant shares with the model are not compiled again, unless variables or operations differ.
        """
        if not _have_equal_variables(self.model, mutant):
            program = type(self)(mutant)
            program.measurable = self.measurable
            program.give(free_groups(self.model))
            return program
        program = copy(self)
        program._replace(mutant)
        return program

    def give(self, groups: Iterable[FreeGroup]) -> None:
        """Let what changes freely from outside give these values alone."""
        self.outside = self._outside([FreeMaker(group, self.packing) for group in groups])

    def _replace(self, mutant: BehaviorModel) -> None:
        """Take another model with the same variables and operations."""
        before, self.model = self.model, mutant
        pairs = list(zip(before.operations, mutant.operations, strict=True))
        changed = {new.name: self._operation(new) for old, new in pairs if new is not old}
        automatic = {id(old): step for old, step in zip(before.automatic_transitions, self.automatic, strict=True)}
        environment = {id(old): step for old, step in zip(before.environment, self.environment, strict=True)}
        requests = {id(line.resource): line for line in self.requests}
        self.operations = {name: changed.get(name, known) for name, known in self.operations.items()}
        self.automatic = tuple(automatic.get(id(t)) or self._automatic(t) for t in mutant.automatic_transitions)
        self.automatic_cubes = tuple((*step.cube, step) for step in self.automatic)
        self.environment = tuple(environment.get(id(t)) or self._environment(t) for t in mutant.environment)
        self.requests = tuple(requests.get(id(r)) or self._request_line(n, r) for n, r in enumerate(mutant.resources))
        self.shared = tuple(line for line in self.requests if line.resource.shared)
        self.outside = self._outside(self.outside.free)
        self._current = self._current | dict(self._lifecycle_states(changed.values()))
        self._planner_reads = {}

    def begin(self, state: Mapping[str, Value]) -> int:
        """Return the packed state of a world whose runner is at rest; `state` has a value for every variable of it."""
        return self.packing.pack(self._rest | {name: state[name] for name in self._world})

    def current(self, state: int) -> LifecycleState | None:
        """Return the current operation of a packed state with its state; `None` if no operation is current."""
        return self._current.get(state & self._current_mask)

    def fail_current(self, state: int) -> tuple[RunnableOperation, int]:
        """Return the current operation, and the packed state with it failed. The caller knows that there is one."""
        operation = self._current[state & self._current_mask].operation
        keep, bits = operation.become[OperationState.FAILED]
        return operation, state & keep | bits

    def end(self, state: int, plan_state: PlanState) -> int:
        """Return the packed state after the end of a run whose requests in flight are cancelled (semantics 5)."""
        keep, bits = self.plan_states[plan_state]
        state = state & keep | bits
        for line in self.requests:
            state = line.given_up(state)
        current = self.current(state)
        if current is not None:
            keep, bits = current.operation.become[OperationState.INITIAL]
            state = state & keep | bits
        return state

    def injection(self, injection: Injection) -> CompiledStep:
        """Return an injection as a step: it acts like an automatic transition.

        The guard is `when`; with `after` the predicate may be false again as the injection acts.
        """
        assign = tuple(Assign(name, Constant(value)) for name, value in injection.assign)
        when = None if injection.after_ns is not None else injection.when
        return self._automatic(Transition(injection.name, when or Truth(True), a=assign))

    def occupied_by(self, injection: Injection) -> RequestLine | None:
        """Return the shared resource that another user occupies by an injection; `None` if there is none."""
        if injection.condition is None or injection.condition.kind is not ConditionKind.OCCUPIED:
            return None
        return next((line for line in self.shared if line.resource.name == injection.resource), None)

    def planner_reads(self, goal: Predicate) -> int:
        """Return the bits of the variables that decide whether a plan for `goal` exists; memoized.

        Those are the variables of the world in guards `g`, in actions `a` of operations, and in the goal.
        """
        if goal not in self._planner_reads:
            planned = [t for operation in self.model.operations for t in (operation.pre, operation.post)]
            guards = [transition.g for transition in planned]
            read = [part.reads() for part in (*guards, goal, *(action for t in planned for action in t.a))]
            world = frozenset(self._world)
            masks = {name: self.packing[name].mask for names in read for name in names if name in world}
            self._planner_reads[goal] = sum(masks.values())
        return self._planner_reads[goal]

    def test(self, predicate: Predicate) -> Test:
        """Return a predicate as a function of packed states; memoized, as goals are repeated."""
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
            self._parts(operation),
            operation.deadline_ns,
            operation.disabled_deadline_ns,
            become,
            self.packing.assignment({CURRENT_NAME: operation.name, CURRENT_STATE: initial}),
        )

    def _parts(self, operation: Operation) -> dict[OperationPart, CompiledStep]:
        parts = {
            OperationPart.PRE: self._step(operation.pre),
            OperationPart.POST: self._step(operation.post),
            OperationPart.TIMEDOUT: CompiledStep("", _always, self.packing.update(operation.timedout)),
            OperationPart.NOTHING: _NOTHING,
        }
        if operation.failed is not None:
            parts[OperationPart.FAILED] = self._step(operation.failed)
        return parts

    def _lifecycle_states(self, operations: Iterable[RunnableOperation]) -> Iterator[tuple[int, LifecycleState]]:
        """Yield each operation in each of its states, after the bits of `current.name` and `current.state`."""
        for operation in operations:
            for state in OperationState:
                _, bits = self.packing.assignment({CURRENT_NAME: operation.name, CURRENT_STATE: state.value})
                yield bits, LifecycleState(operation, state)

    def _step(self, transition: Transition) -> CompiledStep:
        update = self.packing.update(transition.running_actions)
        return CompiledStep(transition.name, self.packing.test(transition.running_guard), update)

    def _environment(self, transition: EnvironmentTransition) -> CompiledStep:
        update = self.packing.update(transition.actions)
        return CompiledStep(transition.name, self.packing.test(transition.guard), update)

    def _outside(self, free: Sequence[FreeMaker]) -> OutsideChanges:
        """Return what changes freely, by environment transitions, and by other users of shared resources."""
        targets = (tuple(action.target for action in each.actions) for each in self.model.environment)
        return OutsideChanges([*free, *map(TransitionMaker, self.environment, targets), *map(OtherUser, self.shared)])

    def _automatic(self, transition: Transition) -> CompiledStep:
        """Return an automatic transition; one that fails an operation needs that operation to be executing."""
        guard, actions = transition.running_guard, transition.running_actions
        failing = [action for action in actions if self._is_operation_state(action)]
        if failing:
            executing = Constant(OperationState.EXECUTING.value)
            guard = conjunction([guard, *(Equal(Reference(action.target), executing) for action in failing)])
            # The file may assign `current.state` or `<operation>.state`. Here `current.state` is assigned, and
            # `fail_current` sets the other one.
            failed = Assign(CURRENT_STATE, Constant(OperationState.FAILED.value))
            actions = (*(action for action in actions if action.target != CURRENT_STATE), failed)
        test, update = self.packing.test(guard), self.packing.update(actions)
        return CompiledStep(transition.name, test, update, self.packing.cube(guard), fails_operation=bool(failing))

    def _is_operation_state(self, action: Action) -> bool:
        role = self.packing.space[action.target].role
        return role in (Role.OPERATION_STATE, Role.CURRENT_STATE)

    def _request_line(self, number: int, resource: Resource) -> RequestLine:
        packing = self.packing
        trigger, state = packing[resource.trigger], packing[resource.request_state]
        initial = RequestState.INITIAL.value
        return RequestLine(
            number,
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
