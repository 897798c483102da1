"""Goals that no run can reach any more after a history of runs (semantics 7.12, `non_blocking`).

What plain runs leave open, no run may close. So the state in which a runner is at rest is followed: goals are given,
requests succeed, deadlines pass, and something changes from outside, in any order, until a run reaches the goal or
nothing is left to follow.
"""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from functools import cached_property
from itertools import chain, combinations, islice, product
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from scbm.cases.trace import End
from scbm.model import Assign, Constant, GoalOrder, Role, RunPlans
from scbm.model.sources import InitialStates, inputs, published_by, replied
from scbm.planning import DEFAULT_PLANNER, PLANNERS, PlanLimits
from scbm.running.untimed.situations import (
    HappeningKind,
    PlanningTooLargeError,
    TooManyRepliesError,
    TooManyRestsError,
    world_bits,
)
from scbm.testing.continuations.continued_runs import MOST_SITUATIONS, ContinuedRuns, SearchTooLongError
from scbm.testing.continuations.unjudged import Unjudged
from scbm.testing.requirement_monitors import LIMIT_WORDS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Value
    from scbm.running import Program
    from scbm.running.untimed.noted_steps import NotedSteps
    from scbm.running.untimed.situations import Happening, Position, RunStep

LIMIT_ENDS = tuple(LIMIT_WORDS)
"""The ends of runs that a limit ended: such histories do not count."""

_PLAN_LIMITS = PlanLimits(expansions=1_000)
"""The limits of each plan of a search, which needs a plan in many of its situations."""

_MOST_TRIED = 200
"""Maximum number of sets of variables that are tried to name a latch."""

_MOST_RESTS = 5
"""Maximum number of states at rest in which a set of variables is tried."""

_LARGEST_LATCH = 3
"""Maximum number of variables of a latch that is found by trying sets, the smallest first."""


_TOO_LARGE = (SearchTooLongError, PlanningTooLargeError, TooManyRepliesError, TooManyRestsError)

Answer = TypeVar("Answer")


class UnknownReachabilityError(Exception):
    """It is unknown whether goals can be reached: a search was too long, or the model has no such rule."""


class LostGoals(NamedTuple):
    """Goals that no run can reach any more.

    Attributes:
        goals: their names.
        latch: the smallest set of variables that nothing changes any more and whose initial values would make the first
            of the goals reachable; of more than three variables one that needs each of them; empty if there is none.
    """

    goals: tuple[str, ...]
    latch: tuple[str, ...] = ()


class _ReachMemory(dict[tuple[int, int], bool]):
    """For a goal and a state at rest whether a run reaches the goal from there."""


class ReachableGoals:
    """Answers which goals of one model a runner at rest can still reach.

    Answers are memoized. What is unknown depends on the model and the state alone, never on the states that were asked
    for before: each answer has its own memory of what is reached.
    """

    def __init__(self, model: BehaviorModel, program: Program | None = None, most: int = MOST_SITUATIONS) -> None:
        """Prepare nothing yet: of most models few states at rest are asked for.

        Args:
            model: the model.
            program: the compiled model, if it is compiled.
            most: the maximum number of situations of one search.
        """
        self._model = model
        self._most = most
        self._runs = ContinuedRuns(model, model.planner.name or DEFAULT_PLANNER, _PLAN_LIMITS, program)
        self._lost: dict[int, tuple[LostGoals | None] | None] = {}
        self._open: dict[int, tuple[bool] | None] = {}

    @property
    def unjudged(self) -> Unjudged | None:
        """Why no case of the model is judged; `None` if its goals follow each other, and a search can follow plans."""
        model, planner = self._model, PLANNERS[self._model.planner.name or DEFAULT_PLANNER]
        if model.runs.goals is not GoalOrder.SEQUENCE:
            return Unjudged.SINGLE_GOALS
        if model.runs.plans is RunPlans.DRAWN:
            return Unjudged.DRAWN_PLANS
        return Unjudged.EXTERNAL_PLANNER if planner.is_external else None

    def lost_after(self, state: Mapping[str, Value]) -> LostGoals | None:
        """Return the goals that no run reaches from a state at rest on, though plain runs leave them open.

        Raises `UnknownReachabilityError`.
        """
        values = {each.name: state.get(each.name, each.initial) for each in self._model.running_space}
        return _known(self._lost, self._runs.program.packing.pack(values), self._lost_from)

    def _lost_from(self, state: int) -> LostGoals | None:
        rest, reached = self._all_steps(is_open=True)[0].rest(state).state, _ReachMemory()
        lost = [goal for goal in range(len(self._model.goals)) if self._is_lost(rest, goal, reached)]
        if not lost:
            return None
        names = tuple(self._model.goals[goal][0] for goal in lost)
        return LostGoals(names, self._latch(rest, lost[0], reached))

    def _is_lost(self, rest: int, goal: int, reached: _ReachMemory) -> bool:
        """Return whether an open goal cannot be reached; the search from here is spared where it is known to be closed.

        A search that takes too long does not matter if the goal is not open.
        """
        if self._open.get(goal) == (False,):
            return False
        try:
            is_reached = self._reaches(rest, goal, reached)
        except _TOO_LARGE:
            if self._is_open(goal):
                raise
            return False
        return not is_reached and self._is_open(goal)

    def _is_open(self, goal: int) -> bool:
        """Return whether a goal can be reached from each state that plain runs leave behind, or has to be."""
        return _known(self._open, goal, self._is_open_after_plain_runs)

    def _is_open_after_plain_runs(self, goal: int) -> bool:
        if self._model.goals[goal][0] in self._model.reachable_again:
            return True
        reached = _ReachMemory()
        return all(self._reaches(rest, goal, reached) for rest in self._plain_rests)

    def excluded_by_plain_runs(self, most_pairs: int) -> LostGoals | None:
        """Return the goals that some plain runs leave reachable and others do not; `None` for none.

        Raises `UnknownReachabilityError`, also if there are more than `most_pairs` pairs of goal and rest.
        """
        try:
            rests = self._plain_rests
            if len(rests) * len(self._model.goals) > most_pairs:
                raise SearchTooLongError
            reached = _ReachMemory()
            lost = {
                goal: [rest for rest in rests if not self._reaches(rest, goal, reached)]
                for goal in range(len(self._model.goals))
            }
            excluded = [goal for goal, left in lost.items() if 0 < len(left) < len(rests)]
            latch = self._latch(lost[excluded[0]][0], excluded[0], reached) if excluded else ()
        except _TOO_LARGE as error:
            raise UnknownReachabilityError from error
        return LostGoals(tuple(self._model.goals[goal][0] for goal in excluded), latch) if excluded else None

    # continuations

    def _all_steps(self, *, is_open: bool) -> Sequence[NotedSteps]:
        return [
            self._runs.steps(goal, number, is_open=is_open, is_sequence=True)
            for number, (_, goal) in enumerate(self._model.goals)
        ]

    def _reaches(self, rest: int, goal: int, reached: _ReachMemory) -> bool:
        """Return whether a run can reach a goal from a state at rest on."""
        if (goal, rest) not in reached:
            continued = self._continued(rest, goal, reached)
            reached[goal, rest] = continued is None
            for position in continued or ():
                if position.is_at_rest:
                    reached[goal, position.state] = False
        return reached[goal, rest]

    def _continued(self, rest: int, goal: int, reached: _ReachMemory) -> Mapping[Position, None] | None:
        """Return all positions that can follow a state at rest; `None` if a run reaches the goal in one of them.

        The newest position comes first, and changes from outside, deadlines and other goals last.
        """
        steps = self._all_steps(is_open=True)
        start = steps[0].rest(rest)
        seen, near = {start: None}, [start]
        later: deque[Position] = deque()
        while near or later:
            position = near.pop() if near else later.popleft()
            for is_direct, number, step in _following(steps, position, goal):
                if number == goal and _has_reached(step):
                    return None
                for target in _targets(steps, step):
                    if target.is_at_rest and reached.get((goal, target.state)):
                        return None
                    if target not in seen:
                        seen[target] = None
                        near.append(target) if is_direct else later.append(target)
            if len(seen) > self._most:
                raise SearchTooLongError
        return seen

    # plain runs

    @cached_property
    def _plain_rests(self) -> tuple[int, ...]:
        """Return the states at rest of all sequences of plain runs, the empty one included."""
        steps = self._all_steps(is_open=False)
        starts = (steps[0].start(world_bits(self._runs.program, values)) for values in self._plain_starts())
        seen = dict.fromkeys(chain.from_iterable(_targets(steps, step) for step in starts))
        pending = list(seen)
        while pending:
            position = pending.pop()
            for step in _plainly_following(steps, position):
                new = dict.fromkeys(target for target in _targets(steps, step) if target not in seen)
                seen |= new
                pending += new
            if len(seen) > self._most:
                raise SearchTooLongError
        return tuple(position.state for position in seen if position.is_at_rest)

    def _plain_starts(self) -> Iterator[dict[str, Value]]:
        """Yield the initial states with nominal inputs and published values, or all where none of these is allowed."""
        allowed = InitialStates(self._model)
        for fixed in (nominal_outside(self._model), {}):
            found = [each for each in self._beginnings(fixed) if allowed.allows(each)]
            if found:
                yield from found
                return

    def _beginnings(self, fixed: Mapping[str, Value]) -> Iterator[dict[str, Value]]:
        for group in InitialStates(self._model).beginnings(is_open=not fixed):
            choices = [(fixed[name],) if name in fixed else values for name, values in group.items()]
            found = list(islice(product(*choices), self._most + 1))
            if len(found) > self._most:
                raise SearchTooLongError
            yield from (dict(zip(group, values, strict=True)) for values in found)

    # what keeps a goal from being reached

    def _latch(self, rest: int, goal: int, reached: _ReachMemory) -> tuple[str, ...]:
        """Return a smallest set of variables that nothing changes, and whose initial values open the goal again.

        They are set in a state at rest that can follow: where a stop is still pressed, its latch would be set at once.
        """
        positions = self._continued(rest, goal, reached) or {}
        kept = self._kept_away(positions)
        sets = chain.from_iterable(combinations(kept, size) for size in range(1, _LARGEST_LATCH + 1))
        rests = self._nearest_rests(positions)
        tried = ((names, state) for names in sets for state in rests)
        found = (names for names, state in islice(tried, _MOST_TRIED) if self._opens(state, goal, names, reached))
        return next(found, None) or self._needed(kept, rests, goal, reached)

    def _needed(self, kept: Sequence[str], rests: Sequence[int], goal: int, reached: _ReachMemory) -> tuple[str, ...]:
        """Return variables of which each is needed to open a goal in a state at rest; none if all do not open it."""
        rest = next((each for each in rests if self._opens(each, goal, kept, reached)), None)
        needed = list(kept) if rest is not None else []
        for name in reversed(needed):
            others = [each for each in needed if each != name]
            needed = others if rest is not None and self._opens(rest, goal, others, reached) else needed
        return tuple(needed)

    def _nearest_rests(self, positions: Mapping[Position, None]) -> list[int]:
        """Return the states at rest among positions with the fewest variables away from their initial values."""
        packing = self._runs.program.packing
        names = [each for each in self._model.running_space if each.role is Role.DECLARED]
        rests = dict.fromkeys(position.state for position in positions if position.is_at_rest)
        away = {rest: sum(packing.value(rest, each.name) != each.initial for each in names) for rest in rests}
        return sorted(rests, key=lambda rest: away[rest])[:_MOST_RESTS]

    def _kept_away(self, positions: Mapping[Position, None]) -> tuple[str, ...]:
        """Return the variables of the model that have one value in all positions, which is not their initial one.

        Those that no part of the model sets to another value come first: the others need only these to be reset.
        """
        states, packing = [position.state for position in positions], self._runs.program.packing
        names = self._runs.relevance(self._model.goals[0][1]).names
        found = []
        for name in names:
            variable = self._model.running_space[name]
            if variable.role is Role.DECLARED and len({state & packing[name].mask for state in states}) == 1:
                found += [name] if packing.value(states[0], name) != variable.initial else []
        kept = {name: packing.value(states[0], name) for name in found}
        return tuple(sorted(found, key=lambda name: self._may_set_otherwise(name, kept[name])))

    def _may_set_otherwise(self, name: str, value: Value) -> bool:
        """Return whether an action assigns another value to a variable than this one, or something else changes it."""
        model = self._model
        actions = (*model.actions, *(action for each in model.environment for action in each.actions))
        kept = Assign(name, Constant(value))
        return name in replied(model) or any(each.target == name and each != kept for each in actions)

    def _opens(self, rest: int, goal: int, names: Iterable[str], reached: _ReachMemory) -> bool:
        """Return whether initial values of some variables make a goal reachable; a search too long finds nothing."""
        space = self._model.running_space
        keep, bits = self._runs.program.packing.assignment({name: space[name].initial for name in names})
        steps = self._all_steps(is_open=True)
        settled = steps[0].start(rest & keep | bits).rests
        try:
            return any(self._reaches(steps[0].rest(each).state, goal, reached) for each in settled)
        except _TOO_LARGE:
            return False


def _known(memory: dict[int, tuple[Answer] | None], key: int, find: Callable[[int], Answer]) -> Answer:
    """Return a memoized answer; raise `UnknownReachabilityError` each time if finding it takes too long."""
    if key not in memory:
        memory[key] = None
        with suppress(UnknownReachabilityError, *_TOO_LARGE):
            memory[key] = (find(key),)
    answer = memory[key]
    if answer is None:
        raise UnknownReachabilityError
    return answer[0]


def nominal_outside(model: BehaviorModel) -> dict[str, Value]:
    """Return the inputs and published variables with their nominal values, with which plain runs begin."""
    published = (name for resource in model.resources for name in published_by(resource, model))
    return {name: model.nominal_state[name] for name in dict.fromkeys((*inputs(model), *published))}


def _following(steps: Sequence[NotedSteps], position: Position, goal: int) -> Iterator[tuple[bool, int, RunStep]]:
    """Yield all continuations of a position: whether it is direct, the number of the goal of its run, and the step."""
    if position.is_at_rest:
        for number, each in enumerate(steps):
            yield number == goal, number, each.begin(position.state)
        yield from ((False, position.goal, step) for _, step in steps[0].at_rest(position))
        return
    pursued = steps[position.goal]
    for happening in pursued.happenings(position):
        if _may_continue(happening):
            yield happening.kind in _DIRECT, position.goal, pursued.after(position, happening)


_DIRECT = (HappeningKind.ANSWER, HappeningKind.REPLY, HappeningKind.NEXT)
"""What leads on without anything unusual."""


def _may_continue(happening: Happening) -> bool:
    """Return whether it belongs to a continuation: requests succeed, and no limit ends a run."""
    if happening.kind is HappeningKind.REPLY:
        return happening.succeeded
    return happening.kind is not HappeningKind.TIME_LIMIT


def _plainly_following(steps: Sequence[NotedSteps], position: Position) -> Iterator[RunStep]:
    """Yield what follows in plain runs: a deadline passes only where no reply is awaited."""
    if position.is_at_rest:
        yield from (each.begin(position.state) for each in steps)
        return
    pursued = steps[position.goal]
    for happening in pursued.happenings(position):
        is_fault = happening.kind is HappeningKind.DEADLINE and position.in_flight
        if _may_continue(happening) and not is_fault:
            yield pursued.after(position, happening)


def _has_reached(step: RunStep) -> bool:
    return any(note.end is End.REACHED for note in step.notes)


def _targets(steps: Sequence[NotedSteps], step: RunStep) -> Iterator[Position]:
    """Yield the positions after a step: that of the run, or those of the runner at rest after its end."""
    if step.target is not None:
        yield step.target
    yield from map(steps[0].rest, step.rests)
