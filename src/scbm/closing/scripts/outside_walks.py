"""Walks in which inputs and published values change as a test can show it, preferably in mid motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.closing.runs.run_graph import Start
from scbm.closing.runs.walks import Walk, direct_walks, path_along
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.running.untimed.situations import HappeningKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.closing.runs.run_graph import Edge, RunGraph
    from scbm.closing.runs.walks import RunPath


class WalkKind(NamedTuple):
    """What a walk may have.

    Attributes:
        only_in_motion: whether nothing changes from outside but while a request is in flight.
        while_planning: whether something may happen while a plan is awaited, so that plans take time.
        cuts_short: whether the time limit may end a run that is not the last one.
    """

    only_in_motion: bool = False
    while_planning: bool = True
    cuts_short: bool = False


_KINDS = (
    WalkKind(only_in_motion=True, while_planning=False),
    WalkKind(while_planning=False),
    WalkKind(),
    WalkKind(cuts_short=True),
)
"""All kinds, the most natural one first."""


class NaturalWalks:
    """The shortest walks of graphs to single obligations, those with changes in mid motion first.

    All walks of one kind through a graph come from one search, which goes on as further ones are asked for.
    """

    def __init__(self) -> None:
        self._firsts: dict[tuple[int, WalkKind], _FirstVisits] = {}

    def __call__(self, graphs: Sequence[RunGraph], wanted: int) -> Iterator[Walk]:
        """Yield for each graph the shortest walks of each kind that visit something wanted."""
        for kind in _KINDS:
            walks = (self._to(graph, kind).walk(wanted) for graph in graphs if graph.visits & wanted)
            yield from sorted(filter(None, walks), key=lambda walk: walk.path.length)
        yield from direct_walks(graphs, wanted)

    def _to(self, graph: RunGraph, kind: WalkKind) -> _FirstVisits:
        key = (id(graph), kind)
        if key not in self._firsts:
            self._firsts[key] = _FirstVisits(ShownWalks(graph, kind))
        return self._firsts[key]


class _FirstVisits:
    """The edges that visit something first in one search."""

    def __init__(self, walks: ShownWalks) -> None:
        self._walks = walks
        self._following = iter(walks)
        self._visits = 0
        self._first: list[tuple[int, Edge]] = []

    def walk(self, wanted: int) -> Walk | None:
        """Return the shortest walk from any initial state; `None` if no walk of this kind visits anything wanted."""
        while not self._visits & wanted:
            following = next(self._following, None)
            if following is None:
                return None
            visits = following[1].visits
            if visits & ~self._visits:
                self._visits |= visits
                self._first.append(following)
        node, edge = next((node, edge) for node, edge in self._first if edge.visits & wanted)
        return Walk(self._walks.path(node, edge), wanted)


class ShownWalks:
    """The shortest walks of one graph that a test can show, one to each edge that is on any of them."""

    def __init__(self, graph: RunGraph, kind: WalkKind) -> None:
        """Take no walk of a kind yet."""
        self.graph = graph
        self._kind = kind
        self._edges: list[tuple[int, Edge]] = []
        self._search = BreadthFirst((0,), self._successors)

    def __iter__(self) -> Iterator[tuple[int, Edge]]:
        """Yield the edges with their nodes, the nearest to an initial state first."""
        while self._search.frontier:
            self._edges.clear()
            self._search.expand(self._search.expanded + 1)
            yield from self._edges

    def _successors(self, node: int) -> Iterator[tuple[Edge, int]]:
        for edge, goes_on in shown_edges(self.graph, node, self._kind):
            self._edges.append((node, edge))
            if goes_on:
                yield edge, edge.target

    def path(self, node: int, edge: Edge | None = None) -> RunPath:
        """Return the walk to a node, and over an edge from there."""
        edges = self._search.actions_to(node)
        return path_along(self.graph, edges if edge is None else [*edges, edge])


def shown_edges(graph: RunGraph, node: int, kind: WalkKind) -> Iterator[tuple[Edge, bool]]:
    """Yield the edges of a node that a simulated run can take, and whether a walk can go on after each."""
    for edge in graph.edges(node):
        if _can_be_shown(graph, node, edge, kind):
            label = graph.label(edge.number)
            is_limit = not isinstance(label, Start) and label.kind is HappeningKind.TIME_LIMIT
            yield edge, edge.target >= 0 and (kind.cuts_short or not is_limit)


def _can_be_shown(graph: RunGraph, node: int, edge: Edge, kind: WalkKind) -> bool:
    """Return whether a simulated run can take an edge of a node."""
    label = graph.label(edge.number)
    if isinstance(label, Start) or label.kind is HappeningKind.GOAL:
        return True
    if label.kind is HappeningKind.PLAN_LIMIT:
        return False
    position = graph.positions[node - 1]
    if position.is_asking and not kind.while_planning:
        return label.kind is HappeningKind.ANSWER
    is_in_motion = bool(position.in_flight) and not position.is_at_rest
    return label.kind is not HappeningKind.OUTSIDE or is_in_motion or not kind.only_in_motion
