"""Where runs come nearest to a state in which a guard holds, and the conjuncts that are lacking there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

from scbm.closing.proofs.blame import blame
from scbm.closing.summaries import listed
from scbm.model import format_value
from scbm.model.predicates import TRUE, conjuncts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.closing.runs.all_runs import AllRuns
    from scbm.model import Packing, Predicate, StateSpace, Value


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
