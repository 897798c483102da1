"""What a runner wants done. Records are effects too: whoever drives the runner keeps or publishes them.

What can happen to a runner. The time comes beside the event, not in it.

The limits of a runner. Times are the runner's own: simulated ones in a simulation.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

from scbm.cases.trace import Changes, Record

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.cases import Condition, Injection
    from scbm.cases.trace import End
    from scbm.model import Predicate, Value


@dataclass(frozen=True, slots=True)
class SendRequest:
    """Send a request to a resource."""

    request: int
    resource: str
    payload: Changes


@dataclass(frozen=True, slots=True)
class CancelRequest:
    """Tell a resource that nobody waits for this request any more."""

    request: int
    resource: str


@dataclass(frozen=True, slots=True)
class ChangeResource:
    """Tell a simulated resource what becomes of it: an injection says so, or is put back."""

    resource: str
    condition: Condition


@dataclass(frozen=True, slots=True)
class AskPlan:
    """Ask the planner, and answer with `PlanAnswered` and the same `ask`."""

    ask: int
    state: Mapping[str, Value]
    goal: Predicate


@dataclass(frozen=True, slots=True)
class RunFinished:
    """The run for a goal ended."""

    goal: str
    end: End


Effect: TypeAlias = SendRequest | CancelRequest | ChangeResource | AskPlan | RunFinished | Record

_OUTWARD = (SendRequest, CancelRequest, ChangeResource, AskPlan, RunFinished)


def records_of(effects: Iterable[Effect]) -> tuple[Record, ...]:
    """Those effects that are records, in their order."""
    return tuple(effect for effect in effects if not isinstance(effect, _OUTWARD))


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


@dataclass(frozen=True, slots=True)
class RunnerOptions:
    """When a runner gives up, and what it may wait for.

    Attributes:
        time_limit_ns: how long one goal may be pursued.
        plan_limit: how many plans may be asked for, for one goal.
        livelock_bound: how many automatic transitions one settling may take (semantics 5.1).
        instant_bound: how many events may come at one moment. Where resources answer in no time, requests can be sent
            and answered for ever, and no time limit ends that.
        awaits_measurements: whether a measured value may still arrive unasked, so that a goal which cannot be
            planned for is waited for (semantics 5.6).
    """

    time_limit_ns: int = 3_600_000_000_000
    plan_limit: int = 100
    livelock_bound: int = 1_000
    instant_bound: int = 10_000
    awaits_measurements: bool = False
