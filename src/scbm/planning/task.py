"""A model as the planner sees it, on packed integers.

Only variables that planning can tell apart are packed: those that a guard, a goal or an action of another packed
variable reads. The rest (commands that requests carry, counters of the runner) cannot change what is possible.
An operation is one step (semantics 3.3): enabled in S when `pre.g` holds in S and `post.g` in S' = `pre.a`(S);
its result is `post.a`(S'). The runner's variables stand still while a plan is made.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.model import Action, Add, Assign, BehaviorModel, Operation, Packing, Reference, StateSpace, Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    Step: TypeAlias = Callable[[int], int | None]

_MOST_REMEMBERED = 200_000
"""States whose successors are kept for the next search on the same task."""


class Task:
    """The packed transition system of a model. Remembers the successors of states it has seen.

    Attributes:
        packing: the fields of the variables that matter, in the order of the model.
        operations: the names of the operations, in the order of the model.
    """

    def __init__(self, model: BehaviorModel, also: Iterable[str] = ()) -> None:
        """Packs a model; `also` names variables that matter for more than the operations, such as a goal's."""
        relevant = _relevant(model, also)
        self.packing = Packing(StateSpace(variable for variable in model.running_space if variable.name in relevant))
        self.operations = tuple(operation.name for operation in model.operations)
        self._steps = tuple(_step(operation, self.packing) for operation in model.operations)
        self._seen: dict[int, tuple[tuple[int, int], ...]] = {}

    def pack(self, state: Mapping[str, Value]) -> int:
        """The state of the world as this task packs it; the runner's variables are at rest, whatever `state` says."""
        space = self.packing.space
        return self.packing.pack({v.name: v.initial if v.role.is_runner else state[v.name] for v in space})

    def update(self, actions: Iterable[Action]) -> Step:
        """Actions as a function of packed states; `None` where they would leave a domain."""
        return _update(actions, self.packing)

    def successors(self, state: int) -> tuple[tuple[int, int], ...]:
        """Each operation that is enabled, by its index and in order, with the state that it leads to."""
        known = self._seen.get(state)
        if known is None:
            results = ((index, step(state)) for index, step in enumerate(self._steps))
            known = tuple((index, result) for index, result in results if result is not None)
            if len(self._seen) < _MOST_REMEMBERED:
                self._seen[state] = known
        return known


def _step(operation: Operation, packing: Packing) -> Step:
    """The operation as one step; `None` where it is not enabled or would leave a domain."""
    pre_holds, post_holds = packing.test(operation.pre.g), packing.test(operation.post.g)
    start, complete = _update(operation.pre.a, packing), _update(operation.post.a, packing)

    def step(state: int) -> int | None:
        if not pre_holds(state):
            return None
        between = start(state)
        if between is None or not post_holds(between):
            return None
        return complete(between)

    return step


def _update(actions: Iterable[Action], packing: Packing) -> Step:
    """Those of the actions that planning can tell, at once."""
    return packing.update(action for action in actions if action.target in packing.space)


def _relevant(model: BehaviorModel, also: Iterable[str]) -> frozenset[str]:
    """The variables that planning can tell apart: read by a guard, or by an action that matters."""
    guards = [part for operation in model.operations for part in (operation.pre.g, operation.post.g)]
    actions = [a for operation in model.operations for a in (*operation.pre.a, *operation.post.a)]
    found = {name for guard in guards for name in guard.reads()} | set(also)
    found |= {action.target for action in actions if _may_leave(action, model.running_space)}
    while True:
        read = {name for action in actions if action.target in found for name in action.reads()}
        if read <= found:
            return frozenset(found)
        found |= read


def _may_leave(action: Action, space: StateSpace) -> bool:
    """Whether the action can leave its domain, so that it decides whether the step can be taken."""
    if isinstance(action, Add):
        return True
    assert isinstance(action, Assign)  # noqa: S101 - for the reader: there are two kinds of actions
    if not isinstance(action.source, Reference):
        return False
    target = space[action.target].domain
    return any(value not in target for value in space[action.source.name].domain.values)
