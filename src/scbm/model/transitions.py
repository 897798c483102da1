"""Running transitions `g / gr / a / ar` (paper, Section II; semantics 3.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model.predicates import TRUE, Predicate, conjunction

if TYPE_CHECKING:
    from scbm.model.actions import Action


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
