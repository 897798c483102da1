"""The search of all runs for violations: situations beside what a run remembers, breadth-first (decision 53)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias

from scbm.closing.runs.run_graph import Start
from scbm.closing.runs.walks import path_along
from scbm.closing.scripts.outside_walks import WalkKind, shown_edges
from scbm.model.sources import InitialStates, declared_as_states
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.running.untimed.situations import PLAN_LIMIT, HappeningKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.closing.runs.all_runs import AllRuns
    from scbm.closing.runs.run_graph import Edge, RunGraph
    from scbm.closing.runs.walks import RunPath
    from scbm.model import BehaviorModel
    from scbm.running.untimed.situations import Happening

    Memory: TypeAlias = Any
    """What a monitor remembers of a run; each monitor has its own type."""
    Place: TypeAlias = tuple[int, Memory]
    """A node of a graph, and what a monitor remembers of the run before it."""


class Judgement(Protocol):
    """A step as a monitor sees it."""

    @property
    def memory(self) -> Memory:
        """What is remembered after it."""
        ...

    @property
    def violated(self) -> tuple[str, ...]:
        """The names of the requirements that it violates."""
        ...


class RunMonitor(Protocol):
    """Follows runs step by step, and judges them by one requirement or several."""

    @property
    def start(self) -> Memory:
        """What is remembered before the first step."""
        ...

    @property
    def memories(self) -> tuple[Memory, ...]:
        """All that may be remembered; empty if that is too much to list."""
        ...

    @property
    def judged(self) -> Callable[..., Sequence[Judgement]]:
        """The function that gets memory, notes, the packed state after the step, and whether a limit cuts it off."""
        ...


class ViolatingWalk(NamedTuple):
    """A walk that should violate a requirement.

    Attributes:
        requirement: the name of the requirement.
        path: the walk.
        missing: the resources whose last requests get no reply.
        goes_round: whether the run goes round in the end, twice.
    """

    requirement: str
    path: RunPath
    missing: tuple[str, ...] = ()
    goes_round: bool = False


class PossibleEvents:
    """The events of runs that are possible if nothing outside the model changes some variables."""

    def __init__(self, model: BehaviorModel, states: Sequence[str]) -> None:
        """`states` are these variables; with none, all events are possible."""
        self._states = states
        self._beginnings = InitialStates(declared_as_states(model, states))

    def __contains__(self, label: Happening | Start) -> bool:
        if not self._states:
            return True
        if isinstance(label, Start):
            return self._beginnings.can_begin(label.values)
        return label.kind is not HappeningKind.OUTSIDE or not any(name in self._states for name, _ in label.measured)


class ViolationSearch:
    """Searches all runs of a model for violations of what a monitor judges."""

    def __init__(self, runs: AllRuns, monitor: RunMonitor, most: int, states: Sequence[str] = ()) -> None:
        """Search for nothing yet.

        Args:
            runs: the runs; their edges have notes.
            monitor: the judge.
            most: the maximum number of situations, each beside what is remembered in it.
            states: variables that nothing outside the model changes, whatever the model says.
        """
        self._events = PossibleEvents(runs.model, states)
        self._runs = runs
        self._monitor = monitor
        self._most = most
        self.is_complete = runs.stopped is None

    def violated(self) -> tuple[str, ...]:
        """Return the names of the requirements that runs violate; `is_complete` says whether these are all."""
        found: dict[str, None] = {}
        left = self._most
        for graph in self._runs.graphs:
            if not self._may_violate(graph):
                continue

            def successors(place: Place, graph: RunGraph = graph) -> Iterator[tuple[Edge, Place]]:
                for edge, judged in judged_from(self._monitor, graph, place):
                    if graph.label(edge.number) not in self._events:
                        continue
                    if judged.violated:
                        found.update(dict.fromkeys(judged.violated))
                    if edge.target >= 0:
                        yield edge, (edge.target, judged.memory)

            search = BreadthFirst(((0, self._monitor.start),), successors)
            search.expand(left)
            self.is_complete = self.is_complete and not search.frontier
            left = max(0, left - search.expanded)
        return tuple(found)

    def settled_states(self, memory: Memory) -> Iterator[int]:
        """Yield the packed states of settled situations in which this is remembered of a run."""
        for graph in self._runs.graphs:

            def successors(place: Place, graph: RunGraph = graph) -> Iterator[tuple[Edge, Place]]:
                for edge, judged in judged_from(self._monitor, graph, place):
                    if edge.target >= 0:
                        yield edge, (edge.target, judged.memory)

            search = BreadthFirst(((0, self._monitor.start),), successors)
            search.expand(self._most)
            yield from (graph.positions[node - 1].state for node, then in search.states if node and then == memory)

    def _may_violate(self, graph: RunGraph) -> bool:
        """Return whether a step of a graph violates something if any memory may precede it; unknown counts as yes."""
        memories = self._monitor.memories
        return not memories or any(
            judged.violated
            for notes in graph.distinct_notes
            for memory in memories
            for is_cut_off in (False, True)
            for judged in self._monitor.judged(memory, notes, None, is_cut_off=is_cut_off)
        )

    def walks(self, names: tuple[str, ...]) -> Iterator[ViolatingWalk]:
        """Yield walks that violate these requirements, for each graph the shortest ones first."""
        for cuts_short in (False, True):
            for graph in self._runs.graphs:
                yield from self._walks_in(graph, names, WalkKind(cuts_short=cuts_short))

    def _walks_in(self, graph: RunGraph, names: tuple[str, ...], kind: WalkKind) -> Iterator[ViolatingWalk]:
        found: list[tuple[str, Place, Edge]] = []

        def successors(place: Place) -> Iterator[tuple[Edge, Place]]:
            for edge, goes_on in shown_edges(graph, place[0], kind):
                for judged in judged_over(self._monitor, graph, edge, place[1]):
                    found.extend((name, place, edge) for name in judged.violated if name in names)
                    if goes_on:
                        yield edge, (edge.target, judged.memory)

        search = BreadthFirst(((0, self._monitor.start),), successors)
        while search.frontier and search.expanded < self._most:
            search.expand(search.expanded + 1)
            for name, place, edge in found:
                yield ViolatingWalk(name, path_along(graph, [*search.actions_to(place), edge]))
            found.clear()


def judged_from(monitor: RunMonitor, graph: RunGraph, place: Place) -> Iterator[tuple[Edge, Judgement]]:
    """Yield the steps from a place, judged; a step that a limit cuts off may have several judgements."""
    node, memory = place
    for edge in graph.edges(node):
        for judged in judged_over(monitor, graph, edge, memory):
            yield edge, judged


def judged_over(monitor: RunMonitor, graph: RunGraph, edge: Edge, memory: Memory) -> Sequence[Judgement]:
    """Return the judgements of a step."""
    state = graph.positions[edge.target - 1].state if edge.target >= 0 else None
    is_cut_off = graph.label(edge.number) is PLAN_LIMIT
    return monitor.judged(memory, graph.notes(edge.number), state, is_cut_off=is_cut_off)
