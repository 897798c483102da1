"""What a runner wants done. Records are effects too: whoever drives the runner keeps or publishes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from scbm.trace import Changes, Record

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.cases import Condition
    from scbm.model import Predicate, Value
    from scbm.trace import End


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
