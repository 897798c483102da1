"""Whether runs leave all goals reachable that plain runs leave reachable (semantics 7.12, `non_blocking`).

The rules are those of `testing.continuations.reachable_goals`, on the graph of all runs, whose steps are those of
continuations, too.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from scbm.cases.trace import End
from scbm.closing.proofs.proofs import runs_argument
from scbm.closing.requirements.violation_search import PossibleEvents, ViolatingWalk
from scbm.closing.runs.run_graph import Start
from scbm.closing.runs.walks import path_along
from scbm.closing.scripts.outside_walks import WalkKind, shown_edges
from scbm.model.requirements import BuiltIn
from scbm.model.sources import declared_as_states
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.proofcheck import ContinuationsArgument, GoalContinuations
from scbm.running.untimed.situations import NO_GOAL, PLAN_LIMIT, TIME_LIMIT, Happening, HappeningKind
from scbm.testing.continuations.reachable_goals import LIMIT_ENDS, nominal_outside

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence

    from scbm.closing.runs.all_runs import AllRuns
    from scbm.closing.runs.run_graph import Edge


class BlockedRest(NamedTuple):
    """A state at rest after which goals cannot be reached any more.

    Attributes:
        node: its node.
        goals: the numbers of the goals.
    """

    node: int
    goals: tuple[int, ...]


class BlockingSearch:
    """Searches all sequences of runs for one that makes a goal unreachable.

    Attributes:
        is_complete: whether all runs were explored.
    """

    def __init__(self, runs: AllRuns, states: Sequence[str] = ()) -> None:
        """Prepare the search.

        Args:
            runs: sequences of goals under canonical plans; their edges have notes.
            states: variables that nothing outside the model changes, whatever the model says.
        """
        self._runs = runs
        self._model = declared_as_states(runs.model, states)
        self._events = PossibleEvents(runs.model, states)
        self._graph = runs.graphs[0]
        self.is_complete = runs.stopped is None

    @cached_property
    def blocked(self) -> tuple[BlockedRest, ...]:
        """The states at rest of histories after which open goals cannot be reached, the nearest first."""
        found = []
        for node in self._nodes(self._is_of_history):
            if self._graph.is_at_rest(node):
                lost = tuple(goal for goal in self._open if node not in self._reaching[goal])
                found += [BlockedRest(node, lost)] if lost else []
        return tuple(found)

    @property
    def rests(self) -> dict[int, int]:
        """The packed states at rest that histories leave behind, each with its node."""
        nodes = (node for node in self._nodes(self._is_of_history) if self._graph.is_at_rest(node))
        return {self._graph.positions[node - 1].state: node for node in nodes}

    @cached_property
    def _open(self) -> tuple[int, ...]:
        """The goals that can be reached after all plain runs, and those that have to be."""
        again = self._runs.model.reachable_again
        goals = enumerate(self._runs.model.goals)
        return tuple(goal for goal, (name, _) in goals if name in again or self._plain_loss(goal) is None)

    def _plain_loss(self, goal: int) -> int | None:
        """Return the first rest of plain runs after which a goal cannot be reached; `None` if there is none."""
        rests = (node for node in self._plain.states[1:] if self._graph.is_at_rest(node))
        return next((node for node in rests if node not in self._reaching[goal]), None)

    @cached_property
    def _plain(self) -> BreadthFirst[int, Edge]:
        return self._searched(self._is_plain)

    @cached_property
    def _reaching(self) -> tuple[Mapping[int, int], ...]:
        """For each goal the nodes from which continuations lead to it, with the number of steps before the last."""
        graph = self._graph
        before: dict[int, list[int]] = {}
        ends: list[list[int]] = [[] for _ in graph.goals]
        for node in range(1, len(graph.positions) + 1):
            for edge in self._edges(node):
                if _may_continue(graph.label(edge.number)):
                    if edge.target >= 0:
                        before.setdefault(edge.target, []).append(node)
                    if any(note.end is End.REACHED for note in graph.notes(edge.number)):
                        ends[self._goal_on(node, edge)].append(node)
        return tuple(_leading_to(each, before) for each in ends)

    def _goal_on(self, node: int, edge: Edge) -> int:
        label = self._graph.label(edge.number)
        is_given = isinstance(label, Happening) and label.kind is HappeningKind.GOAL
        return label.number if is_given else self._graph.positions[node - 1].goal  # type: ignore[union-attr]

    def _edges(self, node: int) -> Iterator[Edge]:
        """Yield the edges of a node without changes of `states` from outside."""
        return (edge for edge in self._graph.edges(node) if self._graph.label(edge.number) in self._events)

    # histories

    def _nodes(self, follows: Callable[[int, Edge], bool]) -> Sequence[int]:
        """Return the nodes that some edges lead to, the nearest first."""
        return self._searched(follows).states[1:]

    def _searched(self, follows: Callable[[int, Edge], bool], start: int = 0) -> BreadthFirst[int, Edge]:
        def successors(node: int) -> Iterator[tuple[Edge, int]]:
            return ((edge, edge.target) for edge in self._edges(node) if edge.target > 0 and follows(node, edge))

        search = BreadthFirst((start,), successors)
        search.expand_all()
        return search

    def _is_of_history(self, node: int, edge: Edge) -> bool:  # noqa: ARG002 - as `_is_plain`
        return self._graph.label(edge.number) not in (TIME_LIMIT, PLAN_LIMIT) and not any(
            note.end in LIMIT_ENDS for note in self._graph.notes(edge.number)
        )

    def _is_plain(self, node: int, edge: Edge) -> bool:
        label = self._graph.label(edge.number)
        if isinstance(label, Start):
            return label in self._plain_starts
        if label.kind is HappeningKind.DEADLINE and self._graph.positions[node - 1].in_flight:
            return False
        return _may_continue(label) and label.kind is not HappeningKind.OUTSIDE

    @cached_property
    def _plain_starts(self) -> list[Start]:
        """The initial states with nominal inputs and published values; all if none of these is allowed."""
        outside = nominal_outside(self._model)
        starts = [label for edge in self._edges(0) if isinstance(label := self._graph.label(edge.number), Start)]
        nominal = [start for start in starts if all(start.values[name] == value for name, value in outside.items())]
        return nominal or starts

    # certificates

    @property
    def certificate(self) -> ContinuationsArgument:
        """The argument that no history makes an open goal unreachable; only if `blocked` is empty."""
        argument = runs_argument(self._runs)
        positions = self._graph.positions
        rests = [number for number, position in enumerate(positions) if position.is_at_rest]
        order = sorted(range(len(positions)), key=lambda number: max(positions[number].goal, NO_GOAL))
        numbers = {node + 1: number for number, node in enumerate(order)}
        space = self._runs.program.packing
        return ContinuationsArgument(
            argument.variables,
            argument.runs,
            argument.goals,
            argument.plans,
            rests=tuple(map(space.reader(argument.variables), (positions[number].state for number in rests))),
            answers=tuple(self._answer(goal, name, numbers) for goal, (name, _) in enumerate(self._graph.goals)),
        )

    def _answer(self, goal: int, name: str, numbers: Mapping[int, int]) -> GoalContinuations:
        lost = None if goal in self._open else self._plain_loss(goal)
        if lost is None:
            return GoalContinuations(name, tuple(self._reaching[goal].get(node, -1) for node in numbers))
        history = tuple(numbers[edge.target] for edge in self._plain.actions_to(lost))
        after = self._searched(lambda _, edge: _may_continue(self._graph.label(edge.number)), lost)
        return GoalContinuations(name, history=history, closed=tuple(sorted(numbers[node] for node in after.states)))

    # walks

    def walks(self, lost: Container[int] | None = None) -> Iterator[ViolatingWalk]:
        """Yield walks that a case can show to states at rest after which goals are lost, the shortest first.

        `lost` are the nodes of these states, by default those of `blocked`.
        """
        blocked = {each.node: None for each in self.blocked} if lost is None else lost
        graph = self._graph

        def successors(node: int) -> Iterator[tuple[Edge, int]]:
            for edge, goes_on in shown_edges(graph, node, WalkKind()):
                if goes_on and self._is_of_history(node, edge):
                    yield edge, edge.target

        search = BreadthFirst((0,), successors)
        search.expand_all()
        for node in search.states:
            if node in blocked:
                yield ViolatingWalk(BuiltIn.NON_BLOCKING.value, path_along(graph, search.actions_to(node)))


def _may_continue(label: Happening | Start) -> bool:
    """Return whether a continuation may have an event: requests succeed, and no limit ends a run."""
    if isinstance(label, Start) or label in (TIME_LIMIT, PLAN_LIMIT):
        return False
    return label.kind is not HappeningKind.REPLY or label.succeeded


def _leading_to(nodes: Iterable[int], before: Mapping[int, Iterable[int]]) -> Mapping[int, int]:
    """Return the nodes that lead to some nodes, each with its distance; `before` has the predecessors of each."""
    found = dict.fromkeys(nodes, 0)
    frontier = list(found)
    while frontier:
        new = {node: found[last] + 1 for last in frontier for node in before.get(last, ()) if node not in found}
        found |= new
        frontier = list(new)
    return found
