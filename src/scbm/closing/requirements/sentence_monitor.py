"""What runs remember about a requirement of the user, and which steps violate it (semantics 7.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.running.untimed.situations import NoteKind
from scbm.running.untimed.watched_steps import NOWHERE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import Predicate, Requirement
    from scbm.running.untimed.situations import RunNote


class SentenceJudgement(NamedTuple):
    """A step as a requirement sees it.

    Attributes:
        memory: what is remembered after it.
        violated: the name of the requirement, if the step violates it.
        stays: whether what is remembered was `True` before the step, and in each state of it.
    """

    memory: bool
    violated: tuple[str, ...]
    stays: bool = False


class SentenceMonitor:
    """Follows runs step by step for one requirement, by the truth of its predicates in each state on the way.

    Attributes:
        start: what is remembered before the first step.
        memories: all that may be remembered.
    """

    start = False
    memories = (False, True)

    def __init__(self, requirement: Requirement, watched: Sequence[Predicate]) -> None:
        """`watched` are the predicates whose truth the notes have, in this order."""
        self._names = (requirement.name,)
        self._sentence = requirement.sentence
        self._bits = tuple(watched.index(each) for each in requirement.sentence.predicates)
        self._known: dict[tuple[bool, int], _FollowedNotes] = {}
        self._after_states: dict[tuple[SentenceJudgement, int], SentenceJudgement] = {}

    def judged(
        self,
        memory: bool,  # noqa: FBT001 - what is remembered
        notes: tuple[RunNote, ...],
        state: int | None,
        *,
        is_cut_off: bool,
    ) -> Sequence[SentenceJudgement]:
        """Return what a step may do.

        Args:
            memory: what is remembered before it.
            notes: the notes about it.
            state: the packed state after it; `None` if no situation follows.
            is_cut_off: whether a limit of plans ends the run on the way.
        """
        key = memory, id(notes)  # the graph keeps the notes
        if key not in self._known:
            self._known[key] = self._followed(memory, notes)
        last, cut_offs, ends = self._known[key]
        if is_cut_off:
            return [judgement for rest, judgement in cut_offs if state is None or rest == state]
        if not ends and not cut_offs:
            return last
        reached = [judgement for rest, judgement in ends if state is None or rest == state] if ends else last
        return [*reached, *(judgement for rest, judgement in cut_offs if rest == NOWHERE)]

    def _followed(self, memory: bool, notes: tuple[RunNote, ...]) -> _FollowedNotes:  # noqa: FBT001 - as above
        last = SentenceJudgement(memory, (), stays=memory)
        cut_offs: list[tuple[int, SentenceJudgement]] = []
        ends: list[tuple[int, SentenceJudgement]] = []
        for note in notes:
            match note.kind:
                case NoteKind.OBSERVES:
                    last = self._after(last, note.state)
                case NoteKind.MAY_BE_CUT_OFF | NoteKind.MAY_END:
                    judgement = last
                    for truths in note.truths:
                        judgement = self._after(judgement, truths)
                    found = cut_offs if note.kind is NoteKind.MAY_BE_CUT_OFF else ends
                    found.append((note.state, judgement))
                case _:
                    pass
        return _FollowedNotes((last,), tuple(dict.fromkeys(cut_offs)), tuple(dict.fromkeys(ends)))

    def _after(self, before: SentenceJudgement, truths: int) -> SentenceJudgement:
        key = before, truths
        if key not in self._after_states:
            memory, is_violated = self._sentence.watched(before.memory, [bool(truths >> bit & 1) for bit in self._bits])
            violated = self._names if is_violated else before.violated
            self._after_states[key] = SentenceJudgement(memory, violated, stays=before.stays and memory)
        return self._after_states[key]


class _FollowedNotes(NamedTuple):
    """What the notes of a step do.

    Attributes:
        last: what the whole step does, unless a livelock ends the run in it; one judgement.
        cut_offs: what it has done where a limit of plans ends the run, each with the state at rest then.
        ends: what it does if a livelock ends the run in it, each with the state at rest then.
    """

    last: tuple[SentenceJudgement]
    cut_offs: tuple[tuple[int, SentenceJudgement], ...]
    ends: tuple[tuple[int, SentenceJudgement], ...]
