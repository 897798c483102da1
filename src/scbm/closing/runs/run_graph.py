"""The graph of all runs for one goal, or for goals that follow each other: positions as nodes, events as edges.

The graph starts in the initial states that differ in relevant variables. Other variables, such as the parameters of
requests, would only multiply the situations. First the runner settles without a goal. The runner at rest, where a goal
can be given, is a position, too. Where goals follow each other, each end of a run leads to such a position.
"""

from __future__ import annotations

from array import array
from functools import partial
from itertools import islice, product
from math import prod
from operator import ne
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct

from scbm.model import InitialStates
from scbm.planning.engines.breadth_first import BreadthFirst
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


class RunGraph(Struct):
    """The explored part of the graph. Node 0 is no position: its edges are the initial states.

    Attributes:
        goals: the names and predicates of the goals: of the only one, or of all that follow each other.
        starts: the initial states.
        positions: node n + 1 is position n.
        complete: whether everything was explored.
        planning_too_large: whether the exploration ended because planning exceeded its limit.
        has_too_many_steps: whether it ended because too much can happen in each position.
        reach: for each node everything that edges reachable from it visit.
        cut_offs: edges on which a limit of plans can end the run, each with its node and what is visited then.
    """

    goals: tuple[tuple[str, Predicate], ...]
    starts: Sequence[Start]
    positions: list[Position]
    complete: bool
    planning_too_large: bool
    has_too_many_steps: bool
    reach: list[int]
    cut_offs: list[tuple[int, Edge, int]]
    _first: array[int]
    _targets: array[int]
    _visits: list[int]
    _labels: list[Happening | Start]
    _notes: list[tuple[RunNote, ...]]
    _parents: Mapping[int, tuple[int, int] | None]

    @property
    def goal(self) -> tuple[str, Predicate]:
        """The first goal, which is the only one where each run has one."""
        return self.goals[0]

    @property
    def visits(self) -> int:
        """The obligations that runs visit."""
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

    def is_at_rest(self, node: int) -> bool:
        """Return whether a node is a runner at rest between two runs; -1 is none, as a run has ended there."""
        return node > 0 and self.positions[node - 1].is_at_rest

    def path_to(self, node: int) -> list[Edge]:
        """Return the edges of a shortest path from node 0: the path by which the exploration found the node."""
        edges = []
        while (parent := self._parents[node]) is not None:
            source, number = parent
            edges.append(Edge(number, node, self._visits[number]))
            node = source
        return edges[::-1]

    def notes(self, edge: int) -> tuple[RunNote, ...]:
        """Return the notes about the step of an edge; of one that a limit cuts off those about the whole step."""
        return self._notes[edge]

    @property
    def distinct_notes(self) -> Iterable[tuple[RunNote, ...]]:
        """The notes about steps, each once."""
        return {id(notes): notes for notes in self._notes}.values()

    def label(self, edge: int) -> Happening | Start:
        """Return the event of an edge; the initial state for the first edge of a path."""
        return self._labels[edge]


def explore_runs(  # noqa: PLR0913 - the runs, and what limits their exploration
    goals: tuple[tuple[str, Predicate], ...],
    steps: Sequence[RunSteps],
    starts: Sequence[Start],
    most: int,
    progress: Callable[[int], None] | None = None,
    *,
    until: int = 0,
    is_single: bool = False,
) -> RunGraph:
    """Explore all runs for goals breadth-first, so that a limit cuts off the most distant positions.

    Args:
        goals: the goal, or all goals that follow each other; each with its name and predicate.
        steps: the steps of the runs for each goal.
        starts: the initial states.
        most: the maximum number of positions.
        progress: called at intervals with the number of positions.
        until: bits of visits; the exploration ends when it has visited all of them. 0 for no such end.
        is_single: whether no goal is given after the end of a run.
    """
    exploration = _RunExploration(steps, most, progress, until=until, is_single=is_single)
    return exploration.explore(goals, starts)


def steps_from(steps: Sequence[RunSteps], position: Position) -> Iterator[tuple[Happening, RunStep]]:
    """Yield each event that is possible in a position, with its successor; `steps` are those of each goal."""
    if position.is_at_rest:
        yield from steps[0].at_rest(position)
        for number, each in enumerate(steps if position.goal == NO_GOAL else ()):
            yield Happening(HappeningKind.GOAL, number=number), each.begin(position.state)
        return
    pursued = steps[position.goal]
    for happening in pursued.happenings(position):
        yield happening, pursued.after(position, happening)


class _TooManyWaysError(Exception):
    """There are more than `MAX_STEPS_EACH` steps for each position that may be explored."""


class _EnoughVisitedError(Exception):
    """The exploration is over: every obligation that it looks for was visited."""


_REPORT_EVERY = 1_000
"""Progress is reported whenever so many positions were expanded."""


class _RunExploration:
    def __init__(
        self,
        steps: Sequence[RunSteps],
        most: int,
        progress: Callable[[int], None] | None,
        *,
        until: int,
        is_single: bool,
    ) -> None:
        self._steps = steps
        self._is_single = is_single
        self._until = until
        self._left = until
        self._progress = progress
        self._starts: Sequence[Start] = ()
        self._rest_goal = NO_GOAL
        self._most = most
        self._nodes: dict[Position, int] = {}
        self._positions: list[Position] = []
        self._first = array("q", [0])
        self._targets = array("q")
        self._visits: list[int] = []
        self._labels: list[Happening | Start] = []
        self._notes: list[tuple[RunNote, ...]] = []
        self._known_notes: dict[tuple[RunNote, ...], tuple[RunNote, ...]] = {}
        self._known: dict[int, int] = {}
        self._cut_offs: list[tuple[int, Edge, int]] = []
        self._cut_off = 0
        self._complete = True
        self._planning_too_large = self._has_too_many_steps = False

    def explore(self, goals: tuple[tuple[str, Predicate], ...], starts: Sequence[Start]) -> RunGraph:
        self._starts = starts
        exploration = BreadthFirst((0,), self._successors)
        try:
            exploration.expand_all()
            self._complete = self._complete and not self._has_visited_enough()
        except (PlanningTooLargeError, _TooManyWaysError, _EnoughVisitedError) as error:
            self._complete, self._planning_too_large = False, isinstance(error, PlanningTooLargeError)
            self._has_too_many_steps = isinstance(error, _TooManyWaysError)
            self._first.extend([len(self._targets)] * (len(self._positions) + 2 - len(self._first)))
        return RunGraph(
            goals,
            starts,
            self._positions,
            self._complete,
            self._planning_too_large,
            self._has_too_many_steps,
            _reach(self._first, self._targets, self._visits),
            self._cut_offs,
            self._first,
            self._targets,
            self._visits,
            self._labels,
            self._notes,
            exploration.parents,
        )

    def _successors(self, node: int) -> list[tuple[int, int]]:
        """Record the edges of a node, and return their numbers and targets; nodes are numbered as they are found."""
        if self._has_visited_enough():
            raise _EnoughVisitedError
        if len(self._targets) > self._most * MAX_STEPS_EACH:
            raise _TooManyWaysError
        if self._progress is not None and node % _REPORT_EVERY == _REPORT_EVERY - 1:
            self._progress(len(self._positions))
        found: list[tuple[int, int]] = []
        for label, step in steps_from(self._steps, self._positions[node - 1]) if node else self._first_steps():
            self._record(node, label, step, found)
            if self._until and not self._left:
                break
        self._first.append(len(self._targets))
        return found

    def _has_visited_enough(self) -> bool:
        return self._until != 0 and not self._left

    def _first_steps(self) -> Iterator[tuple[Start, RunStep]]:
        """Yield the initial states, with what follows until the runner is settled without a goal."""
        for start in self._starts:
            yield start, self._steps[0].start(start.packed)

    def _record(self, node: int, label: Happening | Start, step: RunStep, found: list[tuple[int, int]]) -> None:
        """Record the edges of a step, mostly one, and add the number and the target of each that ends no run."""
        number = len(self._targets)
        is_begun = node > 0 and (not _is_outside(label) or self._positions[node - 1].goal != NO_GOAL)
        self._rest_goal = NO_MORE_GOALS if self._is_single and is_begun else NO_GOAL
        notes = self._known_notes.setdefault(step.notes, step.notes) if step.notes else ()
        self._add(label, step.visits, step.target, step.rests[:1], notes, found)
        if step.cut_off & ~self._cut_off:  # one edge of each kind is enough
            self._cut_off |= step.cut_off
            self._cut_offs.append((node, Edge(number, self._targets[number], step.visits), step.cut_off))
        for rest in step.rests[1:]:
            self._add(label, step.visits, None, (rest,), notes, found)
        for rest in dict.fromkeys(step.cut_off_rests) if step.cut_off_rests else ():
            self._add(PLAN_LIMIT, step.visits | step.cut_off, None, (rest,), notes, found)
        if self._until:
            self._left &= ~(step.visits | step.cut_off)

    def _add(  # noqa: PLR0913, PLR0917 - the parts of an edge
        self,
        label: Happening | Start,
        visits: int,
        position: Position | None,
        rests: tuple[int, ...],
        notes: tuple[RunNote, ...],
        found: list[tuple[int, int]],
    ) -> None:
        """Record an edge; its target is -1 if the run ends, or there are too many positions."""
        if rests:
            position = self._steps[0].rest(rests[0], self._rest_goal)
        target = -1
        if position is not None:
            target = self._nodes.get(position, 0)
            if not target:
                if len(self._positions) >= self._most:
                    self._complete = False
                else:
                    self._positions.append(position)
                    target = self._nodes[position] = len(self._positions)
            target = target or -1
        if target >= 0:
            found.append((len(self._targets), target))
        self._targets.append(target)
        self._visits.append(self._known.setdefault(visits, visits))
        self._labels.append(label)
        self._notes.append(notes)


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
