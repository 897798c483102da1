"""Exploring millions of states: each engine beside the plain breadth-first search, which goes state by state.

Every figure comes from a process of its own, so that its peak of memory is its own. The planner looks for a goal that
does not exist, and so sees all states; the engines find the same states. `--quick` takes smaller spaces.
"""

from __future__ import annotations

import argparse
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from math import prod
from multiprocessing import get_context
from typing import TYPE_CHECKING

from scbm.model import (
    Action,
    Add,
    And,
    Assign,
    BehaviorModel,
    Constant,
    Domain,
    Equal,
    Operation,
    Predicate,
    Reference,
    Transition,
    Truth,
    Variable,
)
from scbm.planning import PlanLimits, Planner, Unsolvable, system_of
from scbm.planning.engines import ExplorationLimits, Region
from scbm.planning.engines.exploration import Distances, Exploration, Reached
from scbm.planning.plan_search import breadth_first

if TYPE_CHECKING:
    from collections.abc import Callable

GIB = 1 << 30
LIMITS = ExplorationLimits(states=20_000_000, bytes=4 * GIB)


@dataclass(frozen=True)
class Wheels:
    """A model of wheels that turn one position at a time, each on its own: `positions ** wheels` states are reached.

    Attributes:
        shadowed: whether each wheel keeps its last position besides, which makes states as wide again and no more.
    """

    wheels: int
    positions: int
    shadowed: bool = False

    @property
    def states(self) -> int:
        """How many states are reached."""
        return prod([self.positions] * self.wheels)

    def model(self) -> BehaviorModel:
        """The model; nothing ever sets `never`."""
        last = self.positions - 1
        domain = Domain.integers(0, last)
        variables = [Variable("never", Domain.boolean(), False, (False,))]
        operations = []
        for wheel in range(self.wheels):
            here, shadow = f"wheel{wheel}", f"shadow{wheel}"
            keep: tuple[Action, ...] = (Assign(shadow, Reference(here)),) if self.shadowed else ()
            variables.append(Variable(here, domain, 0, (0,)))
            variables.extend([Variable(shadow, domain, last, (last,))] if self.shadowed else [])
            operations.append(_operation(f"turn{wheel}", Truth(True), (Add(here, 1), *keep)))
            at_the_end = Equal(Reference(here), Constant(last))
            operations.append(_operation(f"return{wheel}", at_the_end, (Assign(here, Constant(0)), *keep)))
        return BehaviorModel("wheels", tuple(variables), tuple(operations))

    def goal(self) -> Predicate:
        """All wheels at their last position."""
        last = Constant(self.positions - 1)
        return And(tuple(Equal(Reference(f"wheel{wheel}"), last) for wheel in range(self.wheels)))


@dataclass(frozen=True)
class Figure:
    """What one process measured."""

    what: str
    states: int
    seconds: float
    peak_gib: float

    @property
    def speed(self) -> float:
        """States per second."""
        return self.states / self.seconds


def searched(wheels: Wheels) -> Figure:
    """The plain breadth-first search, with a goal that no state satisfies; the planner would prove that at once."""
    model = wheels.model()
    begin = time.perf_counter()
    problem = Planner(model).problem(Equal(Reference("never"), Constant(True)))
    start = problem.task.pack(model.nominal_state)
    answer = breadth_first(problem, start, PlanLimits(expansions=2 * wheels.states))
    if not isinstance(answer, Unsolvable) or answer.expanded != wheels.states:
        raise AssertionError(answer)
    return _figure("breadth-first search", wheels, begin)


def reached(wheels: Wheels, kind: str) -> Figure:
    """All states, by an engine."""
    begin = time.perf_counter()
    _reached(_exploration(wheels, kind), wheels)
    return _figure(f"{kind}: all states", wheels, begin)


def measured(wheels: Wheels, kind: str) -> Figure:
    """All states, their distances to a goal and their first moves, by an engine."""
    begin = time.perf_counter()
    exploration = _exploration(wheels, kind)
    _reached(exploration, wheels)
    distances = exploration.distances(wheels.goal())
    start = {**wheels.model().nominal_state}
    if not isinstance(distances, Distances) or distances.distance(start) != wheels.wheels * (wheels.positions - 1):
        raise AssertionError(distances)
    return _figure(f"{kind}: all states and distances", wheels, begin)


def _exploration(wheels: Wheels, kind: str) -> Exploration:
    model = wheels.model()
    observed = [variable.name for variable in model.variables]
    starts = [Region({v.name: (v.initial,) for v in model.running_space})]
    return Exploration(system_of(model), starts, observed, LIMITS, kind)


def _reached(exploration: Exploration, wheels: Wheels) -> None:
    if not isinstance(exploration.reached, Reached) or len(exploration.reached) != wheels.states:
        raise AssertionError(exploration.reached)


def _figure(what: str, wheels: Wheels, begin: float) -> Figure:
    seconds = time.perf_counter() - begin
    return Figure(what, wheels.states, seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIB)


def _operation(name: str, guard: Predicate, actions: tuple[Action, ...]) -> Operation:
    pre = Transition(f"start_{name}", guard)
    return Operation(name, pre, Transition(f"complete_{name}", Truth(True), a=actions))


def apart(function: Callable[..., Figure], *arguments: object) -> Figure:
    """What a function measures in a process of its own."""
    with ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def main() -> None:
    """Prints a line for each figure, and how many times faster it is than the planner."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="smaller spaces")
    quick = parser.parse_args().quick
    rings = Wheels(8 if quick else 10, 4)
    decades = Wheels(6 if quick else 7, 10)
    wide = Wheels(decades.wheels, 10, shadowed=True)
    slow = apart(searched, rings)
    figures = [
        slow,
        apart(reached, rings, "dense"),
        apart(measured, rings, "dense"),
        apart(reached, decades, "dense"),
        apart(measured, decades, "dense"),
        apart(reached, wide, "arrays"),
        apart(measured, Wheels(decades.wheels - 1, 10, shadowed=True), "arrays"),
    ]
    for f in figures:
        print(f"{f.what:<32} {f.states:>10,} states in {f.seconds:6.2f} s, {f.peak_gib:.2f} GiB:", end=" ")
        print(f"{f.speed:>12,.0f} per second ({f.speed / slow.speed:,.1f}x)")


if __name__ == "__main__":
    main()
