"""A runner driven by hand: events at times that a test chooses, plans from the real planner or from the test."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases import Injection
from scbm.cases.trace import AutomaticTaken, End, OperationStepped, Record
from scbm.planning import Planner, Solved
from scbm.running import (
    AskPlan,
    CancelRequest,
    ChangeResource,
    Effect,
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
    from collections.abc import Sequence

    from scbm.model import BehaviorModel, Value

SECOND_NS = 1_000_000_000


class Hand:
    """Gives events to a runner, answers its questions for plans, and keeps all that it says."""

    def __init__(
        self,
        model: BehaviorModel | Program,
        options: RunnerOptions | None = None,
        state: dict[str, Value] | None = None,
        *,
        plans: Sequence[PlanAnswered | tuple[str, ...]] | None = None,
        answering: bool = True,
    ) -> None:
        program = model if isinstance(model, Program) else Program(model)
        self.model = program.model
        self.runner = Runner(program, self.model.nominal_state.replace(state or {}), options)
        self.effects: list[Effect] = []
        self.now_ns = 0
        self._planner = Planner(self.model)
        self._plans = None if plans is None else list(plans)
        self._answering = answering

    def give(self, event: Event, seconds: float | None = None) -> list[Effect]:
        """Gives an event, at a time or now, and lets the planner answer; returns the new effects."""
        if seconds is not None:
            self.now_ns = round(seconds * SECOND_NS)
        new = self._handle(event)
        self.effects += new
        return new

    def _handle(self, event: Event) -> list[Effect]:
        new = list(self.runner.handle(event, self.now_ns))
        asked = [effect for effect in new if isinstance(effect, AskPlan)] if self._answering else []
        for question in asked:
            new += self._handle(self._answer(question))
        return new

    def _answer(self, asked: AskPlan) -> PlanAnswered:
        if self._plans is not None:
            plan = self._plans.pop(0)
            if isinstance(plan, PlanAnswered):
                return PlanAnswered(asked.ask, plan.status, plan.plan)
            return PlanAnswered(asked.ask, PlanStatus.SOLVED, plan)
        answer = self._planner.plan(asked.state, asked.goal)
        plan = answer.plan if isinstance(answer, Solved) else ()
        return PlanAnswered(asked.ask, PlanStatus(answer.status), plan)

    # what tests say often

    def goal(self, name: str = "scanned") -> list[Effect]:
        predicate = self.model.goal(name)
        assert predicate is not None
        return self.give(GoalGiven(name, predicate))

    def reply(self, request: int, seconds: float, *, succeeded: bool = True) -> list[Effect]:
        return self.give(ReplyArrived(request, succeeded), seconds)

    def inject(self, injection: Injection, seconds: float | None = None) -> list[Effect]:
        return self.give(InjectionGiven(injection), seconds)

    def wait(self, seconds: float) -> list[Effect]:
        return self.give(TimePassed(), seconds)

    def wait_for_deadline(self) -> list[Effect]:
        deadline_ns = self.runner.deadline_ns
        assert deadline_ns is not None
        return self.give(TimePassed(), deadline_ns / SECOND_NS)

    # what tests ask often

    @property
    def records(self) -> list[Record]:
        outward = (SendRequest, CancelRequest, ChangeResource, AskPlan, RunFinished)
        return [effect for effect in self.effects if not isinstance(effect, outward)]

    @property
    def lifecycle(self) -> list[str]:
        """The states that operations went through, `initial` left out."""
        seen = []
        for record in self.records:
            if isinstance(record, OperationStepped) and record.target != "initial":
                seen.append(f"{record.operation} {record.target}")
            elif isinstance(record, AutomaticTaken) and record.failed:
                seen.append(f"{record.failed} failed by {record.transition}")
        return seen

    @property
    def ends(self) -> list[End]:
        return [effect.end for effect in self.effects if isinstance(effect, RunFinished)]

    @property
    def sent(self) -> list[SendRequest]:
        return [effect for effect in self.effects if isinstance(effect, SendRequest)]

    @property
    def cancelled(self) -> list[int]:
        return [effect.request for effect in self.effects if isinstance(effect, CancelRequest)]
