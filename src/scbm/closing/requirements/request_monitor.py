"""The memory of a run about its requests, and which steps of all runs violate a built-in requirement (semantics 7.12).

The rules are those of `testing.built_in_requirements`, on packed states instead of records.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, NamedTuple

from scbm.closing.runs.walks import path_along
from scbm.closing.scripts.outside_walks import WalkKind, shown_edges
from scbm.model import OperationState, RequestState
from scbm.model.requirements import BuiltIn
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.running.untimed.situations import PLAN_LIMIT, NoteKind, RunNote
from scbm.testing.request_protocol import RequestProtocol

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.closing.runs.all_runs import AllRuns
    from scbm.closing.runs.run_graph import Edge, RunGraph
    from scbm.closing.runs.walks import RunPath
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
    """

    judges: ClassVar[tuple[str, ...]] = (BuiltIn.NO_ORPHAN.value, BuiltIn.READY_AGAIN.value, BuiltIn.STOPS.value)

    def __init__(self, model: BehaviorModel, program: Program) -> None:
        self._program = program
        self._resources = model.resources
        self._protocol = RequestProtocol(model)
        self._uses = {operation.name: self._protocol.uses(operation) for operation in model.operations}
        self._operations = {operation.name: operation for operation in model.operations}
        self._judged: dict[tuple[RequestMemory, tuple[RunNote, ...]], tuple[StepJudgement, ...]] = {}
        self._orphans: dict[tuple[int, str, int], bool] = {}

    def after(self, memory: RequestMemory, notes: tuple[RunNote, ...], state: int) -> StepJudgement:
        """Return what a step does.

        Args:
            memory: what was remembered before it.
            notes: the notes about it.
            state: the packed state after it.
        """
        *_, last = self._after_each(memory, notes)
        return last._replace(memory=self._still_true(last.memory, state))

    def cut_off(self, memory: RequestMemory, notes: tuple[RunNote, ...], state: int) -> Iterator[StepJudgement]:
        """Yield what a step may have done when a limit of plans ended the run on the way."""
        for each in self._after_each(memory, notes)[:-1]:
            yield each._replace(memory=self._still_true(each.memory, state))

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

    def _still_true(self, memory: RequestMemory, state: int) -> RequestMemory:
        """Return what is worth remembering: the owners of triggers that are true."""
        if not memory.owners:
            return memory
        requests = self._program.requests
        return memory._replace(owners=tuple(pair for pair in memory.owners if state & requests[pair[0]].trigger))

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


_NOTHING = RequestMemory()


class ViolatingWalk(NamedTuple):
    """A walk that should violate a requirement.

    Attributes:
        requirement: the name of the requirement.
        path: the walk.
        missing: the resource whose last request gets no reply; `None` if there is none.
    """

    requirement: str
    path: RunPath
    missing: str | None = None


class RequestSearch:
    """Searches all runs of a model for violations of what `RequestMonitor` judges."""

    def __init__(self, runs: AllRuns, monitor: RequestMonitor, most: int) -> None:
        """Search for nothing yet.

        Args:
            runs: the runs; their edges have notes.
            monitor: the judge.
            most: the maximum number of situations, each beside what is remembered in it.
        """
        self._runs = runs
        self._monitor = monitor
        self._most = most
        self.is_complete = runs.stopped is None

    def violated(self) -> tuple[str, ...]:
        """Return the names of the requirements that runs violate; `is_complete` says whether these are all."""
        found: dict[str, None] = {}
        left = self._most
        for graph in self._runs.graphs:

            def successors(place: tuple[int, RequestMemory], graph: RunGraph = graph) -> Iterator[_Step]:
                node, memory = place
                for edge in graph.edges(node):
                    for judged in self._judged(graph, edge, memory):
                        found.update(dict.fromkeys(judged.violated))
                        if edge.target >= 0:
                            yield edge, (edge.target, judged.memory)

            search = BreadthFirst(((0, _NOTHING),), successors)
            search.expand(left)
            self.is_complete = self.is_complete and not search.frontier
            left = max(0, left - search.expanded)
        return tuple(found)

    def walks(self, names: tuple[str, ...]) -> Iterator[ViolatingWalk]:
        """Yield walks that violate these requirements, for each graph the shortest ones first."""
        for cuts_short in (False, True):
            for graph in self._runs.graphs:
                yield from self._walks_in(graph, names, cuts_short=cuts_short)

    def _walks_in(self, graph: RunGraph, names: tuple[str, ...], *, cuts_short: bool) -> Iterator[ViolatingWalk]:
        found: list[tuple[str, tuple[int, RequestMemory], Edge]] = []

        def successors(place: tuple[int, RequestMemory]) -> Iterator[_Step]:
            for edge, goes_on in shown_edges(graph, place[0], WalkKind(cuts_short=cuts_short)):
                for judged in self._judged(graph, edge, place[1]):
                    found.extend((name, place, edge) for name in judged.violated if name in names)
                    if goes_on:
                        yield edge, (edge.target, judged.memory)

        search = BreadthFirst(((0, _NOTHING),), successors)
        while search.frontier and search.expanded < self._most:
            search.expand(search.expanded + 1)
            for name, place, edge in found:
                yield ViolatingWalk(name, path_along(graph, [*search.actions_to(place), edge]))
            found.clear()

    def _judged(self, graph: RunGraph, edge: Edge, memory: RequestMemory) -> Iterator[StepJudgement]:
        """Yield what a step may do; what a limit cuts off may have been judged or not."""
        notes = graph.notes(edge.number)
        state = graph.positions[edge.target - 1].state if edge.target >= 0 else 0
        if graph.label(edge.number) is PLAN_LIMIT:
            yield from self._monitor.cut_off(memory, notes, state)
        else:
            yield self._monitor.after(memory, notes, state)


if TYPE_CHECKING:
    _Step = tuple[Edge, tuple[int, RequestMemory]]
