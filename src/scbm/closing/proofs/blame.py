"""Blame: the conjuncts that keep a guard from ever holding, and what shadows a transition.

This module knows predicates and automatic transitions; an oracle or the reachable states say what can hold in runs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import OperationState, Predicate, Role, conjunction
from scbm.model.predicates import all_needed
from scbm.model.satisfiability import is_satisfiable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.model import BehaviorModel, Transition, Value


def parts_of(predicates: Iterable[Predicate]) -> tuple[Predicate, ...]:
    """Return the conjuncts of predicates, each once; `!(a || b)` has two."""
    return tuple(dict.fromkeys(part for predicate in predicates for part in all_needed(predicate)))


def blame(predicates: Sequence[Predicate], can_hold: Callable[[Predicate], bool]) -> tuple[Predicate, ...]:
    """Return a minimal set of conjuncts of the predicates that never hold together.

    The set has a single conjunct if one never holds, and is empty if all of them can hold together. Of several minimal
    sets
    one with later conjuncts is returned, as guards tend to begin alike.

    Args:
        predicates: what should hold together.
        can_hold: whether a predicate holds in any state.
    """
    parts = parts_of(predicates)
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
    """Return conjuncts of the predicates that hold together in no state; nothing if there are none, or if unknown."""
    space = model.running_space
    if is_satisfiable(conjunction(predicates), space) is not False:
        return ()
    return blame(predicates, lambda part: is_satisfiable(part, space) is not False)


def contradicting(what: str, parts: Sequence[Predicate]) -> str:
    """Return the sentence about a guard with such conjuncts."""
    shown = conjunction(parts)
    return f"{what} contradicts itself: {shown}" if len(parts) > 1 else f"{what} needs {shown}, which holds in no state"


def shadowing(model: BehaviorModel, transition: Transition, states: Iterable[Mapping[str, Value]]) -> tuple[str, ...]:
    """Return the earlier automatic transitions that are always taken where this one could be.

    They are in the order of the file. Nothing is returned if this transition is taken in some state, or is enabled in
    none.

    Args:
        model: the model of the transitions.
        transition: an automatic transition of the model.
        states: values for all variables of the running space; those in which its guard does not hold may lack.
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
    """Return whether the runner could take an automatic transition in a state (semantics 1.3, 2.4, 5.1)."""
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
