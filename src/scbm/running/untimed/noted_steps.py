"""Steps of runs with notes, for what obligations do not show: requests, and how operations and runs end."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from scbm.cases.trace import End
from scbm.model import OperationState
from scbm.running.lifecycle import PlanEffect, parts_by_end
from scbm.running.micro_steps import RequestSending, RunTurn
from scbm.running.untimed.projected_steps import ProjectedSteps
from scbm.running.untimed.run_steps import RunEnding
from scbm.running.untimed.situations import NoteKind, RunNote

if TYPE_CHECKING:
    from scbm.running.lifecycle import OperationMove
    from scbm.running.micro_steps import AutomaticMove, RequestCancelling
    from scbm.running.untimed.plan_queues import FollowingOperation
    from scbm.running.untimed.run_steps import SettlingRun
    from scbm.running.untimed.situations import RunStep


_ENDED = tuple(parts_by_end())


class NotedSteps(ProjectedSteps):
    """Steps of runs, each with its notes."""

    @cached_property
    def _idle_requests(self) -> tuple[int, int]:
        """The mask of all request variables, and their bits while nothing is requested."""
        mask = bits = 0
        for line in self._program.requests:
            mask |= line.watched
            bits |= line.cleared[1]
        return mask, bits

    def _moment(self, kind: NoteKind, state: int) -> tuple[RunNote, ...]:
        """Return the note about a moment, if a trigger is true or a request state is not initial."""
        mask, bits = self._idle_requests
        return (RunNote(kind, state=state),) if state & mask != bits else ()

    def _take_next(self, run: SettlingRun, way: FollowingOperation) -> None:
        if way[0] >= 0:
            run.notes += self._moment(NoteKind.BECOMES_CURRENT, run.state)
        super()._take_next(run, way)

    def _request_plan(self, run: SettlingRun) -> None:
        run.notes += self._moment(NoteKind.ASKS_PLAN, run.state)
        super()._request_plan(run)

    def _follow(self, run: SettlingRun, step: RequestSending | RequestCancelling | RunTurn | None) -> RunStep | None:
        if isinstance(step, RequestSending):
            run.notes += (RunNote(NoteKind.SENDS, resource=step.line.number),)
            mask, bits = self._program.aborted
            if run.state & mask == bits:
                run.notes += (RunNote(NoteKind.SENDS_AFTER_END, resource=step.line.number),)
        return super()._follow(run, step)

    def _take_automatic(self, run: SettlingRun, move: AutomaticMove) -> None:
        if move.failed is not None:
            ended = OperationState.FAILED
            run.notes += (RunNote(NoteKind.ENDS_OPERATION, move.failed.name, ended=ended),)
        super()._take_automatic(run, move)

    def _move_operation(self, run: SettlingRun, move: OperationMove) -> RunStep | None:
        operation, rule, _, after, _ = move
        for line in self._program.requests:
            if line.trigger & after & ~run.state:
                run.notes += (RunNote(NoteKind.TRIGGERS, operation.name, line.number),)
        if rule.target in _ENDED:
            run.notes += (RunNote(NoteKind.ENDS_OPERATION, operation.name, ended=rule.target),)
        elif rule.source is OperationState.DISABLED and rule.plan is PlanEffect.REPLAN:
            run.notes += (RunNote(NoteKind.ENDS_OPERATION, operation.name, ended=rule.source),)
        return super()._move_operation(run, move)

    def _ending(self, state: int, in_flight: tuple[int, ...], end: End) -> RunEnding:
        visits, rests, notes = super()._ending(state, in_flight, end)
        if end is not End.TIME_LIMIT:
            moment = self._moment(NoteKind.REACHES_GOAL, state) if end is End.REACHED else ()
            notes = (*moment, RunNote(NoteKind.ENDS_RUN, end=end, state=state), *notes)
        return RunEnding(visits, rests, notes)

    def _goes_round(self, run: SettlingRun) -> RunStep:
        run.notes += (RunNote(NoteKind.ENDS_RUN, end=End.LIVELOCK, state=run.state),)
        return super()._goes_round(run)

    def _livelock(self, run: SettlingRun, chain: tuple[int, ...]) -> RunStep:
        run.notes += (RunNote(NoteKind.ENDS_RUN, end=End.LIVELOCK, state=run.state),)
        return super()._livelock(run, chain)

    def _note_possible_end(self, run: SettlingRun, kind: NoteKind, ending: RunEnding) -> None:  # noqa: ARG002 - the same
        if kind is NoteKind.MAY_BE_CUT_OFF and self._is_sequence:
            run.notes += (RunNote(kind),)
