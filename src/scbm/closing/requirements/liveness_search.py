"""Whether `p leads to q` holds in all runs: where runs can end, wait or go round with q due (semantics 7.3, 9.3)."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, NamedTuple, cast

from scbm.cases.trace import End
from scbm.closing.requirements.components import components
from scbm.closing.requirements.violation_search import ViolatingWalk, judged_from, judged_over
from scbm.closing.runs.walks import path_along
from scbm.closing.scripts.outside_walks import WalkKind, shown_edges
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.running.untimed.situations import PLAN_LIMIT, TIME_LIMIT, Happening, HappeningKind, NoteKind, WaitsFor
from scbm.testing.continuations.reachable_goals import LIMIT_ENDS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.closing.requirements.sentence_monitor import SentenceJudgement, SentenceMonitor
    from scbm.closing.requirements.violation_search import Judgement, Place
    from scbm.closing.runs.all_runs import AllRuns
    from scbm.closing.runs.run_graph import Edge, RunGraph

    _Following = Mapping[Place, Sequence[tuple[Edge, Place]]]

_MOST_ROUNDS = 100
"""Maximum number of places from which a round is looked for, and of rounds that are judged for each."""

_LEADS_ON = (HappeningKind.ANSWER, HappeningKind.DEADLINE, HappeningKind.GIVE_UP, HappeningKind.NEXT)
"""What comes by itself, also if no reply comes and nothing changes from outside."""


class LivenessSearch:
    """Searches all runs for one in which q stays due.

    Attributes:
        is_complete: whether all runs were searched.
        ends_due: whether a run can end, or wait for nothing but a limit, while q is due.
        goes_round: the operations that runs may repeat without end while q is due; `None` if they cannot.
        is_due_when_settled: whether q can be due in a settled situation of a run, so that time can pass.
    """

    def __init__(self, runs: AllRuns, monitor: SentenceMonitor, most: int) -> None:
        """Search all runs.

        Args:
            runs: the runs; their edges have notes.
            monitor: the judge of one requirement.
            most: the maximum number of situations, each with q due or not.
        """
        self._runs = runs
        self._monitor = monitor
        self._most = most
        self.is_complete = runs.stopped is None
        self.ends_due = self.is_due_when_settled = False
        self.goes_round: tuple[str, ...] | None = None
        self._rounds: list[_Round] = []
        for graph in runs.graphs:
            self._look(graph, self._explored(graph))

    def _explored(self, graph: RunGraph) -> _Following:
        """Return all places, each with the steps in which q stays due."""
        following: dict[Place, list[tuple[Edge, Place]]] = {}

        def successors(place: Place) -> Iterator[tuple[Edge, Place]]:
            kept = following.setdefault(place, [])
            for edge, judged in judged_from(self._monitor, graph, place):
                self.ends_due = self.ends_due or _ends_due(graph, place[0], edge, judged)
                if edge.target >= 0:
                    kept += [(edge, (edge.target, True))] if cast("SentenceJudgement", judged).stays else []
                    yield edge, (edge.target, judged.memory)

        search = BreadthFirst(((0, self._monitor.start),), successors)
        search.expand(self._most)
        self.is_complete = self.is_complete and not search.frontier
        self._most = max(0, self._most - search.expanded)
        return following

    def _look(self, graph: RunGraph, following: _Following) -> None:
        """Note what happens where q is due."""
        due = {place: None for place in following if place[0] and place[1]}
        for node, _ in due:
            self.ends_due = self.ends_due or _only_waits(graph, node)
            self.is_due_when_settled |= graph.positions[node - 1].awaits is not WaitsFor.NEXT
        inside = {
            place: [(e, next_) for e, next_ in following[place] if next_ in due and _may_repeat(graph, place[0], e)]
            for place in due
        }
        targets = {place: [next_ for _, next_ in steps] for place, steps in inside.items()}
        for component in components(targets):
            steps = {place: [step for step in inside[place] if step[1] in component] for place in component}
            edges = [edge for each in steps.values() for edge, _ in each]
            if edges and self._is_fair(graph, component, edges):
                self._rounds.append(_Round(graph, steps))
                self.goes_round = self._operations(graph, component) if self.goes_round is None else self.goes_round

    def _is_fair(self, graph: RunGraph, component: Iterable[Place], edges: Sequence[Edge]) -> bool:
        """Return whether runs can go round without awaiting one plan, reply or deadline all the time."""
        positions = [graph.positions[node - 1] for node, _ in component]
        if all(position.is_at_rest for position in positions):
            return False
        labels = [label for edge in edges if isinstance(label := graph.label(edge.number), Happening)]
        notes = [note for edge in edges for note in graph.notes(edge.number)]
        kinds = {label.kind: None for label in labels}
        if all(position.is_asking for position in positions) and HappeningKind.ANSWER not in kinds:
            return False
        ended = any(note.kind is NoteKind.ENDS_OPERATION for note in notes) or HappeningKind.DEADLINE in kinds
        if all(self._has_timer(position.state) for position in positions) and not ended:
            return False
        return all(
            any(line.number not in position.in_flight for position in positions)
            or any(label.kind is HappeningKind.REPLY and label.resource == line.resource.name for label in labels)
            or any(note.kind is NoteKind.SENDS and note.resource == line.number for note in notes)
            for line in self._runs.program.requests
        )

    def _has_timer(self, state: int) -> bool:
        current = self._runs.program.current(state)
        return current is not None and current.has_timer

    def _operations(self, graph: RunGraph, component: Iterable[Place]) -> tuple[str, ...]:
        found = (self._runs.program.current(graph.positions[node - 1].state) for node, _ in component)
        return tuple(dict.fromkeys(each.operation.name for each in found if each is not None))

    # walks

    def walks(self, name: str) -> Iterator[ViolatingWalk]:
        """Yield walks to ends, waits and rounds with q due, for each graph the shortest ones first."""
        for cuts_short in (False, True):
            for graph in self._runs.graphs:
                yield from self._walks_in(graph, name, WalkKind(cuts_short=cuts_short))
        for each in self._rounds:
            yield from self._walks_round(each, name)

    def _walks_in(self, graph: RunGraph, name: str, kind: WalkKind) -> Iterator[ViolatingWalk]:
        found: list[tuple[Place, Edge]] = []

        def successors(place: Place) -> Iterator[tuple[Edge, Place]]:
            for edge, goes_on in shown_edges(graph, place[0], kind):
                for judged in judged_over(self._monitor, graph, edge, place[1]):
                    if _ends_due(graph, place[0], edge, judged):
                        found.append((place, edge))
                    if goes_on:
                        yield edge, (edge.target, judged.memory)

        search = BreadthFirst(((0, self._monitor.start),), successors)
        tried = 0
        while search.frontier:
            search.expand(search.expanded + 1)
            for waiting in search.states[tried:]:
                node, is_due = waiting
                if node and is_due and _only_waits(graph, node):
                    resources = self._runs.model.resources
                    missing = tuple(resources[number].name for number in graph.positions[node - 1].in_flight)
                    yield ViolatingWalk(name, path_along(graph, search.actions_to(waiting)), missing)
            tried = len(search.states)
            for place, edge in found:
                yield ViolatingWalk(name, path_along(graph, [*search.actions_to(place), edge]))
            found.clear()

    def _walks_round(self, found: _Round, name: str) -> Iterator[ViolatingWalk]:
        """Yield walks that go round twice until a time limit, the shortest way to a round first."""
        graph = found.graph

        def successors(place: Place) -> Iterator[tuple[Edge, Place]]:
            for edge, goes_on in shown_edges(graph, place[0], WalkKind()):
                for judged in judged_over(self._monitor, graph, edge, place[1]):
                    if goes_on:
                        yield edge, (edge.target, judged.memory)

        search = BreadthFirst(((0, self._monitor.start),), successors)
        search.expand(self._most)
        for place in islice((each for each in search.states if each in found.steps), _MOST_ROUNDS):
            once = next((each for each in found.from_place(place) if self._is_fair(graph, *_along(place, each))), [])
            if once:
                limit = [edge for edge in graph.edges(place[0]) if graph.label(edge.number) is TIME_LIMIT]
                edges = [*search.actions_to(place), *once, *once, *limit[:1]]
                yield ViolatingWalk(name, path_along(graph, edges), goes_round=True)


class _Round(NamedTuple):
    """Places between which runs can go round with q due.

    Attributes:
        graph: their graph.
        steps: for each place the steps to others of them.
    """

    graph: RunGraph
    steps: Mapping[Place, Sequence[tuple[Edge, Place]]]

    def from_place(self, place: Place) -> Iterator[list[Edge]]:
        """Yield rounds from a place and back, one over each step, the shortest first."""
        before: dict[Place, list[tuple[Edge, Place]]] = {each: [] for each in self.steps}
        for source, steps in self.steps.items():
            for edge, target in steps:
                before[target].append((edge, source))
        there = BreadthFirst((place,), lambda here: self.steps[here])
        back = BreadthFirst((place,), lambda here: before[here])
        there.expand_all()
        back.expand_all()
        lengths = [
            (there.depth(source) + back.depth(target), edge, source, target)
            for source, steps in self.steps.items()
            for edge, target in steps
        ]
        for _, edge, source, target in sorted(lengths, key=lambda each: each[0])[:_MOST_ROUNDS]:
            yield [*there.actions_to(source), edge, *reversed(back.actions_to(target))]


def _along(place: Place, edges: Sequence[Edge]) -> tuple[list[Place], Sequence[Edge]]:
    """Return the places of a round with its edges."""
    return [place, *((edge.target, True) for edge in edges)], edges


def _ends_due(graph: RunGraph, node: int, edge: Edge, judged: Judgement) -> bool:
    """Return whether q is due after the end of a run that no limit ended."""
    if not judged.memory or not node or _is_limit(graph, edge):
        return False
    label = graph.label(edge.number)
    gives_goal = isinstance(label, Happening) and label.kind is HappeningKind.GOAL
    if graph.is_at_rest(node) and not gives_goal:  # a run can end in the step in which its goal is given
        return False
    return edge.target < 0 or graph.is_at_rest(edge.target)


def _is_limit(graph: RunGraph, edge: Edge) -> bool:
    """Return whether a limit ends the run on an edge; a run that asks for plans without end is a livelock."""
    label, notes = graph.label(edge.number), graph.notes(edge.number)
    if label is PLAN_LIMIT:
        return all(note.end is not End.LIVELOCK for note in notes)
    return label is TIME_LIMIT or any(note.end in LIMIT_ENDS for note in notes)


def _only_waits(graph: RunGraph, node: int) -> bool:
    """Return whether only a limit ends a run in a situation if no reply comes and nothing changes from outside."""
    if graph.is_at_rest(node):
        return False
    labels = (graph.label(edge.number) for edge in graph.edges(node))
    return not any(isinstance(label, Happening) and label.kind in _LEADS_ON for label in labels)


def _may_repeat(graph: RunGraph, node: int, edge: Edge) -> bool:
    """Return whether a round may have an edge of a node: no limit ends the run, and no request fails or times out."""
    label = graph.label(edge.number)
    if not isinstance(label, Happening) or _is_limit(graph, edge):
        return False
    if label.kind is HappeningKind.DEADLINE and graph.positions[node - 1].in_flight:
        return False
    return label.kind is not HappeningKind.REPLY or label.succeeded
