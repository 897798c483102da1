"""Steps of runs with the truth of some predicates in each state on the way, for requirements of the user.

The states are those after each record of a trace (semantics 7.3): after each micro-step, each cancellation at the end
of a run, and each automatic transition at rest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases.trace import End
from scbm.running.untimed.noted_steps import NotedSteps
from scbm.running.untimed.run_steps import RunEnding, RunSteps
from scbm.running.untimed.situations import NoteKind, RunNote

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.model import PlanState
    from scbm.model.packing import Test
    from scbm.running.compiled_steps import RequestLine
    from scbm.running.micro_steps import MicroStep, MicroSteps
    from scbm.running.untimed.run_steps import SettlingRun
    from scbm.running.untimed.situations import RunStep

NOWHERE = -1
"""The state at rest after an end that automatic transitions follow without end."""


class WatchedSteps(NotedSteps):
    """Steps of runs, each with the truth of the watched predicates in its states."""

    def watch(self, predicates: Sequence[Test]) -> WatchedSteps:
        """Watch these predicates from now on, and return the steps; bit n of what is noted is predicate n."""
        self._predicates = tuple(predicates)
        self._last = NOWHERE
        self._alternative: NoteKind | None = None
        self._known_truths: dict[int, int] = {}
        self._known_ends: dict[tuple[int, tuple[int, ...], PlanState], tuple[RunEnding, tuple[int, ...]]] = {}
        self._steps = _ObservedSteps(self._steps, self._observe)  # type: ignore[assignment]
        self._idle_steps = _ObservedSteps(self._idle_steps, self._observe)  # type: ignore[assignment]
        return self

    def start(self, state: int) -> RunStep:
        """Return the step in which the runner starts in a packed state: it settles without a goal."""
        self._notes = []
        return self._noted(super().start(state))

    def _noted(self, step: RunStep) -> RunStep:
        self._last = NOWHERE
        return super()._noted(step)

    def _observe(self, state: int) -> None:
        """Note the truth of the predicates in a state, unless it is that of the state before in this step."""
        if state not in self._known_truths:
            self._known_truths[state] = sum(holds(state) << bit for bit, holds in enumerate(self._predicates))
        self._note_truths(self._known_truths[state])

    def _note_truths(self, truths: int) -> None:
        if truths != self._last:
            self._last = truths
            self._notes.append(RunNote(NoteKind.OBSERVES, state=truths))

    # ends of runs, of which a step may have several: by limits on the way, or in any state of a livelock

    def _cut_off(self, run: SettlingRun) -> None:
        self._alternative = NoteKind.MAY_BE_CUT_OFF
        RunSteps._cut_off(self, run)  # noqa: SLF001 - the note of `NotedSteps` says less
        self._alternative = None

    def _livelock(self, run: SettlingRun, chain: tuple[int, ...]) -> RunStep:
        self._notes.append(RunNote(NoteKind.ENDS_RUN, end=End.LIVELOCK, state=run.state))
        self._alternative = NoteKind.MAY_END
        step = RunSteps._livelock(self, run, chain)  # noqa: SLF001 - as above
        self._alternative = None
        return step

    def _end(self, state: int, in_flight: tuple[int, ...], plan_state: PlanState) -> RunEnding:
        key = (state, in_flight, plan_state)
        if key not in self._known_ends:
            self._known_ends[key] = self._watched_end(state, self._requests(in_flight), plan_state)
        ending, truths = self._known_ends[key]
        if self._alternative is None:
            for each in truths:
                self._note_truths(each)
        else:
            rest = ending.rests[0] if ending.rests else NOWHERE
            self._notes.append(RunNote(self._alternative, state=rest, truths=truths))
        return ending

    def _watched_end(
        self, state: int, in_flight: tuple[RequestLine, ...], plan_state: PlanState
    ) -> tuple[RunEnding, tuple[int, ...]]:
        """Return the end of a run, and the truth of the predicates in the states until the runner is settled."""
        notes, last = self._notes, self._last
        self._notes, self._last = [], NOWHERE
        ending = RunEnding(*self._idle(self._at_end(state, in_flight, plan_state)))
        truths = tuple(note.state for note in self._notes)
        self._notes, self._last = notes, last
        return ending, truths

    def _at_end(self, state: int, in_flight: tuple[RequestLine, ...], plan_state: PlanState) -> int:
        for line in in_flight:
            keep, bits = line.cleared
            state = state & keep | bits
            self._observe(state)
        return super()._at_end(state, in_flight, plan_state)


class _ObservedSteps:
    """The micro-steps of a runner; each state for which one is asked is observed first."""

    def __init__(self, steps: MicroSteps, observe: Callable[[int], None]) -> None:
        self._first = steps.first
        self._observe = observe

    def first(self, state: int, in_flight: tuple[RequestLine, ...], *, timer_passed: bool) -> MicroStep | None:
        """Return the first micro-step in a state; `None` if the runner is settled."""
        self._observe(state)
        return self._first(state, in_flight, timer_passed=timer_passed)
