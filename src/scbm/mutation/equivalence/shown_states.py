"""Walks that a test can show to the states of runs, found by one search for all states."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from msgspec.structs import replace

from scbm.closing.runs.run_graph import Start, steps_from
from scbm.closing.scripts.outside_walks import ShownWalks, WalkKind
from scbm.mutation.equivalence.observed_runs import StateOfGoal
from scbm.running.untimed.situations import DEADLINE, TIME_LIMIT, Happening

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.closing.runs.run_graph import Edge, RunGraph
    from scbm.closing.runs.walks import RunPath
    from scbm.mutation.equivalence.observed_runs import ObservedRuns
    from scbm.mutation.equivalence.runner_differences import StateDifference


_Label: TypeAlias = Happening | int | None
"""An event, or a packed initial state; `None` is a time limit that the graph has no edge for."""


class _WalkToState(NamedTuple):
    """A walk to a node, and over an edge from there; at the end the time limit may pass."""

    walks: ShownWalks
    node: int
    edge: Edge | None
    is_cut_short: bool = False

    @property
    def path(self) -> RunPath:
        path = self.walks.path(self.node, self.edge)
        if not self.is_cut_short:
            return path
        *before, last = path.runs
        return replace(path, runs=(*before, replace(last, happenings=(*last.happenings, TIME_LIMIT))))


class ShownStates:
    """The nearest walks to the states of runs.

    The steps of runs are taken once more, in the order of the nearest walks, to learn which edge leads to which states.
    """

    def __init__(self, observed: ObservedRuns) -> None:
        """Take no walk yet."""
        self._observed = observed
        self._evaluated: dict[StateOfGoal, list[_WalkToState]] = {}
        self._deadlines: dict[StateOfGoal, _WalkToState] = {}
        self._parts = self._searches()

    def paths(self, difference: StateDifference) -> Iterator[RunPath]:
        """Yield walks on which a difference shows, the best first; none if no test can show it."""
        number = 0
        while True:
            found = self._known(difference)
            for walk in found[number:]:
                yield walk.path
            number = len(found)
            if not next(self._parts, False):
                return

    def _known(self, difference: StateDifference) -> Sequence[_WalkToState]:
        if not difference.at_deadline:
            return tuple(self._evaluated.get(difference.where, ()))
        walk = self._deadlines.get(difference.where)
        return () if walk is None else (walk,)

    def _searches(self) -> Iterator[bool]:
        """Search all graphs for walks of one kind, then for those of the next one; yield `True` after each kind."""
        for cuts_short in (False, True):
            for number, graph in enumerate(self._observed.graphs):
                _GraphSearch(self._observed, number, graph).note(
                    self._evaluated, self._deadlines, cuts_short=cuts_short
                )
            yield True


class _GraphSearch:
    """Notes the walks to the states of one graph."""

    def __init__(self, observed: ObservedRuns, number: int, graph: RunGraph) -> None:
        runs = observed.runs
        self._graph = graph
        self._number = number
        self._observed = observed
        self._goals = observed.goals_of(number)
        goals = [runs.model.goals[goal][1] for goal in self._goals]
        self._steps = [runs.steps(goal, position) for position, goal in enumerate(goals)]
        self._on_edges: dict[int, dict[_Label, list[StateOfGoal]]] = {}

    def note(
        self,
        evaluated: dict[StateOfGoal, list[_WalkToState]],
        deadlines: dict[StateOfGoal, _WalkToState],
        *,
        cuts_short: bool,
    ) -> None:
        """Note the first walk of this kind to each state, and to each deadline that passes."""
        walks = ShownWalks(self._graph, WalkKind(cuts_short=cuts_short))
        known: dict[StateOfGoal, None] = {}
        for node, edge in walks:
            label = self._graph.label(edge.number)
            on_edges = self._states_on_edges(node)
            if label is DEADLINE:
                position = self._graph.positions[node - 1]
                where = StateOfGoal(self._observed.goal_of(self._number, position), position.state)
                deadlines.setdefault(where, _WalkToState(walks, node, edge))
            own = _WalkToState(walks, node, edge), label.packed if isinstance(label, Start) else label
            for walk, key in (own, (_WalkToState(walks, node, None, is_cut_short=True), None)):
                for where in on_edges.get(key, ()):
                    if where not in known:
                        known[where] = None
                        evaluated.setdefault(where, []).append(walk)

    def _states_on_edges(self, node: int) -> dict[_Label, list[StateOfGoal]]:
        """Return the states in which guards are evaluated, by event; under `None` those after the time limit."""
        if node not in self._on_edges:
            self._on_edges[node] = dict(self._take_steps(node))
        return self._on_edges[node]

    def _take_steps(self, node: int) -> Iterator[tuple[_Label, list[StateOfGoal]]]:
        if node:
            for happening, _ in steps_from(self._steps, self._graph.positions[node - 1]):
                yield happening, self._take_evaluated()
            yield None, self._take_evaluated()
            return
        for start in self._graph.starts:
            self._steps[0].start(start.packed)
            yield start.packed, self._take_evaluated()

    def _take_evaluated(self) -> list[StateOfGoal]:
        """Return the states in which guards were evaluated since the last call."""
        found = []
        for goal, steps in zip(self._goals, self._steps, strict=True):
            found += [StateOfGoal(goal, state) for state in steps.evaluated]
            steps.evaluated.clear()
        return found
