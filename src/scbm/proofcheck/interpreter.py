"""From situation to situation: which events can come, and what comes of each.

This is not the runner of `scbm.running`, and shares nothing with it but the semantics.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, assert_never

from scbm.model import PlanState
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE, operation_state_name
from scbm.proofcheck.certificate import Awaits, Situation
from scbm.proofcheck.checked_run import (
    CheckedRun,
    CheckedStep,
    DeadlineEvent,
    Event,
    PlannerAnswer,
    Question,
    ReplyEvent,
)
from scbm.proofcheck.checker_planner import CanonicalPlanner, NoPlanExists, PlanFound
from scbm.proofcheck.guarded_parts import GuardedRules

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate, Resource, Value
    from scbm.proofcheck.guarded_parts import Values


class Interpreter:
    """Runs for one goal.

    When a plan is asked for and no request is in flight, nothing can come before the answer. So the answer, and all
    that follows from it, is a part of the same step. If that goes round for ever, nothing new comes of it: the run goes
    nowhere from there.

    Limits, of time or of plans, can end a run anywhere. What happens then, at its end, is told beside the steps.
    """

    def __init__(self, model: BehaviorModel, goal: Predicate, variables: Sequence[str]) -> None:
        """`variables` are those that are looked at; `relevance.check_variables` finds nothing wrong with them."""
        self._rules = GuardedRules(model, variables)
        self._goal = goal
        self._planner = CanonicalPlanner(model, goal)
        self._behind_ends: dict[tuple[Value, ...], tuple[str, ...]] = {}

    def begin(self, state: Mapping[str, Value]) -> CheckedStep:
        """The goal is given in an initial state, which has at least the variables of the world that are looked at."""
        space = self._rules.model.running_space
        values: Values = {v: space[v].initial if space[v].role.is_runner else state[v] for v in self._rules.variables}
        values |= {**self._rules.at_rest, PLAN_STATE: PlanState.PLANNING.value}
        return self._finish(self._run(values))

    def events(self, situation: Situation) -> Iterator[Event]:
        """Everything that can happen next."""
        for name in situation.in_flight:
            for measured in self._measured(self._rules.resources[name]):
                yield ReplyEvent(name, succeeded=True, measured=measured)
            yield ReplyEvent(name, succeeded=False)
        values = self._values(situation)
        operation = self._rules.operations.get(str(values[CURRENT_NAME]))
        if operation is not None and values[CURRENT_STATE] in operation.timed:
            yield DeadlineEvent()
        if situation.awaits in (Awaits.PLAN, Awaits.UNSOLVABLE, Awaits.STALE):
            yield PlannerAnswer()

    def after(self, situation: Situation, event: Event) -> CheckedStep:
        """What comes of one of the events."""
        run = self._resumed(situation)
        match event:
            case ReplyEvent():
                run.receive_reply(event)
            case DeadlineEvent():
                run.pass_deadline()
            case PlannerAnswer():
                run.receive_answer()
            case _:
                assert_never(event)
        return self._finish(run)

    def cut_off(self, situation: Situation) -> tuple[str, ...]:
        """What is visited if the time limit passes here."""
        return self._behind_end(self._values(situation), situation.in_flight)

    def _measured(self, resource: Resource) -> Iterator[tuple[tuple[str, Value], ...]]:
        """Every choice of measured values. A variable that is not measured is as if it were measured as it is."""
        names = [name for name in resource.measures if name in self._rules.variables]
        domains = [self._rules.model.space[name].domain.values for name in names]
        for values in product(*domains):
            yield tuple(zip(names, values, strict=True))

    # between situations and runs

    def _run(self, values: Values) -> CheckedRun:
        return CheckedRun(self._rules, self._goal, self._planner, values)

    def _values(self, situation: Situation) -> Values:
        values = {**dict(zip(self._rules.variables, situation.values, strict=True)), **self._rules.at_rest}
        if values[CURRENT_NAME] != NO_OPERATION:
            values[operation_state_name(str(values[CURRENT_NAME]))] = values[CURRENT_STATE]
        return values

    def _resumed(self, situation: Situation) -> CheckedRun:
        run = self._run(self._values(situation))
        run.in_flight = list(situation.in_flight)
        match situation.awaits:
            case Awaits.NOTHING:
                run.queue = list(situation.queue)
            case Awaits.PLAN:
                run.question = Question(None, PlanFound(situation.queue))
            case Awaits.UNSOLVABLE:
                run.question = Question(run.values, NoPlanExists())
            case Awaits.STALE:
                run.question = Question(None, NoPlanExists())
            case Awaits.CHANGE:
                run.unsolvable_in = run.values
            case _:
                assert_never(situation.awaits)
        return run

    def _situation(self, run: CheckedRun) -> Situation:
        """Where a run is that is settled and has not ended.

        A planner that will give up counts as one that will find no plan: the run would end, and here it may go on.
        """
        values = tuple(run.values[name] for name in self._rules.variables)
        in_flight = tuple(run.in_flight)
        if run.question is None:
            awaits = Awaits.CHANGE if run.values[CURRENT_NAME] == NO_OPERATION else Awaits.NOTHING
            return Situation(values, tuple(run.queue), in_flight, awaits)
        if isinstance(run.question.answer, PlanFound):
            return Situation(values, run.question.answer.operations, in_flight, Awaits.PLAN)
        awaits = Awaits.UNSOLVABLE if run.question.asked_in == run.values else Awaits.STALE
        return Situation(values, (), in_flight, awaits)

    def _finish(self, run: CheckedRun) -> CheckedStep:
        """Lets the run settle, and the planner answer if nothing can come before that."""
        asked: dict[Situation, None] = {}
        run.settle()
        while not run.has_ended and run.question is not None and not run.in_flight:
            situation = self._situation(run)
            if situation in asked:
                return self._step(run, None)
            asked[situation] = None
            run.asked.append((run.values, ()))  # a limit can end the run here, too
            run.receive_answer()
            run.settle()
        return self._step(run, None if run.has_ended else self._situation(run))

    def _step(self, run: CheckedRun, situation: Situation | None) -> CheckedStep:
        cut_off = dict.fromkeys(name for values, sent in run.asked for name in self._behind_end(values, sent))
        return CheckedStep(situation, run.values, tuple(run.visited), tuple(cut_off))

    def _behind_end(self, values: Values, in_flight: Sequence[str]) -> tuple[str, ...]:
        """What is visited behind the end of a run that a limit ends with these values."""
        run = self._run(values)
        run.in_flight = list(in_flight)
        run.end(PlanState.ABORTED)
        end = tuple(run.values.values())
        if end not in self._behind_ends:
            run.settle()
            self._behind_ends[end] = tuple(run.visited)
        return self._behind_ends[end]
