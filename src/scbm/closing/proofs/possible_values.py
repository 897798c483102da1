"""The values that runs can give variables, and the obligations that these rule out (decision 18).

The runner's steps (semantics 5 and 6) are rules of a delete relaxation: where the guard can hold, the values that the
actions assign are added, and no value is ever removed. So runs have no other values. The lifecycle of operations is the
table of the runner; time, plans and the order of steps are left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import Aspect, Obligation
from scbm.closing.proofs.blame import blame, contradicting, contradiction
from scbm.closing.summaries import listed
from scbm.model import (
    Action,
    Add,
    And,
    Assign,
    Constant,
    Equal,
    NotEqual,
    OperationState,
    Or,
    Predicate,
    Reference,
    RequestState,
    Role,
    Truth,
    conjunction,
    format_value,
)
from scbm.model.normal_form import bits_of, indices_of, normal_form
from scbm.model.packing import value_table
from scbm.model.satisfiability import satisfiable
from scbm.model.sources import free_groups
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, operation_state_name
from scbm.planning.engines import Move, MovePart, TransitionSystem
from scbm.planning.engines.delete_relaxation import Effect, RelaxedRule, relaxed_values
from scbm.planning.engines.joint_moves import joint_moves
from scbm.running.compiled_steps import OperationPart
from scbm.running.lifecycle import LIFECYCLE, guard_and_actions, is_current_in, states_trying

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Operation, Resource, StateSpace, Transition, Value, Variable
    from scbm.model.packing import ValueTable

_MAX_LISTED = 5
"""Maximum number of values of a variable that a reason lists."""


def possible_values(model: BehaviorModel) -> dict[str, tuple[Value, ...]]:
    """Return, for each variable of the running space, a superset of the values that it has in runs.

    What changes freely has all its values from the beginning (semantics 9.2). Variables are in the order of the
    space, values in the order of the domain.
    """
    space = model.running_space
    free: dict[str, list[Value]] = {}
    for group in free_groups(model):
        for name, values in group.values:
            free.setdefault(name, []).extend(values)
    starts = [bits_of(map(v.domain.index, (*_at_first(v), *free.get(v.name, ())))) for v in space]
    found = relaxed_values((each for rule in _rules(model) for each in _relaxed(rule, space)), starts)
    return {v.name: tuple(v.domain.values[i] for i in indices_of(bits)) for v, bits in zip(space, found, strict=True)}


def ruled_out(model: BehaviorModel, values: Mapping[str, tuple[Value, ...]]) -> tuple[tuple[Obligation, str], ...]:
    """Return the obligations that the values rule out, in the order of `Obligations`, each with its reason.

    *disabled* and *queued* are never among them. Everything that the structure of the model rules out is.
    """
    reasons = _ValueReasons(model, values)
    found = [
        (Obligation(operation.name, aspect), why)
        for operation in model.operations
        for aspect, why in reasons.of_operation(operation)
    ]
    for transition in model.automatic_transitions:
        why = reasons.of_automatic(transition)
        if why is not None:
            found.append((Obligation(transition.name, Aspect.TAKEN), why))
    return tuple(found)


def _at_first(variable: Variable) -> tuple[Value, ...]:
    """Return the values that a variable can have before the first event."""
    if variable.role is Role.PLAN_STATE:
        # Automatic transitions have their turn once more when a run has ended, however it ended.
        return variable.domain.values
    return (variable.initial,) if variable.role.is_runner else (variable.initial, *variable.random)


# the runner's steps as rules


class _ValueRule(Struct, frozen=True):
    """A step of the runner.

    Attributes:
        guard: where the step can be taken.
        actions: what it does; all actions have to stay in their domains.
        measured: variables that it may give any of some values.
    """

    guard: Predicate
    actions: tuple[Action, ...]
    measured: tuple[tuple[str, tuple[Value, ...]], ...] = ()


def _rules(model: BehaviorModel) -> Iterator[_ValueRule]:
    for operation in model.operations:
        yield from _operation_rules(operation)
    for transition in model.automatic_transitions:
        yield from _automatic_rules(transition, model)
    for change in model.environment:
        yield _ValueRule(change.guard, change.actions)
    for resource in model.resources:
        yield from _request_rules(resource, model)


def _operation_rules(operation: Operation) -> Iterator[_ValueRule]:
    """Yield the rows of the lifecycle table for an operation, whether a plan has it or not (semantics 5.5)."""
    yield _ValueRule(Truth(True), (_assign(CURRENT_NAME, operation.name),))
    for row in LIFECYCLE:
        part = guard_and_actions(operation, row.part)
        if part is not None:
            guard, actions = part
            where = _is_current_in(operation.name, row.source)
            yield _ValueRule(And((where, guard)), (*_becomes(operation.name, row.target), *actions))


def _is_current_in(operation: str, state: OperationState) -> Predicate:
    """Return the condition that an operation is current and in a state."""
    return _executes(operation) if state is OperationState.EXECUTING else is_current_in(operation, (state,))


def _automatic_rules(transition: Transition, model: BehaviorModel) -> Iterator[_ValueRule]:
    """Yield one rule, or one for each operation that the transition may fail (semantics 1.3)."""
    fails = _fails(transition, model)
    others = tuple(action for action in transition.running_actions if not _is_operation_state(action, model))
    if len(others) == len(transition.running_actions):
        yield _ValueRule(transition.running_guard, others)
    for name in fails:
        guard = And((_executes(name), transition.running_guard))
        yield _ValueRule(guard, (*_becomes(name, OperationState.FAILED), *others))


def _fails(transition: Transition, model: BehaviorModel) -> tuple[str, ...]:
    """Return the operations that an automatic transition may fail."""
    targets = dict.fromkeys(action.target for action in transition.running_actions)
    names = tuple(operation.name for operation in model.operations)
    return names if CURRENT_STATE in targets else tuple(n for n in names if operation_state_name(n) in targets)


def _is_operation_state(action: Action, model: BehaviorModel) -> bool:
    return model.running_space[action.target].role in (Role.OPERATION_STATE, Role.CURRENT_STATE)


def _request_rules(resource: Resource, model: BehaviorModel) -> Iterator[_ValueRule]:
    """Yield the rules of a request: sent and answered (semantics 6.2). Cancelling restores an earlier value."""
    trigger, state = resource.trigger, resource.request_state
    executing = _is(state, RequestState.EXECUTING.value)
    sent = And((_is(trigger, True), _is(state, RequestState.INITIAL.value)))
    yield _ValueRule(sent, (_assign(state, RequestState.EXECUTING.value),))
    measured = tuple((name, resource.sends(model.space[name])) for name in resource.measures)
    yield _ValueRule(executing, (_assign(state, RequestState.SUCCEEDED.value),), measured)
    yield _ValueRule(executing, (_assign(state, RequestState.FAILED.value),))
    if resource.shared:
        free = _is(state, RequestState.INITIAL.value)
        yield _ValueRule(free, (_assign(state, RequestState.EXECUTING.value),))
        yield _ValueRule(executing, (_assign(state, RequestState.INITIAL.value),))


def _waits(operation: Operation) -> Predicate:
    """Return the condition that the operation is current and its precondition is evaluated."""
    return is_current_in(operation.name, states_trying(OperationPart.PRE))


def _executes(operation: str) -> Predicate:
    """Return the condition that an operation is current and executes, also by its own state."""
    executing = OperationState.EXECUTING
    is_current = is_current_in(operation, (executing,)).operands
    return And((*is_current, _is(operation_state_name(operation), executing.value)))


def _becomes(operation: str, state: OperationState) -> tuple[Action, ...]:
    return _assign(operation_state_name(operation), state.value), _assign(CURRENT_STATE, state.value)


def _is(name: str, value: Value) -> Predicate:
    return Equal(Reference(name), Constant(value))


def _assign(name: str, value: Value) -> Action:
    return Assign(name, Constant(value))


# sets of values


def _relaxed(rule: _ValueRule, space: StateSpace) -> Iterator[RelaxedRule]:
    """Yield a rule of the relaxation, or one for each case of the variables that its sums read."""
    measured = [_any_value(name, values, space) for name, values in rule.measured]
    if not any(len(action.reads()) > 1 for action in rule.actions):
        effects = [_effect(action, space) for action in rule.actions]
        yield RelaxedRule(normal_form(rule.guard, space), (*effects, *measured))
        return
    for case in joint_moves(_single_move(rule.guard, rule.actions, space)):
        effects = [_table_effect(table) for table in case.writes]
        yield RelaxedRule(case.guard, (*effects, *measured))


def _single_move(guard: Predicate, actions: Sequence[Action], space: StateSpace) -> TransitionSystem:
    return TransitionSystem(space, (Move("", (MovePart(guard, tuple(actions)),)),))


def _effect(action: Action, space: StateSpace) -> Effect:
    """Return the values that an action can give its variable when it is taken any number of times."""
    if isinstance(action, Add):
        target, size, amount = space.position(action.target), len(space[action.target].domain), action.amount
        return Effect(target, target, lambda bits: _shifted(bits, amount, size))
    if isinstance(action.source, Constant):
        position, value = space.position(action.target), action.source.constant
        image = 1 << space[action.target].domain.index(value)
        return Effect(position, position, lambda bits: image if bits else 0)
    return _table_effect(value_table(action, space))


def _table_effect(table: ValueTable) -> Effect:
    indices = table.indices
    return Effect(
        table.target,
        table.source,
        lambda bits: bits_of(index for i in indices_of(bits) if (index := indices[i]) is not None),
    )


def _any_value(name: str, values: tuple[Value, ...], space: StateSpace) -> Effect:
    position, everything = space.position(name), bits_of(map(space[name].domain.index, values))
    return Effect(position, position, lambda bits: everything if bits else 0)


class ValueSets:
    """For each variable the set of values that it can have."""

    def __init__(self, space: StateSpace, values: Mapping[str, Sequence[Value]]) -> None:
        """Raise `KeyError` for a variable of the space without values, and for a value outside its domain."""
        self._space = space
        self._bits = tuple(bits_of(map(v.domain.index, values[v.name])) for v in space)

    def can_hold(self, predicate: Predicate) -> bool:
        """Return whether some choice of values satisfies the predicate, or the search for one met its limit."""
        return satisfiable(normal_form(predicate, self._space), self._bits) is not False

    def can_do(self, actions: Sequence[Action]) -> bool:
        """Return whether each of the actions can give its variable a value of the domain."""
        return self.can_take(Truth(True), actions)

    def can_take(self, guard: Predicate, actions: Sequence[Action]) -> bool:
        """Return whether the actions can be taken together where the guard can hold."""
        rules = _relaxed(_ValueRule(guard, tuple(actions)), self._space)
        return any(rule.can_be_taken(self._bits) for rule in rules)


def _shifted(bits: int, amount: int, size: int) -> int:
    """Return the values of a range of `size` that are one `amount` or more from the given ones, by doubling."""
    whole = (1 << size) - 1

    def moved(values: int, by: int) -> int:
        return (values << by if by > 0 else values >> -by) & whole

    reached, by = moved(bits, amount), amount
    while abs(by) < size:
        reached |= moved(reached, by)
        by *= 2
    return reached


# what the sets rule out


class _ValueReasons:
    """The reasons why the values of a model rule obligations out."""

    def __init__(self, model: BehaviorModel, values: Mapping[str, tuple[Value, ...]]) -> None:
        self._model = model
        self._values = values
        self._sets = ValueSets(model.running_space, values)

    def of_operation(self, operation: Operation) -> Iterator[tuple[Aspect, str]]:
        """Yield the aspects that are ruled out, each with the reason."""
        states = self._values[operation_state_name(operation.name)]
        never = None
        if OperationState.EXECUTING.value not in states:
            never = f"it never executes: {self._blocked('its precondition', operation.pre, _waits(operation))}"
            yield Aspect.EXECUTING, never
        if OperationState.FAILED.value not in states:
            yield Aspect.FAILED, never or self._never_failed(operation)
        if OperationState.TIMEDOUT.value not in states:
            yield Aspect.TIMEDOUT, never or _never_timedout(operation)
        if OperationState.COMPLETED.value not in states:
            where = _executes(operation.name)
            yield Aspect.COMPLETED, never or self._blocked("its postcondition", operation.post, where)

    def _never_failed(self, operation: Operation) -> str:
        name = operation.name
        where = _executes(name)
        ways = [] if operation.failed is None else [("its `failed` transition", operation.failed)]
        automatic = self._model.automatic_transitions
        ways += [(transition.name, transition) for transition in automatic if name in _fails(transition, self._model)]
        reasons = [self._blocked(what, transition, where) for what, transition in ways]
        return "; ".join(reasons) or "nothing fails it: it has no `failed` transition, and no automatic one fails it"

    def of_automatic(self, transition: Transition) -> str | None:
        """Return why an automatic transition is never taken; `None` if the values allow it."""
        rules = _automatic_rules(transition, self._model)
        if any(self._sets.can_take(rule.guard, rule.actions) for rule in rules):
            changes = conjunction((transition.running_guard, _changes(transition)))
            return None if self._sets.can_hold(changes) else "wherever its guard can hold, it would change nothing"
        executing = [_executes(name) for name in _fails(transition, self._model)]
        where = Or(tuple(executing)) if len(executing) > 1 else conjunction(executing)
        return self._blocked("its guard", transition, where)

    def _blocked(self, what: str, transition: Transition, where: Predicate) -> str:
        """Return why a transition cannot be taken where it is evaluated."""
        parts = contradiction((transition.running_guard,), self._model)
        if parts:
            return contradicting(what, parts)
        blamed = blame((transition.running_guard,), lambda part: self._sets.can_hold(And((where, part))))
        if not blamed:
            return self._misfit(what, transition, where)
        needed = conjunction(blamed)
        read = needed.reads()
        if self._sets.can_hold(needed):
            return f"{what} needs {needed}, which never holds when it is evaluated"
        if len(read) == 1:
            wanted = "that value" if isinstance(needed, Equal) else "such a value"
            return f"{what} needs {needed}, and no run gives {read[0]} {wanted}{self._known(read[0])}"
        if not read:
            return f"{what} needs {needed}, which never holds"
        return f"{what} needs {needed}, and no run gives {listed(read, 'and')} such values"

    def _misfit(self, what: str, transition: Transition, where: Predicate) -> str:
        """Return which action keeps a transition from being taken where its guard can hold."""
        for action in transition.running_actions:
            if not self._sets.can_do((action,)):
                return f"{what} would leave a domain: {action}"
        here = And((where, transition.running_guard))
        for action in transition.running_actions:
            if len(action.reads()) > 1 and not self._sets.can_take(here, (action,)):
                return f"{what} holds only where it would leave a domain: {action}"
        return f"{what} is never evaluated"

    def _known(self, name: str) -> str:
        """Return the possible values of a variable in words; empty if they are too many to list."""
        values = [format_value(value) for value in self._values[name]]
        if len(values) > _MAX_LISTED:
            return ""
        return f": it is always {values[0]}" if len(values) == 1 else f": it is only ever {listed(values, 'or')}"


def _never_timedout(operation: Operation) -> str:
    return "it has no `deadline`" if operation.deadline_ns is None else "its `timedout` actions would leave a domain"


def _changes(transition: Transition) -> Predicate:
    """Return the condition under which the actions of a transition change the state; `+=` never adds 0."""
    changes: list[Predicate] = []
    for action in transition.running_actions:
        if isinstance(action, Add):
            return Truth(True)
        changes.append(NotEqual(Reference(action.target), action.source))
    return Or(tuple(changes)) if len(changes) > 1 else conjunction(changes)
