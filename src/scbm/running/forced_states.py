"""Forced states: from which record on a run shows what no cell could have done (semantics 9.10).

An injection forces the state if no source of the variables that it changes could have changed them at that moment. Only
inputs and published values change without a request, and only at settled moments. Variables that environment
transitions assign change by these alone. Other users occupy and leave shared resources. Every state after a forced
state counts as forced, too. The condition of a resource decides about replies alone, so it forces nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases.trace import (
    BecameCurrent,
    End,
    InjectionApplied,
    OperationStepped,
    PlanAsked,
    PlanReceived,
    PutBack,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    RunEnded,
    RunStarted,
)
from scbm.model import OperationState
from scbm.running.events import PlanStatus
from scbm.running.micro_steps import PlanStep, RunTurn, next_in_plan

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.cases.trace import Record
    from scbm.model import Predicate, Value
    from scbm.running.program import Program, RequestLine


def first_forced(
    program: Program, initial: Mapping[str, Value], goals: Sequence[Predicate], records: Sequence[Record]
) -> int | None:
    """Return the index of the first record whose injection forces the state; `None` if none does.

    Args:
        program: the compiled model.
        initial: the state in which the runner starts.
        goals: the goals of the case, in their order; one that was not begun has no run in `records`.
        records: the trace.
    """
    follower = _TraceFollower(program, initial, goals)
    for index, record in enumerate(records):
        if isinstance(record, (InjectionApplied, PutBack)) and follower.is_forced(record):
            return index
        follower.follow(record)
    return None


class _TraceFollower:
    """The situation of a runner after some records: the state, the requests in flight, and the plan."""

    def __init__(self, program: Program, initial: Mapping[str, Value], goals: Sequence[Predicate]) -> None:
        self._program = program
        self._lines = {line.resource.name: line for line in program.requests}
        packing, groups = program.packing, program.free_groups
        self._outside = tuple((sum(packing[name].mask for name in group.names), group) for group in groups)
        self._goals = list(goals)
        self._state = program.begin(initial)
        self._steps = program.micro_steps(None)
        self._planner_reads = 0
        self._in_flight: dict[str, RequestLine] = {}
        self._queued = 0
        self._asked_in: int | None = None
        self._unsolvable_in: int | None = None

    def follow(self, record: Record) -> None:
        """Update the situation with the next record."""
        match record:
            case RunStarted():
                self._state = self._program.packing.pack(dict(record.state))
                goal = self._goals.pop(0)
                self._steps = self._program.micro_steps(goal)
                self._planner_reads = self._program.planner_reads(goal)
            case PlanReceived():
                self._queued = len(record.plan)
                is_unsolvable = record.status == PlanStatus.UNSOLVABLE
                self._unsolvable_in = self._asked_in if is_unsolvable else self._unsolvable_in
                self._asked_in = None
            case BecameCurrent():
                self._queued -= 1
            case OperationStepped(target=OperationState.INITIAL) if record.source is not OperationState.COMPLETED:
                self._queued = 0
            case RequestSent():
                self._in_flight[record.resource] = self._lines[record.resource]
            case RequestCancelled() | ReplyReceived():
                self._in_flight.pop(record.resource, None)
            case RunEnded(end=End.NOT_STARTED.value):
                self._goals.pop(0)
            case RunEnded():
                self._steps = self._program.micro_steps(None)
                self._queued, self._asked_in, self._unsolvable_in = 0, None, None
            case _:
                pass
        self._state = self._after(record)
        if isinstance(record, PlanAsked):
            self._asked_in = self._state

    def is_forced(self, record: InjectionApplied | PutBack) -> bool:
        """Return whether no source could have made the changes of an injection here."""
        return not self._can_become(self._state, self._after(record))

    def _after(self, record: Record) -> int:
        if not record.changes:
            return self._state
        keep, bits = self._program.packing.assignment(dict(record.changes))
        return self._state & keep | bits

    def _can_become(self, state: int, target: int) -> bool:
        """Return whether sources can lead from one packed state to another, with no micro-step between them."""
        if state == target:
            return True
        if not self._is_settled(state):
            return False
        return any(self._can_become(each, target) for each in self._following(state, target) if each != state)

    def _following(self, state: int, target: int) -> Iterator[int]:
        """Yield the states that one change from outside leads to, as far as they are nearer to the target."""
        packing = self._program.packing
        for mask, group in self._outside:
            changed = ((name, values) for name, values in group.values if (state ^ target) & packing[name].mask)
            if all(packing.value(target, name) in values for name, values in changed):
                yield state & ~mask | target & mask
        for step in self._program.environment:
            after = step.update(state) if step.test(state) else None
            if after is not None and not (after ^ state) & (after ^ target):
                yield after
        for line in self._program.shared:
            if line.resource.name not in self._in_flight:
                nearer = (after for after in line.used_by_others(state) if not (after ^ state) & (after ^ target))
                yield from nearer

    def _is_settled(self, state: int) -> bool:
        """Return whether no micro-step is left in a packed state. A deadline may pass later in the same instant."""
        step = self._steps.first(state, tuple(self._in_flight.values()), timer_passed=False)
        if step is not RunTurn.FOLLOW_PLAN:
            return step is None
        unsolvable_in = self._unsolvable_in
        following = next_in_plan(
            is_queued=self._queued > 0,
            is_asking=self._asked_in is not None,
            is_unsolvable=unsolvable_in is not None and not (unsolvable_in ^ state) & self._planner_reads,
            may_change=True,
        )
        return following in (PlanStep.AWAIT_ANSWER, PlanStep.AWAIT_CHANGE)
