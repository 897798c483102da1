"""A search for one obligation where runs are too many to look at all: first what is nearest to its guard.

How near a state is, is how many conjuncts of the guard it misses. Of equally near positions the one found first is
looked at first. Positions are remembered, so a counter that has to be raised five times is raised step by step.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING

from scbm.cases.coverage import Aspect
from scbm.closing.runs.run_graph import Start
from scbm.closing.runs.situations import PlanningTooLargeError
from scbm.closing.runs.walks import RunPath
from scbm.model.normal_form import AllOf, AnyOf, NormalForm, OneOf, Pair, normal_form
from scbm.model.packing import compile_test

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.cases.coverage import Obligation
    from scbm.closing.runs.run_steps import RunSteps
    from scbm.closing.runs.situations import Happening, Position, RunStep
    from scbm.model import BehaviorModel, Packing, Predicate
    from scbm.model.bit_fields import Field


@dataclass(slots=True)
class _GuidedHit:
    """A position, with the way to it."""

    position: Position
    before: _GuidedHit | None
    label: Happening | Start


def find_path(
    steps: RunSteps, starts: Sequence[Start], wanted: int, distance: Callable[[int], int], most: int
) -> tuple[RunPath | None, int]:
    """A run for the goal of `steps` that visits something of what is wanted; `None` if none was found.

    Args:
        steps: the steps of runs.
        starts: where they begin.
        wanted: bits of visits.
        distance: how far a packed state is from what is wanted; 0 is near.
        most: so many positions may be looked at.

    Returns:
        The run, and how many positions were looked at.
    """
    guided = _GuidedSearch(steps, wanted, distance)
    try:
        return guided.search(starts, most), len(guided.seen)
    except PlanningTooLargeError:
        return None, len(guided.seen)


class _GuidedSearch:
    def __init__(self, steps: RunSteps, wanted: int, distance: Callable[[int], int]) -> None:
        self._steps = steps
        self._wanted = wanted
        self._distance = distance
        self.seen: dict[Position, None] = {}
        self._heap: list[tuple[int, int, _GuidedHit]] = []

    def search(self, starts: Sequence[Start], most: int) -> RunPath | None:
        for start in islice(starts, most):
            way = self._reach(self._steps.begin(start.packed), None, start)
            if way is not None:
                return way
        while self._heap and len(self.seen) < most:
            _, _, found = heapq.heappop(self._heap)
            for happening in self._steps.happenings(found.position):
                way = self._reach(self._steps.after(found.position, happening), found, happening)
                if way is not None:
                    return way
        return None

    def _reach(self, step: RunStep, before: _GuidedHit | None, label: Happening | Start) -> RunPath | None:
        """Goes to where a step leads; the way, if the step visits what is wanted."""
        if step.visits & self._wanted:
            return _way(before, label)
        if step.target is not None and step.target not in self.seen:
            self.seen[step.target] = None
            found = _GuidedHit(step.target, before, label)
            heapq.heappush(self._heap, (self._distance(step.target.state), len(self.seen), found))
        return None


def _way(before: _GuidedHit | None, label: Happening | Start) -> RunPath:
    labels = [label]
    while before is not None:
        labels.append(before.label)
        before = before.before
    start, *happenings = reversed(labels)
    assert isinstance(start, Start)  # noqa: S101 - that is how runs begin
    return RunPath(start, tuple(each for each in happenings if not isinstance(each, Start)))


def guard_of(model: BehaviorModel, obligation: Obligation) -> Predicate:
    """What must hold for an obligation to be visited, or at least on the way to it."""
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
    """How many conjuncts of a predicate a packed state misses, the fewest of its alternatives."""
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


def _steps_away(allowed: int, index: int) -> int:
    """How far the next allowed value is in the order of the domain: counters come nearer step by step."""
    above, below = allowed >> index, allowed & ((1 << index) - 1)
    ways = [(above & -above).bit_length() - 1] if above else []
    return min([*ways, index - below.bit_length() + 1] if below else ways)
