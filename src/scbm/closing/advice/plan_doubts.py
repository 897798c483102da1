"""Doubts about plans: operations that are never enabled, unreachable goals, and actions that leave a domain."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING

from scbm.closing.advice.doubts import Doubt
from scbm.model import InitialStates, Slug, State, format_value
from scbm.planning import LimitReached, PlanLimits, Planner, Reach, Unsolvable, explore

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel, Predicate, Transition
    from scbm.planning import Task

MAX_STATES = 50_000
"""Maximum number of planning states that are explored."""

_MAX_STARTS = 200
"""Maximum number of initial states that are explored from."""

_MAX_EXPANSIONS = 100_000
"""Maximum number of expanded states to find out from which initial states a goal is reachable."""

_MAX_COMBINATIONS = 20_000
"""Maximum number of combinations of random values that are enumerated for initial states."""


@dataclass(frozen=True, slots=True)
class PlanningExploration:
    """The allowed initial states, and the planning states that operations reach from them.

    Attributes:
        planner: the planner of the model.
        starts: allowed initial states, in order.
        all_starts: whether these are all.
        reach: the planning states that are reachable from them, without the effects of requests and the runner.
    """

    planner: Planner
    starts: tuple[State, ...]
    all_starts: bool
    reach: Reach


def explore_model(model: BehaviorModel) -> PlanningExploration:
    """Explore the planning states of a model, within the limits."""
    planner = Planner(model)
    initial = InitialStates(model)
    starts = tuple(islice(initial.allowed(_MAX_COMBINATIONS), _MAX_STARTS + 1))
    complete = initial.combinations <= _MAX_COMBINATIONS and len(starts) <= _MAX_STARTS
    starts = starts[:_MAX_STARTS]
    task = planner.base_task
    reach = explore(task, [task.pack(state) for state in starts], MAX_STATES)
    return PlanningExploration(planner, starts, complete, reach)


def doubts_about_plans(model: BehaviorModel, exploration: PlanningExploration) -> Iterator[Doubt]:
    """Yield doubts about missing initial states, operations never enabled, unreachable goals, and domains left."""
    if not exploration.starts:
        message = "no initial state was found that satisfies `initial_states`"
        slug = Slug.NO_INITIAL_STATE if exploration.all_starts else Slug.CHECK_INCOMPLETE
        yield Doubt(slug, message, ("initial_states",))
        return
    yield from _never_enabled(exploration)
    yield from _domains_left(model, exploration)
    for name, goal in model.goals:
        yield from _unreachable(name, goal, exploration)


def _never_enabled(exploration: PlanningExploration) -> Iterator[Doubt]:
    task = exploration.planner.base_task
    enabled: dict[int, None] = {}
    for state in exploration.reach.states:
        enabled.update(dict.fromkeys(operation for operation, _ in task.successors(state)))
    for index, name in enumerate(task.operations):
        if index not in enabled and exploration.reach.complete and exploration.all_starts:
            count = len(exploration.reach.states)
            where = f"in none of the {count} states" if count > 1 else "not in the only state"
            message = f"{name} is enabled {where} that plans can reach"
            yield Doubt(Slug.OPERATION_NEVER_ENABLED, message, ("operations", name, "pre", "g"))
    if not exploration.reach.complete:
        message = f"plans reach more than {MAX_STATES} states, and the exploration ended there"
        yield Doubt(Slug.CHECK_INCOMPLETE, message, ("operations",))


def _domains_left(model: BehaviorModel, exploration: PlanningExploration) -> Iterator[Doubt]:
    """Yield a doubt for actions that would leave a domain in a reachable state with their guard (semantics 2.4)."""
    task = exploration.planner.base_task
    for operation in model.operations:
        here = ("operations", operation.name)
        can_start, can_complete = task.packing.test(operation.pre.g), task.packing.test(operation.post.g)
        enabled = [state for state in exploration.reach.states if can_start(state)]
        yield from _leaving(operation.pre, (*here, "pre", "a"), enabled, task)
        started = [state for state in map(task.update(operation.pre.a), enabled) if state is not None]
        done = [state for state in started if can_complete(state)]
        yield from _leaving(operation.post, (*here, "post", "a"), done, task)


def _leaving(transition: Transition, path: tuple[str, ...], states: Sequence[int], task: Task) -> Iterator[Doubt]:
    """Yield a doubt with the first state in which the actions of the transition would leave a domain."""
    update = task.update(transition.a)
    for state in states:
        if update(state) is None:
            values = task.packing.values(state)
            read = dict.fromkeys(name for action in transition.a for name in action.reads() if name in values)
            shown = ", ".join(f"{name} == {format_value(values[name])}" for name in read)
            message = f"`a` of {transition.name} would leave a domain where {shown}, so it cannot be taken there"
            yield Doubt(Slug.DOMAIN_LEFT, message, path)
            return


def _unreachable(name: str, goal: Predicate, exploration: PlanningExploration) -> Iterator[Doubt]:
    """Yield a doubt if a goal is unreachable from some or all initial states."""
    lost: list[State] = []
    left = _MAX_EXPANSIONS
    for tried, start in enumerate(exploration.starts):
        answer = exploration.planner.plan(start, goal, PlanLimits(expansions=left))
        left -= answer.expanded
        if isinstance(answer, LimitReached):
            message = f"the search for plans to the goal {name} was given up after {tried} initial states"
            yield Doubt(Slug.CHECK_INCOMPLETE, message, ("goals", name))
            return
        if isinstance(answer, Unsolvable):
            lost.append(start)
    if len(lost) == len(exploration.starts):
        count = "any" if exploration.all_starts else f"any of {len(lost)}"
        message = f"no plan reaches the goal {name} from {count} initial state{'' if exploration.all_starts else 's'}"
        yield Doubt(Slug.GOAL_UNREACHABLE, message, ("goals", name))
    elif lost:
        message = f"no plan reaches the goal {name} from {len(lost)} of {len(exploration.starts)} initial states"
        yield Doubt(Slug.GOAL_NOT_ALWAYS_REACHABLE, message, ("goals", name), f"one of them: {_drawn(lost[0])}")


def _drawn(state: State) -> str:
    """Return the values by which an initial state differs from the nominal one."""
    drawn = [v.name for v in state.space if state[v.name] != v.initial]
    return ", ".join(f"{name} == {format_value(state[name])}" for name in drawn) or "the nominal one"
