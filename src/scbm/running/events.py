"""What can happen to a runner. The time comes beside the event, not in it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from scbm.cases import Injection
    from scbm.model import Predicate
    from scbm.trace import Changes


@dataclass(frozen=True, slots=True)
class GoalGiven:
    """A goal to pursue; it waits in order while another one is pursued."""

    name: str
    predicate: Predicate


@dataclass(frozen=True, slots=True)
class ReplyArrived:
    """A resource answered a request, perhaps with measured values."""

    request: int
    succeeded: bool
    measured: Changes = ()


@dataclass(frozen=True, slots=True)
class Measured:
    """A resource published measured values unasked."""

    values: Changes


@dataclass(frozen=True, slots=True)
class InjectionGiven:
    """A tester injects something, now or as soon as its condition holds."""

    injection: Injection


class PlanStatus(StrEnum):
    """The three answers of a planner."""

    SOLVED = "solved"
    UNSOLVABLE = "unsolvable"
    LIMIT_REACHED = "limit_reached"


@dataclass(frozen=True, slots=True)
class PlanAnswered:
    """The planner answered the question `ask`; `plan` names operations if it is solved."""

    ask: int
    status: PlanStatus
    plan: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class TimePassed:
    """Nothing but time: the runner's deadline has come."""


Event: TypeAlias = GoalGiven | ReplyArrived | Measured | InjectionGiven | PlanAnswered | TimePassed
