"""Environment transitions: how inputs change, and how often they do in a simulation (semantics 9.4)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.model.diagnostics import Place
    from scbm.model.operations import Action
    from scbm.model.predicates import Predicate
    from scbm.model.resources import Latency


class RateKind(StrEnum):
    """When the clock of an environment transition starts."""

    EVERY = "every"
    """At the beginning of a run, and again each time that it has passed."""
    AFTER = "after"
    """The clock starts when the guard becomes true, and stops when it becomes false."""


@dataclass(frozen=True, slots=True)
class Rate:
    """How often an environment transition fires in a simulation.

    Attributes:
        kind: when its clock starts.
        time: the distribution of the time that the clock runs.
        place: where it is written; two rates that differ only in their places are equal.
    """

    kind: RateKind
    time: Latency
    place: Place | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class EnvironmentTransition:
    """A change that something outside the model and its resources makes, such as a person who presses a button.

    Attributes:
        name: an identifier.
        guard: where it can fire; reads no variable of the runner.
        actions: what it assigns, all at once; declared variables only.
        rate: how often it fires in a simulation; `None` for never.
    """

    name: str
    guard: Predicate
    actions: tuple[Action, ...]
    rate: Rate | None = None

    def __str__(self) -> str:
        return f"{self.name}: {self.guard} / [{', '.join(map(str, self.actions))}]"
