"""The steps of runs as closing takes them, beside the real runner: the same events lead to the same situation."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.cases.coverage import Obligations, visited_by
from scbm.cases.trace import End, Record
from scbm.closing.runs.all_runs import AllRuns, CloseLimits, RunScope
from scbm.closing.runs.run_graph import Edge, RunGraph
from scbm.files import read_model
from scbm.model import BehaviorModel, GoalOrder, PlanSet, Predicate, State
from scbm.planning import Planner, Solved
from scbm.running import (
    AskPlan,
    CancelRequest,
    ChangeResource,
    Effect,
    Event,
    GoalGiven,
    PlanAnswered,
    PlanStatus,
    Program,
    ReplyArrived,
    RunFinished,
    Runner,
    RunnerOptions,
    SendRequest,
    TimePassed,
)
from scbm.running.untimed.run_steps import RunSteps
from scbm.running.untimed.situations import TIME_LIMIT, Happening, HappeningKind, Position, RunNote, WaitsFor
from scbm.testing import RandomCases, Tester
from support.opened_models import opened
from support.profiles import examples
from support.random_models import random_model, small_random_model
from support.strategies import running_models

MAX_PLANS = 100
FEW = CloseLimits(situations=200, starts=16)
NOTED = RunScope(keeps_notes=True)


class Led:
    """A real runner, led along happenings."""

    def __init__(self, model: BehaviorModel, state: State, goal: tuple[str, Predicate]) -> None:
        self.runner = Runner(Program(model), state, RunnerOptions(10**30, MAX_PLANS))
        self.obligations = Obligations.of(model)
        self.planner = Planner(model)
        self.in_flight: dict[str, int] = {}
        self.asked: AskPlan | None = None
        self.ended = False
        self.end: End | None = None
        self.plans = 0
        self.now_ns = 0
        self.visited = 0
        self.goal = GoalGiven(*goal)
        self.give(TimePassed())  # the runner settles when it starts, before its goal

    def give(self, event: Event) -> None:
        effects = self.runner.handle(event, self.now_ns)
        records: list[Record] = [e for e in effects if not isinstance(e, (*_NO_RECORDS, ChangeResource))]
        self.visited |= visited_by(records, self.obligations)
        for effect in effects:
            self.note(effect)
        if self.asked is not None and not self.in_flight and not self.ended:
            self.answer()

    def note(self, effect: Effect) -> None:
        match effect:
            case SendRequest(request, resource):
                self.in_flight[resource] = request
            case CancelRequest(request, resource):
                if self.in_flight.get(resource) == request:
                    del self.in_flight[resource]
            case AskPlan():
                self.asked = effect
            case RunFinished(_, end):
                self.ended, self.end = True, end

    def answer(self) -> None:
        asked, self.asked = self.asked, None
        assert asked is not None
        self.plans += 1
        answer = self.planner.plan(asked.state, asked.goal)
        plan = answer.plan if isinstance(answer, Solved) else ()
        self.give(PlanAnswered(asked.ask, PlanStatus(answer.status), plan))

    def happen(self, happening: Happening) -> None:
        self.visited = 0
        if happening.kind is HappeningKind.REPLY:
            request = self.in_flight.pop(happening.resource)
            self.give(ReplyArrived(request, happening.succeeded, happening.measured))
        elif happening.kind is HappeningKind.DEADLINE:
            self.now_ns = self.runner.deadline_ns or 0
            self.give(TimePassed())
        elif happening.kind is HappeningKind.GOAL:
            self.give(self.goal)
        else:
            self.answer()

    def agrees(self, position: Position, runs: AllRuns) -> bool:
        packed = self.runner.program.packing.pack(self.runner.state) & runs.relevance.mask
        resources = [resource.name for resource in self.runner.program.model.resources]
        in_flight = tuple(resources[number] for number in position.in_flight)
        is_asking = position.awaits in (WaitsFor.PLAN, WaitsFor.UNSOLVABLE, WaitsFor.STALE)
        queue = runs.queues(runs.model.goals[0][1]).content(position.queue)
        expected = () if is_asking or queue is None else queue
        return (
            packed == position.state
            and in_flight == tuple(self.in_flight)
            and is_asking == (self.asked is not None)
            and expected == tuple(operation.name for operation in self.runner._queue)
        )


_NO_RECORDS = (SendRequest, CancelRequest, AskPlan, RunFinished)


REPEATS = """
behavior_model: repeats
variables:
  part: {domain: [out, raw, made], initial: out}
resources:
  gripper: {}
operations:
  fetch: {request: gripper, guard: part == out, effects: [part <- raw]}
  make: {pre: {g: part == raw}, post: {g: true, a: [part <- made]}}
automatic_transitions:
  unmake: {g: part == made, a: [part <- raw]}
goals:
  made: part == made
"""


@pytest.mark.parametrize("initial", ["out", "raw"])
def test_a_run_that_repeats_in_one_instant_ends_as_livelock_in_both(initial: str) -> None:
    model = read_model(REPEATS.replace("initial: out", f"initial: {initial}"))
    (graph,) = AllRuns(model, FEW, lambda _: None, NOTED).graphs
    edges = [edge for node in range(len(graph.positions) + 1) for edge in graph.edges(node)]
    assert End.LIVELOCK in map(_end, (graph.notes(edge.number) for edge in edges))
    assert Tester(model).execute(RandomCases(model).case(0, 1)).verdict.end is End.LIVELOCK


@pytest.mark.slow
@examples(200)
@given(st.one_of(running_models(), st.integers(0, 199).map(random_model)), st.data())
def test_the_graph_of_runs_goes_where_the_runner_goes(model: BehaviorModel, data: st.DataObject) -> None:
    goal = data.draw(st.sampled_from(model.goals))
    runs = AllRuns(replace(model, goals=(goal,)), FEW, lambda _: None, NOTED)
    for graph in runs.graphs:
        if not any(graph.edges(0)):
            return  # no initial state is allowed
        edge = _choose(data, graph, 0)
        start = graph.label(edge.number)
        assert not isinstance(start, Happening)
        led = Led(model, State(model.space, dict(start.values)), graph.goal)
        for _ in range(15):
            if led.plans >= MAX_PLANS:
                assert edge.target >= 0 or led.end == _end(graph.notes(edge.number))
                return  # closing knows no limit of plans
            assert edge.visits & runs.visits.mask == led.visited
            if edge.target < 0:
                assert led.ended or not graph.complete
                assert not led.ended or led.end == _end(graph.notes(edge.number))
                break
            assert not led.ended
            assert led.agrees(graph.positions[edge.target - 1], runs)
            if not any(graph.label(e.number) != TIME_LIMIT for e in graph.edges(edge.target)):
                break
            edge = _choose(data, graph, edge.target)
            happening = graph.label(edge.number)
            assert isinstance(happening, Happening)
            led.happen(happening)


def _end(notes: Sequence[RunNote]) -> End | None:
    return next((note.end for note in notes if note.end is not None), None)


def _choose(data: st.DataObject, graph: RunGraph, node: int) -> Edge:
    return data.draw(st.sampled_from([e for e in graph.edges(node) if graph.label(e.number) != TIME_LIMIT]))


@examples(100, usual=12)
@given(
    st.integers(0, 199),
    st.sampled_from([random_model, lambda number: opened(small_random_model(number), number)]),
    st.tuples(st.booleans(), st.sampled_from(GoalOrder), st.sampled_from(PlanSet)).map(lambda kind: RunScope(*kind)),
)
def test_steps_that_are_memoized_by_what_they_read_are_those_that_are_taken_one_by_one(
    number: int, make: Callable[[int], BehaviorModel], scope: RunScope
) -> None:
    runs = AllRuns(make(number), FEW, lambda _: None, scope)
    is_sequence = scope.goals is GoalOrder.SEQUENCE
    for index, (_, goal) in enumerate(runs.model.goals):
        position = index if is_sequence else 0
        plain = RunSteps(
            runs.program,
            runs.relevance,
            runs.visits,
            goal,
            runs.answers.to(goal),
            runs.queues(goal),
            number=position,
            is_open=scope.is_open,
            is_sequence=is_sequence,
        )
        projected = runs.steps(goal, position)
        for start in runs.starts:
            assert projected.start(start.packed) == plain.start(start.packed)
        for situation in runs.graphs[0 if is_sequence else index].positions:
            if situation.is_at_rest:
                assert list(projected.at_rest(situation)) == list(plain.at_rest(situation))
                assert projected.begin(situation.state) == plain.begin(situation.state)
            elif situation.goal == position:
                assert list(projected.following(situation)) == list(plain.following(situation))
        assert list(projected.evaluated) == list(plain.evaluated)


@examples(60, usual=8)
@given(
    st.integers(0, 199),
    st.sampled_from([random_model, lambda number: opened(small_random_model(number), number)]),
    st.tuples(st.booleans(), st.sampled_from(GoalOrder), st.sampled_from(PlanSet)).map(lambda kind: RunScope(*kind)),
    st.sampled_from([True, False]),
)
def test_notes_about_memoized_steps_are_those_about_steps_taken_anew(
    number: int,
    make: Callable[[int], BehaviorModel],
    scope: RunScope,
    is_watching: bool,  # noqa: FBT001 - drawn
) -> None:
    model = make(number)
    predicates = (*dict(model.goals).values(), *(operation.pre.running_guard for operation in model.operations))
    scope = replace(scope, keeps_notes=True, watched=predicates if is_watching else ())
    runs = AllRuns(model, FEW, lambda _: None, scope)
    is_sequence = scope.goals is GoalOrder.SEQUENCE
    for index, (_, goal) in enumerate(model.goals):
        position = index if is_sequence else 0
        memoized = runs.steps(goal, position)
        for situation in runs.graphs[0 if is_sequence else index].positions:
            anew = runs.steps(goal, position)
            if situation.is_at_rest:
                assert list(memoized.at_rest(situation)) == list(anew.at_rest(situation))
                assert memoized.begin(situation.state) == anew.begin(situation.state)
            elif situation.goal == position:
                assert list(memoized.following(situation)) == list(anew.following(situation))
