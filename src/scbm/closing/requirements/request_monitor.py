"""The memory of a run about its requests, and which steps of all runs violate a built-in requirement (semantics 7.12).

The rules are those of `testing.built_in_requirements`, on packed states instead of records.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, NamedTuple

from scbm.model import OperationState, RequestState
from scbm.model.requirements import BuiltIn
from scbm.model.sources import declared_as_states
from scbm.running.untimed.situations import NoteKind, RunNote
from scbm.testing.request_protocol import RequestProtocol

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel, Resource
    from scbm.running import Program


_ANSWERED = (RequestState.SUCCEEDED.value, RequestState.FAILED.value)


class RequestMemory(NamedTuple):
    """The part of the steps before that decides how the next steps of a run are judged.

    Attributes:
        owners: the resources whose triggers are true, by number, each with the operation that made it true.
        went_wrong: the last operation that ended, if it failed or timed out; else the empty text.
    """

    owners: tuple[tuple[int, str], ...] = ()
    went_wrong: str = ""


class StepJudgement(NamedTuple):
    """A step as the built-in requirements see it.

    Attributes:
        memory: what is remembered after it.
        violated: the names of the requirements that it violates.
    """

    memory: RequestMemory
    violated: tuple[str, ...]


class RequestMonitor:
    """Follows runs of one model, step by step, and judges their requests.

    Attributes:
        judges: the names of the requirements that it is about.
        start: what is remembered before the first step.
        memories: all that may be remembered: not listed.
    """

    judges: ClassVar[tuple[str, ...]] = (BuiltIn.NO_ORPHAN.value, BuiltIn.READY_AGAIN.value, BuiltIn.STOPS.value)
    start: ClassVar[RequestMemory] = RequestMemory()
    memories: ClassVar[tuple[RequestMemory, ...]] = ()

    def __init__(self, model: BehaviorModel, program: Program, states: Sequence[str] = ()) -> None:
        """`states` are variables that nothing outside the model changes, whatever the model says."""
        model = declared_as_states(model, states)
        self._program = program
        self._resources = model.resources
        self._protocol = RequestProtocol(model)
        self._uses = {operation.name: self._protocol.uses(operation) for operation in model.operations}
        self._operations = {operation.name: operation for operation in model.operations}
        self._judged: dict[tuple[RequestMemory, tuple[RunNote, ...]], tuple[StepJudgement, ...]] = {}
        self._triggers = program.triggers
        self._kept: dict[tuple[StepJudgement, int], StepJudgement] = {}
        self._orphans: dict[tuple[int, str, int], bool] = {}

    def judged(
        self, memory: RequestMemory, notes: tuple[RunNote, ...], state: int | None, *, is_cut_off: bool
    ) -> Sequence[StepJudgement]:
        """Return what a step may do; what a limit cuts off may have been judged or not.

        Args:
            memory: what was remembered before it.
            notes: the notes about it.
            state: the packed state after it; `None` if no situation follows.
            is_cut_off: whether a limit of plans ends the run on the way.
        """
        each = self._after_each(memory, notes)
        return [self._still_true(judged, state or 0) for judged in (each[:-1] if is_cut_off else each[-1:])]

    def _after_each(self, memory: RequestMemory, notes: tuple[RunNote, ...]) -> tuple[StepJudgement, ...]:
        """Return what was done until each note about a limit, and what the whole step does."""
        key = memory, notes
        if key not in self._judged:
            self._judged[key] = tuple(self._follow(memory, notes))
        return self._judged[key]

    def _follow(self, memory: RequestMemory, notes: Iterable[RunNote]) -> Iterator[StepJudgement]:
        violated: dict[str, None] = {}
        owners, went_wrong = dict(memory.owners), memory.went_wrong
        for note in notes:
            match note.kind:
                case NoteKind.TRIGGERS:
                    owners[note.resource] = note.operation
                case NoteKind.ENDS_OPERATION:
                    is_wrong = note.ended in (OperationState.FAILED, OperationState.TIMEDOUT)
                    went_wrong = note.operation if is_wrong and self._uses[note.operation] else ""
                case NoteKind.SENDS_AFTER_END:
                    violated[BuiltIn.STOPS.value] = None
                case NoteKind.MAY_BE_CUT_OFF:
                    yield StepJudgement(_memory(owners, went_wrong), tuple(violated))
                case _:
                    if note.kind.is_moment:
                        violated.update(dict.fromkeys(self._violated_at(note, owners, went_wrong)))
        yield StepJudgement(_memory(owners, went_wrong), tuple(violated))

    def _still_true(self, judged: StepJudgement, state: int) -> StepJudgement:
        """Return a judgement that remembers no more than is worth it: the owners of triggers that are true."""
        if not judged.memory.owners:
            return judged
        key = judged, state & self._triggers
        if key not in self._kept:
            owners = tuple(p for p in judged.memory.owners if state & self._program.requests[p[0]].trigger)
            self._kept[key] = judged._replace(memory=judged.memory._replace(owners=owners))
        return self._kept[key]

    # judgement

    def _violated_at(self, note: RunNote, owners: dict[int, str], went_wrong: str) -> Iterator[str]:
        """Yield what is violated at a moment."""
        orphans = [self._is_orphan(number, owners, note.state) for number in range(len(self._resources))]
        if any(orphans):
            yield BuiltIn.NO_ORPHAN.value
        if note.kind is NoteKind.ASKS_PLAN and went_wrong:
            for number, resource in enumerate(self._resources):
                is_judged = resource in self._uses[went_wrong] and not orphans[number]
                if is_judged and not self._is_ready(resource, note.state):
                    yield BuiltIn.READY_AGAIN.value

    def _is_orphan(self, number: int, owners: dict[int, str], state: int) -> bool:
        owner = owners.get(number)
        if owner is None or not state & self._program.requests[number].trigger:
            return False
        key = number, owner, state
        if key not in self._orphans:
            values = self._program.packing.values(state)
            may_outlive = self._protocol.may_outlive(self._operations[owner], self._resources[number], values)
            self._orphans[key] = not may_outlive
        return self._orphans[key]

    def _is_ready(self, resource: Resource, state: int) -> bool:
        if self._program.packing.value(state, resource.request_state) not in _ANSWERED:
            return True
        return self._protocol.is_ready(resource, self._program.packing.values(state))


def _memory(owners: dict[int, str], went_wrong: str) -> RequestMemory:
    return RequestMemory(tuple(sorted(owners.items())), went_wrong)
