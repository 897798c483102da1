"""Operations: tasks that take time, with a pre- and a postcondition (paper, Sections II and IV; semantics 3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.model.actions import Action
    from scbm.model.transitions import Transition


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
