"""The records of a run, one class for each kind of thing that can happen.

Every record says when it happened, in nanoseconds since the runner's time began, and which variables it changed
to what. The first record of a run has the whole state; with the changes of those behind it, the state at each
moment follows from the trace alone.

How the run for a goal can end (semantics 5).

The state at a moment of a run, from its records alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, ClassVar, TypeAlias

from scbm.model import OperationState, PlanState, Value

if TYPE_CHECKING:
    from collections.abc import Iterable


class End(StrEnum):
    """The end of a run. A planner that gave up is not an unsolvable problem, so it has an end of its own.

    A run that was `lost` with a node came to none of the others, and has no trace: who tests says so, no runner.
    """

    REACHED = "reached"
    UNSOLVABLE = "unsolvable"
    ABORTED = "aborted"
    TIME_LIMIT = "time_limit"
    REPLAN_LIMIT = "replan_limit"
    PLANNER_LIMIT = "planner_limit"
    LIVELOCK = "livelock"
    MODEL_ERROR = "model_error"
    LOST = "lost"

    @property
    def plan_state(self) -> PlanState:
        """What `plan.state` is afterwards."""
        match self:
            case End.REACHED:
                return PlanState.COMPLETED
            case End.UNSOLVABLE:
                return PlanState.UNSOLVABLE
            case _:
                return PlanState.ABORTED


Changes: TypeAlias = tuple[tuple[str, Value], ...]
"""The variables that changed, in the order of the model, and what they changed to."""


@dataclass(frozen=True, slots=True)
class RunStarted:
    """A goal began to be pursued. `state` has every variable; `changes` what starting did to it."""

    kind: ClassVar[str] = "run_started"
    at_ns: int
    goal: str
    predicate: str
    state: Changes
    changes: Changes = ()


@dataclass(frozen=True, slots=True)
class PlanAsked:
    """A plan was asked for; `ask` numbers the questions."""

    kind: ClassVar[str] = "plan_asked"
    at_ns: int
    ask: int
    changes: Changes


@dataclass(frozen=True, slots=True)
class PlanReceived:
    """An answer came: its status, and the operations of the plan if it is `solved`."""

    kind: ClassVar[str] = "plan_received"
    at_ns: int
    ask: int
    status: str
    plan: tuple[str, ...]
    changes: Changes


@dataclass(frozen=True, slots=True)
class PlanDropped:
    """An answer came to a question that nobody asks any more."""

    kind: ClassVar[str] = "plan_dropped"
    at_ns: int
    ask: int
    changes: Changes = ()


@dataclass(frozen=True, slots=True)
class BecameCurrent:
    """An operation came to the head of the queue."""

    kind: ClassVar[str] = "became_current"
    at_ns: int
    operation: str
    changes: Changes


@dataclass(frozen=True, slots=True)
class OperationStepped:
    """The current operation went from one state to another; `transition` names what was taken, if anything."""

    kind: ClassVar[str] = "operation"
    at_ns: int
    operation: str
    source: OperationState
    target: OperationState
    transition: str | None
    changes: Changes


@dataclass(frozen=True, slots=True)
class AutomaticTaken:
    """An automatic transition was taken; `failed` is the operation that it failed, if it did."""

    kind: ClassVar[str] = "automatic"
    at_ns: int
    transition: str
    failed: str | None
    changes: Changes


@dataclass(frozen=True, slots=True)
class RequestSent:
    """A request went to a resource, with these values."""

    kind: ClassVar[str] = "request_sent"
    at_ns: int
    request: int
    resource: str
    payload: Changes
    changes: Changes


@dataclass(frozen=True, slots=True)
class RequestCancelled:
    """A request in flight was given up."""

    kind: ClassVar[str] = "request_cancelled"
    at_ns: int
    request: int
    resource: str
    changes: Changes


@dataclass(frozen=True, slots=True)
class ReplyReceived:
    """The reply to the request in flight came."""

    kind: ClassVar[str] = "reply_received"
    at_ns: int
    request: int
    resource: str
    succeeded: bool
    changes: Changes


@dataclass(frozen=True, slots=True)
class ReplyDropped:
    """A reply came that belongs to no request in flight; `why` is `late`, `repeated` or `unknown`."""

    kind: ClassVar[str] = "reply_dropped"
    at_ns: int
    request: int
    why: str
    changes: Changes = ()


@dataclass(frozen=True, slots=True)
class MeasurementReceived:
    """Measured values came unasked."""

    kind: ClassVar[str] = "measurement"
    at_ns: int
    changes: Changes


@dataclass(frozen=True, slots=True)
class MeasurementRefused:
    """A measured value was dropped: no resource measures that variable, or it cannot have that value."""

    kind: ClassVar[str] = "measurement_refused"
    at_ns: int
    variable: str
    value: Value
    changes: Changes = ()


@dataclass(frozen=True, slots=True)
class InjectionApplied:
    """An injection acted; `failed` is the operation that it failed, if it did."""

    kind: ClassVar[str] = "injection"
    at_ns: int
    injection: str
    failed: str | None
    changes: Changes


@dataclass(frozen=True, slots=True)
class PutBack:
    """A held injection ended, and what nothing else had changed since was put back."""

    kind: ClassVar[str] = "put_back"
    at_ns: int
    injection: str
    changes: Changes


@dataclass(frozen=True, slots=True)
class ResourceChanged:
    """The tester changes the condition of a resource, by an injection or as that one is put back."""

    kind: ClassVar[str] = "resource"
    at_ns: int
    injection: str
    resource: str
    condition: str
    changes: Changes = ()


@dataclass(frozen=True, slots=True)
class MessageDisturbed:
    """The simulated network lost a message that was sent now (`copies` is 0), or will deliver it so many times."""

    kind: ClassVar[str] = "message"
    at_ns: int
    request: int
    resource: str
    message: str
    copies: int
    changes: Changes = ()


@dataclass(frozen=True, slots=True)
class RunEnded:
    """The run for a goal ended; `end` is one of the ends of semantics 5, `detail` says more of some of them."""

    kind: ClassVar[str] = "run_ended"
    at_ns: int
    goal: str
    end: str
    detail: tuple[str, ...]
    changes: Changes


Record: TypeAlias = (
    RunStarted
    | PlanAsked
    | PlanReceived
    | PlanDropped
    | BecameCurrent
    | OperationStepped
    | AutomaticTaken
    | RequestSent
    | RequestCancelled
    | ReplyReceived
    | ReplyDropped
    | MeasurementReceived
    | MeasurementRefused
    | InjectionApplied
    | PutBack
    | ResourceChanged
    | MessageDisturbed
    | RunEnded
)


@dataclass(frozen=True, slots=True)
class Trace:
    """The records of a run, in order.

    Attributes:
        model: the name of the model that was run.
        case: the name of the test case.
        records: what happened.
    """

    model: str
    case: str
    records: tuple[Record, ...]


def state_after(records: Iterable[Record]) -> dict[str, Value]:
    """The value of every variable behind these records; empty as long as no run has started."""
    state: dict[str, Value] = {}
    for record in records:
        if isinstance(record, RunStarted):
            state.update(record.state)
        if state:  # what changed before a run is in the state with which it starts
            state.update(record.changes)
    return state
