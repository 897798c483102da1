"""Whether a run that a limit ended would have gone on without end: it waits, or goes round (semantics 7.13)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.cases.trace import (
    BecameCurrent,
    End,
    InjectionApplied,
    MeasurementReceived,
    OperationStepped,
    PlanAsked,
    PlanDropped,
    PlanReceived,
    Record,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    RunStarted,
    state_after,
)
from scbm.model import OperationState
from scbm.testing.requirement_monitors import limit_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.running import Program

_EVENTS = (ReplyReceived, PlanReceived, MeasurementReceived, InjectionApplied)
"""The records with which events begin: before each of them the run was settled."""


class _Counts(NamedTuple):
    """How often something has happened that a run must not await all the way round.

    Attributes:
        plans: answers of the planner.
        ended: ends of operations.
        requests: for each resource in flight the requests and replies so far.
    """

    plans: int
    ended: int
    requests: tuple[tuple[str, int], ...]


class EndlessRuns:
    """Judges the runs of one model by the variables that matter to it and to one requirement."""

    def __init__(self, program: Program, names: Sequence[str]) -> None:
        """`names` are the variables by which situations differ."""
        self._program = program
        self._names = tuple(names)

    def shows(self, records: Sequence[Record], since: int) -> bool:
        """Return whether a limit ended the last run of a trace while it waited for nothing else, or went round.

        Args:
            records: the trace.
            since: the index of the record from which on the run has to wait or go round.
        """
        limit = limit_of(records)
        if limit is None or limit.first <= since:
            return False
        run = _RunFromRecord(self._program, self._names, records, since + 1)
        for record in records[since + 1 : limit.first]:
            if run.is_back(record):
                return True
            run.follow(record)
        return limit.end.end == End.TIME_LIMIT and run.is_waiting


class _RunFromRecord:
    """The last run of a trace from one record on."""

    def __init__(self, program: Program, names: Sequence[str], records: Sequence[Record], start: int) -> None:
        self._program = program
        self._names = names
        self._state = state_after(records[:start])
        self._plan: tuple[str, ...] = ()
        self._is_asking = False
        self._plans = self._ended = 0
        self._counts: dict[str, int] = {}
        self._in_flight: dict[str, None] = {}
        self._seen: dict[tuple[object, ...], _Counts] = {}
        for record in records[:start]:
            self._follow_requests(record)
            self._follow_plan(record)
        self._seen.clear()

    def follow(self, record: Record) -> None:
        """Follow a record."""
        self._follow_requests(record)
        self._follow_plan(record)
        if isinstance(record, RunStarted):
            self._seen.clear()
            self._state.update(record.state)
        self._state.update(record.changes)

    def _follow_requests(self, record: Record) -> None:
        match record:
            case RequestSent(resource=resource):
                self._in_flight[resource] = None
                self._counts[resource] = self._counts.get(resource, 0) + 1
            case ReplyReceived(resource=resource, succeeded=succeeded):
                self._in_flight.pop(resource, None)
                self._counts[resource] = self._counts.get(resource, 0) + 1
                if not succeeded:
                    self._seen.clear()
            case RequestCancelled(resource=resource):
                self._in_flight.pop(resource, None)
            case OperationStepped(target=OperationState.TIMEDOUT) if self._in_flight:
                self._seen.clear()  # a request that does not succeed
            case _:
                pass

    def _follow_plan(self, record: Record) -> None:
        match record:
            case PlanAsked():
                self._is_asking = True
            case PlanReceived(plan=plan):
                self._plan, self._is_asking = plan, False
                self._plans += 1
            case PlanDropped():
                self._plan, self._is_asking = (), False
            case BecameCurrent():
                self._plan = self._plan[1:]
            case OperationStepped(target=target):
                self._ended += target is OperationState.INITIAL
            case _:
                pass

    def is_back(self, record: Record) -> bool:
        """Return whether an event begins where one began before, and nothing was awaited all the way round."""
        if not isinstance(record, _EVENTS):
            return False
        values = tuple(self._state[name] for name in self._names)
        place = (values, tuple(self._in_flight), self._plan, self._is_asking)
        now = _Counts(self._plans, self._ended, tuple((name, self._counts[name]) for name in self._in_flight))
        before = self._seen.setdefault(place, now)
        if before is now or (self._is_asking and now.plans == before.plans):
            return False
        if self._has_timer and now.ended == before.ended:
            return False
        return all(first != last for first, last in zip(before.requests, now.requests, strict=True))

    @property
    def _has_timer(self) -> bool:
        current = self._program.current(self._program.packing.pack(self._state))
        return current is not None and current.has_timer

    @property
    def is_waiting(self) -> bool:
        """Whether an operation or a reply is awaited that no deadline ends, and no plan is."""
        current = self._program.current(self._program.packing.pack(self._state))
        is_waiting = bool(self._in_flight) if current is None else not current.has_timer
        return is_waiting and not self._is_asking
