"""Why no plan reaches a goal: the conjunct of a guard that stays false, from the state that comes nearest."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct

from scbm.closing.proofs.blame import parts_of
from scbm.closing.proofs.nearest_misses import (
    distance,
    in_words,
    lacking_comparisons,
    listed_values,
    nearest_of,
    nearest_state,
    values_read,
)
from scbm.closing.summaries import listed
from scbm.model import conjunction
from scbm.model.sources import inputs, moved, outside_values
from scbm.planning import explore

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

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
    return tuple(each.text for each in islice(_sentences(planner, start, goal), _MAX_LINES))


def root_of_unreachable(planner: Planner, start: State, goal: Predicate) -> str | None:
    """Return the first of all reasons that does not rest on another one; `None` if none is found."""
    return next((each.text for each in _sentences(planner, start, goal) if each.is_root), None)


def _sentences(planner: Planner, start: State, goal: Predicate) -> Iterator[_WhyNot]:
    task = planner.task(goal)
    reach = explore(task, [task.pack(start)], _MAX_STATES)
    if reach.complete:
        yield from _Chain(planner.model, task, reach.states).sentences(goal)


class _WhyNot(NamedTuple):
    text: str
    is_root: bool = False


class _Chain(Struct, frozen=True):
    """The operations on the way to a goal that no plan reaches.

    Attributes:
        model: the model.
        task: its operations as moves between packed states.
        states: all states that plans reach.
    """

    model: BehaviorModel
    task: Task
    states: Sequence[int]

    def sentences(self, goal: Predicate) -> Iterator[_WhyNot]:
        """Yield a sentence for the goal, and for each operation on the way to it whose guard stays false."""
        miss = nearest_of(parts_of([goal]), self.states, self.task.packing)
        todo = [("the goal", miss)] if miss else []
        seen: dict[str, None] = {}
        while todo:
            what, miss = todo.pop(0)
            yield _WhyNot(miss.words(what, f" in {_number(self.states)}", "a plan"))
            for state, lacking in self._lacking(miss):
                changing = self._changing(lacking)
                if not changing and lacking.reads():
                    yield _WhyNot(_unchanged(self.model, lacking), is_root=True)
                for operation in changing:
                    if operation.name in seen:
                        continue
                    seen[operation.name] = None
                    found = self._blocked(operation)
                    if found is not None:
                        todo.append(found)
                    else:
                        yield from self._why_not(operation, lacking, state, miss)

    def _lacking(self, miss: NearestMiss) -> Iterator[tuple[int, Predicate]]:
        """Yield the comparisons that each blamed conjunct lacks in the nearest state in which the others hold."""
        packing = self.task.packing
        for part in miss.never:
            others = packing.test(conjunction(each for each in miss.never if each is not part))
            state = nearest_state(miss.never, filter(others, self.states), packing)
            yield from ((state, each) for each in lacking_comparisons(part, packing.values(state)))

    def _changing(self, lacking: Predicate) -> Sequence[Operation]:
        """Return the operations that may bring a comparison nearer; if none does, all that may change it.

        Guards do not count. An operation that copies variables which the comparison does not read may bring it nearer.
        """
        assigning = [each for each in self.model.operations if _may_change(each, lacking)]
        read = self.task.packing.reader(lacking.reads())
        different = {read(state): state for state in self.states}.values()
        nearer = [each for each in assigning if _copies(each, lacking) or self._is_nearer(each, lacking, different)]
        return nearer or assigning

    def _is_nearer(self, operation: Operation, lacking: Predicate, states: Iterable[int]) -> bool:
        """Return whether a comparison is nearer after the actions of an operation in one of some states."""
        start, end = (self.task.update(part.a) for part in (operation.pre, operation.post))
        values = self.task.packing.values
        after = ((state, None if (started := start(state)) is None else end(started)) for state in states)
        return any(
            changed is not None and distance(lacking, values(changed)) < distance(lacking, values(state))
            for state, changed in after
        )

    def _blocked(self, operation: Operation) -> tuple[str, NearestMiss] | None:
        """Return the part of an operation that stays false in plans, and its nearest miss."""
        packing = self.task.packing
        miss = nearest_of(parts_of([operation.pre.g]), self.states, packing)
        if miss is not None:
            return operation.name, miss
        can_start, start = packing.test(operation.pre.g), self.task.update(operation.pre.a)
        started = [start(state) for state in self.states if can_start(state)]
        after = [state for state in started if state is not None]
        miss = nearest_of(parts_of([operation.post.g]), after, packing)
        return None if miss is None else (f"the postcondition of {operation.name}", miss)

    def _why_not(self, operation: Operation, lacking: Predicate, state: int, miss: NearestMiss) -> Iterator[_WhyNot]:
        """Yield why an operation does not make a comparison hold in a state: its guard, or what else it changes."""
        packing = self.task.packing
        read = values_read(miss.never, state, packing)
        equal = [each for each in self.states if values_read(miss.never, each, packing) == read]
        steps = (step for each in equal for step in self.task.successors(each))
        after = next((after for index, after in steps if self.task.operations[index] == operation.name), None)
        if after is not None:
            broken = [part for part in miss.never if not part.holds(packing.values(after))]
            if broken and lacking.holds(packing.values(after)):
                yield _WhyNot(f"{operation.name} makes {lacking} true, but {in_words(broken)} false", is_root=True)
            return
        own = nearest_of(parts_of([operation.pre.g]), equal, packing)
        if own is not None and self._is_nearer(operation, lacking, [state]):
            targets = [action.target for action in (*operation.pre.a, *operation.post.a)]
            names = listed([name for name in lacking.reads() if name in targets])
            needs = in_words(own.never)
            yield _WhyNot(f"with {listed_values(read)}, {operation.name} would change {names}, but needs {needs}")


def _number(states: Sequence[int]) -> str:
    return "the only state" if len(states) == 1 else f"any of the {len(states):,} states"


def _may_change(operation: Operation, part: Predicate) -> bool:
    """Return whether an operation can make a comparison hold: it assigns what the comparison reads."""
    read = part.reads()
    for action in (*operation.pre.a, *operation.post.a):
        if action.target in read and (len(read) > 1 or action.reads() or part.holds({action.target: action.value({})})):
            return True
    return False


def _copies(operation: Operation, part: Predicate) -> bool:
    """Return whether an operation gives a variable of a comparison a value that depends on other variables."""
    read = part.reads()
    actions = [action for action in (*operation.pre.a, *operation.post.a) if action.target in read]
    return any(name not in read for action in actions for name in action.reads())


def _unchanged(model: BehaviorModel, part: Predicate) -> str:
    """Return that no operation makes a comparison hold, and whether something outside the plans does."""
    outside = [name for name in part.reads() if name in outside_values(model)]
    others = {action.target: None for each in model.automatic_transitions for action in each.running_actions}
    by_automatic = [name for name in part.reads() if name in others]
    no_operation = f"no operation makes {part} true"
    if outside:
        name = outside[0]
        if model.space[name].source is None and name in inputs(model) and name not in moved(model):
            return f"{no_operation}: nothing assigns {name}, so it is an input; add an operation that assigns it"
        return f"{no_operation}; {name} changes from outside, which plans do not count on"
    measured = next(((r.name, name) for r in model.resources for name in part.reads() if name in r.measures), None)
    if measured:
        resource, name = measured
        return (
            f"{no_operation}; {resource} measures {name}, which plans do not count on: "
            f"let an operation that asks {resource} assign the value that it should find"
        )
    if by_automatic:
        return f"{no_operation}; an automatic transition changes {by_automatic[0]}, which plans do not count on"
    return f"{no_operation}: add one that assigns it, or plan from another state"
