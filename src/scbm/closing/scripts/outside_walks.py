"""Walks in which inputs and published values change as a test can show it, preferably in mid motion.

A simulated planner answers at once. So a change while a plan is awaited can be shown only from the second plan on:
`plan.state` becomes `planning` then, and an injection can wait for that. What happens to a runner at rest can be shown
between two goals, and not before the first one.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

from scbm.closing.runs.run_graph import Start
from scbm.closing.runs.situations import HappeningKind
from scbm.closing.runs.walks import Walk, direct_walks, path_along
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.proofcheck import Awaits

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.closing.runs.run_graph import Edge, RunGraph
    from scbm.closing.runs.walks import RunPath


class _Phase(IntEnum):
    """The phase of a walk."""

    AT_FIRST = 0  # no goal was given
    ASKED = 1  # the last goal that was given has got no plan
    ANSWERED = 2


class _Kind(NamedTuple):
    """A kind of walks.

    Attributes:
        only_in_motion: whether nothing changes during a run but while a request is in flight.
        cuts_short: whether the time limit may end a run that is not the last one.
    """

    only_in_motion: bool
    cuts_short: bool = False


_KINDS = (_Kind(only_in_motion=True), _Kind(only_in_motion=False), _Kind(only_in_motion=False, cuts_short=True))
"""All kinds, the most natural one first."""

_FOUND = -1
"""A virtual node behind each edge that visits what is wanted."""


def natural_walks(graphs: Sequence[RunGraph], wanted: int) -> Iterator[Walk]:
    """Yield for each graph the shortest walks that visit something wanted: those with changes in mid motion first."""
    for kind in _KINDS:
        walks = (_shortest(graph, wanted, kind) for graph in graphs)
        yield from sorted(filter(None, walks), key=lambda walk: walk.path.length)
    yield from direct_walks(graphs, wanted)


def _shortest(graph: RunGraph, wanted: int, kind: _Kind) -> Walk | None:
    """Return the shortest walk from any initial state; `None` if no walk of this kind visits anything wanted."""

    def successors(place: int) -> Iterator[tuple[Edge, int]]:
        node, phase = divmod(place, len(_Phase))
        for edge in graph.edges(node):
            if not _can_be_shown(graph, node, edge, _Phase(phase), kind):
                continue
            if edge.visits & wanted:
                yield edge, _FOUND
            elif edge.target >= 0 and graph.reach[edge.target] & wanted and _may_go_on(graph, edge, kind):
                yield edge, len(_Phase) * edge.target + _phase_after(graph, edge, _Phase(phase))

    search = BreadthFirst((0,), successors)
    if search.expand_all(lambda place: place == _FOUND) is None:
        return None
    return Walk(path_along(graph, search.actions_to(_FOUND)), wanted)


class ShownWalks:
    """The shortest walks of one graph that a test can show, one to each edge that is on any of them.

    A place is a node together with how far a walk has come.
    """

    def __init__(self, graph: RunGraph, *, cuts_short: bool) -> None:
        """Take no walk yet.

        Args:
            graph: the graph.
            cuts_short: whether the time limit may end a run that is not the last one.
        """
        self.graph = graph
        self._cuts_short = cuts_short
        self._edges: list[tuple[int, Edge]] = []
        self._search = BreadthFirst((0,), self._successors)

    def __iter__(self) -> Iterator[tuple[int, Edge]]:
        """Yield the edges with their places, the nearest to an initial state first."""
        while self._search.frontier:
            self._edges.clear()
            self._search.expand(self._search.expanded + 1)
            yield from self._edges

    def _successors(self, place: int) -> Iterator[tuple[Edge, int]]:
        for edge, following in shown_edges(self.graph, place, cuts_short=self._cuts_short):
            self._edges.append((place, edge))
            if following is not None:
                yield edge, following

    @staticmethod
    def node(place: int) -> int:
        """Return the node of a place."""
        return node_of(place)

    def path(self, place: int, edge: Edge | None = None) -> RunPath:
        """Return the walk to a place, and over an edge from there."""
        edges = self._search.actions_to(place)
        return path_along(self.graph, edges if edge is None else [*edges, edge])


def shown_edges(graph: RunGraph, place: int, *, cuts_short: bool) -> Iterator[tuple[Edge, int | None]]:
    """Yield the edges that a simulated run can take from a place, with the places that they lead to.

    A place is a node together with how far a walk has come; place 0 is node 0. `None` if no walk goes on there.

    Args:
        graph: the graph.
        place: the place.
        cuts_short: whether the time limit may end a run that is not the last one.
    """
    kind = _Kind(only_in_motion=False, cuts_short=cuts_short)
    node, phase = divmod(place, len(_Phase))
    for edge in graph.edges(node):
        if _can_be_shown(graph, node, edge, _Phase(phase), kind):
            goes_on = edge.target >= 0 and _may_go_on(graph, edge, kind)
            yield edge, len(_Phase) * edge.target + _phase_after(graph, edge, _Phase(phase)) if goes_on else None


def node_of(place: int) -> int:
    """Return the node of a place."""
    return place // len(_Phase)


def _phase_after(graph: RunGraph, edge: Edge, phase: _Phase) -> _Phase:
    label = graph.label(edge.number)
    if isinstance(label, Start):
        return _Phase.AT_FIRST if graph.is_at_rest(edge.target) else _Phase.ASKED
    if label.kind is HappeningKind.GOAL:
        return _Phase.ASKED
    gets_plan = label.kind is HappeningKind.ANSWER and graph.positions[edge.target - 1].awaits is not Awaits.CHANGE
    return _Phase.ANSWERED if gets_plan else phase


def _may_go_on(graph: RunGraph, edge: Edge, kind: _Kind) -> bool:
    label = graph.label(edge.number)
    return kind.cuts_short or isinstance(label, Start) or label.kind is not HappeningKind.TIME_LIMIT


def _can_be_shown(graph: RunGraph, node: int, edge: Edge, phase: _Phase, kind: _Kind) -> bool:
    """Return whether a simulated run can take an edge of a node."""
    label = graph.label(edge.number)
    if isinstance(label, Start) or label.kind is HappeningKind.GOAL:
        return True
    if label.kind in (HappeningKind.SETTLE, HappeningKind.PLAN_LIMIT):
        return False
    position = graph.positions[node - 1]
    if position.is_at_rest:
        return phase is not _Phase.AT_FIRST
    if label.kind is not HappeningKind.OUTSIDE:
        return not position.is_asking or label.kind is HappeningKind.ANSWER
    if kind.only_in_motion:
        return bool(position.in_flight) and not position.is_asking
    return phase is _Phase.ANSWERED or not position.is_asking
