"""The checker's own planner: canonical plans by search over named states (semantics 4), and the plans of proofs (9.3).

It shares no code with `scbm.planning`, so a fault there cannot make a wrong certificate look sound. It is slower and
has no heuristics and no packed states; it memoizes successors and answers instead.

Of canonical plans the operations that are left are known. Of any plans it is known from which state, by the planner's
rules, the rest of a plan starts; which operations follow is decided one by one: the goal can be reached after them.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Protocol, TypeAlias

from msgspec import Struct

from scbm.model import PlanSet
from scbm.proofcheck.guarded_parts import GuardedRule, may_leave

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import Action, BehaviorModel, Predicate, Value
    from scbm.proofcheck.certificate import Queue

    Following: TypeAlias = tuple[str | None, Queue]
    """An operation that can follow, and the rest of the plan then; `None` if the plan ends here."""

    WorldState: TypeAlias = tuple[Value, ...]
    """A value for each variable that can influence a plan, in the order of the model."""


MAX_PLANNING_STATES = 1_000_000
"""Maximum number of states that one search may find: as many as the planner of a run may expand (semantics 4.1)."""


class PlanFound(Struct, frozen=True):
    """The goal can be reached; `operations` is the canonical plan."""

    operations: tuple[str, ...]


class NoPlanExists(Struct, frozen=True):
    """The search found all reachable states, and the goal holds in none of them."""


class PlanningLimitReached(Struct, frozen=True):
    """The search found the maximum number of states, and the goal holds in none of them: nothing is known."""


PlanAnswer: TypeAlias = PlanFound | NoPlanExists | PlanningLimitReached


class PlannedStates:
    """The states that plans of one model for one goal go through.

    Attributes:
        names: the variables on which plans depend, in the order of the model.
    """

    def __init__(self, model: BehaviorModel, goal: Predicate) -> None:
        read = _planning_variables(model, goal)
        self.names = tuple(name for name in model.space.names if name in read)
        self._at_rest = {v.name: v.initial for v in model.running_space if v.role.is_runner}
        self._goal = goal

        def half(name: str, guard: Predicate, actions: tuple[Action, ...]) -> GuardedRule:
            kept = tuple(action for action in actions if action.target in self.names)
            return GuardedRule(name, guard, kept, tuple(model.space[action.target].domain for action in kept))

        self._operations = tuple(
            (o.name, half(o.name, o.pre.g, o.pre.a), half(o.name, o.post.g, o.post.a)) for o in model.operations
        )
        self._successors: dict[WorldState, tuple[tuple[str, WorldState], ...]] = {}

    def start(self, values: Mapping[str, Value]) -> WorldState:
        """Return the state to plan from. Variables of the runner are at rest in it (4.1).

        Args:
            values: a value for each variable that can influence a plan, at least. Every variable that a certificate
                may not omit is among them (`runs_check`).
        """
        return tuple(values[name] for name in self.names)

    def is_goal(self, state: WorldState) -> bool:
        """Return whether the goal holds in a state."""
        return self._goal.holds(self._named(state))

    def _named(self, state: WorldState) -> dict[str, Value]:
        return {**self._at_rest, **dict(zip(self.names, state, strict=True))}

    def successors(self, state: WorldState) -> tuple[tuple[str, WorldState], ...]:
        """Return the enabled operations in the order of the model, each with the state that it leads to (3.3)."""
        if state not in self._successors:
            before = self._named(state)
            found = []
            for name, pre, post in self._operations:
                between = pre.taken(before)
                after = None if between is None else post.taken(between)
                if after is not None:
                    found.append((name, tuple(after[variable] for variable in self.names)))
            self._successors[state] = tuple(found)
        return self._successors[state]


class CanonicalPlanner:
    """Plans of one model for one goal."""

    def __init__(self, model: BehaviorModel, goal: Predicate) -> None:
        self._states = PlannedStates(model, goal)
        self._answers: dict[WorldState, PlanAnswer] = {}

    def plan(self, values: Mapping[str, Value]) -> PlanAnswer:
        """Return the canonical plan from a state, or why there is none; `values` as in `PlannedStates.start`."""
        start = self._states.start(values)
        if start not in self._answers:
            self._search(start)
        return self._answers[start]

    def _search(self, start: WorldState) -> None:
        """Find the answer for `start` breadth-first.

        States are visited in the order of their shortest paths, and paths of the same length in the lexicographic
        order of operations: each state is found first on its canonical path. So the first goal state found ends the
        canonical plan. The rest of a canonical plan is canonical as well. If no goal state is reachable from `start`,
        none is reachable from any successor.
        """
        parents: dict[WorldState, tuple[WorldState, str] | None] = {start: None}
        frontier = deque([start])
        if self._states.is_goal(start):
            self._answers[start] = PlanFound(())
            return
        while frontier:
            state = frontier.popleft()
            for operation, successor in self._states.successors(state):
                if successor in parents:
                    continue
                parents[successor] = (state, operation)
                if self._states.is_goal(successor):
                    self._answer_path(parents, successor)
                    return
                if len(parents) > MAX_PLANNING_STATES:
                    self._answers[start] = PlanningLimitReached()
                    return
                frontier.append(successor)
        self._answers.update(dict.fromkeys(parents, NoPlanExists()))

    def _answer_path(self, parents: Mapping[WorldState, tuple[WorldState, str] | None], state: WorldState) -> None:
        """Answer for every state on the path that ends in the goal state `state`."""
        plan: tuple[str, ...] = ()
        self._answers[state] = PlanFound(plan)
        while (step := parents[state]) is not None:
            state, operation = step
            plan = (operation, *plan)
            self._answers[state] = PlanFound(plan)


def _planning_variables(model: BehaviorModel, goal: Predicate) -> dict[str, None]:
    """Return the variables on which plans depend, directly or through an action. All others only multiply states."""
    halves = [half for operation in model.operations for half in (operation.pre, operation.post)]
    actions = [action for half in halves for action in half.a]
    found = dict.fromkeys([*goal.reads(), *(name for half in halves for name in half.g.reads())])
    found |= {action.target: None for action in actions if may_leave(action, model.running_space)}
    known = 0
    while known < len(found):
        known = len(found)
        found |= {name: None for action in actions if action.target in found for name in action.reads()}
    return found


class PlansFound(Struct, frozen=True):
    """There are plans; `queue` stands for all of them."""

    queue: Queue


PlansAnswer: TypeAlias = PlansFound | NoPlanExists | PlanningLimitReached


class CheckedPlans(Protocol):
    """The plans to one goal that the runner may get."""

    names: tuple[str, ...]
    """The variables of a queue that is a state; empty if queues are operations."""

    def answer(self, values: Mapping[str, Value]) -> PlansAnswer:
        """Return the plans from a state, or why there are none."""
        ...

    def following(self, queue: Queue) -> Sequence[Following]:
        """Return everything that can follow in the plans; nothing without a plan."""
        ...

    def queued(self, queue: Queue) -> Iterator[str]:
        """Yield the operations of the plans; those of parts that were asked for before may be left out."""
        ...


def plans_of(plan_set: PlanSet, model: BehaviorModel, goal: Predicate) -> CheckedPlans:
    """Return the plans of a set."""
    return CanonicalPlans(model, goal) if plan_set is PlanSet.CANONICAL else AnyPlans(model, goal)


class CanonicalPlans:
    """The canonical plans to one goal."""

    def __init__(self, model: BehaviorModel, goal: Predicate) -> None:
        self.names: tuple[str, ...] = ()
        self._planner = CanonicalPlanner(model, goal)

    def answer(self, values: Mapping[str, Value]) -> PlansAnswer:
        """Return the canonical plan from a state, or why there is none."""
        answer = self._planner.plan(values)
        return PlansFound(answer.operations or None) if isinstance(answer, PlanFound) else answer

    @staticmethod
    def following(queue: Queue) -> Sequence[Following]:
        """Return the next operation; nothing without a plan."""
        return ((str(queue[0]), queue[1:] or None),) if queue else ()

    @staticmethod
    def queued(queue: Queue) -> Iterator[str]:
        """Yield the operations of the plan."""
        return map(str, queue or ())


class AnyPlans:
    """Any plans to one goal."""

    def __init__(self, model: BehaviorModel, goal: Predicate) -> None:
        self._states = PlannedStates(model, goal)
        self.names = self._states.names
        self._reaches_goal: dict[WorldState, bool] = {}
        self._queued_from: dict[WorldState, None] = {}

    def answer(self, values: Mapping[str, Value]) -> PlansAnswer:
        """Return the plans from a state, or why there are none."""
        start = self._states.start(values)
        if not self._know(start):
            return PlanningLimitReached()
        return PlansFound(start) if self._reaches_goal[start] else NoPlanExists()

    def following(self, queue: Queue) -> Sequence[Following]:
        """Return everything that can follow in the plans."""
        if queue is None or not self._know(queue):
            return ()
        following = self._states.successors(queue)
        found: list[Following] = [(operation, after) for operation, after in following if self._reaches_goal[after]]
        return (*found, (None, None)) if self._states.is_goal(queue) else tuple(found)

    def queued(self, queue: Queue) -> Iterator[str]:
        """Yield the operations of the plans that no earlier call has yielded for the same states."""
        todo = [] if queue is None else [queue]
        while todo:
            state = todo.pop()
            if state in self._queued_from:
                continue
            self._queued_from[state] = None
            for operation, rest in self.following(state):
                if operation is not None and rest is not None:
                    yield operation
                    todo.append(rest)

    def _know(self, start: WorldState) -> bool:
        """Return whether it is known which states after `start` reach the goal; search within the limit."""
        if start in self._reaches_goal:
            return True
        before: dict[WorldState, list[WorldState]] = {start: []}
        todo = [start]
        while todo:
            state = todo.pop()
            for _, after in self._states.successors(state):
                if after not in before:
                    before[after] = []
                    if after not in self._reaches_goal:
                        todo.append(after)
                before[after].append(state)
            if len(before) > MAX_PLANNING_STATES:
                return False
        self._mark(before)
        return True

    def _mark(self, before: Mapping[WorldState, Sequence[WorldState]]) -> None:
        """Note which states reach the goal; `before` has the predecessors of each, and of known states that follow."""
        known = self._reaches_goal
        todo = [state for state in before if (known[state] if state in known else self._states.is_goal(state))]
        found = dict.fromkeys(todo)
        while todo:
            for state in before[todo.pop()]:
                if state not in found:
                    found[state] = None
                    todo.append(state)
        for state in before:
            known.setdefault(state, state in found)
