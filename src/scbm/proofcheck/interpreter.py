"""The events that can follow a situation, and the situations that they lead to.

This is not the runner of `scbm.running`, and shares only the semantics with it.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, assert_never

from msgspec.structs import replace

from scbm.model import GoalOrder, PlanSet, PlanState
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE, operation_state_name
from scbm.proofcheck.certificate import Awaits, Situation
from scbm.proofcheck.checked_run import (
    CheckedRun,
    CheckedStep,
    DeadlineEvent,
    Event,
    GivingUp,
    NextInPlan,
    OutsideEvent,
    PlannerAnswer,
    Question,
    ReplyEvent,
    StepEnd,
)
from scbm.proofcheck.checker_planner import NoPlanExists, PlansFound, plans_of
from scbm.proofcheck.guarded_parts import GuardedRules

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate, Resource, Value
    from scbm.proofcheck.guarded_parts import Values


class Interpreter:
    """The steps of runs for one goal.

    If a plan is requested and no request is in flight, the answer is the next event. So the answer and everything after
    it belong to the same step. If such a step comes back to a situation, it visits nothing new and ends there.

    Limits of time or of plans can end a run anywhere. `cut_off` has what is visited after such an end.

    Where each run has one goal, what a runner at rest visits after the end belongs to the step that ends the run. Where
    goals follow each other, the step has the values at the end (`CheckedStep.rests`), and `at_rest` has what follows.
    Before the first goal the runner settles, and something may change from outside.

    Attributes:
        model: the model.
        planned: the variables of a queue that is a state; empty for canonical plans.
    """

    def __init__(
        self,
        model: BehaviorModel,
        goal: Predicate,
        variables: Sequence[str],
        goals: GoalOrder = GoalOrder.SINGLE,
        plan_set: PlanSet = PlanSet.CANONICAL,
    ) -> None:
        """Prepare the steps.

        Args:
            model: the model.
            goal: the goal of the runs.
            variables: those of a certificate, without flaws by `runs_check.check_variables`.
            goals: whether goals follow each other.
            plan_set: the plans that the runner may get.
        """
        self.model = model
        self._rules = GuardedRules(model, variables)
        self._goal = goal
        self._plans = plans_of(plan_set, model, goal)
        self._is_sequence = goals is GoalOrder.SEQUENCE
        self._after_ends: dict[tuple[Value, ...], tuple[str, ...]] = {}
        self.planned = self._plans.names

    def start(self, state: Mapping[str, Value]) -> CheckedStep:
        """Return the step in which the runner starts and settles without a goal.

        `state` is an initial state, which has a value for each of `variables`.
        """
        space = self._rules.model.running_space
        values: Values = {v: space[v].initial if space[v].role.is_runner else state[v] for v in self._rules.variables}
        return self._settled_step({**values, **self._rules.at_rest})

    def begin(self, rest: Values) -> CheckedStep:
        """Return the step in which the goal is given to a runner at rest."""
        return self._finish(self._run({**rest, PLAN_STATE: PlanState.PLANNING.value}))

    def at_rest(self, rest: Values) -> Iterator[CheckedStep]:
        """Yield what can follow while no goal is pursued and the runner is settled: something changes from outside."""
        for changes in self._rules.outside.changes(rest, ()):
            yield self._settled_step({**rest, **dict(changes)})

    def events(self, situation: Situation) -> Iterator[Event]:
        """Yield the events that can follow."""
        if situation.awaits is Awaits.NEXT:
            yield from map(NextInPlan, self._plans.following(situation.queue))
            return
        for name in situation.in_flight:
            for measured in self._measured(self._rules.resources[name]):
                yield ReplyEvent(name, succeeded=True, measured=measured)
                yield ReplyEvent(name, succeeded=False, measured=measured)
        values = self._values(situation)
        operation = self._rules.operations.get(str(values[CURRENT_NAME]))
        if operation is not None and values[CURRENT_STATE] in operation.timed:
            yield DeadlineEvent()
        if situation.awaits in (Awaits.PLAN, Awaits.UNSOLVABLE, Awaits.STALE):
            yield PlannerAnswer()
        yield from map(OutsideEvent, self._rules.outside.changes(values, situation.in_flight))
        if self._rules.outside and situation.awaits is Awaits.CHANGE and not situation.in_flight:
            yield GivingUp()

    def after(self, situation: Situation, event: Event) -> CheckedStep:
        """Return the step that one of these events starts."""
        run = self._resumed(situation)
        match event:
            case ReplyEvent():
                run.receive_reply(event)
            case DeadlineEvent():
                run.pass_deadline()
            case PlannerAnswer():
                run.receive_answer()
            case OutsideEvent(changes):
                run.change(changes)
            case GivingUp():
                run.end(PlanState.UNSOLVABLE)
            case NextInPlan(following):
                run.choose(following)
            case _:
                assert_never(event)
        return self._finish(run)

    def cut_off(self, situation: Situation) -> CheckedStep | None:
        """Return the step in which the time limit passes; `None` where it is decided how the plan goes on."""
        if situation.awaits is Awaits.NEXT:
            return None
        return self._after_end(self._values(situation), situation.in_flight)

    def _measured(self, resource: Resource) -> Iterator[tuple[tuple[str, Value], ...]]:
        """Yield every choice of measured values.

        Not to measure a variable is the same as to measure its old value, if the resource can send that.
        """
        names = [name for name in resource.measures if name in self._rules.variables]
        sent = [resource.sends(self._rules.model.space[name]) for name in names]
        narrow = [
            len(values) < len(self._rules.model.space[name].domain) for name, values in zip(names, sent, strict=True)
        ]
        choices = [(None, *values) if is_narrow else values for values, is_narrow in zip(sent, narrow, strict=True)]
        for values in product(*choices):
            yield tuple((name, value) for name, value in zip(names, values, strict=True) if value is not None)

    # between situations and runs

    def _run(self, values: Values) -> CheckedRun:
        return CheckedRun(self._rules, self._goal, self._plans, values)

    def _values(self, situation: Situation) -> Values:
        values = {**dict(zip(self._rules.variables, situation.values, strict=True)), **self._rules.at_rest}
        if values[CURRENT_NAME] != NO_OPERATION:
            values[operation_state_name(str(values[CURRENT_NAME]))] = values[CURRENT_STATE]
        return values

    def _resumed(self, situation: Situation) -> CheckedRun:
        run = self._run(self._values(situation))
        run.in_flight = list(situation.in_flight)
        match situation.awaits:
            case Awaits.NOTHING | Awaits.NEXT:
                run.queue = situation.queue
            case Awaits.PLAN:
                run.question = Question(None, PlansFound(situation.queue))
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
        """Return the situation of a run that is settled and has not ended."""
        values = tuple(run.values[name] for name in self._rules.variables)
        in_flight = tuple(run.in_flight)
        if run.must_choose:
            return Situation(values, run.queue, in_flight, Awaits.NEXT)
        if run.question is None:
            awaits = Awaits.CHANGE if run.values[CURRENT_NAME] == NO_OPERATION else Awaits.NOTHING
            return Situation(values, run.queue, in_flight, awaits)
        if isinstance(run.question.answer, PlansFound):
            return Situation(values, run.question.answer.queue, in_flight, Awaits.PLAN)
        asked_in = run.question.asked_in
        is_fresh = asked_in is not None and run.is_same_to_planner(asked_in)
        awaits = Awaits.UNSOLVABLE if is_fresh else Awaits.STALE
        return Situation(values, None, in_flight, awaits)

    def _finish(self, run: CheckedRun) -> CheckedStep:
        """Let the run settle, and let the planner answer if no other event can come first."""
        asked: dict[Situation, None] = {}
        run.settle()
        while not run.has_ended and run.question is not None and not run.in_flight and not self._rules.outside:
            situation = self._situation(run)
            if situation in asked:
                return self._step(run, None)
            asked[situation] = None
            run.note_limit()  # a limit can end the run here, too
            run.receive_answer()
            run.settle()
        if run.has_ended and not self._is_sequence and self._rules.outside:
            run.visited |= dict.fromkeys(self._rest_of_run(run.values))
        return self._step(run, None if run.has_ended else self._situation(run))

    def _step(self, run: CheckedRun, situation: Situation | None) -> CheckedStep:
        cut_off: dict[str, None] = {}
        rest = run.values if run.has_ended and not run.is_livelocked and self._is_sequence else None
        ends = []
        for possible in run.may_end:
            ended = self._after_end(possible.values, possible.in_flight)
            cut_off |= dict.fromkeys(ended.visited)
            moments = (*run.moments[: possible.moments], *ended.moments)
            ends.append(StepEnd(moments, ended.rest, possible.is_livelock))
        rests = tuple(values for values in (rest, *(end.rest for end in ends)) if values is not None)
        moments = tuple(run.moments)
        return CheckedStep(
            situation,
            run.values,
            tuple(run.visited),
            tuple(cut_off),
            rests,
            rest,
            moments,
            tuple(ends),
            run.has_reached,
        )

    def _after_end(self, values: Values, in_flight: Sequence[str]) -> CheckedStep:
        """Return what follows the end of a run that a limit ends with these values, with the moments of its end."""
        run = self._run(values)
        run.in_flight = list(in_flight)
        run.end(PlanState.ABORTED)
        if not self._is_sequence:
            return CheckedStep(None, run.values, self._rest_of_run(run.values))
        step = self._settled_step(run.values)
        return replace(step, moments=(*run.moments, *step.moments))

    def _settled_step(self, values: Values) -> CheckedStep:
        """Return the step in which a runner without a goal settles; it has no rest if that never ends."""
        run = self._run(values)
        run.has_ended = True
        run.settle()
        rest = None if run.is_livelocked else run.values
        rests = () if rest is None else (rest,)
        return CheckedStep(None, run.values, tuple(run.visited), rests=rests, rest=rest, moments=tuple(run.moments))

    def _rest_of_run(self, values: Values) -> tuple[str, ...]:
        """Return what is visited from these values on after the end of a run, whatever changes from outside."""
        start = tuple(values.values())
        if start not in self._after_ends:
            visited: dict[str, None] = {}
            reached: dict[tuple[Value, ...], None] = {}
            todo = [values]
            while todo:
                step = self._settled_step(todo.pop())
                visited |= dict.fromkeys(step.visited)
                for rest in step.rests:
                    key = tuple(rest.values())
                    if key not in reached:
                        reached[key] = None
                        todo += [{**rest, **dict(each)} for each in self._rules.outside.changes(rest, ())]
            self._after_ends[start] = tuple(visited)
        return self._after_ends[start]
