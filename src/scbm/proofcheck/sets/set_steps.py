"""The steps of runs as formulas, for the check of sets: read it beside semantics 5, 6 and 9.

It shares no code with the moves that find sets. Each step is one micro-step or one event; a situation may be in the
midst of a settling. Three rules let more happen than in runs, which proves no less: the planner may answer that no plan
exists wherever it is asked, automatic transitions may be taken as a livelock wherever one is, and requests without a
trigger are cancelled in any order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.model import GoalOrder, OperationState, PlanState, RequestState
from scbm.model.sources import free_groups
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE
from scbm.proofcheck.certificate import (
    GOAL,
    PHASE,
    ClaimedAspect,
    ClaimedObligation,
    SetPhase,
    predicted_name,
    request_name,
)
from scbm.proofcheck.guarded_parts import fails_operation
from scbm.proofcheck.sets.clauses import TRUE
from scbm.proofcheck.sets.set_views import SituationView, ValueLiterals

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Operation, Predicate, Resource, Transition, Value
    from scbm.model.operations import Action
    from scbm.proofcheck.sets.clauses import Clauses

_PURSUING = (SetPhase.NO_PLAN, SetPhase.ASKING, SetPhase.PLAN)


class SetStep(Struct, frozen=True):
    """A step of runs.

    Attributes:
        what: its name for messages.
        where: holds in the situations in which it is possible.
        given: the new values of the variables that it changes.
        visits: the obligations that it visits.
        may_become: variables that keep their value or get one of some values.
        leads_on: whether the rest of a plan still leads to the goal afterwards.
        ends_run: whether it ends a run, whose requests in flight are cancelled one after the other.
    """

    what: str
    where: int
    given: Mapping[str, ValueLiterals]
    visits: tuple[ClaimedObligation, ...] = ()
    may_become: tuple[tuple[str, tuple[Value, ...]], ...] = ()
    leads_on: bool = False
    ends_run: bool = False


class SetSteps:
    """The steps of a model."""

    def __init__(  # noqa: PLR0913, PLR0917 - what a situation is, and which plans there are
        self,
        model: BehaviorModel,
        literals: Mapping[str, ValueLiterals],
        planned: Sequence[str],
        alive: int,
        clauses: Clauses,
        choices: Mapping[str, int] | None = None,
    ) -> None:
        """Prepare the steps.

        Args:
            model: the model.
            literals: the values of all variables of situations.
            planned: the variables of the world on which plans depend.
            alive: the assumption that no dead state is predicted; it is never negated.
            clauses: the clauses.
            choices: for each operation the assumption that it is the next one in a canonical plan from the predicted
                state; by default plans are any. It is never negated.
        """
        self._model = model
        self._choices = choices
        self._literals = literals
        self._planned = tuple(planned)
        self._alive = alive
        self._clauses = clauses
        self._world = SituationView.of_world(literals, model, clauses)
        states = {name: literals[predicted_name(name)] for name in planned}
        self._plan = SituationView.of_plan(states, model, clauses)
        self._order()

    def goal_holds(self, view: SituationView) -> int:
        """Return whether the goal that is pursued holds."""
        goals = self._model.goals
        return self._any(self._all(self._is(GOAL, name), view.holds(goal)) for name, goal in goals)

    def predicted_goal(self) -> int:
        """Return whether the goal that is pursued holds in the state that the plan predicts."""
        return self.goal_holds(self._plan)

    def _order(self) -> None:
        """Find where micro-steps of each kind are tried: where none of those before them applies."""
        model, every = self._model, self._all
        self._taken = [self._automatic(transition) for transition in model.automatic_transitions]
        calm = -self._any(where for where, _ in self._taken)
        running = self._is(PHASE, *_PURSUING)
        aborted = self._is(PLAN_STATE, PlanState.ABORTED.value)
        self._at_rest = every(self._is(PHASE, SetPhase.REST, SetPhase.OVER), calm)
        self._aborts = every(running, calm, aborted)
        self._sends = every(running, calm, -aborted)
        self._cancels = every(self._sends, *(-self._is_ready(resource) for resource in model.resources))
        ending = every(self._cancels, *(-self._is_stale(resource) for resource in model.resources))
        initial = self._is(CURRENT_STATE, OperationState.INITIAL.value)
        self._reaches = every(ending, initial, self.goal_holds(self._world))
        self._goes_on = every(ending, -self._reaches)
        self._is_free = every(self._goes_on, self._is(CURRENT_NAME, NO_OPERATION))
        self._asks = every(self._is_free, self._is(PHASE, SetPhase.ASKING))
        waiting = self._any(self._waits(operation) for operation in model.operations)
        self._settled = self._any((every(self._goes_on, waiting), self._asks))

    # formulas

    def _all(self, *literals: int) -> int:
        return self._clauses.all_of(literals)

    def _any(self, literals: Iterator[int] | Sequence[int]) -> int:
        return self._clauses.any_of(literals)

    def _is(self, name: str, *values: Value) -> int:
        return self._any([self._literals[name][value] for value in values])

    def _set(self, changes: Mapping[str, Value]) -> dict[str, ValueLiterals]:
        """Return new values of variables, as far as situations have them."""
        kept = {name: value for name, value in changes.items() if name in self._literals}
        return {n: {v: TRUE if v == value else -TRUE for v in self._literals[n]} for n, value in kept.items()}

    def _first(self, names: Sequence[str]) -> dict[str, ValueLiterals]:
        """Return that variables without a meaning have their first values."""
        return self._set({name: next(iter(self._literals[name])) for name in names})

    def _forgets_plan(self) -> dict[str, ValueLiterals]:
        return {**self._first([*map(predicted_name, self._planned)]), **self._set({PHASE: SetPhase.NO_PLAN})}

    def _leaves(self) -> dict[str, ValueLiterals]:
        return self._set({CURRENT_NAME: NO_OPERATION, CURRENT_STATE: OperationState.INITIAL.value})

    def _acting(self, guard: Predicate, actions: Sequence[Action]) -> tuple[int, dict[str, ValueLiterals]]:
        """Return whether a guard holds and actions fit, and the values that they give."""
        inside, given = self._world.after(actions)
        return self._all(self._world.holds(guard), inside), given

    def _running(self, transition: Transition) -> tuple[int, dict[str, ValueLiterals]]:
        return self._acting(transition.running_guard, transition.running_actions)

    # all steps

    def steps(self) -> Iterator[SetStep]:
        """Yield all steps."""
        yield from self._goals()
        yield from self._plans()
        for operation in self._model.operations:
            yield from self._next(operation)
            yield from self._lifecycle(operation)
        for resource in self._model.resources:
            yield from self._requests(resource)
        yield from self._automatic_steps()
        yield from self._outside()
        yield from self._ends()

    # 5.7, 5.6, 4: goals and plans

    def _goals(self) -> Iterator[SetStep]:
        where = self._all(self._at_rest, self._is(PHASE, SetPhase.REST))
        for name, _ in self._model.goals:
            given = self._set({PHASE: SetPhase.NO_PLAN, GOAL: name, PLAN_STATE: PlanState.PLANNING.value})
            yield SetStep(f"the goal {name} is given", where, given)

    def _plans(self) -> Iterator[SetStep]:
        asked = {predicted_name(name): self._literals[name] for name in self._planned}
        asked |= self._set({PHASE: SetPhase.ASKING, PLAN_STATE: PlanState.PLANNING.value})
        without = self._all(self._is_free, self._is(PHASE, SetPhase.NO_PLAN, SetPhase.ASKING))
        yield SetStep("a plan is requested", without, asked)
        answered = self._all(self._asks, self._alive)
        planned = self._set({PHASE: SetPhase.PLAN, PLAN_STATE: PlanState.EXECUTING.value})
        yield SetStep("the planner answers", answered, planned)
        names = [n for n in self._literals if n not in (PHASE, GOAL) and n not in map(predicted_name, self._planned)]
        looked_at = {**self._first(names), **self._set({PHASE: SetPhase.PLANNED})}
        yield SetStep("the operations of a plan are listed", answered, looked_at)
        done = self._all(self._is_free, self._is(PHASE, SetPhase.PLAN), self.predicted_goal())
        yield SetStep("the plan ends", done, self._forgets_plan())

    def planned_step(self, operation: Operation) -> tuple[int, dict[str, ValueLiterals]]:
        """Return whether the planner lets an operation follow, and the state that it predicts then (3.3)."""
        inside, between = self._plan.after(operation.pre.a)
        view = self._plan.following(between)
        fits, after = view.after(operation.post.a)
        where = self._all(self._plan.holds(operation.pre.g), inside, view.holds(operation.post.g), fits)
        return where, {predicted_name(name): values for name, values in {**between, **after}.items()}

    def _next(self, operation: Operation) -> Iterator[SetStep]:
        enabled, after = self.planned_step(operation)
        name = operation.name
        enabled = enabled if self._choices is None else self._all(enabled, self._choices[name])
        where = self._all(self._is_free, self._is(PHASE, SetPhase.PLAN), enabled)
        given = {**after, **self._set({CURRENT_NAME: name})}
        yield SetStep(f"{name} is next in the plan", where, given, leads_on=True)
        listed = self._all(self._is(PHASE, SetPhase.PLANNED), enabled)
        visits = (ClaimedObligation(name, ClaimedAspect.QUEUED),)
        yield SetStep(f"{name} is in a plan", listed, after, visits, leads_on=True)

    # 5.5: the operation

    def _in(self, operation: Operation, state: OperationState) -> int:
        current = self._is(CURRENT_NAME, operation.name)
        return self._all(self._goes_on, current, self._is(CURRENT_STATE, state.value))

    def _entering(
        self, operation: Operation, where: int, given: Mapping[str, ValueLiterals], state: OperationState
    ) -> SetStep:
        visits = (ClaimedObligation(operation.name, ClaimedAspect(state.value)),)
        after = {**given, **self._set({CURRENT_STATE: state.value})}
        return SetStep(f"{operation.name} becomes {state}", where, after, visits)

    def _waits(self, operation: Operation) -> int:
        """Return whether an operation waits for an event while it is current."""
        current = self._is(CURRENT_NAME, operation.name)
        states = OperationState
        starts, _ = self._running(operation.pre)
        ends = [self._running(part)[0] for part in (operation.post, operation.failed) if part is not None]
        disabled = self._all(self._is(CURRENT_STATE, states.DISABLED.value), -starts)
        executing = self._all(self._is(CURRENT_STATE, states.EXECUTING.value), *(-end for end in ends))
        return self._all(current, self._any((disabled, executing)))

    def _lifecycle(self, operation: Operation) -> Iterator[SetStep]:
        states, name = OperationState, operation.name
        starts, given = self._running(operation.pre)
        initial, disabled, executing = (
            self._in(operation, s) for s in (states.INITIAL, states.DISABLED, states.EXECUTING)
        )
        yield self._entering(operation, self._all(self._any((initial, disabled)), starts), given, states.EXECUTING)
        yield self._entering(operation, self._all(initial, -starts), {}, states.DISABLED)
        drops = {**self._leaves(), **self._forgets_plan()}
        if operation.disabled_deadline_ns is not None:
            yield SetStep(f"{name} is given up", self._all(disabled, -starts), drops)
        completes, given = self._running(operation.post)
        yield self._entering(operation, self._all(executing, completes), given, states.COMPLETED)
        left = self._all(executing, -completes)
        if operation.failed is not None:
            fails, given = self._running(operation.failed)
            yield self._entering(operation, self._all(left, fails), given, states.FAILED)
            left = self._all(left, -fails)
        if operation.deadline_ns is not None:
            inside, given = self._world.after(operation.timedout)
            yield self._entering(operation, self._all(left, inside), given, states.TIMEDOUT)
            yield self._end(f"{name} ends with a model error", self._all(left, -inside), PlanState.ABORTED)
        yield SetStep(f"{name} is left", self._in(operation, states.COMPLETED), self._leaves())
        ended = self._any((self._in(operation, states.FAILED), self._in(operation, states.TIMEDOUT)))
        yield SetStep(f"{name} is left, and a plan is needed", ended, drops)

    # 5.3, 6: requests

    def _is_ready(self, resource: Resource) -> int:
        initial = self._is(resource.request_state, RequestState.INITIAL.value)
        return self._all(self._is(resource.trigger, True), initial)

    def _flies(self, resource: Resource) -> int:
        return self._is(request_name(resource.name), True)

    def _is_stale(self, resource: Resource) -> int:
        return self._all(self._flies(resource), self._is(resource.trigger, False))

    def _requests(self, resource: Resource) -> Iterator[SetStep]:
        name, state, flies = resource.name, resource.request_state, request_name(resource.name)
        before = self._model.resources[: self._model.resources.index(resource)]
        sends = self._all(self._sends, self._is_ready(resource), *(-self._is_ready(other) for other in before))
        yield SetStep(f"a request to {name}", sends, self._set({state: RequestState.EXECUTING.value, flies: True}))
        cancels = self._all(self._cancels, self._is_stale(resource))
        yield SetStep(
            f"a cancelled request to {name}", cancels, self._set({state: RequestState.INITIAL.value, flies: False})
        )
        measured = tuple((n, resource.sends(self._model.space[n])) for n in resource.measures if n in self._literals)
        for end in (RequestState.SUCCEEDED, RequestState.FAILED):
            where = self._all(self._settled, self._flies(resource))
            given = self._set({state: end.value, flies: False})
            yield SetStep(
                f"a reply of {name}", where, given, may_become=tuple((n, v) for n, v in measured if n not in given)
            )

    # 5.1: automatic transitions

    def _automatic(self, transition: Transition) -> tuple[int, dict[str, ValueLiterals]]:
        """Return whether a transition is taken unless one before it is, and the values that it gives."""
        space = self._model.running_space
        failing = [action for action in transition.running_actions if fails_operation(action, space)]
        others = [action for action in transition.running_actions if action not in failing]
        where, given = self._acting(transition.running_guard, others)
        guards = [self._world.has(action.target, OperationState.EXECUTING.value) for action in failing]
        kept = self._all(*(self._same(name, values) for name, values in given.items()))
        where = self._all(
            where, *guards, *([] if failing else [-kept]), self._is(PHASE, SetPhase.REST, SetPhase.OVER, *_PURSUING)
        )
        if failing:
            given = {**given, **self._set({CURRENT_STATE: OperationState.FAILED.value})}
        return where, given

    def _same(self, name: str, values: ValueLiterals) -> int:
        """Return whether a variable has the same value before and after."""
        return self._any([self._all(self._literals[name][value], literal) for value, literal in values.items()])

    def _automatic_steps(self) -> Iterator[SetStep]:
        left = TRUE
        for transition, (where, given) in zip(self._model.automatic_transitions, self._taken, strict=True):
            taken = ClaimedObligation(transition.name, ClaimedAspect.TAKEN)
            space = self._model.running_space
            if any(fails_operation(action, space) for action in transition.running_actions):
                for operation in self._model.operations:
                    here = self._all(left, where, self._is(CURRENT_NAME, operation.name))
                    failed = ClaimedObligation(operation.name, ClaimedAspect.FAILED)
                    yield SetStep(transition.name, here, given, (taken, failed))
            else:
                yield SetStep(transition.name, self._all(left, where), given, (taken,))
            left = self._all(left, -where)

    # 9: changes from outside

    def _outside(self) -> Iterator[SetStep]:
        where = self._any((self._settled, self._at_rest))
        for group in free_groups(self._model):
            known = tuple((name, values) for name, values in group.values if name in self._literals)
            if known:
                yield SetStep(f"a change by {group.name}", where, {}, may_become=known)
        for transition in self._model.environment:
            acts, given = self._acting(transition.guard, transition.actions)
            if given:
                yield SetStep(f"a change by {transition.name}", self._all(where, acts), given)
        free, used = RequestState.INITIAL.value, RequestState.EXECUTING.value
        for resource in (each for each in self._model.resources if each.shared):
            for before, after in ((free, used), (used, free)):
                alone = self._all(where, -self._flies(resource), self._is(resource.request_state, before))
                yield SetStep(f"another user of {resource.name}", alone, self._set({resource.request_state: after}))

    # 5: ends

    def _end(self, what: str, where: int, plan_state: PlanState) -> SetStep:
        phase = SetPhase.REST if self._model.runs.goals is GoalOrder.SEQUENCE else SetPhase.OVER
        given = {**self._forgets_plan(), **self._leaves(), **self._first([GOAL])}
        given |= self._set({PHASE: phase, PLAN_STATE: plan_state.value})
        executing, initial = RequestState.EXECUTING.value, RequestState.INITIAL.value
        for resource in self._model.resources:
            occupied = self._all(self._is(resource.request_state, executing), -self._flies(resource))
            values = dict.fromkeys(self._literals[resource.request_state], -TRUE)
            given[resource.request_state] = {**values, executing: occupied, initial: -occupied}
            given |= self._set({resource.trigger: False, request_name(resource.name): False})
        return SetStep(what, where, given, ends_run=True)

    def _ends(self) -> Iterator[SetStep]:
        running = self._is(PHASE, *_PURSUING)
        livelock = self._all(running, self._any([where for where, _ in self._taken]))
        asking = self._all(self._is_free, self._is(PHASE, SetPhase.NO_PLAN))
        yield self._end("the goal is reached", self._reaches, PlanState.COMPLETED)
        yield self._end("the run is aborted", self._aborts, PlanState.ABORTED)
        yield self._end("a limit ends the run", self._any((self._settled, asking)), PlanState.ABORTED)
        yield self._end("a livelock", livelock, PlanState.ABORTED)
        yield self._end("no plan exists", self._asks, PlanState.UNSOLVABLE)
