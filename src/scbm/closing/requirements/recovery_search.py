"""All runs with one failed or missing reply: whether each reaches its goal, or ends as allowed (semantics 7.12).

Nothing changes from outside in these runs, and no limit ends them. Time is left out as in all graphs of runs, but for
one thing: a deadline passes only if each request in flight gets no reply, or may take longer in a simulation.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from scbm.cases.trace import End
from scbm.closing.requirements.violation_search import ViolatingWalk
from scbm.closing.runs.walks import path_along
from scbm.model import Assign, Constant, GoalOrder, OperationState
from scbm.model.requirements import BuiltIn
from scbm.model.sources import declared_as_states
from scbm.model.variables import CURRENT_STATE
from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.running.lifecycle import timer_ns
from scbm.running.untimed.situations import PLAN_LIMIT, TIME_LIMIT, Happening, HappeningKind, NoteKind
from scbm.testing.continuations.waiting_runs import OutsideHelp
from scbm.testing.request_faults import RequestFate, is_at_fault
from scbm.testing.request_protocol import sets
from scbm.testing.verdicts import ExcuseRules

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.closing.runs.all_runs import AllRuns
    from scbm.closing.runs.run_graph import Edge, RunGraph
    from scbm.model import Action, BehaviorModel, Resource
    from scbm.running.compiled_steps import RequestLine
    from scbm.running.untimed.situations import Position

_NONE = -1
_NOT_JUDGED = (End.REACHED, End.LIVELOCK, End.MODEL_ERROR)
"""Ends that `recovers` is not about: livelocks and errors of the model fail each case."""

_ENDLESS = (End.TIME_LIMIT, End.REPLAN_LIMIT)
"""The ends of a run that goes on without end."""


class FaultPlace(NamedTuple):
    """A node of the graph, together with what has gone wrong on the way.

    Attributes:
        node: the node.
        has_fault: whether one reply has failed or is missing.
        missing: the number of the resource whose request is in flight and gets no reply; -1 if there is none.
    """

    node: int
    has_fault: bool = False
    missing: int = _NONE


class MissedGoal(NamedTuple):
    """A run with one fault that may miss its goal.

    Attributes:
        graph: the graph of its run.
        place: where it waits, repeats, or takes its last edge.
        edge: its last edge; `None` if it goes on without end.
        end: how it ends.
        operations: the operations that it repeats without end, if it does.
    """

    graph: RunGraph
    place: FaultPlace
    edge: Edge | None
    end: End
    operations: tuple[str, ...] = ()


class RecoverySearch:
    """Searches all runs with one failed or missing reply for one that misses its goal.

    Attributes:
        is_complete: whether all of these runs were searched.
        is_any_waiting: whether a run waits for a change from outside, which leads it to its goal.
        is_any_unknown: whether a run waits, and it is unknown what changes from outside lead to.
        is_any_livelocked: whether a run ends in a livelock, which fails its case by itself.
    """

    def __init__(self, runs: AllRuns, most: int, states: Sequence[str] = ()) -> None:
        """Search for nothing yet.

        Args:
            runs: the runs in which nothing changes from outside; their edges have notes.
            most: the maximum number of places.
            states: variables that nothing outside the model changes, whatever the model says.
        """
        self._runs = runs
        self._program = runs.program
        self._model = runs.model
        self._rules = ExcuseRules.of(declared_as_states(runs.model, states))
        allowed = (*self._rules.may_end, *chain.from_iterable(ends for _, ends in self._rules.goals_may_end))
        self._follows_time_limit = End.TIME_LIMIT.value in allowed  # else it ends only runs that wait
        self._follows_limits = End.REPLAN_LIMIT.value in allowed  # else a run that a limit of plans ends is undecided
        self._numbers = {resource.name: number for number, resource in enumerate(self._model.resources)}
        self._resent = _sent_by_automatic_transitions(self._model)
        self._searches: dict[int, BreadthFirst[FaultPlace, Edge | None]] = {}
        self._left = most
        self.is_complete = runs.stopped is None
        self.is_any_waiting = False
        self.is_any_unknown = False
        self.is_any_livelocked = False

    def missed(self) -> tuple[MissedGoal, ...]:
        """Return runs that may miss their goal, for each graph the shortest first; `is_complete` says whether all."""
        found: list[MissedGoal] = []
        for number, graph in enumerate(self._runs.graphs):
            search = self._search(number, graph)
            for place in search.states:
                found += self._missed_at(graph, place)
            found += self._endless(graph, search.states)
        return tuple(found)

    def walk(self, missed: MissedGoal) -> ViolatingWalk:
        """Return the walk to a goal that is missed."""
        number = next(n for n, graph in enumerate(self._runs.graphs) if graph is missed.graph)
        edges = [edge for edge in self._searches[number].actions_to(missed.place) if edge is not None]
        if missed.edge is not None:
            edges.append(missed.edge)
        lost = missed.place.missing
        resources = () if lost == _NONE else (self._model.resources[lost].name,)
        return ViolatingWalk(BuiltIn.RECOVERS.value, path_along(missed.graph, edges), resources)

    # the runs

    def _search(self, number: int, graph: RunGraph) -> BreadthFirst[FaultPlace, Edge | None]:
        def successors(place: FaultPlace) -> Iterator[tuple[Edge | None, FaultPlace]]:
            for edge, following in self._following(graph, place):
                if following.node >= 0:
                    yield edge, following
            if not place.has_fault and place.node:  # in a settled position time passes, until a reply is overdue
                for resource in graph.positions[place.node - 1].in_flight:
                    overdue = is_at_fault(RequestFate(is_overdue=True))
                    yield None, FaultPlace(place.node, has_fault=overdue, missing=resource)

        self._searches[number] = search = BreadthFirst((FaultPlace(0),), successors)
        search.expand(self._left)
        self.is_complete = self.is_complete and not search.frontier
        self._left = max(0, self._left - search.expanded)
        return search

    def _following(self, graph: RunGraph, place: FaultPlace) -> Iterator[tuple[Edge, FaultPlace]]:
        """Yield the edges with at most one fault, with the places that they lead to; node -1 after the last end."""
        position = graph.positions[place.node - 1] if place.node else None
        is_waiting = True
        for edge in sorted(graph.edges(place.node), key=lambda edge: graph.label(edge.number) is TIME_LIMIT):
            label = graph.label(edge.number)
            if label is PLAN_LIMIT and not self._follows_limits:
                continue
            if label is TIME_LIMIT and not self._follows_time_limit and not is_waiting:
                continue
            has_fault = place.has_fault
            if position is not None and isinstance(label, Happening):
                if not self._can_happen(label, position, place):
                    continue
                has_failed = label.kind is HappeningKind.REPLY and not label.succeeded
                has_fault = has_fault or is_at_fault(RequestFate(has_failed=has_failed))
            is_waiting = is_waiting and not self._goes_on(graph, edge)
            yield edge, FaultPlace(edge.target, has_fault, self._still_missing(graph, edge, place.missing))

    def _can_happen(self, label: Happening, position: Position, place: FaultPlace) -> bool:
        if label.kind is HappeningKind.REPLY:
            is_missing = self._numbers[label.resource] == place.missing
            return not is_missing and (label.succeeded or not place.has_fault)
        return label.kind is not HappeningKind.DEADLINE or self._can_pass(position, place)

    def _can_pass(self, position: Position, place: FaultPlace) -> bool:
        """Return whether the deadline of the current operation can pass in time."""
        expected = [number for number in position.in_flight if number != place.missing]
        if not expected:
            return True
        current = self._program.current(position.state)
        if current is None:
            return True
        state = OperationState(str(self._program.packing.value(position.state, CURRENT_STATE)))
        limit_ns = timer_ns(current.operation, state)
        requests = self._program.requests
        return limit_ns is None or all(self._may_be_late(requests[number], limit_ns) for number in expected)

    def _may_be_late(self, line: RequestLine, limit_ns: int) -> bool:
        """Return whether a reply that comes may come after a timer that began with its request or later."""
        longest_ns = line.resource.simulation.latency.longest_ns
        return line.number in self._resent or longest_ns is None or longest_ns >= limit_ns

    @staticmethod
    def _still_missing(graph: RunGraph, edge: Edge, missing: int) -> int:
        """Return the resource whose reply is missing after an edge, unless its request was cancelled or sent again."""
        if missing == _NONE or edge.target < 0 or missing not in graph.positions[edge.target - 1].in_flight:
            return _NONE
        is_sent = any(note.kind is NoteKind.SENDS and note.resource == missing for note in graph.notes(edge.number))
        return _NONE if is_sent else missing

    # what misses its goal

    def _missed_at(self, graph: RunGraph, place: FaultPlace) -> Iterator[MissedGoal]:
        """Yield the runs that end on an edge of a place, or that wait there without end."""
        if not place.node:
            return
        position = graph.positions[place.node - 1]
        goal = self._goal_of(graph, position)
        waits = place.has_fault and not position.is_at_rest
        for edge, following in self._following(graph, place):
            waits = waits and not self._goes_on(graph, edge)
            if not following.has_fault or graph.label(edge.number) is PLAN_LIMIT:
                continue
            for note in graph.notes(edge.number):
                if note.end is not None and self._is_missed(
                    graph, _goal_given(graph, edge) or goal, note.end, note.state, position.in_flight
                ):
                    yield MissedGoal(graph, place, edge, note.end)
        if waits and self._is_missed(graph, goal, End.TIME_LIMIT, position.state, position.in_flight):
            yield MissedGoal(graph, place, None, End.TIME_LIMIT)

    def _goal_of(self, graph: RunGraph, position: Position) -> str:
        """Return the name of the goal that is pursued; of a runner at rest that of any."""
        number = position.goal if self._runs.goals is GoalOrder.SEQUENCE else 0
        return graph.goals[max(number, 0)][0]

    @staticmethod
    def _goes_on(graph: RunGraph, edge: Edge) -> bool:
        """Return whether an edge is more than a limit that ends the run."""
        return graph.label(edge.number) not in (TIME_LIMIT, PLAN_LIMIT)

    def _endless(self, graph: RunGraph, places: Sequence[FaultPlace]) -> Iterator[MissedGoal]:
        """Yield a run that repeats without end, if there is one."""
        inside = {place: None for place in places if place.has_fault and not graph.is_at_rest(place.node)}
        following = {place: [next_ for next_ in self._within(graph, place) if next_ in inside] for place in inside}
        rounds = _between_cycles(following)
        for place in rounds:
            position = graph.positions[place.node - 1]
            goal = self._goal_of(graph, position)
            if any(self._is_missed(graph, goal, end, position.state, position.in_flight) for end in _ENDLESS):
                operations = self._operations_in(graph, _round_from(place, rounds))
                yield MissedGoal(graph, place, None, End.REPLAN_LIMIT, operations)
                return

    def _within(self, graph: RunGraph, place: FaultPlace) -> Iterator[FaultPlace]:
        """Yield the places that follow within a run."""
        for edge, following in self._following(graph, place):
            if following.node >= 0 and self._goes_on(graph, edge):
                yield following

    def _operations_in(self, graph: RunGraph, places: Sequence[FaultPlace]) -> tuple[str, ...]:
        found = (self._program.current(graph.positions[place.node - 1].state) for place in places)
        return tuple(dict.fromkeys(each.operation.name for each in found if each is not None))

    def _is_missed(self, graph: RunGraph, goal: str, end: End, state: int, in_flight: Sequence[int]) -> bool:
        """Return whether `recovers` blames a run for its end: not where the model allows it, or waits for a change."""
        rules = self._rules
        self.is_any_livelocked = self.is_any_livelocked or end is End.LIVELOCK
        if end in _NOT_JUDGED or end.value in (*rules.may_end, *dict(rules.goals_may_end).get(goal, ())):
            return False
        values = self._program.packing.values(state)
        kept = self._runs.relevance.names
        if any(name in kept and values[name] != nominal for name, nominal in rules.inputs):
            return False
        lines = [self._program.requests[number] for number in in_flight]
        asked = [line.resource.name for line in lines if state & line.trigger]
        found = rules.outside_help(end, values, asked, dict(graph.goals)[goal])
        self.is_any_waiting = self.is_any_waiting or found is OutsideHelp.LEADS_TO_GOAL
        self.is_any_unknown = self.is_any_unknown or found is OutsideHelp.UNKNOWN
        return found is OutsideHelp.NONE


def _goal_given(graph: RunGraph, edge: Edge) -> str | None:
    """Return the name of the goal that is given on an edge; `None` if none is."""
    label = graph.label(edge.number)
    if not isinstance(label, Happening) or label.kind is not HappeningKind.GOAL:
        return None
    return graph.goals[label.number][0]


def _sent_by_automatic_transitions(model: BehaviorModel) -> tuple[int, ...]:
    """Return the resources, by number, whose requests automatic transitions may send while an operation executes."""
    return tuple(
        number
        for number, resource in enumerate(model.resources)
        if any(_may_send(each.running_actions, resource) for each in model.automatic_transitions)
    )


def _may_send(actions: Sequence[Action], resource: Resource) -> bool:
    """Return whether a request can be sent after actions: they set the trigger, or leave it and reset the state."""
    if sets(actions, resource):
        return True
    is_off = Assign(resource.trigger, Constant(False)) in actions
    return not is_off and any(action.target == resource.request_state for action in actions)


def _between_cycles(following: dict[FaultPlace, list[FaultPlace]]) -> dict[FaultPlace, list[FaultPlace]]:
    """Return the places that are on a cycle, or between two cycles, each with its successors there."""
    before: dict[FaultPlace, list[FaultPlace]] = {place: [] for place in following}
    for place, others in following.items():
        for each in others:
            before[each].append(place)
    left = _without_ends(_without_ends(dict.fromkeys(following), following, before), before, following)
    return {place: [each for each in following[place] if each in left] for place in left}


def _without_ends(
    places: dict[FaultPlace, None],
    following: dict[FaultPlace, list[FaultPlace]],
    before: dict[FaultPlace, list[FaultPlace]],
) -> dict[FaultPlace, None]:
    """Return the places without those from which each way ends."""
    count = {place: sum(each in places for each in following[place]) for place in places}
    todo = [place for place in places if not count[place]]
    while todo:
        for each in before[todo.pop()]:
            if each in count:
                count[each] -= 1
                if not count[each]:
                    todo.append(each)
    return {place: None for place in places if count[place]}


def _round_from(place: FaultPlace, following: dict[FaultPlace, list[FaultPlace]]) -> list[FaultPlace]:
    """Return the places of a cycle that a place leads to."""
    seen: dict[FaultPlace, None] = {}
    while place not in seen:
        seen[place] = None
        place = following[place][0]
    places = list(seen)
    return places[places.index(place) :]
