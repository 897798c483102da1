"""Why no plan reaches a goal: the conjunct of a guard that stays false, from the state that comes nearest."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.proofs.nearest_misses import nearest_of
from scbm.closing.summaries import listed
from scbm.model.predicates import conjuncts
from scbm.model.sources import outside_values
from scbm.planning import explore

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.closing.proofs.nearest_misses import NearestMiss
    from scbm.model import BehaviorModel, Operation, Predicate, State
    from scbm.planning import Planner
    from scbm.planning.planning_task import Task

_MAX_STATES = 20_000
"""Maximum number of states that are explored for a reason; beyond it there is none."""

_MAX_LINES = 6
"""Maximum number of sentences: a chain of operations that is longer is cut off."""


def why_unreachable(planner: Planner, start: State, goal: Predicate) -> tuple[str, ...]:
    """Return which conjunct of the goal stays false, then that of each operation that would change it, and so on.

    Nothing is returned if there are too many states. All planning states that plans reach are compared.

    Args:
        planner: the planner of the model.
        start: the state in which plans begin.
        goal: a goal that no plan reaches.
    """
    task = planner.task(goal)
    reach = explore(task, [task.pack(start)], _MAX_STATES)
    if not reach.complete:
        return ()
    return tuple(_chain(planner.model, task, reach.states, goal))[:_MAX_LINES]


def _chain(model: BehaviorModel, task: Task, states: Sequence[int], goal: Predicate) -> Iterator[str]:
    """Yield a sentence for the goal, and for each operation on the way to it whose guard stays false."""
    todo: list[tuple[str, Predicate]] = [("the goal", goal)]
    seen: dict[str, None] = {}
    while todo:
        what, guard = todo.pop(0)
        miss = nearest_of(tuple(dict.fromkeys(conjuncts(guard))), states, task.packing)
        if miss is None:
            continue
        yield miss.words(what, f" in {_number(states)}", "a plan")
        changing = [each for each in model.operations if _may_change(each, miss)]
        if not changing:
            yield _unchanged(model, miss)
        for operation in changing:
            if operation.name not in seen:
                seen[operation.name] = None
                todo.append((operation.name, operation.pre.g))


def _number(states: Sequence[int]) -> str:
    return "the only state" if len(states) == 1 else f"any of the {len(states):,} states"


def _may_change(operation: Operation, miss: NearestMiss) -> bool:
    """Return whether an operation can make a conjunct that never holds hold: it assigns what the conjunct reads."""
    for part in miss.never:
        read = part.reads()
        for action in (*operation.pre.a, *operation.post.a):
            if action.target not in read:
                continue
            if len(read) > 1 or action.reads() or part.holds({action.target: action.value({})}):
                return True
    return False


def _unchanged(model: BehaviorModel, miss: NearestMiss) -> str:
    """Return that no operation makes conjuncts hold, and whether something outside the plans does."""
    outside = [name for part in miss.never for name in part.reads() if name in outside_values(model)]
    others = {action.target: None for each in model.automatic_transitions for action in each.running_actions}
    by_automatic = [name for part in miss.never for name in part.reads() if name in others]
    no_operation = f"no operation makes {listed(list(map(str, miss.never)))} true"
    if outside:
        return f"{no_operation}; {outside[0]} changes from outside, which plans do not count on"
    if by_automatic:
        return f"{no_operation}; an automatic transition changes {by_automatic[0]}, which plans do not count on"
    return f"{no_operation}: add one that assigns it, or plan from another state"
