"""The runner of one case over nodes, with the changes from outside that the case lists (semantics 7.2).

It has no clock. A run in wall time and the replay of its log give it the same events, and get the same records.
"""

from __future__ import annotations

import heapq
from collections import deque
from itertools import count
from typing import TYPE_CHECKING

from scbm.running import GoalGiven, Measured, RunFinished, Runner
from scbm.running.simulation import RecordedMoves
from scbm.running.simulation.environment_moves import event_of, parts_of
from scbm.running.simulation.impossible_changes import ImpossibleChange, why_impossible

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.cases import Case
    from scbm.cases.trace import Changes
    from scbm.running import Effect, Event, Program, RunnerOptions
    from scbm.running.simulation.environment_moves import ClockTick


class CaseRunner:
    """Runs a case. Each change that it lists waits for a settled moment, at its time or later, at which it is possible.

    The changes come in the order of their times: one that waits holds back those behind it.

    Attributes:
        is_over: whether the run for the last goal has ended.
        waiting: the change that is due and was impossible at the last settled moment, and why; `None` if there is none.
    """

    def __init__(self, program: Program, case: Case, options: RunnerOptions) -> None:
        """Start in the initial state of the case.

        Args:
            program: the compiled model.
            case: the case.
            options: the limits of the runner.
        """
        self.is_over = False
        self.waiting: ImpossibleChange | None = None
        self._runner = Runner(program, case.initial, options)
        self._runner.changes_pending = self._is_pending
        self._ungiven = self._unfinished = len(case.goals)
        self._changes = case.environment or ()
        self._moves = RecordedMoves(program, self._changes)
        self._order = count()
        self._later: list[tuple[int, bool, int, ClockTick]] = []
        self._due: deque[ClockTick] = deque()
        self._rest: list[Changes] = []
        self._was_pending = False
        self._is_outdated = False
        self._now_ns = 0
        self._schedule(self._moves.begin())

    def handle(self, event: Event, now_ns: int) -> list[Effect]:
        """Handle an event as `Runner.handle` does; one that `next_change` has returned is the change of the case."""
        self._ungiven -= isinstance(event, GoalGiven)
        if event == self.next_change(now_ns):
            self._rest = self._parts[1:]
            if not self._rest:
                self._moves.tick(self._due.popleft(), self._runner.packed_state, is_waiting=False)
        self._now_ns, self._was_pending = now_ns, False
        effects = self._runner.handle(event, now_ns)
        self._unfinished -= sum(isinstance(effect, RunFinished) for effect in effects)
        self.is_over = self._unfinished <= 0
        if not self.is_over:
            self._schedule(self._moves.observe(self._runner.packed_state, now_ns))
            self.next_change(now_ns)
            self._is_outdated = self._was_pending and not self._may_come(self._runner.packed_state)
        return effects

    def next_change(self, now_ns: int) -> Measured | None:
        """Return the change of the case that comes now; `None` if none is due, or the first one that is has to wait."""
        while self._later and self._later[0][0] <= now_ns:
            self._due.append(heapq.heappop(self._later)[-1])
        if self._ungiven or self.is_over:
            return None
        change = self._possible()
        self.waiting = self._impossible() if self._due and change is None else None
        return change

    @property
    def deadline_ns(self) -> int | None:
        """The time at which a change of the case, or else `TimePassed`, is due unless another event comes first."""
        if self._is_outdated:
            return self._now_ns
        times_ns = (self._runner.deadline_ns, self._later[0][0] if self._later else None)
        return min((at_ns for at_ns in times_ns if at_ns is not None), default=None)

    def _schedule(self, ticks: Iterable[ClockTick]) -> None:
        for tick in ticks:
            heapq.heappush(self._later, (tick.at_ns, not tick.precedes, next(self._order), tick))

    def _is_pending(self, state: int) -> bool:
        self._was_pending = self._may_come(state)
        return self._was_pending

    def _may_come(self, state: int) -> bool:
        """Return whether a change will come if nothing but time passes from a settled packed state on."""
        return bool(self._later) or self._moves.begins_in(state) or self._possible() is not None

    # the first change that is due

    def _possible(self) -> Measured | None:
        return event_of(self._parts[0], self._by, self._runner) if self._due else None

    @property
    def _by(self) -> str:
        return self._changes[self._due[0].clock].by

    @property
    def _parts(self) -> list[Changes]:
        """The rest of a change that has begun; of another one what it stands for in the present state."""
        return self._rest or parts_of(self._changes[self._due[0].clock], self._runner)

    def _impossible(self) -> ImpossibleChange:
        runner, values = self._runner, self._parts[0]
        model = runner.program.model
        reason = why_impossible(model, runner.state, values, self._by, is_settled=runner.is_settled)
        return ImpossibleChange(self._due[0].at_ns, values, self._by, reason)
