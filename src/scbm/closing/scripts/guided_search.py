"""A guided search for one obligation where runs are too many to explore: best-first, nearest to its guard first.

The distance of a state is the number of conjuncts of the guard that do not hold in it; for a counter, the number of
steps to a value that does. Of equally distant positions the one found first is expanded first.
"""

from __future__ import annotations

import heapq
from itertools import islice
from typing import TYPE_CHECKING, assert_never

from msgspec import Struct

from scbm.cases.coverage import Aspect
from scbm.closing.runs.run_graph import Start
from scbm.closing.runs.walks import PathRun, RunPath
from scbm.model.normal_form import AllOf, AnyOf, NormalForm, OneOf, Pair, normal_form
from scbm.model.packing import compile_test
from scbm.running.untimed.situations import PlanningTooLargeError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.cases.coverage import Obligation
    from scbm.model import BehaviorModel, Packing, Predicate
    from scbm.model.packing import Field
    from scbm.running.untimed.run_steps import RunSteps
    from scbm.running.untimed.situations import Happening, Position, RunStep


class _GuidedHit(Struct):
    """A position with the path to it."""

    position: Position
    before: _GuidedHit | None
    label: Happening | Start


def find_path(  # noqa: PLR0913, PLR0917 - the runs, what is searched for, and how far
    goal: tuple[str, Predicate],
    steps: RunSteps,
    starts: Sequence[Start],
    wanted: int,
    distance: Callable[[int], int],
    most: int,
) -> tuple[RunPath | None, int]:
    """Return a run for a goal that visits something of what is wanted; `None` if none was found.

    Args:
        goal: the name and the predicate of the goal.
        steps: the steps of its runs.
        starts: the initial states.
        wanted: bits of visits.
        distance: the distance of a packed state from what is wanted.
        most: the maximum number of positions.

    Returns:
        The run, and the number of visited positions.
    """
    guided = _GuidedSearch(goal, steps, wanted, distance)
    try:
        return guided.search(starts, most), len(guided.seen)
    except PlanningTooLargeError:
        return None, len(guided.seen)


class _GuidedSearch:
    def __init__(
        self, goal: tuple[str, Predicate], steps: RunSteps, wanted: int, distance: Callable[[int], int]
    ) -> None:
        self._goal = goal
        self._steps = steps
        self._wanted = wanted
        self._distance = distance
        self.seen: dict[Position, None] = {}
        self._heap: list[tuple[int, int, _GuidedHit]] = []

    def search(self, starts: Sequence[Start], most: int) -> RunPath | None:
        for start in islice(starts, max(most, 0)):
            step = self._steps.start(start.packed)
            for given in (step, *map(self._steps.begin, step.rests)):
                path = self._reach(given, None, start)
                if path is not None:
                    return path
        while self._heap and len(self.seen) < most:
            _, _, found = heapq.heappop(self._heap)
            for happening in self._steps.happenings(found.position):
                path = self._reach(self._steps.after(found.position, happening), found, happening)
                if path is not None:
                    return path
        return None

    def _reach(self, step: RunStep, before: _GuidedHit | None, label: Happening | Start) -> RunPath | None:
        """Visit the target of a step; return the path if the step visits what is wanted."""
        if step.visits & self._wanted:
            return self._path_to(before, label)
        if step.target is not None and step.target not in self.seen:
            self.seen[step.target] = None
            found = _GuidedHit(step.target, before, label)
            heapq.heappush(self._heap, (self._distance(step.target.state), len(self.seen), found))
        return None

    def _path_to(self, before: _GuidedHit | None, label: Happening | Start) -> RunPath:
        labels = [label]
        while before is not None:
            labels.append(before.label)
            before = before.before
        start, *happenings = reversed(labels)
        assert isinstance(start, Start)  # noqa: S101 - that is how runs begin
        followed = tuple(each for each in happenings if not isinstance(each, Start))
        return RunPath(start, (PathRun(self._goal, followed),))


def guard_of(model: BehaviorModel, obligation: Obligation) -> Predicate:
    """Return the predicate that must hold for an obligation to be visited, or at least on the path to it."""
    if obligation.aspect is Aspect.TAKEN:
        transitions = model.automatic_transitions
        return next(t.running_guard for t in transitions if t.name == obligation.subject)
    operation = model.operation(obligation.subject)
    if obligation.aspect is Aspect.COMPLETED:
        return operation.post.running_guard
    if obligation.aspect is Aspect.FAILED and operation.failed is not None:
        return operation.failed.running_guard
    return operation.pre.running_guard


def distance_to(predicate: Predicate, packing: Packing) -> Callable[[int], int]:
    """Return a function from packed states to the number of conjuncts that do not hold; the least over alternatives."""
    return _distance(normal_form(predicate, packing.space), packing.fields)


def _distance(form: NormalForm, fields: Sequence[Field]) -> Callable[[int], int]:
    match form:
        case bool():
            return lambda _: 0 if form else 1
        case OneOf(variable, allowed):
            index = fields[variable].index
            return lambda state: 0 if allowed >> index(state) & 1 else _steps_away(allowed, index(state))
        case Pair():
            test = compile_test(form, fields)
            return lambda state: 0 if test(state) else 1
        case AllOf(parts):
            distances = [_distance(part, fields) for part in parts]
            return lambda state: sum(distance(state) for distance in distances)
        case AnyOf(parts):
            distances = [_distance(part, fields) for part in parts]
            return lambda state: min(distance(state) for distance in distances)
        case _:
            assert_never(form)


def _steps_away(allowed: int, index: int) -> int:
    """Return the distance of the nearest allowed value in the order of the domain."""
    above, below = allowed >> index, allowed & ((1 << index) - 1)
    ways = [(above & -above).bit_length() - 1] if above else []
    return min([*ways, index - below.bit_length() + 1] if below else ways)
