"""Where runs come nearest to a state in which a guard holds, and the conjuncts that are lacking there."""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct

from scbm.closing.proofs.blame import blame, parts_of
from scbm.closing.summaries import listed
from scbm.model import Equal, Implies, Member, Or, Order, conjunction, format_value
from scbm.model.predicates import TRUE, all_needed, alternatives

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.closing.runs.all_runs import AllRuns
    from scbm.model import Packing, Predicate, StateSpace, Value


def in_words(parts: Sequence[Predicate]) -> str:
    """Return conjuncts as an enumeration, in which disjunctions have brackets."""
    is_alone = len(parts) == 1
    return listed([str(p) if is_alone or not isinstance(p, (Or, Implies)) else f"({p})" for p in parts])


def listed_values(values: Iterable[tuple[str, Value]]) -> str:
    """Return the values of variables as an enumeration."""
    return listed([f"{name} == {format_value(value)}" for name, value in values])


class NearestMiss(Struct, frozen=True):
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
        needs = f"{what} needs {in_words(self.never)}, which {hold}{where}"
        return f"{needs}; {who} comes nearest with {listed_values(self.nearest)}" if self.nearest else needs


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
    parts = parts_of(guards)
    counts = packing.test(when)
    states = _projected(runs.observed, (when, *parts), packing)
    return nearest_of(parts, [state for state in states if counts(state)], packing)


def nearest_of(parts: Sequence[Predicate], states: Iterable[int], packing: Packing) -> NearestMiss | None:
    """Return the nearest miss of conjuncts that do not hold together in any of some packed states.

    `None` is returned if they hold together in some state, or there is no state.
    """
    different = _projected(states, parts, packing)
    tests = {part: packing.test(part) for part in parts}

    def can_hold(predicate: Predicate) -> bool:
        needed = [tests[part] for part in all_needed(predicate) if part in tests]
        return any(all(test(state) for test in needed) for state in different)

    never = blame(parts, can_hold) if different else ()
    if not never:
        return None
    nearest = nearest_state(parts, different, packing)
    lacking = sum(not test(nearest) for test in tests.values())
    return NearestMiss(never, lacking, values_read(never, nearest, packing))


def nearest_state(parts: Sequence[Predicate], states: Iterable[int], packing: Packing) -> int:
    """Return the first packed state in which the fewest comparisons of conjuncts do not hold, or by the least amount.

    Of equal distances, one is nearer in which earlier conjuncts hold.
    """
    different = _projected(states, parts, packing)

    def rank(state: int) -> tuple[Distance, list[bool]]:
        values = dict(values_read(parts, state, packing))
        return distance(conjunction(parts), values), [not part.holds(values) for part in parts]

    return different[min(different, key=rank)]


def values_read(parts: Iterable[Predicate], state: int, packing: Packing) -> tuple[tuple[str, Value], ...]:
    """Return the variables that predicates read, each once, with their values in a packed state."""
    names = tuple(dict.fromkeys(name for part in parts for name in part.reads()))
    return tuple(zip(names, packing.reader(names)(state), strict=True))


class Distance(NamedTuple):
    """The distance of a state to those in which a predicate holds; symbols differ by 1.

    Attributes:
        comparisons: how many comparisons must change at least.
        least: by how much.
        all: the same for all alternatives of the predicate together, which decides a tie.
    """

    comparisons: int
    least: int
    all: int


def distance(predicate: Predicate, values: Mapping[str, Value]) -> Distance:
    """Return the distance of a state to those in which a predicate holds."""
    if predicate.holds(values):
        return Distance(0, 0, 0)
    parts = all_needed(predicate)
    if len(parts) > 1:
        return Distance(*map(sum, zip(*(distance(part, values) for part in parts), strict=True)))
    choices = [distance(each, values) for each in alternatives(predicate) if each != predicate]
    if choices:
        return min(choices)._replace(all=sum(each.all for each in choices))
    match predicate:
        case Equal(left, right) | Order(left, _, right):
            pairs = [(left, right)]
        case Member(variable, members):
            pairs = [(variable, member) for member in members]
        case _:
            return Distance(1, 1, 1)
    least = min(_difference(left.value(values), right.value(values)) for left, right in pairs)
    return Distance(1, least, least)


def lacking_comparisons(predicate: Predicate, values: Mapping[str, Value]) -> Iterator[Predicate]:
    """Yield the comparisons of a predicate that do not hold, those of each alternative included."""
    if not predicate.holds(values):
        parts = all_needed(predicate)
        parts = parts if len(parts) > 1 else alternatives(predicate)
        if parts == (predicate,):
            yield predicate
        else:
            yield from (each for part in parts for each in lacking_comparisons(part, values))


def _difference(left: Value, right: Value) -> int:
    """Return how far two values are apart that a comparison compares."""
    return abs(left - right) if isinstance(left, int) and isinstance(right, int) else 1


def _projected(states: Iterable[int], predicates: Sequence[Predicate], packing: Packing) -> dict[int, int]:
    """Return the packed states that differ in what predicates read, in order, each with the first state that has it."""
    names = dict.fromkeys(name for predicate in predicates for name in predicate.reads())
    mask = reduce(or_, (packing[name].mask for name in names), 0)
    every = list(states)
    first = dict(zip(map(mask.__and__, reversed(every)), reversed(every), strict=True))
    return {read: first[read] for read in dict.fromkeys(map(mask.__and__, every))}
