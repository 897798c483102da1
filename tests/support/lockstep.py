"""Two runners in lock-step: one of a model and one of a mutant, under all the same choices from outside.

Both are real runners with real planners. Everything that can happen happens to a copy of both, at the same moment: the
planner of each answers, a request fails, or succeeds with each choice of measured values, the earlier deadline passes,
something changes from outside, the time limit passes, or a goal is given. As soon as their effects differ, the models
differ. Slow and obvious: nothing is left out of a situation, not even variables that nothing reads.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import TypeAlias

from msgspec.structs import replace

from scbm.cases.trace import RunnerStarted, RunStarted
from scbm.model import BehaviorModel, GoalOrder, Predicate, State, Value
from scbm.model.sources import outside_groups
from scbm.planning import Planner, Solved
from scbm.running import (
    AskPlan,
    Effect,
    Event,
    GoalGiven,
    Measured,
    PlanAnswered,
    PlanStatus,
    Program,
    ReplyArrived,
    Runner,
    RunnerOptions,
    TimePassed,
)
from support.enumeration import _Outside, fork, runner_livelocks, starts_of

_Timed: TypeAlias = tuple[Event, int]
_FOR_EVER = 10**30
_OPTIONS = RunnerOptions(time_limit_ns=_FOR_EVER, plan_limit=_FOR_EVER, instant_bound=_FOR_EVER)


@dataclass(frozen=True)
class Comparison:
    """What all runs in lock-step come to.

    Attributes:
        difference: what happened until the effects differed; `None` if they never did.
        pairs: how many pairs of situations there are.
        complete: whether these are all; otherwise a limit or a difference ended the comparison.
    """

    difference: tuple[str, ...] | None
    pairs: int
    complete: bool


def compare_runs(original: BehaviorModel, mutant: BehaviorModel, most: int = 20_000) -> Comparison:
    """Compare all runs of two models that differ in a part of the model, under canonical plans.

    Args:
        original: the model.
        mutant: the changed model.
        most: the maximum number of pairs of situations.
    """
    return _Comparer((_Side(original, original), _Side(mutant, original)), most).compare()


@dataclass(frozen=True, slots=True)
class _Pair:
    """A situation of both runners.

    Attributes:
        runners: the runner of the original, and that of the mutant.
        asked: the open question of each; `None` if there is none.
        path: what happened until now.
    """

    runners: tuple[Runner, Runner]
    asked: tuple[AskPlan | None, AskPlan | None] = (None, None)
    path: tuple[str, ...] = ()


class _Comparer:
    def __init__(self, sides: tuple[_Side, _Side], most: int) -> None:
        self._sides = sides
        self._most = most
        self._seen: set[object] = set()
        self._todo: list[_Pair] = []

    def compare(self) -> Comparison:
        starts = [list(side.starts()) for side in self._sides]
        if {_world(start) for start in starts[0]} != {_world(start) for start in starts[1]}:
            return self._ended("an initial state is one of them alone")
        for start in starts[0]:
            pair = _Pair((self._sides[0].runner(start), self._sides[1].runner(start)))
            after = self._happen(pair, "start", (Measured(()), 0), (Measured(()), 0))
            if after is None:
                return self._ended("start")
            self._todo.append(after)
        for pair in self._todo:
            difference = self._difference(pair)
            if difference is not None:
                return self._ended(*pair.path, difference)
            if len(self._seen) > self._most:
                return Comparison(None, len(self._seen), complete=False)
        return Comparison(None, len(self._seen), complete=True)

    def _ended(self, *path: str) -> Comparison:
        return Comparison(path, len(self._seen), complete=False)

    def _difference(self, pair: _Pair) -> str | None:
        """Let everything happen; return the event whose effects differ, and note the pairs after the others."""
        events, others = (
            dict(side.events(runner, ask))
            for side, runner, ask in zip(self._sides, pair.runners, pair.asked, strict=True)
        )
        if sorted(events) != sorted(others):
            return f"{sorted(events)} or {sorted(others)}"
        for label in events:
            after = self._happen(pair, label, events[label], others[label])
            if after is None:
                return label
            key = tuple(_key(runner, ask) for runner, ask in zip(after.runners, after.asked, strict=True))
            if key not in self._seen:
                self._seen.add(key)
                self._todo.append(after)
        return None

    def _happen(self, pair: _Pair, label: str, event: _Timed, other: _Timed) -> _Pair | None:
        """Let one thing happen to copies of both runners; return the situation afterwards, `None` if they differ."""
        times = [min(event[1], other[1])] * 2 if label == _DEADLINE else [event[1], other[1]]
        runners, asked, effects = [], [], []
        whats = zip(self._sides, pair.runners, pair.asked, (event[0], other[0]), times, strict=True)
        for side, runner, ask, what, at_ns in whats:
            twin = fork(runner)
            if label == _LIMIT:
                twin._timer_ns = None
            if label == _GIVE_UP:
                twin.options = _OPTIONS
            done = twin.handle(what, at_ns)
            twin.options = side.options
            now_asked = _asked(done, ask)
            runners.append(twin)
            asked.append(now_asked if twin._asked is not None else None)
            effects.append([_seen(effect) for effect in done])
        if effects[0] != effects[1]:
            return None
        return _Pair((runners[0], runners[1]), (asked[0], asked[1]), (*pair.path, label))


_LIMIT, _GIVE_UP, _DEADLINE = "time limit", "given up", "deadline"


def _seen(effect: Effect) -> object:
    """An effect, without the states of operations in the first record: a mutant may lack an operation."""
    if isinstance(effect, RunnerStarted | RunStarted):
        return type(effect), effect.at_ns, _world(dict(effect.state)), effect.changes
    if isinstance(effect, AskPlan):
        return effect.ask, str(effect.goal)
    return effect


def _world(state: Mapping[str, Value]) -> tuple[tuple[str, Value], ...]:
    """The values without those of operations, in an order of their own."""
    return tuple(sorted((n, v) for n, v in state.items() if not n.endswith(".state")))


def _asked(effects: list[Effect], before: AskPlan | None) -> AskPlan | None:
    asked = [effect for effect in effects if isinstance(effect, AskPlan)]
    return asked[-1] if asked else before


def _key(runner: Runner, ask: AskPlan | None) -> object:
    """Everything that decides what a runner does next."""
    packing = runner.program.packing
    reads = runner._planner_reads
    return (
        runner._state,
        runner._goal is None or runner._goal.name,
        tuple(operation.name for operation in runner._queue),
        tuple(line.resource.name for line in runner._requests.in_flight),
        None if runner._timer_ns is None else runner._timer_ns - runner._now_ns,
        None if ask is None else tuple(ask.state[v.name] for v in packing.space if not v.role.is_runner),
        None if runner._unsolvable_in is None else runner._unsolvable_in & reads,
        runner._awaits_change,
    )


class _Side:
    """One of the two models, with the changes from outside that the original has."""

    def __init__(self, model: BehaviorModel, original: BehaviorModel) -> None:
        self.model = model
        self.program = Program(model)
        self.program.measurable = Program(original).measurable  # the world is that of the original
        self.planner = Planner(model)
        environment = {each.name: each for each in model.environment}
        kept = tuple(environment[each.name] for each in original.environment if each.name in environment)
        is_open = bool(outside_groups(original))
        self._outside = _Outside(replace(original, environment=kept)) if is_open else None
        self.options = replace(_OPTIONS, awaits_measurements=is_open)
        self._is_sequence = original.runs.goals is GoalOrder.SEQUENCE
        self.answer = cache(self._answer)

    def starts(self) -> Iterator[State]:
        """All initial states."""
        return starts_of(self.model, is_open=self._outside is not None)

    def runner(self, start: State) -> Runner:
        return Runner(self.program, start, self.options)

    def _answer(self, state: tuple[object, ...], goal: Predicate) -> tuple[PlanStatus, tuple[str, ...]]:
        names = [v.name for v in self.model.space]
        answer = self.planner.plan(dict(zip(names, state, strict=True)), goal)  # type: ignore[arg-type]
        return PlanStatus(answer.status), answer.plan if isinstance(answer, Solved) else ()

    def events(self, runner: Runner, ask: AskPlan | None) -> Iterator[tuple[str, tuple[Event, int]]]:
        """Everything that can happen, by a label, with its time."""
        now_ns = runner._now_ns
        outside = None if runner_livelocks(runner) else self._outside
        for label, event in outside.events(runner) if outside is not None else ():
            yield label, (event, now_ns)
        if runner.is_at_rest:
            if (self._is_sequence or not runner._asks) and not runner_livelocks(runner):
                yield from ((name, (GoalGiven(name, goal), now_ns)) for name, goal in self.model.goals)
            return
        if ask is not None:
            state = tuple(ask.state[v.name] for v in self.model.space)
            yield "answer", (PlanAnswered(ask.ask, *self.answer(state, ask.goal)), now_ns)
        space = self.model.space
        for request, line in runner._requests._lines.items():
            resource = line.resource
            choices = [[(), *(((n, value),) for value in resource.sends(space[n]))] for n in resource.measures]
            for choice in product(*choices):
                measured = tuple(pair for chosen in choice for pair in chosen)
                for succeeded in (True, False):
                    yield (
                        f"{resource.name} {succeeded} {measured}",
                        (ReplyArrived(request, succeeded, measured), now_ns),
                    )
        if runner._timer_ns is not None:
            yield _DEADLINE, (TimePassed(), runner._timer_ns)
        yield _LIMIT, (TimePassed(), runner._goal_deadline_ns)
        if self._outside is not None and runner._awaits_change and not runner._requests.in_flight:
            yield _GIVE_UP, (Measured(()), now_ns)
