"""The remaining parts of plans as numbers, so that positions can be compared: canonical plans, or any plans.

Of a canonical plan the operations that are left are known. Of any plans the state is known from which, by the planner's
rules, the rest starts. Which operation follows is decided one by one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeAlias

from scbm.planning import Solved, Unsolvable
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.running.untimed.situations import PlanningTooLargeError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from scbm.model import Packing, Value
    from scbm.planning import Answer
    from scbm.planning.planning_task import Steps

    FollowingOperation: TypeAlias = tuple[int, int]
    """The position of an operation in the model, and the number of the rest of the queue; `(-1, 0)` if plans end."""


class PlanQueues(Protocol):
    """Queues with numbers. 0 is no queue."""

    def of_answer(self, state: int, plan: Iterable[int]) -> int:
        """Return the queue of an answer of the planner: the state that was planned from, and the canonical plan."""
        ...

    def following(self, queue: int) -> tuple[FollowingOperation, ...]:
        """Return everything that can follow; nothing without a queue."""
        ...

    def planned(self, queue: int) -> Iterable[int]:
        """Return the operations of the plans; those of parts that were asked for before may be left out."""
        ...

    def content(self, queue: int) -> tuple[Value, ...] | None:
        """Return a queue: names of operations, or the values of a state; `None` if there is none."""
        ...


class CanonicalQueues:
    """The operations that are left of canonical plans; operations are numbered by their position in the model."""

    def __init__(self, names: Iterable[str]) -> None:
        """`names` are those of all operations."""
        self._names = tuple(names)
        self._cells: list[FollowingOperation] = [(-1, 0)]
        self._numbers: dict[FollowingOperation, int] = {}

    def of_answer(self, state: int, plan: Iterable[int]) -> int:  # noqa: ARG002 - the plan says it all
        """Return the queue of a plan."""
        queue = 0
        for operation in reversed(tuple(plan)):
            cell = (operation, queue)
            if cell not in self._numbers:
                self._numbers[cell] = len(self._cells)
                self._cells.append(cell)
            queue = self._numbers[cell]
        return queue

    def following(self, queue: int) -> tuple[FollowingOperation, ...]:
        """Return the next operation with the rest; nothing without a queue."""
        return (self._cells[queue],) if queue else ()

    def planned(self, queue: int) -> Iterable[int]:
        """Return the operations of a queue, in order, each once."""
        return dict.fromkeys(self._operations(queue))

    def content(self, queue: int) -> tuple[Value, ...] | None:
        """Return the names of the operations of a queue."""
        return tuple(self._names[number] for number in self._operations(queue)) or None

    def _operations(self, queue: int) -> Iterator[int]:
        while queue:
            operation, queue = self._cells[queue]
            yield operation


class AnyPlanQueues:
    """The states from which the rest of any plan starts."""

    def __init__(  # noqa: PLR0913, PLR0917 - what a planner knows of its states, and its limit
        self,
        packing: Packing,
        translate: Callable[[int], int],
        plan: Callable[[int], Answer],
        successors: Callable[[int], Steps],
        is_goal: Callable[[int], bool],
        most: int,
    ) -> None:
        """Prepare the queues of one goal.

        Args:
            packing: packs the states of the planner.
            translate: returns a state of the runner as the planner packs it.
            plan: the canonical planner's answer in a state of the planner.
            successors: the operations that are enabled in a state of the planner, with the states that they lead to.
            is_goal: whether the goal holds in a state of the planner.
            most: maximum number of states that searches may expand together.
        """
        self._packing = packing
        self._translate = translate
        self._plan = plan
        self._successors = successors
        self._is_goal = is_goal
        self._left = most
        self._states = [0]
        self._numbers: dict[int, int] = {}
        self._following: dict[int, tuple[FollowingOperation, ...]] = {}
        self._planned_from: dict[int, None] = {}

    def of_answer(self, state: int, plan: Iterable[int]) -> int:  # noqa: ARG002 - other plans are possible, too
        """Return the queue that starts in the state that was planned from."""
        return self._number(self._translate(state))

    def following(self, queue: int) -> tuple[FollowingOperation, ...]:
        """Return everything that can follow. Raises `PlanningTooLargeError`."""
        if queue not in self._following:
            self._following[queue] = tuple(self._find_following(self._states[queue])) if queue else ()
        return self._following[queue]

    def planned(self, queue: int) -> Iterable[int]:
        """Return the operations of the plans that no earlier call has returned for the same states, each once."""
        found: dict[int, None] = {}

        def rests(here: int) -> Iterator[FollowingOperation]:
            if here in self._planned_from:
                return
            self._planned_from[here] = None
            for operation, rest in self.following(here):
                if rest:
                    found[operation] = None
                    yield operation, rest

        BreadthFirst((queue,), rests).expand_all()
        return found

    def content(self, queue: int) -> tuple[Value, ...] | None:
        """Return the values of the state."""
        if not queue:
            return None
        values: Mapping[str, bool | int | str] = self._packing.values(self._states[queue])
        return tuple(values[v.name] for v in self._packing.space if not v.role.is_runner)

    def _number(self, state: int) -> int:
        if state not in self._numbers:
            self._numbers[state] = len(self._states)
            self._states.append(state)
        return self._numbers[state]

    def _find_following(self, state: int) -> Iterator[FollowingOperation]:
        for operation, after in self._successors(state):
            if self._reaches_goal(after):
                yield operation, self._number(after)
        if self._is_goal(state):
            yield -1, 0

    def _reaches_goal(self, state: int) -> bool:
        """Return whether there is a plan from a state."""
        answer = self._plan(state)
        self._left -= answer.expanded
        if self._left < 0:
            raise PlanningTooLargeError
        if not isinstance(answer, Solved | Unsolvable):
            raise PlanningTooLargeError
        return isinstance(answer, Solved)
