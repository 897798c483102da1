"""The records of a run: one class for each kind of event, the ends of a run, and the state after some records.

Each record has its time, in nanoseconds from the start of the runner's time, and the variables that it changed. The
first record of a trace has the whole state. The state at each moment follows from it and from the later changes, so
coverage, requirements and charts need the trace alone.

A new kind of record is one class here, with its `severity`, and one member of `Record`. mypy then names each place that
needs a case for it: those places match over all kinds and end in `assert_never`.
"""

from __future__ import annotations

from enum import StrEnum
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar, TypeAlias

from msgspec import Struct

from scbm.model import FIRST_PLANNER, OperationState, PlannerIdentity, PlanState, Value

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


class End(StrEnum):
    """How the run for a goal can end (semantics 5).

    A planner that reaches a limit, or whose incomplete search finds nothing, has not proved its problem unsolvable. So
    `planner_limit` and `no_plan_found` are ends of their own. A run is `lost` if a node disappeared: it has no trace,
    and the tester reports this end in place of the runner. A goal of a case is `not_started` if its `when` never
    holds. A run is `impossible` from the moment on at which no maker can make a change that its case lists.
    """

    REACHED = "reached"
    UNSOLVABLE = "unsolvable"
    ABORTED = "aborted"
    TIME_LIMIT = "time_limit"
    REPLAN_LIMIT = "replan_limit"
    PLANNER_LIMIT = "planner_limit"
    NO_PLAN_FOUND = "no_plan_found"
    LIVELOCK = "livelock"
    MODEL_ERROR = "model_error"
    NOT_STARTED = "not_started"
    LOST = "lost"
    IMPOSSIBLE = "impossible"

    @property
    def plan_state(self) -> PlanState:
        """The value of `plan.state` after a run with this end; a goal that was not started leaves it as it is."""
        match self:
            case End.REACHED:
                return PlanState.COMPLETED
            case End.UNSOLVABLE:
                return PlanState.UNSOLVABLE
            case _:
                return PlanState.ABORTED


class RecordSeverity(StrEnum):
    """How serious an event is: part of the nominal course, a deviation from it, or an error of the model."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


Changes: TypeAlias = tuple[tuple[str, Value], ...]
"""Variables that changed, in the order of the model, each with its new value."""


class RunnerStarted(Struct, frozen=True):
    """The runner started, without a goal: the first record of a trace. `state` has every variable."""

    kind: ClassVar[str] = "runner_started"
    severity: ClassVar[RecordSeverity] = RecordSeverity.INFO
    at_ns: int
    state: Changes
    changes: Changes = ()


class RunStarted(Struct, frozen=True):
    """The runner began to pursue a goal. `state` has every variable; `changes` has what the start changed."""

    kind: ClassVar[str] = "run_started"
    severity: ClassVar[RecordSeverity] = RecordSeverity.INFO
    at_ns: int
    goal: str
    predicate: str
    state: Changes
    changes: Changes = ()


class PlanAsked(Struct, frozen=True):
    """The runner asked for a plan; `ask` is the number of the question."""

    kind: ClassVar[str] = "plan_asked"
    severity: ClassVar[RecordSeverity] = RecordSeverity.INFO
    at_ns: int
    ask: int
    changes: Changes


class PlanReceived(Struct, frozen=True):
    """The planner answered: its status, and the operations of the plan if the status is `solved`."""

    kind: ClassVar[str] = "plan_received"
    at_ns: int
    ask: int
    status: str
    plan: tuple[str, ...]
    changes: Changes

    @property
    def severity(self) -> RecordSeverity:
        """A warning unless there is a plan."""
        return RecordSeverity.INFO if self.status == "solved" else RecordSeverity.WARNING


class PlanDropped(Struct, frozen=True):
    """The planner answered a question that is out of date; the runner ignored the answer."""

    kind: ClassVar[str] = "plan_dropped"
    severity: ClassVar[RecordSeverity] = RecordSeverity.INFO
    at_ns: int
    ask: int
    changes: Changes = ()


class BecameCurrent(Struct, frozen=True):
    """The first operation of the queue became the current operation."""

    kind: ClassVar[str] = "became_current"
    severity: ClassVar[RecordSeverity] = RecordSeverity.INFO
    at_ns: int
    operation: str
    changes: Changes


class OperationStepped(Struct, frozen=True):
    """The current operation changed its state; `transition` is the name of the transition taken, if there was one."""

    kind: ClassVar[str] = "operation"
    at_ns: int
    operation: str
    source: OperationState
    target: OperationState
    transition: str | None
    changes: Changes

    @property
    def severity(self) -> RecordSeverity:
        """A warning if the operation is disabled, failed, timed out, or was given up while it was disabled."""
        match self.target:
            case OperationState.DISABLED | OperationState.FAILED | OperationState.TIMEDOUT:
                return RecordSeverity.WARNING
            case OperationState.INITIAL if self.source is OperationState.DISABLED:
                return RecordSeverity.WARNING
            case _:
                return RecordSeverity.INFO


class AutomaticTaken(Struct, frozen=True):
    """An automatic transition was taken; `failed` is the operation that it made fail, if it did."""

    kind: ClassVar[str] = "automatic"
    at_ns: int
    transition: str
    failed: str | None
    changes: Changes

    @property
    def severity(self) -> RecordSeverity:
        """A warning if the transition made an operation fail."""
        return RecordSeverity.INFO if self.failed is None else RecordSeverity.WARNING


class RequestSent(Struct, frozen=True):
    """The runner sent a request to a resource, with the values in `payload`."""

    kind: ClassVar[str] = "request_sent"
    severity: ClassVar[RecordSeverity] = RecordSeverity.INFO
    at_ns: int
    request: int
    resource: str
    payload: Changes
    changes: Changes


class RequestCancelled(Struct, frozen=True):
    """The runner cancelled a request in flight."""

    kind: ClassVar[str] = "request_cancelled"
    severity: ClassVar[RecordSeverity] = RecordSeverity.WARNING
    at_ns: int
    request: int
    resource: str
    changes: Changes


class ReplyReceived(Struct, frozen=True):
    """The reply to the request in flight arrived; `measured` has all values that it carried, changed or not."""

    kind: ClassVar[str] = "reply_received"
    at_ns: int
    request: int
    resource: str
    succeeded: bool
    changes: Changes
    measured: Changes = ()

    @property
    def severity(self) -> RecordSeverity:
        """A warning if the resource failed."""
        return RecordSeverity.INFO if self.succeeded else RecordSeverity.WARNING


class ReplyDropped(Struct, frozen=True):
    """A reply to no request in flight arrived and was ignored; `why` is `late`, `repeated` or `unknown`."""

    kind: ClassVar[str] = "reply_dropped"
    severity: ClassVar[RecordSeverity] = RecordSeverity.WARNING
    at_ns: int
    request: int
    why: str
    changes: Changes = ()


class MeasurementReceived(Struct, frozen=True):
    """A resource published values, or the environment changed them; `by` is its transition, if there is one.

    `measured` has all values that arrived, changed or not.
    """

    kind: ClassVar[str] = "measurement"
    severity: ClassVar[RecordSeverity] = RecordSeverity.INFO
    at_ns: int
    changes: Changes
    by: str = ""
    measured: Changes = ()


class MeasurementRefused(Struct, frozen=True):
    """A measured value was ignored: no resource measures the variable, or the value is outside its domain."""

    kind: ClassVar[str] = "measurement_refused"
    severity: ClassVar[RecordSeverity] = RecordSeverity.WARNING
    at_ns: int
    variable: str
    value: Value
    changes: Changes = ()


NETWORK = "network"
"""The name in a trace of the source of a change of a resource that no injection of the case makes."""

SENT = "sent"
"""The name in a trace of what a driver sent though nothing in the model could have sent it."""


class InjectionApplied(Struct, frozen=True):
    """An injection acted, or a driver sent what nothing in the model could have sent.

    `failed` is the operation that it made fail, if it did. It is `forced` if no source of the variables could have made
    the change at this moment (semantics 9.10).
    """

    kind: ClassVar[str] = "injection"
    severity: ClassVar[RecordSeverity] = RecordSeverity.WARNING
    at_ns: int
    injection: str
    failed: str | None
    changes: Changes
    forced: bool = False


class PutBack(Struct, frozen=True):
    """A held injection ended, and restored the variables that nothing else had changed since; `forced` as there."""

    kind: ClassVar[str] = "put_back"
    severity: ClassVar[RecordSeverity] = RecordSeverity.INFO
    at_ns: int
    injection: str
    changes: Changes
    forced: bool = False


class ResourceChanged(Struct, frozen=True):
    """The condition of a resource changed: an injection or a restart began or ended, or its node was lost or found."""

    kind: ClassVar[str] = "resource"
    at_ns: int
    injection: str
    resource: str
    condition: str
    changes: Changes = ()

    @property
    def severity(self) -> RecordSeverity:
        """A warning unless the resource is well again."""
        return RecordSeverity.INFO if self.condition == "well" else RecordSeverity.WARNING


class MessageDisturbed(Struct, frozen=True):
    """The simulated network loses a message that was sent now (`copies` is 0), or delivers it `copies` times."""

    kind: ClassVar[str] = "message"
    severity: ClassVar[RecordSeverity] = RecordSeverity.WARNING
    at_ns: int
    request: int
    resource: str
    message: str
    copies: int
    changes: Changes = ()


class RunEnded(Struct, frozen=True):
    """The run for a goal ended; `end` is the value of an `End`, and `detail` has the names that explain it.

    A goal that was never begun ends without a `RunStarted`: as `not_started`, then `detail` has its `when`; or as
    `livelock`, as automatic transitions repeat while no goal is pursued.
    """

    kind: ClassVar[str] = "run_ended"
    at_ns: int
    goal: str
    end: str
    detail: tuple[str, ...]
    changes: Changes

    @property
    def severity(self) -> RecordSeverity:
        """An error if the model is wrong, a warning if the goal was not reached for another reason."""
        match self.end:
            case End.REACHED:
                return RecordSeverity.INFO
            case End.LIVELOCK | End.MODEL_ERROR:
                return RecordSeverity.ERROR
            case _:
                return RecordSeverity.WARNING


class LivelockedAtRest(Struct, frozen=True):
    """Automatic transitions repeat while no goal is pursued; `detail` has their names. No goal begins any more."""

    kind: ClassVar[str] = "livelocked_at_rest"
    severity: ClassVar[RecordSeverity] = RecordSeverity.ERROR
    at_ns: int
    detail: tuple[str, ...]
    changes: Changes = ()


Record: TypeAlias = (
    RunnerStarted
    | RunStarted
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
    | LivelockedAtRest
)
"""A record of a run: one class for each kind of event."""


class Trace(Struct, frozen=True):
    """The records of a run, in order.

    Attributes:
        model: the name of the model that was run.
        case: the name of the test case.
        records: the records.
        planner: the planner that made the plans of the run.
    """

    model: str
    case: str
    records: tuple[Record, ...]
    planner: PlannerIdentity = FIRST_PLANNER


def state_after(records: Iterable[Record]) -> dict[str, Value]:
    """Return the value of every variable after `records`; an empty dict if they do not begin a trace."""
    state: dict[str, Value] = {}
    for record in records:
        if isinstance(record, (RunnerStarted, RunStarted)):
            state.update(record.state)
        if state:
            state.update(record.changes)
    return state


def ends_of(records: Iterable[Record]) -> tuple[RunEnded, ...]:
    """Return the ends of the runs in `records`, one for each goal that has ended."""
    return tuple(record for record in records if isinstance(record, RunEnded))


def ranges_of_goals(records: Sequence[Record]) -> tuple[range, ...]:
    """Return for each goal of a trace the indices of its records, in order; together they are all indices.

    The records before the first goal belong to it. What follows the end of a run belongs to that run, until the next
    goal begins, or is given up before it began.
    """
    begins = [0]
    has_ended = False
    for index, record in enumerate(records):
        if has_ended and isinstance(record, (RunStarted, RunEnded)):
            begins.append(index)
            has_ended = False
        has_ended = has_ended or isinstance(record, RunEnded)
    return tuple(range(begin, end) for begin, end in pairwise((*begins, len(records))))


def run_end(records: Sequence[Record]) -> RunEnded | None:
    """Return the last end of a run in `records`; `None` if they end none."""
    return next((record for record in reversed(records) if isinstance(record, RunEnded)), None)
