"""Doubts from exploring planning states: operations never enabled, unreachable goals, domains left, and livelocks.

Livelocks are cycles of automatic transitions. Runs are not explored here (`scbm close` does that). Each planning state
is taken at rest, and with each of its operations executing and the requests of that operation executing, succeeded and
failed.

Plans alone do not reach every state of a run: a failure, a timeout, an automatic transition or a measured value can
enable an operation. The moves of `recovery_system` are these, and the start and the completion of each operation. They
leave out conditions on requests, on the states of operations and on changes from outside, so that more moves are
possible than in runs, never fewer.
"""

from __future__ import annotations

from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.closing.advice.doubts import Doubt, Unfinished, written_as
from scbm.closing.advice.instant_operations import completes_at_once
from scbm.closing.advice.unplanned_changes import PLANNED, with_unplanned_changes
from scbm.closing.advice.unreachable_goals import root_of_unreachable
from scbm.closing.proofs.possible_values import ValueSets, possible_values
from scbm.model import (
    And,
    Assign,
    Constant,
    Equal,
    InitialStates,
    OperationState,
    PlanState,
    Reference,
    RequestState,
    Slug,
    State,
    conjunction,
    format_value,
)
from scbm.model.predicates import TRUE
from scbm.model.sources import moved, outside_values, published_by
from scbm.model.variables import (
    CURRENT_NAME,
    CURRENT_STATE,
    NO_OPERATION,
    PLAN_STATE,
    VariableSource,
    operation_state_name,
)
from scbm.planning import LimitReached, NoPlanFound, PlanLimits, Planner, Reach, Task, Unsolvable, explore
from scbm.planning.engines import Move, MovePart, TransitionSystem, may_leave
from scbm.running import Program
from scbm.running.compiled_steps import OperationPart
from scbm.running.micro_steps import describe_cycle, find_cycle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.model import Action, BehaviorModel, Operation, Predicate, Transition, Value
    from scbm.planning import Answer


_MAX_COMBINATIONS = 20_000
"""Maximum number of combinations of random values that are enumerated for initial states."""


_MAX_MULTIPLIED = 3
"""Maximum number of variables and operations that are named where a limit ends the exploration."""

_FEW = 5_000
"""Number of states that the canonical planner expands for a goal before the greedy one is asked."""


class CheckLimits(Struct, frozen=True):
    """The limits of the exploration for warnings.

    Attributes:
        states: maximum number of planning states, and of states that plans and recovery reach.
        starts: maximum number of initial states that are explored from.
        expansions: maximum number of expanded states for all plans to one goal.
        chains: maximum number of states in which automatic transitions are followed.
    """

    states: int = 20_000
    starts: int = 200
    expansions: int = 20_000
    chains: int = 60_000


THOROUGH = CheckLimits(states=2_000_000, starts=20_000, expansions=2_000_000, chains=2_000_000)
"""The limits of `scbm check --thorough`: a hundred times as many states as by default."""


class PlannerPair:
    """The canonical planner of a model, and the greedy one for goals that are too far away for it.

    Attributes:
        canonical: the canonical planner.
    """

    def __init__(self, model: BehaviorModel) -> None:
        self.canonical = Planner(model)
        self._greedy = Planner(model, "greedy")

    def plan(self, start: Mapping[str, Value], goal: Predicate, left: int) -> tuple[Answer, int]:
        """Return the answer after at most `left` expanded states, and how many of these are left."""
        answer = self.canonical.plan(start, goal, PlanLimits(expansions=min(left, _FEW)))
        left -= answer.expanded
        if isinstance(answer, LimitReached) and left > 0:
            answer = self._greedy.plan(start, goal, PlanLimits(expansions=left))
            left -= answer.expanded
        return answer, left


class PlanningExploration(Struct, frozen=True, dict=True):
    """The allowed initial states, and the planning states that operations reach from them.

    Attributes:
        model: the model.
        planners: the planners of the model.
        starts: allowed initial states, in order.
        all_starts: whether these are all.
        reach: the planning states that are reachable from them, without the effects of requests and the runner.
        limits: the limits of the exploration.
        progress: called with a description of each phase.
    """

    model: BehaviorModel
    planners: PlannerPair
    starts: tuple[State, ...]
    all_starts: bool
    reach: Reach
    limits: CheckLimits
    progress: Callable[[str], None]

    @property
    def task(self) -> Task:
        """The packed operations."""
        return self.planners.canonical.base_task

    @cached_property
    def changed_planners(self) -> PlannerPair:
        """The planners whose plans begin with unplanned changes."""
        return PlannerPair(with_unplanned_changes(self.model))


def explore_model(model: BehaviorModel, limits: CheckLimits, progress: Callable[[str], None]) -> PlanningExploration:
    """Explore the planning states of a model, within the limits."""
    planners = PlannerPair(model)
    initial = InitialStates(model)
    starts = tuple(islice(initial.allowed(_MAX_COMBINATIONS), limits.starts + 1))
    complete = initial.combinations <= _MAX_COMBINATIONS and len(starts) <= limits.starts
    starts = starts[: limits.starts]
    task = planners.canonical.base_task
    counted = _counting(progress, "planning states")
    reach = explore(task, [task.pack(state) for state in starts], limits.states, counted)
    return PlanningExploration(model, planners, starts, complete, reach, limits, progress)


def _counting(progress: Callable[[str], None], noun: str) -> Callable[[int], None]:
    return lambda count: progress(f"exploring: {count:,} {noun}")


def doubts_about_plans(model: BehaviorModel, exploration: PlanningExploration) -> Iterator[Doubt | Unfinished]:
    """Yield doubts about missing initial states, operations never enabled, unreachable goals, and domains left."""
    if not exploration.starts:
        message = "no initial state was found that satisfies `initial_states`"
        is_proved = exploration.all_starts
        yield Doubt(Slug.NO_INITIAL_STATE, message, ("initial_states",)) if is_proved else Unfinished(message)
        return
    if not exploration.reach.complete:
        message = f"plans reach more than {exploration.limits.states:,} states"
        yield Unfinished(message)
    if not exploration.all_starts:
        message = f"there are more than {len(exploration.starts):,} initial states"
        yield Unfinished(message)
    yield from _never_enabled(model, exploration)
    yield from _domains_left(model, exploration)
    for name, goal in model.goals:
        yield from _unreachable(name, goal, exploration)


def _never_enabled(model: BehaviorModel, exploration: PlanningExploration) -> Iterator[Doubt | Unfinished]:
    """Yield a doubt for each operation that neither plans nor recovery enable; all states or value sets prove it."""
    reach, task = exploration.reach, exploration.task
    left = _never_enabled_in(reach, task, task.operations)
    if left and not (reach.complete and exploration.all_starts):
        # The value sets of all runs may still prove it.
        values = ValueSets(model.running_space, possible_values(model))
        yield from (_proved(name) for name in left if not values.can_hold(model.operation(name).pre.g))
    elif left:
        yield from _never_recovered(left, model, exploration)


def _never_recovered(
    names: Sequence[str], model: BehaviorModel, exploration: PlanningExploration
) -> Iterator[Doubt | Unfinished]:
    """Yield a doubt for each operation that no plan reaches, unless recovery may enable it."""
    task = Task(recovery_system(model))
    starts = [task.pack(state) for state in exploration.starts]
    counted = _counting(exploration.progress, "states that recovery reaches")
    reach = explore(task, starts, exploration.limits.states, counted)
    if not reach.complete:
        values = ValueSets(model.running_space, possible_values(model))
        yield from (_proved(name) for name in names if not values.can_hold(model.operation(name).pre.g))
        yield Unfinished(_too_many(names, reach, task, exploration.limits.states))
        return
    count = len(exploration.reach.states)
    where = f"enabled in none of the {count} states" if count > 1 else "not enabled in the only state"
    for name in _never_enabled_in(reach, task, names):
        message = f"{name} is {where} that plans can reach, nor after failures and automatic transitions"
        yield Doubt(Slug.OPERATION_NEVER_ENABLED, message, ("operations", name, "pre", "g"))


def _too_many(names: Sequence[str], reach: Reach, task: Task, limit: int) -> str:
    """Return why failures, timeouts and automatic transitions were not explored to the end, in words of the model."""
    declared = [variable for variable in task.packing.space if not variable.role.is_runner]
    masks = {variable.name: task.packing[variable.name].mask for variable in declared}
    counts = {name: len({state & mask for state in reach.states}) for name, mask in masks.items()}
    most = sorted((name for name in counts if counts[name] > 1), key=lambda name: -counts[name])[:_MAX_MULTIPLIED]
    values = ", ".join(f"{name} ({counts[name]} values)" for name in most)
    asked = ", ".join(names[:_MAX_MULTIPLIED]) + (" and others" if len(names) > _MAX_MULTIPLIED else "")
    return (
        f"whether {asked} can be enabled after failures, timeouts and automatic transitions is unknown: these lead to "
        f"more than {limit:,} states, as the values of variables multiply: {values}; smaller domains have fewer"
    )


def _never_enabled_in(reach: Reach, task: Task, names: Sequence[str]) -> list[str]:
    """Return those of `names` whose moves are enabled in none of the states."""
    missing = dict.fromkeys(names)
    for state in reach.states:
        if not missing:
            break
        for index, _ in task.successors(state):
            missing.pop(task.operations[index], None)
    return list(missing)


def _proved(name: str) -> Doubt:
    message = f"{name} is never enabled: no run without injections gives the variables of its guard such values"
    return Doubt(Slug.OPERATION_NEVER_ENABLED, message, ("operations", name, "pre", "g"))


def _domains_left(model: BehaviorModel, exploration: PlanningExploration) -> Iterator[Doubt]:
    """Yield a doubt for actions that would leave a domain in a reachable state with their guard (semantics 2.4)."""
    task = exploration.task
    for operation in model.operations:
        timedout = _planned(operation.timedout, task) if _can_time_out(operation, model) else ()
        actions = (*operation.pre.a, *operation.post.a, *timedout)
        if not any(may_leave(action, model.running_space) for action in actions):
            continue
        here = ("operations", operation.name)
        can_start, can_complete = task.packing.test(operation.pre.g), task.packing.test(operation.post.g)
        enabled = [state for state in exploration.reach.states if can_start(state)]
        yield from _leaving(operation.pre, (*here, "pre"), enabled, task)
        started = [state for state in map(task.update(operation.pre.a), enabled) if state is not None]
        done = [state for state in started if can_complete(state)]
        yield from _leaving(operation.post, (*here, "post"), done, task)
        left = _first_left(timedout, started, task)
        if left is not None:
            message = f"`timedout` of {operation.name} would leave a domain where {left}, and the run ends there"
            remedy = "exclude these values by the guard of the operation, or use `min` or `max`"
            yield Doubt(Slug.DOMAIN_LEFT, message, (*here, "timedout"), remedy)


def _can_time_out(operation: Operation, model: BehaviorModel) -> bool:
    return operation.deadline_ns is not None and not completes_at_once(operation, model)


def _leaving(transition: Transition, path: tuple[str, ...], states: Sequence[int], task: Task) -> Iterator[Doubt]:
    """Yield a doubt with the first state in which the actions of the transition would leave a domain."""
    left = _first_left(transition.a, states, task)
    if left is not None:
        message = f"{written_as(path, 'a')} would leave a domain where {left}, so it cannot be taken there"
        yield Doubt(Slug.DOMAIN_LEFT, message, (*path, "a"))


def _first_left(actions: Sequence[Action], states: Sequence[int], task: Task) -> str | None:
    """Return what actions read in the first state in which they would leave a domain; `None` if there is none."""
    update = task.update(tuple(actions))
    for state in states:
        if update(state) is None:
            values = task.packing.values(state)
            read = dict.fromkeys(name for action in actions for name in action.reads() if name in values)
            return ", ".join(f"{name} == {format_value(values[name])}" for name in read)
    return None


def _planned(actions: Sequence[Action], task: Task) -> tuple[Action, ...]:
    """Return the actions about variables that the planner knows."""
    known = [variable.name for variable in task.packing.space]
    return tuple(each for each in actions if each.target in known and all(name in known for name in each.reads()))


def _unreachable(name: str, goal: Predicate, exploration: PlanningExploration) -> Iterator[Doubt | Unfinished]:
    """Yield a doubt if a goal is unreachable from some or all initial states, also after unplanned changes."""
    lost: list[State] = []
    left = exploration.limits.expansions
    for tried, start in enumerate(exploration.starts):
        exploration.progress(f"planning for {name} from initial state {tried + 1:,} of {len(exploration.starts):,}")
        answer, left = exploration.planners.plan(start, goal, left)
        if isinstance(answer, Unsolvable):
            answer, left = exploration.changed_planners.plan({**start, PLANNED: False}, goal, left)
        if isinstance(answer, LimitReached | NoPlanFound):
            count = f"{tried:,} of {len(exploration.starts):,}"
            message = f"plans to the goal {name} were found or refuted from {count} initial states"
            yield Unfinished(message)
            return
        if isinstance(answer, Unsolvable):
            lost.append(start)
    if len(lost) == len(exploration.starts):
        count = "any" if exploration.all_starts else f"any of {len(lost)}"
        message = f"no plan reaches the goal {name} from {count} initial state{'' if exploration.all_starts else 's'}"
        root = root_of_unreachable(exploration.planners.canonical, lost[0], goal)
        yield Doubt(Slug.GOAL_UNREACHABLE, message, ("goals", name), root)
    elif lost:
        message = f"no plan reaches the goal {name} from {len(lost)} of {len(exploration.starts)} initial states"
        yield Doubt(Slug.GOAL_NOT_ALWAYS_REACHABLE, message, ("goals", name), f"one of them: {_drawn(lost[0])}")


def _drawn(state: State) -> str:
    """Return the values by which an initial state differs from the nominal one."""
    drawn = [v.name for v in state.space if state[v.name] != v.initial]
    return ", ".join(f"{name} == {format_value(state[name])}" for name in drawn) or "the nominal one"


_BOUND = 1_000
"""Maximum number of automatic transitions that are followed from one state."""

_REPORTED_EVERY = 1_000


def doubts_about_livelocks(model: BehaviorModel, exploration: PlanningExploration) -> Iterator[Doubt | Unfinished]:
    """Yield each cycle of automatic transitions once, with a state in which it begins."""
    if not model.automatic_transitions:
        return
    program = Program(model)
    limit = exploration.limits.chains
    reported: dict[frozenset[str], None] = {}
    for chains, state in enumerate(_running_states(program, exploration)):
        if chains == limit:
            message = f"automatic transitions were followed in {limit:,} states"
            yield Unfinished(message)
            return
        if chains % _REPORTED_EVERY == 0:
            exploration.progress(f"following automatic transitions: {chains:,} states")
        cycle = find_cycle(program, state, _BOUND)
        if cycle and frozenset(cycle) not in reported:
            reported[frozenset(cycle)] = None
            remedy = f"this happens where {_where(program, state, cycle)}"
            path = ("automatic_transitions", cycle[0])
            yield Doubt(Slug.AUTOMATIC_LIVELOCK, describe_cycle(cycle), path, remedy)


def _running_states(program: Program, exploration: PlanningExploration) -> Iterator[int]:
    """Yield states that runs can reach, packed for running."""
    task = exploration.task
    pack = program.packing.pack
    rest = {variable.name: variable.initial for variable in program.packing.space}
    starts = [_PackedStart.of(program, name) for name in task.operations]
    for state in exploration.reach.states:
        at_rest = pack({**rest, **task.packing.values(state), PLAN_STATE: PlanState.EXECUTING.value})
        yield at_rest
        for index, _ in task.successors(state):
            yield from starts[index].executing(at_rest)


class _PackedStart(Struct, frozen=True):
    """The start of an operation on packed states; an assignment is `state & keep | bits`.

    Attributes:
        update: applies the actions of the precondition; `None` where these leave a domain.
        executes: the assignment that makes the operation current and executing.
        requests: for each resource its trigger, and the assignments that make its request executing, succeeded, failed.
    """

    update: Callable[[int], int | None]
    executes: tuple[int, int]
    requests: tuple[tuple[int, tuple[tuple[int, int], ...]], ...]

    @staticmethod
    def of(program: Program, name: str) -> _PackedStart:
        """Return the start of an operation."""
        assignment, executing = program.packing.assignment, OperationState.EXECUTING.value
        executes = {operation_state_name(name): executing, CURRENT_NAME: name, CURRENT_STATE: executing}
        requests = [
            (each.trigger, tuple(assignment({each.resource.request_state: now.value}) for now in _REQUESTED))
            for each in program.requests
        ]
        update = program.operations[name].parts[OperationPart.PRE].update
        return _PackedStart(update, assignment(executes), tuple(requests))

    def executing(self, state: int) -> Iterator[int]:
        """Yield the states in which the operation executes and its requests are executing, succeeded and failed."""
        started = self.update(state)
        if started is None:
            return
        keep, bits = self.executes
        started = started & keep | bits
        sent = [assignments for trigger, assignments in self.requests if started & trigger]
        for index in range(len(_REQUESTED)):
            asked = started
            for assignments in sent:
                keep, bits = assignments[index]
                asked = asked & keep | bits
            yield asked


_REQUESTED = (RequestState.EXECUTING, RequestState.SUCCEEDED, RequestState.FAILED)
"""The states of requests that were sent."""


def _where(program: Program, state: int, cycle: tuple[str, ...]) -> str:
    """Return the values that the guards of the cycle read."""
    values = program.packing.values(state)
    transitions = [t for t in program.model.automatic_transitions if t.name in cycle]
    read = dict.fromkeys(name for transition in transitions for name in transition.running_guard.reads())
    return ", ".join(f"{name} == {values[name]}".replace("True", "true").replace("False", "false") for name in read)


def recovery_system(model: BehaviorModel) -> TransitionSystem:
    """Return what plans and recovery can do; the first moves start the operations, in their order."""
    weakening = _Weakening(model)
    moves = [weakening.start(operation) for operation in model.operations]
    for operation in model.operations:
        moves += weakening.ends(operation)
    for transition in model.automatic_transitions:
        moves.append(weakening.move(transition.name, transition.running_guard, transition.running_actions))
    moves += weakening.free_values()
    return TransitionSystem(model.running_space, tuple(moves))


def _changed_from_outside(model: BehaviorModel) -> Iterator[str]:
    """Yield the variables that change from outside by declaration.

    One that nothing assigns counts as an input elsewhere. Here it does not: the model may lack what assigns it.
    """
    undeclared = [variable.name for variable in model.variables if variable.source is not VariableSource.INPUT]
    by_others = [*moved(model), *(name for resource in model.resources for name in published_by(resource, model))]
    yield from (name for name in outside_values(model) if name not in undeclared or name in by_others)


class _Weakening:
    """Makes moves from the transitions of a model; a move is possible wherever its transition is."""

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        requests = [resource.request_state for resource in model.resources]
        runner = [v.name for v in model.running_space if v.role.is_runner and v.name != CURRENT_NAME]
        self._left_out = dict.fromkeys((*requests, *runner, *_changed_from_outside(model)))

    def start(self, operation: Operation) -> Move:
        """Return the start of an operation."""
        guard = conjunction([Equal(Reference(CURRENT_NAME), Constant(NO_OPERATION)), operation.pre.g])
        starting = (*operation.pre.running_actions, Assign(CURRENT_NAME, Constant(operation.name)))
        return self.move(operation.name, guard, starting)

    def ends(self, operation: Operation) -> Iterator[Move]:
        """Yield the completion, the timeout and the failure of an operation, and its end without actions.

        An automatic transition can fail it, and a run can abort it; then none of its own actions are taken.
        """
        ends = [(operation.post.running_guard, operation.post.running_actions), (TRUE, operation.timedout), (TRUE, ())]
        if operation.failed is not None:
            ends.append((operation.failed.running_guard, operation.failed.running_actions))
        is_current = Equal(Reference(CURRENT_NAME), Constant(operation.name))
        for guard, actions in ends:
            ending = (*actions, Assign(CURRENT_NAME, Constant(NO_OPERATION)))
            yield self.move(f"{operation.name} ends", conjunction([is_current, guard]), ending)

    def free_values(self) -> Iterator[Move]:
        """Yield moves that give any of their values to variables whose changes nothing here describes.

        These are measured variables, and those that copy a left-out one.
        """
        measured = [name for resource in self._model.resources for name in resource.measures]
        copies = [action.target for action in self._model.actions if self._reads_left_out(action)]
        for name in dict.fromkeys((*measured, *copies)):
            for value in self._model.running_space[name].domain.values:
                yield self.move(f"{name} changes", TRUE, [Assign(name, Constant(value))])

    def move(self, name: str, guard: Predicate, actions: Iterable[Action]) -> Move:
        """Return a move without conditions on left-out variables, and without actions that set or read them."""
        kept = [action for action in actions if action.target not in self._left_out]
        return Move(name, (MovePart(self._weakened(guard), tuple(a for a in kept if not self._reads_left_out(a))),))

    def _weakened(self, guard: Predicate) -> Predicate:
        """Return a guard that holds wherever `guard` holds: without conjuncts that read left-out variables."""
        if isinstance(guard, And):
            return conjunction(map(self._weakened, guard.operands))
        return TRUE if any(name in self._left_out for name in guard.reads()) else guard

    def _reads_left_out(self, action: Action) -> bool:
        return any(name in self._left_out for name in action.reads())
