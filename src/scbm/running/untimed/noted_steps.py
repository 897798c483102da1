"""Steps of runs with notes, for what obligations do not show: requests, and how operations and runs end."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from scbm.cases.trace import End
from scbm.model import OperationState
from scbm.running.lifecycle import PlanEffect, parts_by_end
from scbm.running.micro_steps import RequestSending, RunTurn
from scbm.running.untimed.run_steps import RunSteps
from scbm.running.untimed.situations import NoteKind, RunNote, RunStep

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.running.lifecycle import OperationMove
    from scbm.running.micro_steps import AutomaticMove, RequestCancelling
    from scbm.running.untimed.plan_queues import FollowingOperation
    from scbm.running.untimed.run_steps import SettlingRun
    from scbm.running.untimed.situations import Happening, Position


_ENDED = tuple(parts_by_end())


class NotedSteps(RunSteps):
    """Steps of runs, each with its notes."""

    @cached_property
    def _notes(self) -> list[RunNote]:
        """The notes about the step that is taken."""
        return []

    @cached_property
    def _idle_requests(self) -> tuple[int, int]:
        """The mask of all request variables, and their bits while nothing is requested."""
        mask = bits = 0
        for line in self._program.requests:
            mask |= line.watched
            bits |= line.cleared[1]
        return mask, bits

    def begin(self, state: int) -> RunStep:
        """Return the step in which the goal is given to a runner at rest in a packed state."""
        self._notes = []
        return self._noted(super().begin(state))

    def resume(self, state: int, in_flight: Iterable[int]) -> RunStep:
        """Return the step of a run without a plan from a packed state on, with these requests in flight."""
        self._notes = []
        return self._noted(super().resume(state, in_flight))

    def after(self, position: Position, happening: Happening) -> RunStep:
        """Return the step that an event starts in a position."""
        self._notes = []
        return self._noted(super().after(position, happening))

    def _after_event(
        self, position: Position, state: int, in_flight: tuple[int, ...], *, timer_passed: bool
    ) -> RunStep:
        self._notes = []
        return self._noted(super()._after_event(position, state, in_flight, timer_passed=timer_passed))

    def at_rest(self, rest: Position) -> Iterator[tuple[Happening, RunStep]]:
        """Yield everything that can happen while no goal is pursued."""
        self._notes = []
        for happening, step in super().at_rest(rest):
            yield happening, self._noted(step)
            self._notes = []

    def _noted(self, step: RunStep) -> RunStep:
        return RunStep(*step[:-1], tuple(self._notes)) if self._notes else step

    # what is noted

    def _note_moment(self, kind: NoteKind, state: int) -> None:
        """Note a moment, if a trigger is true or a request state is not initial."""
        mask, bits = self._idle_requests
        if state & mask != bits:
            self._notes.append(RunNote(kind, state=state))

    def _take_next(self, run: SettlingRun, way: FollowingOperation) -> None:
        if way[0] >= 0:
            self._note_moment(NoteKind.BECOMES_CURRENT, run.state)
        super()._take_next(run, way)

    def _request_plan(self, run: SettlingRun) -> None:
        self._note_moment(NoteKind.ASKS_PLAN, run.state)
        super()._request_plan(run)

    def _answered_at_once(self, run: SettlingRun) -> RunStep | None:  # noqa: ARG002 - notes are of micro-steps
        """Return `None`: notes are made while micro-steps are taken, so these are not memoized."""
        return None

    def _follow(self, run: SettlingRun, step: RequestSending | RequestCancelling | RunTurn | None) -> RunStep | None:
        if isinstance(step, RequestSending):
            self._notes.append(RunNote(NoteKind.SENDS, resource=step.line.number))
            mask, bits = self._program.aborted
            if run.state & mask == bits:
                self._notes.append(RunNote(NoteKind.SENDS_AFTER_END, resource=step.line.number))
        elif step is RunTurn.REACH_GOAL:
            self._note_moment(NoteKind.REACHES_GOAL, run.state)
        return super()._follow(run, step)

    def _take_automatic(self, run: SettlingRun, move: AutomaticMove) -> None:
        if move.failed is not None:
            ended = OperationState.FAILED
            self._notes.append(RunNote(NoteKind.ENDS_OPERATION, move.failed.name, ended=ended))
        super()._take_automatic(run, move)

    def _move_operation(self, run: SettlingRun, move: OperationMove) -> RunStep | None:
        operation, rule, _, after, _ = move
        for line in self._program.requests:
            if line.trigger & after & ~run.state:
                self._notes.append(RunNote(NoteKind.TRIGGERS, operation.name, line.number))
        if rule.target in _ENDED:
            self._notes.append(RunNote(NoteKind.ENDS_OPERATION, operation.name, ended=rule.target))
        elif rule.source is OperationState.DISABLED and rule.plan is PlanEffect.REPLAN:
            self._notes.append(RunNote(NoteKind.ENDS_OPERATION, operation.name, ended=rule.source))
        return super()._move_operation(run, move)

    def _ended(self, run: SettlingRun, end: End) -> RunStep:
        if end is not End.TIME_LIMIT:
            self._notes.append(RunNote(NoteKind.ENDS_RUN, end=end, state=run.state))
        return super()._ended(run, end)

    def _goes_round(self, run: SettlingRun) -> RunStep:
        self._notes.append(RunNote(NoteKind.ENDS_RUN, end=End.LIVELOCK, state=run.state))
        return super()._goes_round(run)

    def _livelock(self, run: SettlingRun, chain: tuple[int, ...]) -> RunStep:
        self._notes.append(RunNote(NoteKind.ENDS_RUN, end=End.LIVELOCK, state=run.state))
        return super()._livelock(run, chain)

    def _cut_off(self, run: SettlingRun) -> None:
        if self._is_sequence:
            self._notes.append(RunNote(NoteKind.MAY_BE_CUT_OFF))
        super()._cut_off(run)
