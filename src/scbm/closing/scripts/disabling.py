"""Injections that disable an operation at the moment it becomes current (paper, Section VII).

Each is a smallest change of the state that makes `g && gr` false: of one variable, or of two where one is not enough.
The change is held for a moment and then reverted, so that the run can continue.
"""

from __future__ import annotations

from itertools import combinations, islice, product
from typing import TYPE_CHECKING

from scbm.cases import Injection
from scbm.cases.trace import BecameCurrent
from scbm.model import Constant, Equal, Reference, RequestState, Role
from scbm.model.operations import apply
from scbm.model.variables import CURRENT_NAME

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases import Case
    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel, Operation, Predicate, State, Value

HOLD_NS = 1_000_000_000
_MAX_CHANGES = 64
_MAX_NAMED = 1_000


def changes_that_disable(
    model: BehaviorModel, operation: Operation, state: State, goal: Predicate
) -> Iterator[dict[str, Value]]:
    """Yield changes of a state in which the precondition holds, so that it is no longer enabled; the smallest first.

    A resource that another client uses comes first, as in the paper. The goal does not hold after any of the changes:
    the run would end.
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
    """Return what a tester may assign: variables of the precondition, request states first, then those of the goal."""
    actions = (name for action in operation.pre.running_actions for name in action.reads())
    read = dict.fromkeys((*operation.pre.running_guard.reads(), *actions))
    free = [v for v in model.space if (v.name in read or v.name in goal.reads()) and len(v.domain) > 1]
    states = [resource.request_state for resource in model.resources]
    free.sort(key=lambda v: (v.name not in read, v.name not in states, v.role is Role.RESOURCE))
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
