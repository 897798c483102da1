"""All runs of a model, by driving the real runner through everything that can happen to it. Slow and obvious.

A *situation* is a settled runner whose run goes on, and the answer that the planner will give if it was asked. There,
everything that can happen without an injection happens to a copy of the runner: the planner answers, each request in
flight fails, or succeeds with each choice of measured values, and the deadline of the operation passes. In an open
world inputs and published values change as well, also after the end of a run. Situations with the same futures are
explored once.
"""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, product
from typing import TypeAlias

from msgspec.structs import replace

from scbm.cases import CONDITIONS, Condition, Injection
from scbm.cases.coverage import Obligations, visited_by
from scbm.cases.trace import Changes
from scbm.model import BehaviorModel, PlanSet, Predicate, Resource, Role, State, Transition
from scbm.model.sources import free_groups
from scbm.planning import Planner, Solved
from scbm.running import (
    AskPlan,
    CancelRequest,
    ChangeResource,
    Effect,
    Event,
    GoalGiven,
    InjectionGiven,
    Measured,
    PlanAnswered,
    PlanStatus,
    Program,
    ReplyArrived,
    RunFinished,
    Runner,
    RunnerOptions,
    SendRequest,
    TimePassed,
)
from scbm.running.requests import Requests

Path: TypeAlias = "tuple[Path | None, str]"
"""What happened, the last first."""

OUTWARD = (SendRequest, CancelRequest, ChangeResource, AskPlan, RunFinished)
_FOR_EVER = 10**30
_DETOUR = 2
"""Any plans are enumerated up to so many operations more than a shortest one has."""
_MAX_PLANS = 200
"""So many plans are enumerated in one state."""
_OPTIONS = RunnerOptions(time_limit_ns=_FOR_EVER, plan_limit=_FOR_EVER, instant_bound=_FOR_EVER)
_WAITING = replace(_OPTIONS, awaits_measurements=True)


@dataclass(frozen=True)
class Enumeration:
    """What all runs of a model come to.

    Attributes:
        obligations: those of the model.
        visited: those that some run visits, as bits, *queued* among them.
        cut_off: those that are visited behind the end that the time limit brings about in some situation.
        situations: how many were found.
        complete: whether these are all; otherwise a limit cut them off.
        ways: for each of them by name, a shortest way to it for some goal and initial state.
    """

    obligations: Obligations
    visited: int
    cut_off: int
    situations: int
    complete: bool
    ways: dict[str, tuple[str, ...]]

    def visits(self, name: str) -> bool:
        """Whether some run visits the obligation of that name, be it one that the time limit ends."""
        return name in self.ways


def enumerate_runs(  # noqa: PLR0913 - which runs
    model: BehaviorModel,
    most: int = 300_000,
    *,
    simulated: bool = False,
    is_open: bool = False,
    is_sequence: bool = False,
    plans: PlanSet = PlanSet.CANONICAL,
) -> Enumeration:
    """Everything that all runs without injections visit, for all goals and allowed initial states.

    Args:
        model: the model.
        most: the maximum number of situations.
        simulated: leaves out what a simulation cannot bring about. There planning takes no time, and deadlines pass
            last in their instant; so no reply to an earlier request comes between a deadline and the next plan.
        is_open: whether inputs and published values change at every settled moment.
        is_sequence: whether goals follow each other, each from where the last run ended.
        plans: the plans that the runner gets; of any plans only those that come to no state twice and are not much
            longer than the shortest.
    """
    explorer = _Explorer(model, most, simulated=simulated, is_open=is_open, plans=plans)
    explorer.explore(is_sequence=is_sequence)
    ways = {name: _labels(path) for name, path in explorer.ways.items()}
    return Enumeration(
        explorer.obligations, explorer.visited, explorer.cut_off, explorer.situations, explorer.complete, ways
    )


def fork(runner: Runner) -> Runner:
    """A runner that goes on from here by itself. What runners share (the program and its parts) never changes."""
    twin = copy.copy(runner)
    for name, value in vars(runner).items():
        if isinstance(value, (list, dict, deque)):
            setattr(twin, name, value.copy())
    twin._requests = Requests()
    twin._requests._lines = runner._requests._lines.copy()
    twin._requests._last = runner._requests._last
    return twin  # replies that were dropped, and requests that were answered, are for counting only


@dataclass(frozen=True, slots=True)
class _Situation:
    """A situation, or what is about to become one.

    Attributes:
        answer: what the planner will say, if it was asked.
        path: what happened until now.
        at_deadline: the last request before the deadline that passed at this very moment, if one did.
    """

    runner: Runner
    answer: PlanAnswered | None
    path: Path
    at_deadline: int | None = None

    @property
    def is_instant(self) -> bool:
        """Whether no time can pass before something else happens."""
        return self.answer is not None or self.runner._timer_ns == self.runner._now_ns


class _Explorer:
    """A breadth-first search through situations."""

    def __init__(self, model: BehaviorModel, most: int, *, simulated: bool, is_open: bool, plans: PlanSet) -> None:
        self.obligations = Obligations.of(model)
        self.visited = 0
        self.cut_off = 0
        self.situations = 0
        self.complete = True
        self.ways: dict[str, Path] = {}
        self._model = model
        self._most = most
        self._simulated = simulated
        self._program = Program(model)
        self._planner = Planner(model)
        self._plans = plans
        self._answers: dict[tuple[Predicate, int], tuple[tuple[PlanStatus, tuple[str, ...]], ...]] = {}
        self._rests: dict[int, tuple[Runner, Path]] = {}
        packing = self._program.packing
        self._outside = _Outside(model) if is_open else ()
        self._after_ends: dict[int, Path] = {}
        self._kept = sum(packing[name].mask for name in matters(model))

    def explore(self, *, is_sequence: bool) -> None:
        """All runs for all goals, from initial states, and from where runs ended."""
        for start in self._starts():
            runner = Runner(self._program, start, _WAITING if self._outside else _OPTIONS)
            path: Path = (None, _differences(start))
            self.visited |= self._visit(runner.handle(Measured(()), 0), path, self.visited)
            self.visited |= self._after_end(runner, path)
        runners = list(self._rests.values())
        seen: dict[str, set[object]] = {goal: set() for goal, _ in self._model.goals}
        begun = len(runners)
        while runners:
            for goal, predicate in self._model.goals:
                self._explore(goal, predicate, runners, seen[goal])
            known = list(self._rests.values()) if is_sequence else []
            runners, begun = known[begun:], len(known)

    def _starts(self) -> list[State]:
        starts = list(islice(starts_of(self._model, is_open=bool(self._outside)), self._most + 1))
        self.complete = len(starts) <= self._most
        return starts[: self._most]

    def _explore(self, goal: str, predicate: Predicate, runners: list[tuple[Runner, Path]], seen: set[object]) -> None:
        """All runs for one goal from runners at rest."""
        todo: deque[_Situation] = deque()
        for rest, before in runners:
            runner = fork(rest)
            earlier, label = before
            path: Path = (before, goal) if earlier is not None else (None, f"{goal} from {label}")
            self._happen(_Situation(runner, None, path), GoalGiven(goal, predicate), runner._now_ns, seen, todo)
        while todo:
            situation = todo.popleft()
            for label, event, at_ns in self._events(situation):
                path = (situation.path, label)
                at_deadline = self._at_deadline(situation, event)
                after = _Situation(fork(situation.runner), situation.answer, path, at_deadline)
                self._happen(after, event, at_ns, seen, todo)
            self._end_early(situation)
            self._give_up(situation)

    def _at_deadline(self, situation: _Situation, event: Event) -> int | None:
        if not self._simulated:
            return None
        if isinstance(event, TimePassed):
            return situation.runner._requests._last
        return situation.at_deadline

    def _end_early(self, situation: _Situation) -> None:
        """The time limit passes, before any other deadline."""
        runner = fork(situation.runner)
        runner._timer_ns = None
        effects = runner.handle(TimePassed(), runner._goal_deadline_ns)
        path: Path = (situation.path, "time limit")
        self.cut_off |= self._visit(effects, path, self.visited | self.cut_off)
        self.cut_off |= self._after_end(runner, path)

    def _give_up(self, situation: _Situation) -> None:
        """A run that waits for something outside ends, if it waits for nothing else."""
        runner = fork(situation.runner)
        if not self._outside or runner._unsolvable_in != runner._state or runner._requests.in_flight:
            return
        runner.options = _OPTIONS
        effects = runner.handle(Measured(()), runner._now_ns)
        path: Path = (situation.path, "given up")
        self.visited |= self._visit(effects, path, self.visited) | self._after_end(runner, path)

    def _after_end(self, ended: Runner, path: Path) -> int:
        """Whatever changes outside after the end of a run: what is visited then."""
        visited = 0
        todo = [(ended, path)]
        while todo:
            before, way = todo.pop()
            if runner_livelocks(before) or before._state & self._kept in self._after_ends:
                continue
            self._after_ends[before._state & self._kept] = way
            self._rests[before._state & self._kept] = before, way
            for label, event in self._changes_from_outside(before):
                runner, path = fork(before), (way, f"{label} after the end")
                effects = runner.handle(event, runner._now_ns)
                visited |= self._visit(effects, path, self.visited | self.cut_off | visited)
                todo.append((runner, path))
        return visited

    def _happen(self, before: _Situation, event: Event, at_ns: int, seen: set[object], todo: deque[_Situation]) -> None:
        """Something happens; what comes of it is visited, and gone on from if it is new."""
        runner = before.runner
        effects = runner.handle(event, at_ns)
        self.visited |= self._visit(effects, before.path, self.visited)
        if any(isinstance(effect, RunFinished) for effect in effects):
            self.visited |= self._after_end(runner, before.path)
            return
        asked = [effect for effect in effects if isinstance(effect, AskPlan)]
        unanswered = (before.answer,) if runner._asked is not None else (None,)
        for answer in self._answered(asked[-1]) if asked else unanswered:
            situation = _Situation(runner, answer, before.path, before.at_deadline)
            if not situation.is_instant:
                situation = _Situation(runner, answer, before.path)
            key = self._key(situation)
            if key in seen:
                continue
            seen.add(key)
            if self.situations == self._most:
                self.complete = False
                return
            self.situations += 1
            todo.append(situation)

    def _visit(self, effects: list[Effect], path: Path, known: int) -> int:
        """What effects visit, and the way to what is not known."""
        records = (effect for effect in effects if not isinstance(effect, OUTWARD))
        visited = visited_by(records, self.obligations)
        if visited & ~known:
            self.ways.update((name, path) for name in self.obligations.names(visited & ~known))
        return visited

    def _answered(self, asked: AskPlan) -> tuple[PlanAnswered, ...]:
        """The answers of the planner, which is asked once for each problem that differs to it."""
        problem = asked.goal, self._planner.task(asked.goal).pack(asked.state)
        if problem not in self._answers:
            answer = self._planner.plan(asked.state, asked.goal)
            plans = self._all_plans(asked, answer) if isinstance(answer, Solved) else ((),)
            self._answers[problem] = tuple((PlanStatus(answer.status), plan) for plan in plans)
        return tuple(PlanAnswered(asked.ask, *answer) for answer in self._answers[problem])

    def _all_plans(self, asked: AskPlan, answer: Solved) -> tuple[tuple[str, ...], ...]:
        """The plans of the set, the canonical one first."""
        found = {answer.plan: None}
        if self._plans is PlanSet.ANY:
            task = self._planner.task(asked.goal)
            most = len(answer.plan) + _DETOUR
            is_goal = self._planner.problem(asked.goal).is_goal
            todo: list[tuple[tuple[int, ...], tuple[str, ...]]] = [((task.pack(asked.state),), ())]
            while todo and len(found) < _MAX_PLANS:
                states, plan = todo.pop()
                if is_goal(states[-1]):
                    found[plan] = None
                if len(plan) < most:
                    steps = task.successors(states[-1])
                    todo += [((*states, s), (*plan, task.operations[o])) for o, s in steps if s not in states]
        return tuple(found)

    def _key(self, situation: _Situation) -> object:
        """Everything that decides what can follow.

        Of a question it is the answer; and, if that is that there is no plan, whether it will be of the present state.
        Which other states have no plan, the runner only remembers so as not to ask again, with the same answer.
        """
        runner, answer, last = situation.runner, situation.answer, situation.at_deadline
        asks = answer and (answer.status, answer.plan, answer.status is PlanStatus.SOLVED or _is_fresh(runner))
        return (
            runner._state & self._kept,
            tuple(operation.name for operation in runner._queue),
            tuple(line.resource.name for line in runner._requests.in_flight),
            runner._timer_ns is None,
            asks,
            None if last is None else tuple(request <= last for request in runner._requests._lines),
        )

    def _events(self, situation: _Situation) -> Iterator[tuple[str, Event, int]]:
        """What can happen, in words, and when."""
        runner, now_ns = situation.runner, situation.runner._now_ns
        if situation.answer is not None:
            plan = ", ".join(situation.answer.plan)
            yield f"{situation.answer.status} {plan}".strip(), situation.answer, now_ns
        for request, line in runner._requests._lines.items():
            if situation.at_deadline is not None and request <= situation.at_deadline:
                continue
            name = line.resource.name
            for measured in self._measurements(line.resource):
                yield f"{name} succeeds {_written(measured)}".strip(), ReplyArrived(request, True, measured), now_ns
                yield f"{name} fails {_written(measured)}".strip(), ReplyArrived(request, False, measured), now_ns
        if runner._timer_ns is not None:
            yield "deadline", TimePassed(), runner._timer_ns
        for label, event in self._changes_from_outside(runner):
            yield label, event, now_ns

    def _changes_from_outside(self, runner: Runner) -> Iterator[tuple[str, Event]]:
        return iter(()) if isinstance(self._outside, tuple) else self._outside.events(runner)

    def _measurements(self, resource: Resource) -> Iterator[Changes]:
        """Each choice of measured values: for each variable nothing, or a value that the resource sends."""
        space = self._model.space
        choices = [[(), *(((name, value),) for value in resource.sends(space[name]))] for name in resource.measures]
        return (tuple(pair for chosen in choice for pair in chosen) for choice in product(*choices))


def runner_livelocks(runner: Runner) -> bool:
    """Whether automatic transitions repeat without end while a runner is at rest; then nothing follows any more."""
    return bool(runner._cycle)


def starts_of(model: BehaviorModel, *, is_open: bool) -> Iterator[State]:
    """All initial states: the allowed ones of random and nominal values, in which free variables have any values."""
    free = {name: values for group in free_groups(model) for name, values in group.values} if is_open else {}
    seen: dict[State, None] = {}
    for known in ({v.name: (v.initial,) for v in model.space}, {v.name: v.random for v in model.space}):
        choices = [dict.fromkeys((*values, *free.get(name, ()))) for name, values in known.items()]
        for values in product(*choices):
            state = State(model.space, dict(zip(known, values, strict=True)))
            if state not in seen and model.initial_states.holds(state):
                seen[state] = None
                yield state


class _Outside:
    """What changes from outside: free variables, environment transitions, other users of shared resources."""

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        self._free = [c for group in free_groups(model) for c in group.changes(group.names)]
        self._shared = [resource for resource in model.resources if resource.shared]

    def __bool__(self) -> bool:
        return bool(self._free or self._model.environment or self._shared)

    def events(self, runner: Runner) -> Iterator[tuple[str, Event]]:
        """Everything that can happen where a runner is settled, in words and as an event."""
        for changes in self._free:
            yield _written(changes), Measured(changes)
        state, space = runner.state, self._model.space
        for each in self._model.environment:
            assigned = tuple((action.target, action.value(state)) for action in each.actions)
            if each.guard.holds(state) and all(value in space[name].domain for name, value in assigned):
                yield f"{each.name}: {_written(assigned)}", Measured(assigned, each.name)
        in_flight = [line.resource.name for line in runner._requests.in_flight]
        for resource in self._shared:
            name = resource.request_state
            if resource.name in in_flight:
                continue
            if state[name] == "initial":
                occupied = Injection("other", resource=resource.name, condition=Condition(CONDITIONS["occupied"]))
                yield f"{resource.name} is occupied", InjectionGiven(occupied)
            elif state[name] == "executing":
                left = Injection("other", ((name, "initial"),))
                yield f"{resource.name} is left", InjectionGiven(left)


def matters(model: BehaviorModel) -> tuple[str, ...]:
    """The variables that can decide what follows.

    A variable that nothing reads decides nothing, with one exception: an automatic transition is taken only where it
    changes something.
    """
    automatic = model.automatic_transitions
    steps = [t for o in model.operations for t in (o.pre, o.post, o.failed) if t is not None] + list(automatic)
    actions = [action for step in steps for action in step.running_actions]
    actions += [action for operation in model.operations for action in operation.timedout]
    actions += [action for each in model.environment for action in each.actions]
    read = {name for each in model.environment for name in each.guard.reads()}
    read |= {name for step in steps for name in _reads(step)} | {name for action in actions for name in action.reads()}
    read |= {name for _, goal in model.goals for name in goal.reads()}
    read |= {action.target for transition in automatic for action in transition.running_actions}
    return tuple(v.name for v in model.running_space if v.role is not Role.DECLARED or v.name in read)


def _reads(transition: Transition) -> tuple[str, ...]:
    return (*transition.g.reads(), *transition.gr.reads())


def _is_fresh(runner: Runner) -> bool:
    return runner._asked_in == runner._state


def _differences(state: State) -> str:
    nominal = {variable.name: variable.initial for variable in state.space}
    return _written(tuple((name, value) for name, value in state.items() if value != nominal[name])) or "nominal"


def _written(values: Changes) -> str:
    return ", ".join(f"{name}={value}" for name, value in values)


def _labels(path: Path | None) -> tuple[str, ...]:
    labels = []
    while path is not None:
        path, label = path
        labels.append(label)
    return tuple(reversed(labels))
