"""Walks through the graph of runs that visit much of what is missing (decision 19)."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from msgspec import Struct, field

from scbm.closing.runs.run_graph import Edge, RunGraph, Start
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.running.untimed.situations import HappeningKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.model import Predicate
    from scbm.running.untimed.situations import Happening


class PathRun(Struct, frozen=True):
    """One run of a path; of the last one perhaps only the beginning.

    Attributes:
        goal: the name and the predicate of its goal.
        happenings: replies, deadlines that pass, answers of the planner, and changes from outside, in order.
        before: what changes from outside while the runner is at rest before the run, in order.
    """

    goal: tuple[str, Predicate]
    happenings: tuple[Happening, ...]
    before: tuple[Happening, ...] = ()


class RunPath(Struct, frozen=True):
    """Runs that follow each other, mostly one.

    Attributes:
        start: the initial state.
        runs: the runs, at least one.
    """

    start: Start
    runs: tuple[PathRun, ...]

    @property
    def length(self) -> int:
        """The number of events."""
        return len(self.runs) + sum(len(run.before) + len(run.happenings) for run in self.runs)


_MAX_COMPARED = 2_000
"""Maximum number of nodes that are expanded to compare legs, once one leg was found."""


class Walk(Struct, frozen=True):
    """A path through a graph.

    Attributes:
        path: the run, or the runs.
        visits: what is visited on the path.
    """

    path: RunPath
    visits: int


class _Leg(Struct, frozen=True):
    """A part of a walk: its edges, and the missing obligations that it visits or keeps reachable."""

    edges: list[Edge]
    kept: int


def best_walk(graphs: Sequence[RunGraph], missing: int) -> Walk | None:
    """Return a walk that visits much of what is missing; `None` if no walk visits any of it."""
    beginnings = [(graph, edge) for graph in graphs for edge in graph.edges(0)]
    promising = [(graph, edge, _promise(graph, edge, missing)) for graph, edge in beginnings]
    graph, edge, promise = max(promising, key=lambda each: each[2].bit_count(), default=(None, None, 0))
    if graph is None or edge is None or not promise:
        return None
    return _walk_on(graph, edge, missing)


def direct_walks(graphs: Sequence[RunGraph], wanted: int) -> Iterator[Walk]:
    """Yield for each goal the shortest walk that visits something wanted; over calm edges first, then over all."""
    for is_calm in (True, False):
        walks = (_shortest(graph, wanted, is_calm=is_calm) for graph in graphs)
        yield from sorted(filter(None, walks), key=lambda walk: walk.path.length)


_FOUND = -1
"""A virtual node behind each edge that visits what is wanted; no position has this number."""


def _shortest(graph: RunGraph, wanted: int, *, is_calm: bool) -> Walk | None:
    """Return the shortest walk from any initial state; of equally short ones the one from the most nominal state."""
    next_edges = graph.calm_edges if is_calm else graph.edges

    def successors(node: int) -> Iterator[tuple[Edge, int]]:
        for edge in next_edges(node):
            if edge.visits & wanted:
                yield edge, _FOUND
            elif edge.target >= 0 and graph.reach[edge.target] & wanted:
                yield edge, edge.target

    search = BreadthFirst((0,), successors)
    return None if search.expand_all(_is_found) is None else _walk(graph, search.actions_to(_FOUND))


def _is_found(node: int) -> bool:
    return node == _FOUND


def walk_over(graph: RunGraph, node: int, last: Edge) -> Walk:
    """Return the shortest walk that ends with the edge `last` of a node."""
    return _walk(graph, [*graph.path_to(node), last])


def _promise(graph: RunGraph, edge: Edge, missing: int) -> int:
    """Return what of the missing is visited on an edge or reachable behind it."""
    behind = graph.reach[edge.target] if edge.target >= 0 else 0
    return (edge.visits | behind) & missing


def _walk_on(graph: RunGraph, edge: Edge, missing: int) -> Walk:
    """Return the walk that goes to the nearest edge that visits something missing until none is reachable."""
    edges = [edge]
    visits = edge.visits
    while edges[-1].target >= 0:
        leg = _next_leg(graph, edges[-1].target, missing & ~visits)
        if leg is None:
            break
        edges += leg.edges
        visits |= _visits(leg.edges)
    return _walk(graph, edges)


def _walk(graph: RunGraph, edges: Sequence[Edge]) -> Walk:
    return Walk(path_along(graph, edges), _visits(edges))


def path_along(graph: RunGraph, edges: Sequence[Edge]) -> RunPath:
    """Return the path of edges that begins with an initial state.

    If the path ends with a runner at rest, the first goal is given once more, as a case ends with its last goal.
    """
    start = graph.label(edges[0].number)
    assert isinstance(start, Start)  # noqa: S101 - the edges of node 0 are the starts
    drafts: list[_PathDraft] = []
    before: list[Happening] = []
    for source, edge in pairwise(edges):
        label = graph.label(edge.number)
        assert not isinstance(label, Start)  # noqa: S101 - all edges but the first are events
        if label.kind is HappeningKind.GOAL:
            drafts.append(_PathDraft(graph.goals[label.number], before))
            before = []
        elif not graph.is_at_rest(source.target):
            drafts[-1].happenings.append(label)
        elif label.kind is HappeningKind.OUTSIDE:
            before.append(label)
    if before or not drafts:
        drafts.append(_PathDraft(graph.goal, before))
    return RunPath(start, tuple(PathRun(each.goal, tuple(each.happenings), tuple(each.before)) for each in drafts))


class _PathDraft(Struct):
    goal: tuple[str, Predicate]
    before: list[Happening] = field(default_factory=list)
    happenings: list[Happening] = field(default_factory=list)


def _next_leg(graph: RunGraph, node: int, missing: int) -> _Leg | None:
    """Return the path to an edge that visits something missing: of those that keep most reachable, the nearest."""
    most = graph.reach[node] & missing
    if not most:
        return None
    return _leg_along(graph, graph.calm_edges, node, missing, most) or _leg_along(
        graph, graph.edges, node, missing, most
    )


def _leg_along(
    graph: RunGraph, next_edges: Callable[[int], Iterable[Edge]], node: int, missing: int, most: int
) -> _Leg | None:
    legs: list[_Leg] = []  # in ascending quality

    def successors(here: int) -> Iterator[tuple[Edge, int]]:
        for edge in next_edges(here):
            if edge.visits & missing:
                leg = _leg(graph, [*search.actions_to(here), edge], missing)
                if not legs or leg.kept.bit_count() > legs[-1].kept.bit_count():
                    legs.append(leg)
                if legs[-1].kept == most:
                    yield edge, _FOUND
            if edge.target >= 0:
                yield edge, edge.target

    search = BreadthFirst((node,), successors)
    while search.frontier and (not legs or search.expanded <= _MAX_COMPARED):
        if search.expand(max(_MAX_COMPARED, search.expanded) + 1, _is_found) is not None:
            break
    return legs[-1] if legs else None


def _leg(graph: RunGraph, edges: list[Edge], missing: int) -> _Leg:
    return _Leg(edges, _visits(edges) & missing | _promise(graph, edges[-1], missing))


def _visits(edges: Sequence[Edge]) -> int:
    visits = 0
    for edge in edges:
        visits |= edge.visits
    return visits
