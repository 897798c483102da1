"""Changes for new cases: of inputs, and injections that disable an operation by force (decision 45).

Inputs and published values change in mid motion where that is possible: while a request is in flight. Values are
distinguished only as far as guards distinguish them (decision 17).

An operation that nothing else disables is disabled at the moment it becomes current (paper, Section VII), by a smallest
change of the state that makes `g && gr` false: of one variable, or of two where one is not enough. That forces the
state. The change is held for a moment and then reverted, so that the run can continue.
"""

from __future__ import annotations

from itertools import combinations, islice, pairwise, product
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases import Case, EnvironmentChange, Injection
from scbm.cases.trace import BecameCurrent, ReplyReceived, RequestCancelled, RequestSent, RunnerStarted
from scbm.closing.distinguished_values import distinguishing_values
from scbm.model import (
    And,
    Constant,
    Equal,
    Implies,
    Member,
    Not,
    NotEqual,
    Or,
    Order,
    Reference,
    RequestState,
    Role,
    State,
    Truth,
    conjunction,
)
from scbm.model.operations import apply
from scbm.model.predicates import substituted
from scbm.model.sources import changed_from_outside
from scbm.model.variables import CURRENT_NAME

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.cases.trace import Changes, Record
    from scbm.model import BehaviorModel, Operation, Predicate, StateSpace, Transition, Value
    from scbm.testing import Execution


HOLD_NS = 1_000_000_000
MAX_INJECTIONS = 6
"""About the maximum number of injections that a new case combines; a run with more of them is hard to follow."""

_MS = 1_000_000
_MAX_CHANGES = 64
_MAX_NAMED = 1_000


def changes_that_disable(
    model: BehaviorModel, operation: Operation, state: State, goal: Predicate
) -> Iterator[dict[str, Value]]:
    """Yield changes of a state in which the precondition holds, so that it is no longer enabled; the smallest first.

    What changes from outside comes first, then a resource that another client uses, as in the paper. The goal does not
    hold after any of the changes: the run would end.
    """
    names = _names(model, operation, goal)
    found = (
        changed
        for size in (1, 2)
        for chosen in combinations(names, size)
        for changed in _changed(model, chosen, state)
        if not _can_start(operation, changed_state := state.replace(changed)) and not goal.holds(changed_state)
    )
    seen: list[dict[str, Value]] = []
    for changed in islice(found, _MAX_CHANGES):
        if not any(smaller.items() <= changed.items() for smaller in seen):
            seen.append(changed)
            yield changed


def _names(model: BehaviorModel, operation: Operation, goal: Predicate) -> list[str]:
    """Return what a tester may assign: variables of the precondition, then those of the goal.

    Of these first what changes from outside, then the request states.
    """
    actions = (name for action in operation.pre.running_actions for name in action.reads())
    read = dict.fromkeys((*operation.pre.running_guard.reads(), *actions))
    free = [v for v in model.space if (v.name in read or v.name in goal.reads()) and len(v.domain) > 1]
    states = [resource.request_state for resource in model.resources]
    outside = changed_from_outside(model)
    free.sort(key=lambda v: (v.name not in read, v.name not in outside, v.name not in states, v.role is Role.RESOURCE))
    return [variable.name for variable in free]


def _changed(model: BehaviorModel, names: Sequence[str], state: State) -> Iterator[dict[str, Value]]:
    """Yield all other values of some variables; of a request state first the value of a resource in use."""
    in_use = RequestState.EXECUTING.value
    values = [sorted(model.space[name].domain.values, key=lambda value: value != in_use) for name in names]
    for chosen in product(*values):
        if all(state[name] != value for name, value in zip(names, chosen, strict=True)):
            yield dict(zip(names, chosen, strict=True))


def _can_start(operation: Operation, state: State) -> bool:
    return operation.pre.running_guard.holds(state) and apply(operation.pre.running_actions, state) is not None


def injection(case: Case, operation: str, changed: dict[str, Value], hold_ns: int | None = HOLD_NS) -> Injection:
    """Return the injection of a change as soon as an operation is current, with a name that is new in the case."""
    when = Equal(Reference(CURRENT_NAME), Constant(operation))
    return Injection(_new_name(case, f"{operation}_waits"), tuple(changed.items()), when, hold_ns=hold_ns)


def _new_name(case: Case, name: str) -> str:
    taken = [injection.name for injection in case.injections]
    names = (name, *(f"{name}_{number}" for number in range(2, _MAX_NAMED)))
    return next(each for each in names if each not in taken)


def current_operations(records: Iterable[Record]) -> dict[str, int]:
    """Return the operations that became current, each with the number of the first record that says so."""
    found: dict[str, int] = {}
    for number, record in enumerate(records):
        if isinstance(record, BecameCurrent):
            found.setdefault(record.operation, number)
    return found


_MAX_INPUT_CHANGES = 4_096
"""Maximum number of combinations of values that are tried for one transition."""


def with_inputs(model: BehaviorModel, transition: Transition, case: Case) -> Iterator[Case]:
    """Yield the case in which inputs change as soon as nothing else disables the transition."""
    for changed, when in _enabling_inputs(model, transition, case):
        come = EnvironmentChange(None if when else 0, changed, when=when)
        before = tuple((name, case.initial[name]) for name, _ in changed)
        yield from _with_changes(case, come, before)


def with_inputs_by_force(model: BehaviorModel, transition: Transition, case: Case) -> Iterator[Case]:
    """Yield the case with an injection that changes inputs then, even where no moment is settled."""
    for changed, when in _enabling_inputs(model, transition, case):
        for hold_ns in (HOLD_NS, None):
            injected = Injection(f"{transition.name}_comes", changed, when, hold_ns=hold_ns)
            yield replace(case, injections=(*case.injections, injected))


def _enabling_inputs(
    model: BehaviorModel, transition: Transition, case: Case
) -> Iterator[tuple[Changes, Predicate | None]]:
    """Yield values of inputs that a transition needs, and the rest of its guard."""
    known = changed_from_outside(model)
    names = [name for name in transition.running_guard.reads() if name in known]
    choices = product(*(distinguishing_values(model, name) for name in names))
    for chosen in islice(choices, _MAX_INPUT_CHANGES):
        values = dict(zip(names, chosen, strict=True))
        rest = residual(transition.running_guard, values, model.running_space)
        changed = tuple((name, value) for name, value in values.items() if case.initial[name] != value)
        if rest != Truth(False) and changed:
            yield changed, None if rest == Truth(True) else rest


def _with_changes(case: Case, come: EnvironmentChange, before: Changes) -> Iterator[Case]:
    """Yield the case with a change from outside, first with one that takes it back after a while."""
    holds = conjunction(Equal(Reference(name), Constant(value)) for name, value in come.assign or ())
    go = EnvironmentChange(None, before, when=holds, after_ns=HOLD_NS)
    for changes in ((come, go), (come,)):
        yield replace(case, environment=(*(case.environment or ()), *changes))


def with_inputs_in_motion(model: BehaviorModel, transition: Transition, execution: Execution) -> Iterator[Case]:
    """Yield the case in which inputs change in mid motion so that the transition is taken there."""
    known = changed_from_outside(model)
    names = [name for name in transition.running_guard.reads() if name in known]
    values = [distinguishing_values(model, name) for name in names]
    if not names:
        return
    for at_ns, values_then in _moments_in_motion(execution.trace.records):
        state = State(model.running_space, values_then)
        for chosen in islice(product(*values), _MAX_INPUT_CHANGES):
            changed = {name: value for name, value in zip(names, chosen, strict=True) if state[name] != value}
            if changed and transition.running_guard.holds(state.replace(changed)):
                before = tuple((name, state[name]) for name in changed)
                come = EnvironmentChange(at_ns, tuple(changed.items()))
                yield from _with_changes(execution.case, come, before)


def _moments_in_motion(records: Sequence[Record]) -> Iterator[tuple[int, dict[str, Value]]]:
    """Yield the middle of each time in which a request is in flight and nothing happens, with the state then."""
    state: dict[str, Value] = {}
    in_flight: dict[str, None] = {}
    for record, following in pairwise(records):
        if isinstance(record, RunnerStarted):
            state.update(record.state)
        state.update(record.changes)
        if isinstance(record, RequestSent):
            in_flight[record.resource] = None
        elif isinstance(record, (RequestCancelled, ReplyReceived)):
            in_flight.pop(record.resource, None)
        if in_flight and following.at_ns > record.at_ns + 1:
            middle_ns = (record.at_ns + following.at_ns) // 2
            yield max(middle_ns // _MS * _MS, record.at_ns + 1), dict(state)


def residual(predicate: Predicate, values: Mapping[str, Value], space: StateSpace) -> Predicate:
    """Return the predicate with the values of some variables substituted."""
    match predicate:
        case Not(operand):
            rest = residual(operand, values, space)
            return Truth(not rest.truth) if isinstance(rest, Truth) else Not(rest)
        case And(operands):
            return _all(residual(operand, values, space) for operand in operands)
        case Or(operands):
            return _any(residual(operand, values, space) for operand in operands)
        case Implies(condition, consequence):
            return residual(Or((Not(condition), consequence)), values, space)
        case Equal() | NotEqual() | Order() | Member() if any(name in values for name in predicate.reads()):
            return _leaf(predicate, values, space)
    return predicate


def _leaf(leaf: Equal | NotEqual | Order | Member, values: Mapping[str, Value], space: StateSpace) -> Predicate:
    """Return a leaf with values substituted: the set of values of its other variable for which it holds."""
    others = [name for name in leaf.reads() if name not in values]
    if not others:
        return Truth(leaf.holds(values))
    if len(others) > 1 and not isinstance(leaf, Member):
        return replace(leaf, left=substituted(leaf.left, values), right=substituted(leaf.right, values))
    domain = space[others[0]].domain.values
    fitting = tuple(Constant(value) for value in domain if leaf.holds({**values, others[0]: value}))
    if len(fitting) in (0, len(domain)):
        return Truth(bool(fitting))
    other = Reference(others[0])
    return Equal(other, fitting[0]) if len(fitting) == 1 else Member(other, fitting)


def _all(parts: Iterable[Predicate]) -> Predicate:
    rest = tuple(parts)
    if Truth(False) in rest:
        return Truth(False)
    return conjunction(part for part in rest if part != Truth(True))


def _any(parts: Iterable[Predicate]) -> Predicate:
    rest = tuple(part for part in parts if part != Truth(False))
    if Truth(True) in rest:
        return Truth(True)
    if not rest:
        return Truth(False)
    return rest[0] if len(rest) == 1 else Or(rest)
