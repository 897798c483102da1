"""Actions: what a transition assigns (semantics 2.3). The actions of one transition happen at once.

Operations: tasks that take time, with a pre- and a postcondition (paper, Sections II and IV; semantics 3.2).

Running transitions `g / gr / a / ar` (paper, Section II; semantics 3.1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from scbm.model.predicates import TRUE, Predicate, conjunction

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.model.predicates import Term
    from scbm.model.state import State
    from scbm.model.values import Value


@dataclass(frozen=True, slots=True)
class Assign:
    """`target <- source`."""

    target: str
    source: Term

    def value(self, state: Mapping[str, Value]) -> Value:
        """What is assigned, read from the state before the transition."""
        return self.source.value(state)

    def reads(self) -> tuple[str, ...]:
        """The variables that the right-hand side reads."""
        return self.source.reads()

    def __str__(self) -> str:
        return f"{self.target} <- {self.source}"


@dataclass(frozen=True, slots=True)
class Add:
    """`target += amount`; a negative amount is written `target -= …`. Integer ranges only; never 0."""

    target: str
    amount: int

    def value(self, state: Mapping[str, Value]) -> Value:
        """What is assigned, read from the state before the transition; may be outside the domain."""
        return int(state[self.target]) + self.amount

    def reads(self) -> tuple[str, ...]:
        """The target itself."""
        return (self.target,)

    def __str__(self) -> str:
        return f"{self.target} {'+=' if self.amount > 0 else '-='} {abs(self.amount)}"


Action: TypeAlias = Assign | Add


def apply(actions: Iterable[Action], state: State) -> State | None:
    """The state after all `actions` at once, or `None` if one of them would leave a domain (semantics 2.4)."""
    changes = {action.target: action.value(state) for action in actions}
    for name, value in changes.items():
        if value not in state.space[name].domain:
            return None
    return state.replace(changes)


@dataclass(frozen=True, slots=True)
class Operation:
    """One operation.

    Attributes:
        name: an identifier.
        pre: taken when the operation starts.
        post: taken when it completes.
        deadline_ns: how long it may execute; `None` means for ever.
        failed: a transition that fails the operation while it executes.
        timedout: the actions taken when the deadline passes.
        disabled_deadline_ns: how long it may stay disabled before a new plan is asked for; `None` means for ever.
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


@dataclass(frozen=True, slots=True)
class Transition:
    """A guard and actions that planner and runner see, and more of both that only the runner sees.

    Attributes:
        name: what reports call it.
        g: the guard for planner and runner.
        gr: the guard that only the runner adds.
        a: the actions of planner and runner.
        ar: the actions that only the runner adds.
    """

    name: str
    g: Predicate
    gr: Predicate = TRUE
    a: tuple[Action, ...] = ()
    ar: tuple[Action, ...] = ()

    @property
    def running_guard(self) -> Predicate:
        """`g && gr`, what the runner sees."""
        return conjunction(part for part in (self.g, self.gr) if part != TRUE)

    @property
    def running_actions(self) -> tuple[Action, ...]:
        """`a` and `ar`, what the runner takes."""
        return self.a + self.ar

    def __str__(self) -> str:
        return f"{self.name}: {self.g} / {self.gr} / {_list(self.a)} / {_list(self.ar)}"


def _list(actions: tuple[Action, ...]) -> str:
    return f"[{', '.join(map(str, actions))}]"
