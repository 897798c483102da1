"""Walks in which inputs and published values change as a test can show it, preferably in mid motion.

A simulated planner answers at once. So a change while a plan is awaited can be shown only from the second plan on:
`plan.state` becomes `planning` then, and an injection can wait for that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.runs.run_graph import Start
from scbm.closing.runs.situations import HappeningKind
from scbm.closing.runs.walks import RunPath, Walk, direct_walks
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.proofcheck import Awaits

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.closing.runs.run_graph import Edge, RunGraph

_FOUND = -1
"""A virtual node behind each edge that visits what is wanted."""


def natural_walks(graphs: Sequence[RunGraph], wanted: int) -> Iterator[Walk]:
    """Yield for each goal the shortest walks that visit something wanted: those with changes in mid motion first."""
    for only_in_motion in (True, False):
        walks = (_shortest(graph, wanted, only_in_motion=only_in_motion) for graph in graphs)
        yield from sorted(filter(None, walks), key=lambda walk: len(walk.path.happenings))
    yield from direct_walks(graphs, wanted)


def _shortest(graph: RunGraph, wanted: int, *, only_in_motion: bool) -> Walk | None:
    """Return the shortest walk from any initial state; `None` if no walk of this kind visits anything wanted."""

    def successors(place: int) -> Iterator[tuple[Edge, int]]:
        node, was_answered = divmod(place, 2)
        for edge in graph.edges(node):
            if not _can_be_shown(graph, node, edge, bool(was_answered), only_in_motion=only_in_motion):
                continue
            if edge.visits & wanted:
                yield edge, _FOUND
            elif edge.target >= 0 and graph.reach[edge.target] & wanted:
                yield edge, 2 * edge.target + (was_answered or _gets_plan(graph, edge))

    search = BreadthFirst((0,), successors)
    if search.expand_all(lambda place: place == _FOUND) is None:
        return None
    start, *happenings = [graph.label(edge.number) for edge in search.actions_to(_FOUND)]
    assert isinstance(start, Start)  # noqa: S101 - the edges of node 0 are the starts
    path = RunPath(start, tuple(each for each in happenings if not isinstance(each, Start)))
    return Walk(graph.goal, path, wanted)


def _gets_plan(graph: RunGraph, edge: Edge) -> bool:
    """Return whether the planner answers with a plan on an edge."""
    label = graph.label(edge.number)
    is_answer = not isinstance(label, Start) and label.kind is HappeningKind.ANSWER
    return is_answer and graph.positions[edge.target - 1].awaits is not Awaits.CHANGE


def _can_be_shown(graph: RunGraph, node: int, edge: Edge, was_answered: bool, *, only_in_motion: bool) -> bool:  # noqa: FBT001 - a part of the place
    """Return whether a simulated run can take an edge of a node."""
    label = graph.label(edge.number)
    if isinstance(label, Start):
        return True
    position = graph.positions[node - 1]
    if label.kind is not HappeningKind.OUTSIDE:
        return not position.is_asking or label.kind is HappeningKind.ANSWER
    if only_in_motion:
        return bool(position.in_flight) and not position.is_asking
    return was_answered or not position.is_asking
