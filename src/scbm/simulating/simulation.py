"""One run in virtual time: a heap of what will happen, the runner, and simulated resources."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING

from scbm.model import Outcome
from scbm.planning import PlanLimits, Planner, Solved
from scbm.running import (
    AskPlan,
    CancelRequest,
    Effect,
    End,
    Event,
    GoalGiven,
    InjectionGiven,
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

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.running import Injection
    from scbm.simulating.choices import Chooser
    from scbm.trace import Record


@dataclass(frozen=True, slots=True)
class Simulated:
    """What came of a simulated run.

    Attributes:
        end: how the run for the goal ended.
        ended_ns: the virtual time at which it did.
        records: everything that happened.
    """

    end: End
    ended_ns: int
    records: tuple[Record, ...]


class Simulator:
    """Simulates one model, run after run. Runs do not influence each other."""

    def __init__(
        self,
        model: BehaviorModel,
        options: RunnerOptions | None = None,
        plan_limits: PlanLimits | None = None,
    ) -> None:
        self.model = model
        self.options = options or RunnerOptions()
        self.plan_limits = plan_limits or PlanLimits()
        self.program = Program(model)
        self.planner = Planner(model)
        self.resources = {resource.name: resource for resource in model.resources}

    def run(
        self,
        state: Mapping[str, Value],
        goal: tuple[str, Predicate],
        chooser: Chooser,
        injections: Sequence[Injection] = (),
    ) -> Simulated:
        """Runs one goal from a state of the world until it ends.

        Args:
            state: a value for every variable of the world.
            goal: its name and predicate.
            chooser: decides how resources react.
            injections: what the tester injects; they are armed before the goal is given.
        """
        run = _Run(self, Runner(self.program, state, self.options), chooser)
        for injection in injections:
            run.schedule(0, InjectionGiven(injection))
        run.schedule(0, GoalGiven(*goal))
        return run.finish()


class _Run:
    """The state of one simulation."""

    def __init__(self, simulator: Simulator, runner: Runner, chooser: Chooser) -> None:
        self._simulator = simulator
        self._runner = runner
        self._chooser = chooser
        self._order = count()
        self._heap: list[tuple[int, int, Event]] = []
        self._cancelled: set[int] = set()
        self._records: list[Record] = []
        self._now_ns = 0
        self._end: End | None = None

    def schedule(self, at_ns: int, event: Event) -> None:
        """Lets an event happen; events of one moment happen in the order in which they were scheduled."""
        heapq.heappush(self._heap, (at_ns, next(self._order), event))

    def finish(self) -> Simulated:
        """Lets everything happen until the run ends."""
        while self._end is None:
            event = self._next_event()
            for effect in self._runner.handle(event, self._now_ns):
                self._perform(effect)
        return Simulated(self._end, self._now_ns, tuple(self._records))

    def _next_event(self) -> Event:
        """What happens next; an event before a deadline of the same moment, as it would have come in time."""
        deadline_ns = self._runner.deadline_ns
        while self._heap and (deadline_ns is None or self._heap[0][0] <= deadline_ns):
            self._now_ns, _, event = heapq.heappop(self._heap)
            if not (isinstance(event, ReplyArrived) and event.request in self._cancelled):
                return event
        assert deadline_ns is not None  # noqa: S101 - a goal that is pursued has a time limit
        self._now_ns = deadline_ns
        return TimePassed()

    def _perform(self, effect: Effect) -> None:
        """Does what the runner wants done; all but four kinds of effects are records, to be kept."""
        match effect:
            case SendRequest():
                self._react(effect)
            case CancelRequest(request):
                self._cancelled.add(request)
            case AskPlan():
                self._plan(effect)
            case RunFinished():
                self._end = effect.end
            case _:
                self._records.append(effect)

    def _react(self, sent: SendRequest) -> None:
        """A simulated resource gets a request; a cancelled one is not answered."""
        reaction = self._chooser.react(self._simulator.resources[sent.resource])
        if reaction.outcome is not Outcome.TIMEOUT:
            reply = ReplyArrived(sent.request, reaction.outcome is Outcome.SUCCEED, reaction.measured)
            self.schedule(self._now_ns + reaction.latency_ns, reply)

    def _plan(self, asked: AskPlan) -> None:
        """Planning takes no time in a simulation."""
        simulator = self._simulator
        answer = simulator.planner.plan(asked.state, asked.goal, simulator.plan_limits)
        plan = answer.plan if isinstance(answer, Solved) else ()
        self.schedule(self._now_ns, PlanAnswered(asked.ask, PlanStatus(answer.status), plan))
