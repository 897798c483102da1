"""Steps of runs with the truth of some predicates in each state on the way, for requirements of the user.

The states are those after each record of a trace (semantics 7.3): after each micro-step, each cancellation at the end
of a run, and each automatic transition at rest.
"""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

from scbm.running.untimed.noted_steps import NotedSteps
from scbm.running.untimed.situations import NoteKind, RunNote

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.model import Predicate
    from scbm.running.untimed.projected_steps import Idling, Turn
    from scbm.running.untimed.run_steps import RunEnding, SettlingRun

NOWHERE = -1
"""The state at rest after an end that automatic transitions follow without end."""


class WatchedSteps(NotedSteps):
    """Steps of runs, each with the truth of the watched predicates in its states."""

    def watch(self, predicates: Sequence[Predicate]) -> WatchedSteps:
        """Watch these predicates from now on, and return the steps; bit n of what is noted is predicate n."""
        self._predicates = tuple(map(self._program.test, predicates))
        packing = self._program.packing
        self._watched = reduce(or_, (packing[name].mask for each in predicates for name in each.reads()), 0)
        self._observed: dict[int, tuple[RunNote, ...]] = {}
        return self

    def _notes_of(self, turn: Turn, state: int) -> tuple[RunNote, ...]:
        if not turn.passed:
            return self._observe(state) + turn.notes
        return self._observe_all((state, *(state ^ each for each in turn.passed))) + turn.notes

    def _notes_while_idle(self, state: int, in_flight: tuple[int, ...], idling: Idling) -> tuple[RunNote, ...]:
        states, after = [], state
        for line in self._requests(in_flight):
            keep, bits = line.cleared
            after = after & keep | bits
            states.append(after)
        return self._observe_all((*states, *(state ^ each for each in idling.passed)))

    def _note_possible_end(self, run: SettlingRun, kind: NoteKind, ending: RunEnding) -> None:
        rest = ending.rests[0] if ending.rests else NOWHERE
        run.notes += (RunNote(kind, state=rest, truths=tuple(note.state for note in ending.notes)),)

    def _observe(self, state: int) -> tuple[RunNote, ...]:
        """Return the note about the truth of the predicates in a state."""
        read = state & self._watched
        if read not in self._observed:
            truths = sum(holds(state) << bit for bit, holds in enumerate(self._predicates))
            self._observed[read] = (RunNote(NoteKind.OBSERVES, state=truths),)
        return self._observed[read]

    def _observe_all(self, states: Iterable[int]) -> tuple[RunNote, ...]:
        """Return the notes about the truth of the predicates in states that follow each other, without repetitions."""
        notes: tuple[RunNote, ...] = ()
        for state in states:
            more = self._observe(state)
            if notes[-1:] != more:
                notes += more
        return notes
