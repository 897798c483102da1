"""The steps of runs as closing takes them, beside the real runner: the same events lead to the same situation."""

from __future__ import annotations

from functools import partial

from hypothesis import given, settings
from hypothesis import strategies as st
from support.strategies import running_models

from scbm.certifying import Awaits
from scbm.closing.relevance import Relevance
from scbm.closing.runs import CloseLimits, Runs
from scbm.closing.situations import Happening, Position
from scbm.coverage import Obligations, visited_by
from scbm.model import BehaviorModel, Predicate, State
from scbm.planning import Planner, Solved
from scbm.running import (
    AskPlan,
    CancelRequest,
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
from scbm.trace import Record

MOST_PLANS = 50
FEW = CloseLimits(situations=3_000, starts=64)


class Led:
    """A real runner, led along happenings."""

    def __init__(self, model: BehaviorModel, state: State, goal: tuple[str, Predicate]) -> None:
        self.relevance = Relevance(model, Program(model).packing)
        self.runner = Runner(Program(model), state, RunnerOptions(10**30, MOST_PLANS))
        self.obligations = Obligations.of(model)
        self.planner = Planner(model)
        self.in_flight: dict[str, int] = {}
        self.asked: AskPlan | None = None
        self.ended = False
        self.plans = 0
        self.now_ns = 0
        self.visited = 0
        self.give(GoalGiven(*goal))

    def give(self, event: Event) -> None:
        effects = self.runner.handle(event, self.now_ns)
        records: list[Record] = [effect for effect in effects if not isinstance(effect, _NO_RECORDS)]
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
            case RunFinished():
                self.ended = True

    def answer(self) -> None:
        asked, self.asked = self.asked, None
        assert asked is not None
        self.plans += 1
        answer = self.planner.plan(asked.state, asked.goal)
        plan = answer.plan if isinstance(answer, Solved) else ()
        self.give(PlanAnswered(asked.ask, PlanStatus(answer.status), plan))

    def happen(self, happening: Happening) -> None:
        self.visited = 0
        if happening.resource is not None:
            request = self.in_flight.pop(happening.resource)
            self.give(ReplyArrived(request, happening.succeeded, happening.measured))
        elif happening.passes:
            self.now_ns = self.runner.deadline_ns or 0
            self.give(TimePassed())
        else:
            self.answer()

    def agrees(self, position: Position, runs: Runs) -> bool:
        packed = self.runner.program.packing.pack(self.runner.state) & self.relevance.mask
        resources = [resource.name for resource in self.runner.program.model.resources]
        in_flight = tuple(resources[number] for number in position.in_flight)
        is_asking = position.awaits in (Awaits.PLAN, Awaits.UNSOLVABLE, Awaits.STALE)
        queue = runs.queues.operations(position.queue)
        names = [operation.name for operation in self.runner.program.model.operations]
        expected = () if is_asking else tuple(names[number] for number in queue)
        return (
            packed == position.state
            and in_flight == tuple(self.in_flight)
            and is_asking == (self.asked is not None)
            and expected == tuple(operation.name for operation in self.runner._queue)
        )


_NO_RECORDS = (SendRequest, CancelRequest, AskPlan, RunFinished)


@settings(max_examples=250)
@given(running_models(), st.data())
def test_the_graph_of_runs_goes_where_the_runner_goes(model: BehaviorModel, data: st.DataObject) -> None:
    runs = Runs(model, FEW, lambda _: None)
    for graph in runs.graphs:
        choose = partial(_choose, data)
        edge = choose([edge for edge in graph.edges(0)])
        start = graph.label(edge.number)
        assert not isinstance(start, Happening)
        led = Led(model, State(model.space, dict(start.values)), graph.goal)
        for _ in range(12):
            if led.plans >= MOST_PLANS:
                return  # closing knows no limit of plans
            assert edge.visits & runs.visits.mask == led.visited
            if edge.target < 0:
                assert led.ended or not graph.complete
                break
            assert not led.ended
            assert led.agrees(graph.positions[edge.target - 1], runs)
            edges = list(graph.edges(edge.target))
            if not edges:
                break
            edge = choose(edges)
            happening = graph.label(edge.number)
            assert isinstance(happening, Happening)
            led.happen(happening)


def _choose(data: st.DataObject, edges: list) -> object:  # type: ignore[type-arg]
    return data.draw(st.sampled_from(edges))
