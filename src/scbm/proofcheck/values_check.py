"""Checks sets of values that no step leaves, with no visit to a claimed obligation (`ValuesArgument`).

The check derives everything that can happen in a run of which only a set of values for each variable is known (delete
relaxation). The current operation and its state are kept together in a `_Moment`. All other variables are independent
of each other: a step is possible if the variables that it reads have values in their sets for which its guard holds
and its actions stay in their domains. So everything that happens in a run is possible here, and more. A question that
takes too many valuations counts as possible.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.model import (
    Add,
    And,
    Assign,
    Constant,
    Equal,
    NotEqual,
    OperationState,
    Or,
    Order,
    PlanState,
    Reference,
    Relation,
    RequestState,
    Truth,
    format_value,
)
from scbm.model.sources import free_groups
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE, operation_state_name
from scbm.proofcheck.certificate import CertificateFlaw, ClaimedAspect, ClaimedObligation
from scbm.proofcheck.guarded_parts import fails_operation
from scbm.proofcheck.valuations import TooManyStepsError, is_satisfiable

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import (
        Action,
        BehaviorModel,
        Domain,
        Operation,
        Predicate,
        Resource,
        StateSpace,
        Term,
        Transition,
        Value,
        Variable,
    )
    from scbm.proofcheck.certificate import ValuesArgument


Sets: TypeAlias = "dict[str, tuple[Value, ...]]"
"""The values of each variable of the running space."""
Given: TypeAlias = "tuple[tuple[str, Value], ...]"
"""Pairs of a variable and a value that it gets."""


class Possible(Struct, frozen=True):
    """An event or a step that is possible.

    Attributes:
        what: its name for messages.
        gives: values that variables get; values that were in their sets before may be left out.
        visits: the obligations that it visits.
    """

    what: str
    gives: Given
    visits: tuple[ClaimedObligation, ...] = ()


class _Moment(Struct, frozen=True):
    """An operation is current and in one of its states, the others are initial; or none is current, and all are."""

    operation: Operation | None
    state: OperationState
    sets: Sets
    space: StateSpace


def all_possible(sets: Sets, model: BehaviorModel) -> Iterator[Possible]:
    """Yield everything that is possible from the beginning of a run until nothing follows its end any more."""
    yield _begin(model)
    yield _change_from_outside(model)
    yield _end()
    for resource in model.resources:
        if _can_be_sent(resource, sets):
            yield _request(resource, model)
    for operation in model.operations:
        yield _become_current(operation)
    yield from _environment_transitions(_at_rest(sets, model), model)
    for moment in _moments(sets, model):
        yield from _automatic_transitions(moment, model)
        if moment.operation is not None:
            yield from _lifecycle(moment, moment.operation)


# the beginning, requests, plans


def _begin(model: BehaviorModel) -> Possible:
    given: list[tuple[str, Value]] = [(variable.name, v) for variable in model.space for v in variable.random]
    given += [(variable.name, variable.initial) for variable in model.running_space]
    given += [(PLAN_STATE, PlanState.PLANNING.value), (PLAN_STATE, PlanState.EXECUTING.value)]
    return Possible("the beginning of a run", tuple(given))


def _change_from_outside(model: BehaviorModel) -> Possible:
    """Return that inputs and published values change freely, and that others use shared resources (9.2, 9.5)."""
    given = [(name, value) for group in free_groups(model) for name, values in group.values for value in values]
    used = (RequestState.INITIAL, RequestState.EXECUTING)
    given += [
        (resource.request_state, state.value) for resource in model.resources if resource.shared for state in used
    ]
    return Possible("a change from outside", tuple(given))


def _environment_transitions(moment: _Moment, model: BehaviorModel) -> Iterator[Possible]:
    """Yield the environment transitions that are possible; they read no variable of the runner (9.4)."""
    for transition in model.environment:
        given = _given(transition.guard, transition.actions, moment)
        if given is not None:
            yield Possible(f"the environment transition {transition.name}", given)


def _end() -> Possible:
    """Return the end of a run. Requests are cleared, which gives back the values of the beginning of a run."""
    ends = (PlanState.COMPLETED, PlanState.UNSOLVABLE, PlanState.ABORTED)
    return Possible("the end of a run", tuple((PLAN_STATE, end.value) for end in ends))


def _can_be_sent(resource: Resource, sets: Sets) -> bool:
    return True in sets[resource.trigger] and RequestState.INITIAL.value in sets[resource.request_state]


def _request(resource: Resource, model: BehaviorModel) -> Possible:
    """Return a request and its reply. A cancelled request is initial again, which adds no value."""
    states = (RequestState.EXECUTING, RequestState.SUCCEEDED, RequestState.FAILED)
    given: list[tuple[str, Value]] = [(resource.request_state, state.value) for state in states]
    given += [(name, value) for name in resource.measures for value in resource.sends(model.space[name])]
    return Possible(f"a request to {resource.name}", tuple(given))


def _become_current(operation: Operation) -> Possible:
    """Return that an operation becomes current: any can be planned, and be disabled then."""
    visits = (
        ClaimedObligation(operation.name, ClaimedAspect.QUEUED),
        ClaimedObligation(operation.name, ClaimedAspect.DISABLED),
    )
    given = ((CURRENT_NAME, operation.name), *_in_state(operation, OperationState.DISABLED))
    return Possible(f"{operation.name} at the head of the queue", given, visits)


def _in_state(operation: Operation, state: OperationState) -> Given:
    return ((operation_state_name(operation.name), state.value), (CURRENT_STATE, state.value))


# moments


def _moments(sets: Sets, model: BehaviorModel) -> Iterator[_Moment]:
    """Yield the moment without a current operation, then each operation in each state that the sets have."""
    rest = _at_rest(sets, model)
    yield rest
    for operation in model.operations:
        own = operation_state_name(operation.name)
        for state in OperationState:
            if all(value in sets[name] for name, value in _in_state(operation, state)):
                here: Sets = {CURRENT_NAME: (operation.name,), CURRENT_STATE: (state.value,), own: (state.value,)}
                yield _Moment(operation, state, {**rest.sets, **here}, model.running_space)


def _at_rest(sets: Sets, model: BehaviorModel) -> _Moment:
    initial = OperationState.INITIAL
    rest: Sets = {operation_state_name(operation.name): (initial.value,) for operation in model.operations}
    rest |= {CURRENT_NAME: (NO_OPERATION,), CURRENT_STATE: (initial.value,)}
    return _Moment(None, initial, {**sets, **rest}, model.running_space)


# transitions


def _lifecycle(moment: _Moment, operation: Operation) -> Iterator[Possible]:
    """Yield the moves of the current operation that are possible in its state (semantics 5.5)."""
    if moment.state in (OperationState.INITIAL, OperationState.DISABLED):
        yield from _taken(operation.pre, OperationState.EXECUTING, moment, operation)
    if moment.state is OperationState.EXECUTING:
        yield from _taken(operation.post, OperationState.COMPLETED, moment, operation)
        if operation.failed is not None:
            yield from _taken(operation.failed, OperationState.FAILED, moment, operation)
        if operation.deadline_ns is not None:
            given = _given(Truth(True), operation.timedout, moment)
            if given is not None:
                yield _entered(f"the deadline of {operation.name}", given, operation, OperationState.TIMEDOUT)


def _taken(transition: Transition, target: OperationState, moment: _Moment, operation: Operation) -> Iterator[Possible]:
    given = _given(transition.running_guard, transition.running_actions, moment)
    if given is not None:
        yield _entered(transition.name, given, operation, target)


def _entered(what: str, given: Given, operation: Operation, state: OperationState) -> Possible:
    visits = (ClaimedObligation(operation.name, ClaimedAspect(state.value)),)
    return Possible(what, (*given, *_in_state(operation, state)), visits)


def _automatic_transitions(moment: _Moment, model: BehaviorModel) -> Iterator[Possible]:
    """Yield the automatic transitions that are possible (semantics 5.1)."""
    for transition in model.automatic_transitions:
        failing = [action for action in transition.running_actions if fails_operation(action, model.running_space)]
        actions = tuple(action for action in transition.running_actions if action not in failing)
        taken = ClaimedObligation(transition.name, ClaimedAspect.TAKEN)
        if not failing:
            given = _given(And((transition.running_guard, _changes(actions))), actions, moment)
            if given is not None:
                yield Possible(transition.name, given, (taken,))
            continue
        executing = Constant(OperationState.EXECUTING.value)
        guards = (transition.running_guard, *(Equal(Reference(action.target), executing) for action in failing))
        given = _given(And(guards), actions, moment)
        if given is not None and moment.operation is not None:
            failed = _entered(transition.name, given, moment.operation, OperationState.FAILED)
            yield Possible(failed.what, failed.gives, (taken, *failed.visits))


def _changes(actions: tuple[Action, ...]) -> Predicate:
    """Return the predicate that one of the actions changes its variable."""
    return Or(
        tuple(
            Truth(True) if isinstance(action, Add) else NotEqual(Reference(action.target), action.source)
            for action in actions
        )
    )


def _given(guard: Predicate, actions: tuple[Action, ...], moment: _Moment) -> Given | None:
    """Return what the actions give where the guard holds and all stay in their domains; `None` if nowhere."""
    sets = dict(moment.sets)
    inside: list[Predicate] = []
    for action in actions:
        domain, names = moment.space[action.target].domain, action.reads()
        fitting = [values for values in _choices(names, sets) if action.value(values) in domain]
        if not fitting:
            return None
        for name in names:
            kept = dict.fromkeys(values[name] for values in fitting)
            sets[name] = tuple(value for value in sets[name] if value in kept)
        if len(names) > 1 and isinstance(action, Assign):  # not every choice of these values fits
            inside += _inside(action.source, domain)
    where = And((guard, *inside)) if inside else guard
    if not _may_hold(where, sets):
        return None
    return tuple((action.target, value) for action in actions for value in _new(action, where, sets, moment))


def _choices(names: Sequence[str], sets: Sets) -> Iterator[dict[str, Value]]:
    """Yield each choice of values for some variables; without variables the empty one."""
    for values in product(*(sets[name] for name in names)):
        yield dict(zip(names, values, strict=True))


def _inside(term: Term, domain: Domain) -> tuple[Predicate, ...]:
    """Return the conditions that an integer is inside a domain."""
    low, high = Constant(domain.values[0]), Constant(domain.values[-1])
    return Order(term, Relation.AT_LEAST, low), Order(term, Relation.AT_MOST, high)


def _new(action: Action, guard: Predicate, sets: Sets, moment: _Moment) -> Iterator[Value]:
    """Yield the values that the action assigns where the guard holds, and that its target does not have yet."""
    found: dict[Value, None] = {}
    domain, known = moment.space[action.target].domain, dict.fromkeys(moment.sets[action.target])
    for values in _choices(action.reads(), sets):
        value = action.value(values)
        if value in known or value in found or value not in domain:
            continue
        if not values or _may_hold(guard, {**sets, **{name: (each,) for name, each in values.items()}}):
            found[value] = None
            yield value


def _may_hold(guard: Predicate, sets: Sets) -> bool:
    try:
        return is_satisfiable(guard, sets)
    except TooManyStepsError:
        return True


def check_values(
    claimed: Sequence[ClaimedObligation], argument: ValuesArgument, model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the sets of values, or else of the claims."""
    sets = argument.values
    yield from _check_shape(argument, model) or _check_closed(sets, model) or _check_claims(claimed, sets, model)


def _check_shape(argument: ValuesArgument, model: BehaviorModel) -> list[CertificateFlaw]:
    if tuple(argument.values) != model.running_space.names:
        return [CertificateFlaw("the argument", "it does not name every variable once, in the order of the model")]
    return [
        CertificateFlaw(name, "the values are not some of its domain, each once and in order")
        for name, values in argument.values.items()
        if not _is_part(values, model.running_space[name])
    ]


def _is_part(values: tuple[Value, ...], variable: Variable) -> bool:
    domain = variable.domain
    if not all(value in domain for value in values):
        return False
    positions = [domain.index(value) for value in values]
    return positions == sorted(dict.fromkeys(positions))


def _check_closed(sets: Sets, model: BehaviorModel) -> list[CertificateFlaw]:
    """Return a flaw for each value that a possible step gives and that the sets do not have."""
    flaws = (
        CertificateFlaw(name, f"{format_value(value)} is not among its values, but {possible.what} can set it")
        for possible in all_possible(sets, model)
        for name, value in possible.gives
        if value not in sets[name]
    )
    return list(dict.fromkeys(flaws))


def _check_claims(claimed: Sequence[ClaimedObligation], sets: Sets, model: BehaviorModel) -> list[CertificateFlaw]:
    visited_by: dict[ClaimedObligation, str] = {}
    for possible in all_possible(sets, model):
        for obligation in possible.visits:
            visited_by.setdefault(obligation, possible.what)
    return [
        CertificateFlaw(f"claim {obligation}", f"with these values, {visited_by[obligation]} can visit it")
        for obligation in claimed
        if obligation in visited_by
    ]
