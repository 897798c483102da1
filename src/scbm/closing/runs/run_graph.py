"""The graph of all runs for one goal, or for goals that follow each other: positions as nodes, events as edges.

The graph starts in the initial states that differ in relevant variables. Other variables, such as the parameters of
requests, would only multiply the situations. First the runner settles without a goal. The runner at rest, where a goal
can be given, is a position, too. Where goals follow each other, each end of a run leads to such a position.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right
from functools import partial
from itertools import islice, product
from math import prod
from operator import ne
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct

from scbm.model import InitialStates
from scbm.running.untimed.situations import (
    ANSWER,
    NO_GOAL,
    NO_MORE_GOALS,
    PLAN_LIMIT,
    Happening,
    HappeningKind,
    PlanningTooLargeError,
    RunStep,
    world_bits,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.model import Predicate, Value
    from scbm.running import Program
    from scbm.running.untimed.relevance import Relevance
    from scbm.running.untimed.run_steps import RunSteps
    from scbm.running.untimed.situations import Position, RunNote


MAX_STEPS_EACH = 20
"""Maximum number of steps for each position that may be explored: an input of many values has as many everywhere."""


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


_edge: Callable[[tuple[int, int, int]], Edge] = partial(tuple.__new__, Edge)  # half the time of the constructor


class RunGraph(Struct):
    """The explored part of the graph. Node 0 is no position: its edges are the initial states.

    Attributes:
        goals: the names and predicates of the goals: of the only one, or of all that follow each other.
        starts: the initial states.
        positions: node n + 1 is position n.
        complete: whether everything was explored.
        planning_too_large: whether the exploration ended because planning exceeded its limit.
        has_too_many_steps: whether it ended because too much can happen in each position.
        visits: what the edges visit.
        cut_offs: edges on which a limit of plans can end the run, each with its node and what is visited then.
    """

    goals: tuple[tuple[str, Predicate], ...]
    starts: Sequence[Start]
    positions: list[Position]
    complete: bool
    planning_too_large: bool
    has_too_many_steps: bool
    visits: int
    cut_offs: list[tuple[int, Edge, int]]
    _first: array[int]
    _targets: array[int]
    _visits: list[int]
    _labels: list[Happening | Start]
    _notes: list[tuple[RunNote, ...]]
    _found_by: array[int]
    _reach: list[int] | None = None

    @property
    def goal(self) -> tuple[str, Predicate]:
        """The first goal, which is the only one where each run has one."""
        return self.goals[0]

    @property
    def reach(self) -> list[int]:
        """For each node everything that edges reachable from it visit; found when it is first asked for."""
        if self._reach is None:
            self._reach = _reach(self._first, self._targets, self._visits)
        return self._reach

    def edges(self, node: int) -> Iterator[Edge]:
        """Return the events that can occur in a node; none if the node was not expanded."""
        first, last = self._first[node], self._first[node + 1]
        return map(_edge, zip(range(first, last), self._targets[first:last], self._visits[first:last], strict=True))

    def calm_edges(self, node: int) -> Iterator[Edge]:
        """Return the events except replies that arrive before the planner has answered.

        In a simulation planning takes no time, so such replies arrive at the same moment, and not in every order.
        """
        is_asking = node > 0 and self.positions[node - 1].is_asking
        return (edge for edge in self.edges(node) if not is_asking or self._labels[edge.number] is ANSWER)

    def is_at_rest(self, node: int) -> bool:
        """Return whether a node is a runner at rest between two runs; -1 is none, as a run has ended there."""
        return node > 0 and self.positions[node - 1].is_at_rest

    def path_to(self, node: int) -> list[Edge]:
        """Return the edges of a shortest path from node 0: the path by which the exploration found the node."""
        edges = []
        while node:
            number = self._found_by[node - 1]
            edges.append(Edge(number, node, self._visits[number]))
            node = bisect_right(self._first, number) - 1
        return edges[::-1]

    def notes(self, edge: int) -> tuple[RunNote, ...]:
        """Return the notes about the step of an edge; of one that a limit cuts off those about the whole step."""
        return self._notes[edge] if self._notes else ()

    @property
    def distinct_notes(self) -> Iterable[tuple[RunNote, ...]]:
        """The notes about steps, each once."""
        return {id(notes): notes for notes in self._notes}.values()

    def label(self, edge: int) -> Happening | Start:
        """Return the event of an edge; the initial state for the first edge of a path."""
        return self._labels[edge]


def steps_from(steps: Sequence[RunSteps], position: Position) -> Iterable[tuple[Happening, RunStep]]:
    """Return each event that is possible in a position, with its successor; `steps` are those of each goal."""
    return _steps_at_rest(steps, position) if position.is_at_rest else steps[position.goal].following(position)


def _steps_at_rest(steps: Sequence[RunSteps], rest: Position) -> Iterator[tuple[Happening, RunStep]]:
    yield from steps[0].at_rest(rest)
    for number, each in enumerate(steps if rest.goal == NO_GOAL else ()):
        yield Happening(HappeningKind.GOAL, number=number), each.begin(rest.state)


_REPORT_EVERY = 1_000
"""Progress is reported whenever so many positions were expanded."""


class RunExploration:
    """The exploration of all runs breadth-first, so that a limit cuts off the most distant positions.

    Nodes are numbered as they are found, and expanded in this order. What a limit of positions has ended can go on
    within a higher limit, to the graph that this limit would have given at once.
    """

    def __init__(  # noqa: PLR0913 - the runs, and what is kept of them
        self,
        goals: tuple[tuple[str, Predicate], ...],
        steps: Sequence[RunSteps],
        starts: Sequence[Start],
        *,
        until: int = 0,
        is_single: bool = False,
        keeps_notes: bool = False,
    ) -> None:
        """Explore nothing yet.

        Args:
            goals: the goal, or all goals that follow each other; each with its name and predicate.
            steps: the steps of the runs for each goal.
            starts: the initial states.
            until: bits of visits; the exploration ends when it has visited all of them. 0 for no such end.
            is_single: whether no goal is given after the end of a run.
            keeps_notes: whether steps have notes.
        """
        self._goals = goals
        self._steps = steps
        self._starts = starts
        self._until = self._left = until
        self._is_single = is_single
        self._keeps_notes = keeps_notes
        self._most = 0
        self._may_go_on = False
        self._nodes: dict[Position | int, int] = {}  # a runner at rest by its state, negated if it gets no more goals
        self._positions: list[Position] = []
        self._found_by = array("q")
        self._first = array("q", [0])
        self._targets = array("q")
        self._visits: list[int] = []
        self._labels: list[Happening | Start] = []
        self._notes: list[tuple[RunNote, ...]] = []
        self._known_notes: dict[tuple[RunNote, ...], tuple[RunNote, ...]] = {}
        self._known: dict[int, int] = {}
        self._visited = self._cut_off = 0
        self._cut_offs: list[tuple[int, int, int]] = []
        self._beyond: list[tuple[int, Position]] = []
        self._complete = True

    def explore(
        self,
        most: int,
        progress: Callable[[int], None] | None = None,
        *,
        may_go_on: bool = False,
        only_complete: bool = False,
    ) -> RunGraph:
        """Return the graph as far as a limit allows, which may be higher than before.

        Args:
            most: the maximum number of positions.
            progress: called at intervals with the number of positions.
            may_go_on: whether to keep what is needed to go on within a higher limit.
            only_complete: whether to end as soon as there are too many positions, rather than to expand those found.
        """
        self._most, self._may_go_on, self._complete = most, may_go_on, True
        beyond, self._beyond = self._beyond, []
        for number, position in beyond:
            self._targets[number] = self._node(position, number)
        planning_too_large = has_too_many_steps = False
        while len(self._first) <= len(self._positions) + 1 and not (planning_too_large or has_too_many_steps):
            node = len(self._first) - 1
            if self._has_visited_enough() or (only_complete and not self._complete):
                break
            has_too_many_steps = len(self._targets) > most * MAX_STEPS_EACH
            if progress is not None and node % _REPORT_EVERY == _REPORT_EVERY - 1:
                progress(len(self._positions))
            try:
                if not has_too_many_steps:
                    self._expand(node)
            except PlanningTooLargeError:
                planning_too_large = True
        is_ended = planning_too_large or has_too_many_steps or self._has_visited_enough()
        return self._graph(planning_too_large, has_too_many_steps, self._complete and not is_ended)

    def _graph(self, *ends: bool) -> RunGraph:
        """Return what was explored; `ends` are whether planning was too large, too much can happen, all is complete."""
        planning_too_large, has_too_many_steps, is_complete = ends
        unexpanded = len(self._positions) + 2 - len(self._first)
        return RunGraph(
            self._goals,
            self._starts,
            self._positions,
            is_complete,
            planning_too_large,
            has_too_many_steps,
            self._visited,
            [(node, Edge(n, self._targets[n], self._visits[n]), visits) for node, n, visits in self._cut_offs],
            self._first + array("q", [len(self._targets)] * unexpanded),
            self._targets,
            self._visits,
            self._labels,
            self._notes,
            self._found_by,
        )

    @property
    def beyond(self) -> int:
        """The number of positions that were found beyond the limit."""
        return len({position for _, position in self._beyond})

    def end_at(self, until: int) -> None:
        """End with the visits of `until`, some of those that it was to end with."""
        self._until = until
        self._left &= until

    def _has_visited_enough(self) -> bool:
        return self._until != 0 and not self._left

    def _expand(self, node: int) -> None:
        """Record the edges of a node, or of the initial states."""
        position = self._positions[node - 1] if node else None
        is_before_goal = position is None or position.goal == NO_GOAL
        nodes, targets, visits, labels = self._nodes, self._targets, self._visits, self._labels
        for label, step in self._first_steps() if position is None else steps_from(self._steps, position):
            target, visited, cut_off, rests, cut_off_rests, notes = step
            number = len(targets)
            if cut_off_rests or len(rests) > 1 or self._is_single:
                gives_goal = not is_before_goal or (position is not None and not _is_outside(label))
                self._record(label, step, NO_MORE_GOALS if self._is_single and gives_goal else NO_GOAL)
            else:  # most steps
                if target is not None:
                    targets.append(nodes.get(target) or self._node(target, number))
                elif rests:
                    targets.append(nodes.get(rests[0]) or self._node(self._steps[0].rest(rests[0]), number))
                else:
                    targets.append(-1)
                visits.append(self._known.setdefault(visited, visited))
                labels.append(label)
                if self._keeps_notes:
                    self._notes.append(self._known_notes.setdefault(notes, notes) if notes else ())
            self._visited |= visited
            if cut_off & ~self._cut_off:  # one edge of each kind is enough
                self._cut_off |= cut_off
                self._cut_offs.append((node, number, cut_off))
            if self._until:
                self._left &= ~(visited | cut_off)
                if not self._left:
                    break
        self._first.append(len(targets))

    def _first_steps(self) -> Iterator[tuple[Start, RunStep]]:
        """Yield the initial states, with what follows until the runner is settled without a goal."""
        for start in self._starts:
            yield start, self._steps[0].start(start.packed)

    def _record(self, label: Happening | Start, step: RunStep, goal: int) -> None:
        """Record the edges of a step, with this goal of a runner at rest after it."""
        if step.rests:
            for rest in step.rests:
                self._add(label, step.visits, rest, goal, step.notes)
        else:
            self._add(label, step.visits, step.target, goal, step.notes)
        for rest in dict.fromkeys(step.cut_off_rests):
            self._add(PLAN_LIMIT, step.visits | step.cut_off, rest, goal, step.notes)

    def _add(
        self,
        label: Happening | Start,
        visits: int,
        target: Position | int | None,
        goal: int,
        notes: tuple[RunNote, ...],
    ) -> None:
        """Record an edge; its target is a position, or the state of a runner at rest with this goal."""
        if isinstance(target, int):
            key = target if goal == NO_GOAL else ~target
            node = self._nodes.get(key) or self._node(self._steps[0].rest(target, goal), len(self._targets))
        else:
            node = -1 if target is None else self._node(target, len(self._targets))
        self._targets.append(node)
        self._visits.append(self._known.setdefault(visits, visits))
        self._labels.append(label)
        if self._keeps_notes:
            self._notes.append(self._known_notes.setdefault(notes, notes) if notes else ())

    def _node(self, position: Position, number: int) -> int:
        """Return the node of a position that an edge leads to; a new one if need be, -1 if there are too many."""
        key: Position | int = position
        if position.is_at_rest:
            key = position.state if position.goal == NO_GOAL else ~position.state
        node = self._nodes.get(key)
        if node is None and len(self._positions) >= self._most:
            self._complete = False
            if self._may_go_on:
                self._beyond.append((number, position))
            return -1
        if node is None:
            self._positions.append(position)
            self._found_by.append(number)
            node = self._nodes[key] = len(self._positions)
        return node


def _is_outside(label: Happening | Start) -> bool:
    return isinstance(label, Happening) and label.kind is HappeningKind.OUTSIDE


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


def initial_states(
    program: Program,
    relevance: Relevance,
    most: int,
    *,
    is_open: bool,
    values: Mapping[str, tuple[Value, ...]],
) -> tuple[tuple[Start, ...], bool]:
    """Return the initial states of runs that differ in relevant variables, those nearest to the nominal state first.

    Args:
        program: the compiled model.
        relevance: the variables that can influence a run.
        most: of the combinations of values at most so many are enumerated.
        is_open: whether variables that change freely from outside begin with any of their values.
        values: the values with which some of these variables begin, besides those of the nominal state.

    Returns:
        The states, and whether these are all.
    """
    model, found = program.model, dict[int, Start]()
    nominal, left, is_complete = model.nominal_state, most, True
    read = dict.fromkeys((*relevance.names, *model.initial_states.reads()))
    for beginning in InitialStates(model).beginnings(is_open=is_open):
        kept = {n: [v for v in known if v == nominal[n] or v in values.get(n, known)] for n, known in beginning.items()}
        nominal_first = [sorted(known, key=partial(ne, nominal[name])) for name, known in kept.items()]
        choices = [known if name in read else known[:1] for name, known in zip(beginning, nominal_first, strict=True)]
        for combination in islice(product(*choices), left):
            state = dict(zip(beginning, combination, strict=True))
            if model.initial_states.holds(state):
                packed = world_bits(program, state)
                found.setdefault(packed & relevance.mask, Start(state, packed))
        count = prod(map(len, choices))
        is_complete, left = is_complete and count <= left, max(0, left - count)
    nearest = sorted(found.values(), key=lambda start: sum(nominal[name] != v for name, v in start.values.items()))
    return tuple(nearest), is_complete
