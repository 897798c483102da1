"""Blame: the conjuncts that keep a guard from ever holding, where runs come nearest, and what shadows a transition.

This module knows predicates and automatic transitions; an oracle or the reachable states say what can hold in runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

from scbm.closing.summaries import listed
from scbm.model import OperationState, Predicate, Role, conjunction, format_value
from scbm.model.predicates import TRUE, conjuncts
from scbm.model.satisfiability import is_satisfiable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.closing.runs.all_runs import AllRuns
    from scbm.model import BehaviorModel, Packing, StateSpace, Transition, Value


def blame(predicates: Sequence[Predicate], can_hold: Callable[[Predicate], bool]) -> tuple[Predicate, ...]:
    """Return a minimal set of conjuncts of the predicates that never hold together.

    The set has a single conjunct if one never holds, and is empty if all of them can hold together. Of several minimal
    sets
    one with later conjuncts is returned, as guards tend to begin alike.

    Args:
        predicates: what should hold together.
        can_hold: whether a predicate holds in any state.
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


@dataclass(frozen=True, slots=True)
class NearestMiss:
    """The nearest state of runs to one in which a guard holds.

    Attributes:
        never: conjuncts that never hold together, as few as possible; a single one if it never holds.
        lacking: how many conjuncts of the guard do not hold in the nearest state.
        nearest: the values that these conjuncts read in the nearest state that a run reaches first.
    """

    never: tuple[Predicate, ...]
    lacking: int
    nearest: tuple[tuple[str, Value], ...]

    def is_about_runner(self, space: StateSpace) -> bool:
        """Return whether the conjuncts read variables of the runner, such as the state of an operation."""
        return any(space[name].role.is_runner for part in self.never for name in part.reads())

    def words(self, what: str, where: str = "", who: str = "a run") -> str:
        """Return a clause about what needs the conjuncts, about the states that count, and `who` comes nearest."""
        hold = "never holds" if len(self.never) == 1 else "never hold together"
        values = listed([f"{name} == {format_value(value)}" for name, value in self.nearest])
        needs = f"{what} needs {listed(list(map(str, self.never)))}, which {hold}{where}"
        return f"{needs}; {who} comes nearest with {values}"


def nearest_miss(guards: Sequence[Predicate], runs: AllRuns, when: Predicate = TRUE) -> NearestMiss | None:
    """Return the nearest miss of predicates that do not hold together in any state in which runs evaluate guards.

    Args:
        guards: the predicates.
        runs: the explored runs.
        when: only states in which this holds count.

    Returns:
        `None` if the predicates hold together in some state, or no state counts.
    """
    packing = runs.program.packing
    parts = tuple(dict.fromkeys(part for guard in guards for part in conjuncts(guard)))
    states = _states(packing, [when, *parts], runs)
    counts = packing.test(when)
    return nearest_of(parts, [state for state in states if counts(state)], packing)


def nearest_of(parts: Sequence[Predicate], states: Sequence[int], packing: Packing) -> NearestMiss | None:
    """Return the nearest miss of conjuncts that do not hold together in any of some packed states.

    `None` is returned if they hold together in some state, or there is no state.
    """
    tests = {part: packing.test(part) for part in parts}

    def can_hold(predicate: Predicate) -> bool:
        needed = [tests[part] for part in conjuncts(predicate) if part in tests]
        return any(all(test(state) for test in needed) for state in states)

    never = blame(parts, can_hold) if states else ()
    if not never:
        return None
    holding = {state: tuple(test(state) for test in tests.values()) for state in states}
    nearest = max(states, key=lambda state: (sum(holding[state]), holding[state]))  # the first ones decide a tie
    lacking = len(tests) - sum(holding[nearest])
    values = packing.values(nearest)
    shown = dict.fromkeys(name for part in never for name in part.reads())
    return NearestMiss(never, lacking, tuple((name, values[name]) for name in shown))


def _states(packing: Packing, predicates: Sequence[Predicate], runs: AllRuns) -> list[int]:
    """Return the packed states of runs that differ in what predicates read, in the order in which runs reach them."""
    names = dict.fromkeys(name for predicate in predicates for name in predicate.reads())
    mask = reduce(or_, (packing[name].mask for name in names), 0)
    return list(dict.fromkeys(state & mask for state in runs.observed))


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
