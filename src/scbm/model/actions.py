"""Actions: what a transition assigns (semantics 2.3). The actions of one transition happen at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

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
