"""All runs with their memory of requests: which steps violate a built-in requirement, and walks to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.closing.requirements.request_monitor import RequestMemory, StepJudgement
from scbm.closing.runs.situations import PLAN_LIMIT
from scbm.closing.runs.walks import path_along
from scbm.closing.scripts.outside_walks import shown_edges
from scbm.planning.engines.breadth_first import BreadthFirst

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.closing.requirements.request_monitor import RequestMonitor
    from scbm.closing.runs.all_runs import AllRuns
    from scbm.closing.runs.run_graph import Edge, RunGraph
    from scbm.closing.runs.walks import RunPath

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
            for edge, following in shown_edges(graph, place[0], cuts_short=cuts_short):
                for judged in self._judged(graph, edge, place[1]):
                    found.extend((name, place, edge) for name in judged.violated if name in names)
                    if following is not None:
                        yield edge, (following, judged.memory)

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
