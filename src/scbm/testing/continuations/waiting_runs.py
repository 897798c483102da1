"""Whether a run that waits could reach its goal if something outside changed (semantics 7.12).

A model that waits for a person who acknowledges a fault cannot recover where no person acts, and that is not its fault.
A lamp that nothing in the model depends on excuses nothing. So the run is followed from the state in which it waits:
once without changes from outside, and once with all of them. Further requests succeed; those in flight get no reply.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

from scbm.cases.trace import End
from scbm.model import PlanState
from scbm.model.sources import outside_groups
from scbm.running.untimed.situations import (
    ANSWER,
    HappeningKind,
    NoteKind,
    PlanningTooLargeError,
    TooManyRepliesError,
    TooManyRestsError,
)
from scbm.testing.continuations.continued_runs import MOST_SITUATIONS, ContinuedRuns, SearchTooLongError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.running.untimed.noted_steps import NotedSteps
    from scbm.running.untimed.situations import Position, RunStep

WAITING_ENDS = (End.TIME_LIMIT, End.REPLAN_LIMIT, End.UNSOLVABLE)
"""The ends of runs that wait, or repeat without end. A run that ends otherwise has not waited for a change."""


class OutsideHelp(Enum):
    """Whether changes from outside lead a waiting run to its goal."""

    LEADS_TO_GOAL = "with changes from outside the run can reach its goal, and without them it cannot"
    NONE = "changes from outside make no difference"
    UNKNOWN = "the search was too long"


class _Wait(NamedTuple):
    """A position of a run, and the resources, by number, whose requests in flight never get a reply."""

    position: Position
    silent: tuple[int, ...]


_TRIED_LAST = (HappeningKind.OUTSIDE, HappeningKind.DEADLINE, HappeningKind.REPLY)
"""What leads on from a wait, in the order in which it is noted: what is noted last is followed first."""


class WaitingRuns:
    """Answers whether changes from outside can lead waiting runs of one model to their goals. Memoizes answers."""

    def __init__(self, model: BehaviorModel) -> None:
        """Prepare nothing yet: most runs do not wait."""
        self._model = model
        self._runs = ContinuedRuns(model)
        self._known: dict[tuple[int, tuple[int, ...], Predicate], OutsideHelp] = {}

    def help_for(self, state: Mapping[str, Value], in_flight: Sequence[str], goal: Predicate) -> OutsideHelp:
        """Return whether changes from outside lead a run to its goal, and nothing else does.

        Args:
            state: the values of all variables as the run ended, the runner's own included. Those of an operation that a
                mutant lacks have their initial values.
            in_flight: the resources with a request in flight, which get no reply.
            goal: the goal of the run.
        """
        if not outside_groups(self._model):
            return OutsideHelp.NONE
        names = dict.fromkeys(in_flight)
        silent = tuple(line.number for line in self._runs.program.requests if line.resource.name in names)
        keep, bits = self._runs.program.plan_states[PlanState.EXECUTING]  # as the run waits, whatever it ended with
        values = {each.name: state.get(each.name, each.initial) for each in self._model.running_space}
        packed = self._runs.program.packing.pack(values) & self._runs.relevance(goal).mask & keep | bits
        key = (packed, silent, goal)
        if key not in self._known:
            self._known[key] = self._searched(packed, silent, goal)
        return self._known[key]

    def _searched(self, state: int, silent: tuple[int, ...], goal: Predicate) -> OutsideHelp:
        try:
            for is_open in (False, True):
                if self._can_reach(state, silent, self._runs.steps(goal, is_open=is_open)):
                    return OutsideHelp.LEADS_TO_GOAL if is_open else OutsideHelp.NONE
        except (SearchTooLongError, PlanningTooLargeError, TooManyRepliesError, TooManyRestsError):
            return OutsideHelp.UNKNOWN
        return OutsideHelp.NONE

    def _can_reach(self, state: int, silent: tuple[int, ...], steps: NotedSteps) -> bool:
        """Return whether the goal can be reached.

        The newest situation comes first: one run to the goal is enough, and this order finds it among fewer situations
        than breadth first, so fewer searches meet the limit.
        """
        seen: dict[_Wait, None] = {}
        pending = [(steps.resume(state, silent), silent)]
        while pending:
            step, silent = pending.pop()
            if any(note.end is End.REACHED for note in step.notes):
                return True
            if step.target is None:
                continue
            wait = _Wait(step.target, _still_silent(step, silent))
            if wait not in seen:
                seen[wait] = None
                pending += [(following, wait.silent) for following in self._following(steps, wait)]
            if len(seen) > MOST_SITUATIONS:
                raise SearchTooLongError
        return False

    def _following(self, steps: NotedSteps, wait: _Wait) -> Iterator[RunStep]:
        """Yield the steps that lead on: a plan is answered at once, requests succeed, and no limit ends the run."""
        if wait.position.is_asking:
            yield steps.after(wait.position, ANSWER)
            return
        silent = [self._runs.program.requests[number].resource.name for number in wait.silent]
        happenings = tuple(steps.happenings(wait.position))
        for kind in _TRIED_LAST:
            for each in happenings:
                is_reply = kind is HappeningKind.REPLY
                if each.kind is kind and not (is_reply and (not each.succeeded or each.resource in silent)):
                    yield steps.after(wait.position, each)


def _still_silent(step: RunStep, silent: tuple[int, ...]) -> tuple[int, ...]:
    """Return the requests that never get a reply and are in flight after a step, unless they were sent again."""
    sent = [note.resource for note in step.notes if note.kind is NoteKind.SENDS]
    in_flight = step.target.in_flight if step.target is not None else ()
    return tuple(each for each in silent if each in in_flight and each not in sent)
