"""The events that a runner handles, the effects that it returns, and its limits.

The time of an event is an argument of `Runner.handle`. Records are effects too: the caller keeps or publishes them.
Times are those of the caller: simulated ones in a simulation.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.cases.trace import Changes, Record

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.cases import Condition, Injection
    from scbm.cases.trace import End
    from scbm.model import Predicate, Value


class SendRequest(Struct, frozen=True):
    """Send a request to a resource."""

    request: int
    resource: str
    payload: Changes


class CancelRequest(Struct, frozen=True):
    """Notify a resource that a request is cancelled: no reply is needed."""

    request: int
    resource: str


class ChangeResource(Struct, frozen=True):
    """Notify a simulated resource of its new condition: an injection acts, or is put back."""

    resource: str
    condition: Condition


class AskPlan(Struct, frozen=True):
    """Request a plan; the caller answers with `PlanAnswered` and the same `ask`."""

    ask: int
    state: Mapping[str, Value]
    goal: Predicate


class RunFinished(Struct, frozen=True):
    """The run for a goal ended."""

    goal: str
    end: End


OutwardEffect: TypeAlias = SendRequest | CancelRequest | ChangeResource | AskPlan | RunFinished
Effect: TypeAlias = OutwardEffect | Record

OUTWARD = (SendRequest, CancelRequest, ChangeResource, AskPlan, RunFinished)
"""The effects that are no records."""


def records_of(effects: Iterable[Effect]) -> tuple[Record, ...]:
    """Return the effects that are records, in their order."""
    return tuple(effect for effect in effects if not isinstance(effect, OUTWARD))


class GoalGiven(Struct, frozen=True):
    """A goal is given; it is queued while the runner pursues another one, and until its predicate `when` holds."""

    name: str
    predicate: Predicate
    when: Predicate | None = None


class ReplyArrived(Struct, frozen=True):
    """A resource replied to a request, perhaps with measured values."""

    request: int
    succeeded: bool
    measured: Changes = ()


class Measured(Struct, frozen=True):
    """A resource published values without a request, or the environment changed them by transition `by`."""

    values: Changes
    by: str = ""


class InjectionGiven(Struct, frozen=True):
    """A tester gives an injection; it acts at its time and as soon as its predicate holds."""

    injection: Injection


class PlanStatus(StrEnum):
    """The four answers of a planner."""

    SOLVED = "solved"
    UNSOLVABLE = "unsolvable"
    LIMIT_REACHED = "limit_reached"
    NO_PLAN_FOUND = "no_plan_found"


class PlanAnswered(Struct, frozen=True):
    """The planner answered request `ask`; `plan` has the names of operations if a plan was found."""

    ask: int
    status: PlanStatus
    plan: tuple[str, ...] = ()


class TimePassed(Struct, frozen=True):
    """The runner's deadline has passed, and nothing else happened."""


Event: TypeAlias = GoalGiven | ReplyArrived | Measured | InjectionGiven | PlanAnswered | TimePassed


class RunnerOptions(Struct, frozen=True):
    """The limits of a runner.

    Attributes:
        time_limit_ns: maximum time for one goal, in nanoseconds.
        plan_limit: maximum number of plans that are requested for one goal.
        livelock_bound: maximum number of automatic transitions in a row; the count begins anew with each event, each
            operation that becomes current, and each request for a plan (semantics 5.1).
        instant_bound: maximum number of events at one moment. Resources that reply in no time can cause requests
            without end, which no time limit stops.
        awaits_measurements: whether measured values can still arrive without a request. Then the runner waits while no
            plan exists (semantics 5.6).
    """

    time_limit_ns: int = 3_600_000_000_000
    plan_limit: int = 100
    livelock_bound: int = 1_000
    instant_bound: int = 10_000
    awaits_measurements: bool = False
