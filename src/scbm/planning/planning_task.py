"""A model as the planner sees it: a transition system on packed integers (semantics 3.3).

Each operation is one move of two parts: it is enabled in S when `pre.g` holds in S and `post.g` holds in S' =
`pre.a`(S), and it leads to `post.a`(S'). Only relevant variables are packed: those that a guard, a goal or an action of
another packed variable reads. The others, such as the parameters of requests, cannot change which operations are
enabled. The variables of the runner are constant during planning.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from scbm.model import Packing
from scbm.planning.engines import Move, MovePart, TransitionSystem, narrowed, relevant

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from scbm.model import Action, BehaviorModel, Operation, Predicate, Value

    Step: TypeAlias = Callable[[int], int | None]
    Steps: TypeAlias = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Problem:
    """A goal with its packed task; the state to plan from is open.

    Attributes:
        is_goal: whether the goal holds in a packed state of the task.
    """

    model: BehaviorModel
    goal: Predicate
    task: Task
    is_goal: Callable[[int], bool]


def system_of(model: BehaviorModel) -> TransitionSystem:
    """Return the operations of a model as moves over all variables; no move changes the runner's variables."""
    return TransitionSystem(model.running_space, tuple(map(_move, model.operations)))


def _move(operation: Operation) -> Move:
    halves = (operation.pre, operation.post)
    return Move(operation.name, tuple(MovePart(half.g, half.a) for half in halves))


_MAX_CACHED = 200_000
"""Maximum number of states whose successors are cached for later searches on the same task."""


class Task:
    """The packed transition system of a model. The successors of states are cached.

    Attributes:
        packing: the fields of the relevant variables, in the order of the model.
        operations: the names of the operations, in the order of the model.
        successors: maps a packed state to the operations that are enabled in it, by index and in order, each with the
            state that it leads to.
    """

    def __init__(self, model: BehaviorModel, also: Iterable[str] = ()) -> None:
        """Pack a model; `also` names variables that are relevant besides those of the operations, such as a goal's."""
        system = system_of(model)
        self.packing = Packing(relevant(system, also))
        self.operations = tuple(move.name for move in system.moves)
        steps = tuple(_step(move, self.packing) for move in narrowed(system, self.packing.space).moves)
        self.successors: Callable[[int], Steps] = _SuccessorCache(steps).__getitem__

    def pack(self, state: Mapping[str, Value]) -> int:
        """Return a state of the world, packed; the runner's variables are at rest, whatever `state` says."""
        space = self.packing.space
        return self.packing.pack({v.name: v.initial if v.role.is_runner else state[v.name] for v in space})

    def update(self, actions: Iterable[Action]) -> Step:
        """Return actions as a function of packed states; `None` where they would leave a domain."""
        return self.packing.update(action for action in actions if action.target in self.packing.space)


class _SuccessorCache(dict[int, "Steps"]):
    """The successors of packed states, computed at the first look-up."""

    def __init__(self, steps: tuple[Step, ...]) -> None:
        super().__init__()
        self._steps = steps

    def __missing__(self, state: int) -> Steps:
        results = ((index, step(state)) for index, step in enumerate(self._steps))
        found = tuple((index, result) for index, result in results if result is not None)
        if len(self) < _MAX_CACHED:
            self[state] = found
        return found


def _step(move: Move, packing: Packing) -> Step:
    """Return the move as a function of packed states; `None` where it is not enabled or would leave a domain."""
    pre, post = move.parts
    pre_holds, post_holds = packing.test(pre.guard), packing.test(post.guard)
    start, complete = packing.update(pre.actions), packing.update(post.actions)

    def step(state: int) -> int | None:
        if not pre_holds(state):
            return None
        between = start(state)
        if between is None or not post_holds(between):
            return None
        return complete(between)

    return step
