"""A model as far as some of its variables are concerned: its guards, and the actions that assign one of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from scbm.certifying.transitions import fails_operation
from scbm.model import Constant, Equal, OperationState, Reference, conjunction
from scbm.model.variables import operation_state_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.model import Action, BehaviorModel, Domain, Operation, Predicate, Resource, Transition, Value

    Values: TypeAlias = dict[str, Value]


_MOST_REMEMBERED = 200_000
"""For so many values it is remembered what is taken next."""


@dataclass(frozen=True, slots=True)
class Rule:
    """A guard, and actions that are taken at once.

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
        """The values afterwards; `None` if the guard does not hold, or an action would leave a domain."""
        return self.acted(values) if self.guard.holds(values) else None

    def acted(self, values: Values) -> Values | None:
        """The values after the actions, whatever the guard says; `None` if one of them would leave a domain."""
        assigned = [action.value(values) for action in self.actions]
        for value, domain in zip(assigned, self.domains, strict=True):
            if value not in domain:
                return None
        return {**values, **{action.target: value for action, value in zip(self.actions, assigned, strict=True)}}


@dataclass(frozen=True, slots=True)
class OperationRules:
    """An operation (semantics 3.2).

    Attributes:
        failed: its own `failed` transition.
        timed: the states that it can only be in for some time.
    """

    name: str
    pre: Rule
    post: Rule
    failed: Rule | None
    timedout: Rule
    timed: tuple[str, ...]


class Rules:
    """All rules of a model.

    Attributes:
        model: the model.
        variables: the variables that are looked at, in order.
        at_rest: the states of all operations when none is current.
    """

    def __init__(self, model: BehaviorModel, variables: Sequence[str]) -> None:
        self.model = model
        self.variables = tuple(variables)
        initial = OperationState.INITIAL.value
        self.at_rest: Values = {operation_state_name(operation.name): initial for operation in model.operations}
        self.operations = {operation.name: self._operation(operation) for operation in model.operations}
        self.resources: dict[str, Resource] = {resource.name: resource for resource in model.resources}
        self._automatic_rules = tuple(self._automatic(transition) for transition in model.automatic_transitions)
        self._known: dict[tuple[Value, ...], tuple[Rule, Values] | None] = {}

    def next_automatic(self, values: Values) -> tuple[Rule, Values] | None:
        """The first automatic transition that can be taken and changes something, with the values afterwards (5.1).

        Remembered, as runs come through the same values again and again. The variables always stand in one order.
        """
        key = tuple(values.values())
        if key in self._known:
            return self._known[key]
        found = self._find_automatic(values)
        if len(self._known) < _MOST_REMEMBERED:
            self._known[key] = found
        return found

    def _find_automatic(self, values: Values) -> tuple[Rule, Values] | None:
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

    def _rule(self, transition: Transition) -> Rule:
        return self._acting(transition.name, transition.running_guard, transition.running_actions)

    def _automatic(self, transition: Transition) -> Rule:
        """An automatic transition; one that fails an operation can be taken only while that one executes (1.3)."""
        space = self.model.running_space
        failing = [action for action in transition.running_actions if fails_operation(action, space)]
        others = [action for action in transition.running_actions if action not in failing]
        executing = Constant(OperationState.EXECUTING.value)
        guards = [transition.running_guard, *(Equal(Reference(action.target), executing) for action in failing)]
        return self._acting(transition.name, conjunction(guards), others, fails_operation=bool(failing))

    def _acting(self, name: str, guard: Predicate, actions: Iterable[Action], *, fails_operation: bool = False) -> Rule:
        kept = tuple(action for action in actions if action.target in self.variables)
        domains = tuple(self.model.running_space[action.target].domain for action in kept)
        return Rule(name, guard, kept, domains, fails_operation)
