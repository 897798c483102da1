"""The guards and actions of a model, restricted to actions on some of its variables.

Everything in a model that has a guard or actions, in one list.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.model import Constant, Equal, OperationState, Reference, RequestState, Role, Truth, conjunction
from scbm.model.sources import free_groups
from scbm.model.variables import operation_state_name

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from scbm.model import (
        Action,
        BehaviorModel,
        Domain,
        EnvironmentTransition,
        Operation,
        Predicate,
        Resource,
        StateSpace,
        Transition,
        Value,
    )

    Values: TypeAlias = dict[str, Value]


class GuardedPart(Struct, frozen=True):
    """A guard with the actions that the runner takes together.

    Attributes:
        what: what reports call it.
        guard: `g && gr`.
        actions: `a` and `ar`.
        is_automatic: whether it is an automatic transition.
    """

    what: str
    guard: Predicate
    actions: tuple[Action, ...]
    is_automatic: bool = False


def parts_of(model: BehaviorModel) -> Iterator[GuardedPart]:
    """Yield the parts of all operations, then automatic and environment transitions, in the order of the model."""
    for operation in model.operations:
        yield from _parts_of_operation(operation)
    for transition in model.automatic_transitions:
        yield GuardedPart(f"automatic transition {transition.name}", *_both(transition), is_automatic=True)
    for change in model.environment:
        yield GuardedPart(f"environment transition {change.name}", change.guard, change.actions)


def _parts_of_operation(operation: Operation) -> Iterator[GuardedPart]:
    yield GuardedPart(f"the precondition of {operation.name}", *_both(operation.pre))
    yield GuardedPart(f"the postcondition of {operation.name}", *_both(operation.post))
    if operation.failed is not None:
        yield GuardedPart(f"the `failed` transition of {operation.name}", *_both(operation.failed))
    yield GuardedPart(f"the `timedout` actions of {operation.name}", Truth(True), operation.timedout)


def _both(transition: Transition) -> tuple[Predicate, tuple[Action, ...]]:
    return transition.running_guard, transition.running_actions


def fails_operation(action: Action, space: StateSpace) -> bool:
    """Return whether an action fails the current operation (semantics 1.3)."""
    return space[action.target].role in (Role.OPERATION_STATE, Role.CURRENT_STATE)


def may_leave(action: Action, space: StateSpace) -> bool:
    """Return whether an action can leave the domain of its target (semantics 2.4)."""
    names, domain = action.reads(), space[action.target].domain
    choices = product(*(space[name].domain.values for name in names))
    return any(action.value(dict(zip(names, values, strict=True))) not in domain for values in choices)


_MAX_REMEMBERED = 200_000
"""Maximum number of states whose next automatic transition is memoized."""


class GuardedRule(Struct, frozen=True):
    """A guard, and actions that are taken together.

    Attributes:
        domains: of the targets of the actions.
        fails_operation: whether the actions would fail the current operation; that action is not among them.
    """

    name: str
    guard: Predicate
    actions: tuple[Action, ...]
    domains: tuple[Domain, ...]
    fails_operation: bool = False

    def taken(self, values: Values) -> Values | None:
        """Return the values afterwards; `None` if the guard does not hold, or an action would leave a domain."""
        return self.acted(values) if self.guard.holds(values) else None

    def acted(self, values: Values) -> Values | None:
        """Return the values after the actions, without the guard; `None` if one of them would leave a domain."""
        assigned = [action.value(values) for action in self.actions]
        for value, domain in zip(assigned, self.domains, strict=True):
            if value not in domain:
                return None
        return {**values, **{action.target: value for action, value in zip(self.actions, assigned, strict=True)}}


class OperationRules(Struct, frozen=True):
    """The rules of an operation (semantics 3.2).

    Attributes:
        failed: its own `failed` transition.
        timed: the states that it can only be in for some time.
    """

    name: str
    pre: GuardedRule
    post: GuardedRule
    failed: GuardedRule | None
    timedout: GuardedRule
    timed: tuple[str, ...]


class OutsideRules:
    """The changes from outside of a model, restricted to some variables; false if there are none."""

    def __init__(self, model: BehaviorModel, variables: Sequence[str], guarded: Sequence[GuardedRule]) -> None:
        """Prepare the changes.

        Args:
            model: the model.
            variables: the variables that are kept.
            guarded: the environment transitions.
        """
        self._free = [changes for group in free_groups(model) for changes in group.changes(variables)]
        self._guarded = [rule for rule in guarded if rule.actions]
        self._shared = [resource for resource in model.resources if resource.shared]

    def __bool__(self) -> bool:
        return bool(self._free or self._guarded or self._shared)

    def changes(self, values: Values, in_flight: Collection[str]) -> Iterator[tuple[tuple[str, Value], ...]]:
        """Yield every change that is possible: of variables that change freely some at once (semantics 9.2).

        Args:
            values: the values where the runner is settled.
            in_flight: the resources with a request of the controller in flight.
        """
        yield from self._free
        for rule in self._guarded:
            after = rule.taken(values)
            if after is not None and after != values:
                yield tuple((name, value) for name, value in after.items() if value != values[name])
        for resource in self._shared:
            name = resource.request_state
            if resource.name not in in_flight and values[name] == RequestState.INITIAL:
                yield ((name, RequestState.EXECUTING.value),)
            elif resource.name not in in_flight and values[name] == RequestState.EXECUTING:
                yield ((name, RequestState.INITIAL.value),)


class GuardedRules:
    """The rules of a model.

    Attributes:
        model: the model.
        variables: the variables of the certificate, in order.
        at_rest: the states of all operations when none is current.
        outside: the changes from outside that can happen at settled moments; false if there are none.
    """

    def __init__(self, model: BehaviorModel, variables: Sequence[str]) -> None:
        self.model = model
        self.variables = tuple(variables)
        initial = OperationState.INITIAL.value
        self.at_rest: Values = {operation_state_name(operation.name): initial for operation in model.operations}
        self.operations = {operation.name: self._operation(operation) for operation in model.operations}
        self.resources: dict[str, Resource] = {resource.name: resource for resource in model.resources}
        self.outside = OutsideRules(model, self.variables, [self._outside(each) for each in model.environment])
        self._automatic_rules = tuple(self._automatic(transition) for transition in model.automatic_transitions)
        self._known: dict[tuple[Value, ...], tuple[GuardedRule, Values] | None] = {}
        self._planner_reads: dict[Predicate, tuple[str, ...]] = {}

    def planner_reads(self, goal: Predicate) -> tuple[str, ...]:
        """Return the variables whose change makes a runner without a plan ask again (5.6); memoized.

        A variable that the certificate omits changes no answer of the planner, so asking again changes nothing then.
        """
        if goal not in self._planner_reads:
            halves = [half for each in self.model.operations for half in (each.pre, each.post)]
            read = dict.fromkeys([*goal.reads(), *(name for half in halves for name in half.g.reads())])
            read |= {name: None for half in halves for action in half.a for name in action.reads()}
            world = [variable.name for variable in self.model.running_space if not variable.role.is_runner]
            self._planner_reads[goal] = tuple(name for name in world if name in read and name in self.variables)
        return self._planner_reads[goal]

    def _outside(self, transition: EnvironmentTransition) -> GuardedRule:
        return self._acting(transition.name, transition.guard, transition.actions)

    def next_automatic(self, values: Values) -> tuple[GuardedRule, Values] | None:
        """Return the first automatic transition that changes the values, and the values afterwards (5.1).

        Memoized, as runs repeat the same values. The variables are always in the same order.
        """
        key = tuple(values.values())
        if key in self._known:
            return self._known[key]
        found = self._find_automatic(values)
        if len(self._known) < _MAX_REMEMBERED:
            self._known[key] = found
        return found

    def _find_automatic(self, values: Values) -> tuple[GuardedRule, Values] | None:
        for rule in self._automatic_rules:
            after = rule.taken(values)
            if after is not None and (after != values or rule.fails_operation):
                return rule, after
        return None

    def _operation(self, operation: Operation) -> OperationRules:
        timers = {
            OperationState.EXECUTING.value: operation.deadline_ns,
            OperationState.DISABLED.value: operation.disabled_deadline_ns,
        }
        return OperationRules(
            operation.name,
            self._rule(operation.pre),
            self._rule(operation.post),
            None if operation.failed is None else self._rule(operation.failed),
            self._acting(f"{operation.name} timing out", conjunction(()), operation.timedout),
            tuple(state for state, allowed_ns in timers.items() if allowed_ns is not None),
        )

    def _rule(self, transition: Transition) -> GuardedRule:
        return self._acting(transition.name, transition.running_guard, transition.running_actions)

    def _automatic(self, transition: Transition) -> GuardedRule:
        """Return an automatic transition; one that fails an operation needs that operation to be executing (1.3)."""
        space = self.model.running_space
        failing = [action for action in transition.running_actions if fails_operation(action, space)]
        others = [action for action in transition.running_actions if action not in failing]
        executing = Constant(OperationState.EXECUTING.value)
        guards = [transition.running_guard, *(Equal(Reference(action.target), executing) for action in failing)]
        return self._acting(transition.name, conjunction(guards), others, fails_operation=bool(failing))

    def _acting(
        self, name: str, guard: Predicate, actions: Iterable[Action], *, fails_operation: bool = False
    ) -> GuardedRule:
        kept = tuple(action for action in actions if action.target in self.variables)
        domains = tuple(self.model.running_space[action.target].domain for action in kept)
        return GuardedRule(name, guard, kept, domains, fails_operation)
