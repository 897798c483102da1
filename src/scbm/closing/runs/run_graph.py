"""The graph of all runs for one goal: the positions of runs as nodes, and the events between them as edges."""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from scbm.closing.runs.situations import ANSWER, PlanningTooLargeError
from scbm.planning.engines.breadth_first import BreadthFirst

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.closing.runs.run_steps import RunSteps
    from scbm.closing.runs.situations import Happening, Position, RunStep
    from scbm.model import Predicate, Value


class Start(NamedTuple):
    """An initial state, named and packed."""

    values: Mapping[str, Value]
    packed: int


class Edge(NamedTuple):
    """An event in a run.

    Attributes:
        number: the number of the edge.
        target: the node that the event leads to; -1 if the run ends.
        visits: what the event visits.
    """

    number: int
    target: int
    visits: int


@dataclass
class RunGraph:
    """The explored part of the graph. Node 0 is no position: its edges are the initial states.

    Attributes:
        goal: the goal's name and predicate.
        starts: the initial states.
        positions: node n + 1 is position n.
        complete: whether everything was explored.
        planning_too_large: whether the exploration ended because planning exceeded its limit.
        reach: for each node everything that edges reachable from it visit.
        cut_offs: edges on which a limit of plans can end the run, each with its node and what is visited then.
    """

    goal: tuple[str, Predicate]
    starts: Sequence[Start]
    positions: list[Position]
    complete: bool
    planning_too_large: bool
    reach: list[int]
    cut_offs: list[tuple[int, Edge, int]]
    _first: array[int]
    _targets: array[int]
    _visits: list[int]
    _labels: list[Happening | Start]
    _parents: Mapping[int, tuple[int, int] | None]

    @property
    def visits(self) -> int:
        """Everything that runs visit."""
        return self.reach[0]

    def edges(self, node: int) -> Iterator[Edge]:
        """Yield the events that can occur in a node; none if the node was not expanded."""
        if node + 1 >= len(self._first):
            return
        for number in range(self._first[node], self._first[node + 1]):
            yield Edge(number, self._targets[number], self._visits[number])

    def calm_edges(self, node: int) -> Iterator[Edge]:
        """Return the events except replies that arrive before the planner has answered.

        In a simulation planning takes no time, so such replies arrive at the same moment, and not in every order.
        """
        is_asking = node > 0 and self.positions[node - 1].is_asking
        return (edge for edge in self.edges(node) if not is_asking or self._labels[edge.number] is ANSWER)

    def path_to(self, node: int) -> list[Edge]:
        """Return the edges of a shortest path from node 0: the path by which the exploration found the node."""
        edges = []
        while (parent := self._parents[node]) is not None:
            source, number = parent
            edges.append(Edge(number, node, self._visits[number]))
            node = source
        return edges[::-1]

    def label(self, edge: int) -> Happening | Start:
        """Return the event of an edge; the initial state for the first edge of a path."""
        return self._labels[edge]


def explore_runs(goal: tuple[str, Predicate], steps: RunSteps, starts: Sequence[Start], most: int) -> RunGraph:
    """Explore all runs for a goal breadth-first, so that a limit cuts off the most distant positions.

    Args:
        goal: the goal's name and predicate.
        steps: the steps of runs.
        starts: the initial states.
        most: the maximum number of positions.
    """
    return _RunExploration(steps, most).explore(goal, starts)


class _RunExploration:
    def __init__(self, steps: RunSteps, most: int) -> None:
        self._steps = steps
        self._starts: Sequence[Start] = ()
        self._most = most
        self._nodes: dict[Position, int] = {}
        self._positions: list[Position] = []
        self._first = array("q", [0])
        self._targets = array("q")
        self._visits: list[int] = []
        self._labels: list[Happening | Start] = []
        self._known: dict[int, int] = {}
        self._cut_offs: list[tuple[int, Edge, int]] = []
        self._cut_off = 0
        self._complete = True
        self._planning_too_large = False

    def explore(self, goal: tuple[str, Predicate], starts: Sequence[Start]) -> RunGraph:
        self._starts = starts
        exploration = BreadthFirst((0,), self._successors)
        try:
            exploration.expand_all()
        except PlanningTooLargeError:
            self._complete, self._planning_too_large = False, True
            self._first.extend([len(self._targets)] * (len(self._positions) + 2 - len(self._first)))
        return RunGraph(
            goal,
            starts,
            self._positions,
            self._complete,
            self._planning_too_large,
            _reach(self._first, self._targets, self._visits),
            self._cut_offs,
            self._first,
            self._targets,
            self._visits,
            self._labels,
            exploration.parents,
        )

    def _successors(self, node: int) -> Iterator[tuple[int, int]]:
        """Record the edges of a node, and yield their numbers and targets; nodes are numbered as they are found."""
        for label, step in self._steps_from(node):
            number = len(self._targets)
            target = self._add(node, label, step)
            if target >= 0:
                yield number, target
        self._first.append(len(self._targets))

    def _steps_from(self, node: int) -> Iterator[tuple[Happening | Start, RunStep]]:
        if not node:
            for start in self._starts:
                yield start, self._steps.begin(start.packed)
            return
        position = self._positions[node - 1]
        for happening in self._steps.happenings(position):
            yield happening, self._steps.after(position, happening)

    def _add(self, node: int, label: Happening | Start, step: RunStep) -> int:
        """Record an edge, and return its target; -1 if the run ends, or there are too many positions."""
        target = -1
        if step.target is not None:
            target = self._nodes.get(step.target, 0)
            if not target:
                if len(self._positions) >= self._most:
                    self._complete = False
                else:
                    self._positions.append(step.target)
                    target = self._nodes[step.target] = len(self._positions)
            target = target or -1
        self._targets.append(target)
        self._visits.append(self._known.setdefault(step.visits, step.visits))
        self._labels.append(label)
        if step.cut_off & ~self._cut_off:  # one edge of each kind is enough
            self._cut_off |= step.cut_off
            self._cut_offs.append((node, Edge(len(self._targets) - 1, target, step.visits), step.cut_off))
        return target


def _reach(first: array[int], targets: array[int], visits: list[int]) -> list[int]:
    """Return for each node what all edges reachable from it visit: a fixed point, propagated to predecessors."""
    count = len(first) - 1
    reach = [0] * count
    before: list[list[int]] = [[] for _ in range(count)]
    for node in range(count):
        for edge in range(first[node], first[node + 1]):
            reach[node] |= visits[edge]
            if targets[edge] >= 0:
                before[targets[edge]].append(node)
    todo, waits = list(range(count)), bytearray(b"\1") * count
    while todo:
        node = todo.pop()
        waits[node] = 0
        for other in before[node]:
            if reach[node] & ~reach[other]:
                reach[other] |= reach[node]
                if not waits[other]:
                    waits[other] = 1
                    todo.append(other)
    return reach
