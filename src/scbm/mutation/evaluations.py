"""Evaluations in runs of the original model: their states, plans, timers and requests, with the cases of each.

A run is followed by its trace. Sets of cases are integers: bit i stands for case i, from 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct, field

from scbm.cases.trace import (
    AutomaticTaken,
    End,
    InjectionApplied,
    OperationStepped,
    PlanAsked,
    PlanReceived,
    RequestSent,
    RunEnded,
    RunStarted,
)
from scbm.running.lifecycle import timer_moves
from scbm.testing.request_moments import find_moments
from scbm.testing.request_protocol import RequestProtocol

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases.trace import Changes, Record
    from scbm.model import OperationState, Predicate
    from scbm.running.program import Program
    from scbm.testing.tester import Execution

_EXPIRES = timer_moves()
"""The steps of an operation that its timer makes."""

TIMED = tuple(before for before, _ in _EXPIRES)
"""The states of an operation that can have a deadline."""


class EvaluatedPlan(Struct, frozen=True):
    """A question of a run for a plan, with its answer.

    Attributes:
        goal: the goal.
        state: the packed state of the runner in which it asked.
        status: the status of the answer.
        plan: the operations of the answer.
    """

    goal: Predicate
    state: int
    status: str
    plan: tuple[str, ...]


class Evaluations(Struct):
    """The evaluations in the runs of some cases.

    Attributes:
        program: the compiled original model.
        states: the packed states that they visited, each with the cases.
        expired_in: for each operation and state the packed states in which its timer passed, each with the cases.
        longest_ns: for each operation and state the longest time in it, by the number of the case.
        requests: the cases that sent a request to a resource.
        questions: the questions for plans of each case, each once; their numbers in the order of the cases.
        moved: the cases in which something decided about the environment.
        with_plans: the cases that have plans of their own.
        busy: the cases in which a request was left between operations, so that built-in requirements read the model.
    """

    program: Program
    states: dict[int, int] = field(default_factory=dict)
    expired_in: dict[tuple[str, OperationState], dict[int, int]] = field(default_factory=dict)
    longest_ns: dict[tuple[str, OperationState], dict[int, int]] = field(default_factory=dict)
    requests: dict[str, int] = field(default_factory=dict)
    questions: list[tuple[EvaluatedPlan, ...]] = field(default_factory=list)
    moved: int = 0
    with_plans: int = 0
    busy: int = 0

    def add(self, execution: Execution) -> None:
        """Add the run of the next case."""
        number = len(self.questions)
        follower = _RunFollower(self, number, execution)
        self.questions.append(tuple(dict.fromkeys(follower.follow(execution.trace.records))))
        self.moved |= (execution.moves is not None) << number
        self.with_plans |= bool(execution.case.plans) << number
        moments = find_moments(execution.trace.records, RequestProtocol(self.program.model))
        self.busy |= any(moment.busy for moment in moments) << number

    def states_of(self, operation: str) -> Iterator[tuple[int, int]]:
        """Yield the visited states in which an operation is current, each with the cases."""
        current = self.program.current
        for state, cases in self.states.items():
            life = current(state)
            if life is not None and life.operation.name == operation:
                yield state, cases


class _RunFollower:
    """Follows one run by its trace."""

    def __init__(self, runs: Evaluations, number: int, execution: Execution) -> None:
        self._runs = runs
        self._number = number
        self._bit = 1 << number
        self._goals = iter(execution.case.goals)
        self._goal: Predicate | None = None
        self._state = runs.program.begin(execution.case.initial)
        self._asked: dict[int, tuple[Predicate, int]] = {}
        self._timed: tuple[str, OperationState, int] | None = None

    def follow(self, records: tuple[Record, ...]) -> Iterator[EvaluatedPlan]:
        """Add what the run evaluated, and yield its questions for plans."""
        self._visit()
        for record in records:
            before = self._state
            if record.changes:
                self._state = self._after(record.changes)
                self._visit()
            self._follow_timer(record, before)
            match record:
                case RunStarted() | RunEnded(end=End.NOT_STARTED.value):
                    self._goal = next(self._goals).predicate
                case PlanAsked() if self._goal is not None:
                    self._asked[record.ask] = self._goal, self._state
                case PlanReceived() if record.ask in self._asked:
                    yield EvaluatedPlan(*self._asked[record.ask], record.status, record.plan)
                case RequestSent():
                    known = self._runs.requests.get(record.resource, 0)
                    self._runs.requests[record.resource] = known | self._bit
                case _:
                    pass

    def _visit(self) -> None:
        states = self._runs.states
        states[self._state] = states.get(self._state, 0) | self._bit

    def _after(self, changes: Changes) -> int:
        keep, bits = self._runs.program.packing.assignment(dict(changes))
        return self._state & keep | bits

    def _follow_timer(self, record: Record, before: int) -> None:
        """Measure how long the current operation is in a state that can have a deadline, and whether that passes."""
        match record:
            case OperationStepped():
                is_over = (record.source, record.target) in _EXPIRES
                self._leave(record.at_ns, before, is_over=is_over)
                if record.target in TIMED:
                    self._timed = record.operation, record.target, record.at_ns
            case RunEnded():
                self._leave(record.at_ns, before, is_over=record.end == End.MODEL_ERROR.value)
            case AutomaticTaken() | InjectionApplied() if record.failed is not None:
                self._leave(record.at_ns, before, is_over=False)
            case _:
                pass

    def _leave(self, now_ns: int, before: int, *, is_over: bool) -> None:
        if self._timed is None:
            return
        operation, state, begun_ns = self._timed
        self._timed = None
        times = self._runs.longest_ns.setdefault((operation, state), {})
        times[self._number] = max(now_ns - begun_ns, times.get(self._number, 0))
        if is_over:
            states = self._runs.expired_in.setdefault((operation, state), {})
            states[before] = states.get(before, 0) | self._bit
