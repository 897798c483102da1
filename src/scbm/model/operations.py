"""Actions, running transitions and operations (paper, Sections II and IV; semantics 2.3, 3.1 and 3.2).

The actions of one transition happen at once.
"""

from __future__ import annotations

from math import prod
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.model.predicates import TRUE, Predicate, Term, conjunction

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.model.values import Value
    from scbm.model.variables import State


class Assign(Struct, frozen=True):
    """`target <- source`."""

    target: str
    source: Term

    def value(self, state: Mapping[str, Value]) -> Value:
        """Return the assigned value, read from the state before the transition."""
        return self.source.value(state)

    def reads(self) -> tuple[str, ...]:
        """Return the variables of the right-hand side."""
        return self.source.reads()

    def __str__(self) -> str:
        return f"{self.target} <- {self.source}"


class Add(Struct, frozen=True):
    """`target += amount`; a negative amount is written `target -= …`. For integer ranges only; never 0."""

    target: str
    amount: int

    def value(self, state: Mapping[str, Value]) -> Value:
        """Return the assigned value, read from the state before the transition; it may be outside the domain."""
        return int(state[self.target]) + self.amount

    def reads(self) -> tuple[str, ...]:
        """Return the target."""
        return (self.target,)

    def __str__(self) -> str:
        return f"{self.target} {'+=' if self.amount > 0 else '-='} {abs(self.amount)}"


Action: TypeAlias = Assign | Add
"""What a transition does to one variable."""


def apply(actions: Iterable[Action], state: State) -> State | None:
    """Return the state after all `actions` at once; `None` if one of them would leave a domain (semantics 2.4)."""
    changes = {action.target: action.value(state) for action in actions}
    for name, value in changes.items():
        if value not in state.space[name].domain:
            return None
    return state.replace(changes)


MAX_SUM_CASES = 2_000
"""Maximum number of cases into which sums divide the steps of one operation or transition."""


def count_sum_cases(actions: Iterable[Action], sizes: Mapping[str, int]) -> int:
    """Return how many cases planners distinguish for sums: one for each choice of values, but for one variable each.

    `sizes` are those of the domains.
    """
    fixed: dict[str, None] = {}
    for action in actions:
        names = sorted(action.reads(), key=lambda name: sizes[name])
        fixed |= dict.fromkeys(names[:-1])
    return prod(sizes[name] for name in fixed)


class Operation(Struct, frozen=True):
    """An operation: a task that takes time, with a pre- and a postcondition.

    Attributes:
        name: an identifier.
        pre: the transition that starts the operation.
        post: the transition that completes it.
        deadline_ns: the maximum duration of its execution; `None` for no limit.
        failed: a transition that fails the operation while it executes.
        timedout: the actions that are taken when the deadline passes.
        disabled_deadline_ns: the maximum time that it may be disabled before replanning; `None` for no limit.
    """

    name: str
    pre: Transition
    post: Transition
    deadline_ns: int | None = None
    failed: Transition | None = None
    timedout: tuple[Action, ...] = ()
    disabled_deadline_ns: int | None = None

    def __str__(self) -> str:
        return f"{self.name}: {self.pre} => {self.post}"


class Transition(Struct, frozen=True):
    """A running transition: a guard and actions for planner and runner, and additional ones for the runner.

    Attributes:
        name: its name in reports.
        g: the guard for planner and runner.
        gr: the additional guard for the runner.
        a: the actions for planner and runner.
        ar: the additional actions for the runner.
    """

    name: str
    g: Predicate
    gr: Predicate = TRUE
    a: tuple[Action, ...] = ()
    ar: tuple[Action, ...] = ()

    @property
    def running_guard(self) -> Predicate:
        """`g && gr`, the guard of the runner."""
        return conjunction(part for part in (self.g, self.gr) if part != TRUE)

    @property
    def running_actions(self) -> tuple[Action, ...]:
        """`a` and `ar`, the actions of the runner."""
        return self.a + self.ar

    def __str__(self) -> str:
        return f"{self.name}: {self.g} / {self.gr} / {_list(self.a)} / {_list(self.ar)}"


def _list(actions: tuple[Action, ...]) -> str:
    return f"[{', '.join(map(str, actions))}]"
