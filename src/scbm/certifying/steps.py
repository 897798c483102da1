"""What can happen to a run that is settled, and what comes of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from scbm.model import format_value

if TYPE_CHECKING:
    from scbm.certifying.certificate import Situation
    from scbm.model import Value


@dataclass(frozen=True, slots=True)
class Reply:
    """A resource replies to the request in flight; if it succeeds, with a value for each variable that it measures."""

    resource: str
    succeeded: bool
    measured: tuple[tuple[str, Value], ...] = ()

    def __str__(self) -> str:
        said = f"{self.resource} {'succeeds' if self.succeeded else 'fails'}"
        measured = ", ".join(f"{name} = {format_value(value)}" for name, value in self.measured)
        return f"{said} with {measured}" if measured else said


@dataclass(frozen=True, slots=True)
class Deadline:
    """The time that the current operation may be in its state has passed."""

    def __str__(self) -> str:
        return "the deadline passes"


@dataclass(frozen=True, slots=True)
class PlannerAnswer:
    """The planner answers."""

    def __str__(self) -> str:
        return "the planner answers"


Event: TypeAlias = Reply | Deadline | PlannerAnswer


@dataclass(frozen=True, slots=True)
class Step:
    """What came of one event.

    Attributes:
        situation: where the run is now; `None` if it has ended, or goes round without waiting for anything.
        values: the values of all variables that are looked at, and the states of all operations.
        visited: the names of the obligations that were visited.
        cut_off: those that would have been visited instead if the limit of plans had ended the run on the way.
    """

    situation: Situation | None
    values: dict[str, Value]
    visited: tuple[str, ...]
    cut_off: tuple[str, ...] = ()
