"""Slow, obvious references that the real packages are compared with. They share only the model with them."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from scbm.model import BehaviorModel, Predicate, State
from scbm.model.operations import apply

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import Value


def world(model: BehaviorModel, state: Mapping[str, Value]) -> State:
    """A state with the runner's variables at rest."""
    return State(model.running_space, {v.name: state.get(v.name, v.initial) for v in model.running_space})


def step(model: BehaviorModel, name: str, state: State) -> State | None:
    """An operation as one step of planning."""
    operation = model.operation(name)
    if not operation.pre.g.holds(state):
        return None
    between = apply(operation.pre.a, state)
    if between is None or not operation.post.g.holds(between):
        return None
    return apply(operation.post.a, between)


def canonical_plan(
    model: BehaviorModel, state: Mapping[str, Value], goal: Predicate, most: int
) -> tuple[str, ...] | None:
    """The canonical plan of at most `most` operations, by looking at all shortest plans and taking the least.

    Distances come first, from a search that keeps no paths; then the least path is read off them operation by
    operation. `None` if no plan is so short.
    """
    start = world(model, state)
    names = [operation.name for operation in model.operations]
    distance = {start: 0}
    queue = deque([start])
    goals = [start] if goal.holds(start) else []
    while queue:
        now = queue.popleft()
        for name in names:
            after = step(model, name, now)
            if after is not None and after not in distance:
                distance[after] = distance[now] + 1
                queue.append(after)
                if goal.holds(after):
                    goals.append(after)
    shortest = min((distance[found] for found in goals), default=None)
    if shortest is None or shortest > most:
        return None
    return _least(model, [start], goal, shortest, names)


def _least(model: BehaviorModel, path: list[State], goal: Predicate, left: int, names: list[str]) -> tuple[str, ...]:
    """The first of all plans with exactly `left` more operations, tried in order; dead ends are remembered."""
    dead: dict[tuple[State, int], None] = {}

    def search(state: State, more: int) -> tuple[str, ...] | None:
        if more == 0:
            return () if goal.holds(state) else None
        if (state, more) in dead:
            return None
        for name in names:
            after = step(model, name, state)
            rest = None if after is None else search(after, more - 1)
            if rest is not None:
                return (name, *rest)
        dead[state, more] = None
        return None

    found = search(path[0], left)
    assert found is not None
    return found


def reachable(model: BehaviorModel, state: Mapping[str, Value]) -> list[State]:
    """All states of the world that operations can reach."""
    start = world(model, state)
    found = {start: None}
    queue = deque([start])
    while queue:
        now = queue.popleft()
        for operation in model.operations:
            after = step(model, operation.name, now)
            if after is not None and after not in found:
                found[after] = None
                queue.append(after)
    return list(found)
