"""Which parts of a guard keep it from ever holding, and which transitions always come before another one.

Knows predicates and automatic transitions; what can hold in runs is said by an oracle or by states.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import And, OperationState, Predicate, Role, conjunction
from scbm.model.satisfiability import is_satisfiable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.model import BehaviorModel, Transition, Value


def conjuncts(predicate: Predicate) -> tuple[Predicate, ...]:
    """The parts that must all hold, those of nested conjunctions among them; the predicate itself if it is none."""
    if not isinstance(predicate, And):
        return (predicate,)
    return tuple(part for operand in predicate.operands for part in conjuncts(operand))


def blame(predicates: Sequence[Predicate], can_hold: Callable[[Predicate], bool]) -> tuple[Predicate, ...]:
    """Conjuncts of the predicates that never hold together, none of which can be left out.

    It is a single one if there is such a one, and nothing if all of them can hold together. In doubt the later
    conjuncts are blamed, as the first ones of a guard tend to be the same everywhere.

    Args:
        predicates: what should hold together.
        can_hold: whether a predicate holds anywhere.
    """
    parts = tuple(dict.fromkeys(part for predicate in predicates for part in conjuncts(predicate)))
    if can_hold(conjunction(parts)):
        return ()
    for part in parts:
        if not can_hold(part):
            return (part,)
    needed = parts
    for part in parts:
        without = tuple(other for other in needed if other != part)
        if not can_hold(conjunction(without)):
            needed = without
    return needed


def contradiction(predicates: Sequence[Predicate], model: BehaviorModel) -> tuple[Predicate, ...]:
    """Conjuncts of the predicates that hold together in no state at all; nothing if there are none, or in doubt."""
    space = model.running_space
    if is_satisfiable(conjunction(predicates), space) is not False:
        return ()
    return blame(predicates, lambda part: is_satisfiable(part, space) is not False)


def contradicting(what: str, parts: Sequence[Predicate]) -> str:
    """What to say of a guard that has such conjuncts."""
    told = conjunction(parts)
    return f"{what} contradicts itself: {told}" if len(parts) > 1 else f"{what} needs {told}, which holds in no state"


def shadowing(model: BehaviorModel, transition: Transition, states: Iterable[Mapping[str, Value]]) -> tuple[str, ...]:
    """The earlier automatic transitions that always go first where this one could be taken.

    Of each state it is the first one that can be taken there, and they are named in the order of the file. Nothing is
    named if some state has no such one, or if this transition can be taken in none of the states.

    Args:
        model: where both stand.
        transition: an automatic transition of the model.
        states: values for all variables of the running space.
    """
    earlier = model.automatic_transitions[: model.automatic_transitions.index(transition)]
    first: dict[str, None] = {}
    for state in states:
        if not _applies(model, transition, state):
            continue
        name = next((other.name for other in earlier if _applies(model, other, state)), None)
        if name is None:
            return ()
        first[name] = None
    return tuple(other.name for other in earlier if other.name in first)


def _applies(model: BehaviorModel, transition: Transition, state: Mapping[str, Value]) -> bool:
    """Whether the runner could take an automatic transition in a state (semantics 1.3, 2.4, 5.1)."""
    if not transition.running_guard.holds(state):
        return False
    changed = False
    for action in transition.running_actions:
        variable, value = model.running_space[action.target], action.value(state)
        if value not in variable.domain:
            return False
        fails = variable.role in (Role.OPERATION_STATE, Role.CURRENT_STATE)
        if fails and state[action.target] != OperationState.EXECUTING.value:
            return False
        changed = changed or value != state[action.target]
    return changed
