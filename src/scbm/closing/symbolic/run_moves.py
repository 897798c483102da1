"""The steps of runs on sets of situations: one move for each micro-step and each event.

Plans are any, or canonical: then each operation is next in a plan only where it is the choice of the planner.

The order of micro-steps is that of `running.micro_steps`, the life of operations that of `running.lifecycle`. A
situation here may be in the midst of a settling. What is simpler than in runs is larger, never smaller: a planner may
also answer that no plan exists, each settling with automatic transitions may end as a livelock, and requests without a
trigger are cancelled in any order.

Beside the variables of the world a situation has the phase of the runner, the goal that it pursues, which requests are
in flight, and the state from which the rest of the plan starts. In the phase `PLANNED` the operations of a plan are
listed (semantics 8.2), and nothing else happens.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import Aspect
from scbm.closing.symbolic.run_space import AssignedValues, SpaceReader
from scbm.model import GoalOrder, InitialStates, OperationState, PlanState, RequestState, Role
from scbm.model.sources import free_groups
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE, operation_state_name
from scbm.proofcheck import GOAL, PHASE, SetPhase, predicted_name, request_name
from scbm.running.lifecycle import LIFECYCLE, PlanEffect, guard_and_actions

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.closing.symbolic.decision_diagrams import Diagram
    from scbm.closing.symbolic.run_space import RunSpace
    from scbm.model import Action, BehaviorModel, Operation, Predicate, Resource, Transition, Value
    from scbm.running.lifecycle import LifecycleRule

    Given = Mapping[str, Value]

PURSUING = (SetPhase.NO_PLAN, SetPhase.ASKING, SetPhase.PLAN)


class Alternative(Struct, frozen=True):
    """A change of situations.

    Attributes:
        where: the situations in which it is possible.
        names: the variables that it gives new values.
        then: the new values; it may compare them with other variables.
    """

    where: Diagram
    names: tuple[str, ...] = ()
    then: Diagram | None = None


class RunMove(Struct, frozen=True):
    """A step of runs: stages one after the other, in each of which any one of the alternatives is taken.

    Attributes:
        where: the situations in which it begins.
        stages: the stages.
        visits: the obligations that it visits, each with its subject.
        is_loose: whether it is possible in more situations than in runs.
        ends_run: whether it ends a run, whose requests in flight are cancelled one after the other.
    """

    where: Diagram
    stages: tuple[tuple[Alternative, ...], ...]
    visits: tuple[tuple[str, Aspect], ...] = ()
    is_loose: bool = False
    ends_run: bool = False


class RunMoves:
    """The moves of a model.

    Attributes:
        space: the variables.
        alive: the predicted states from which a plan may lead to the goal; all that are not proved dead.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - what a situation is, and which moves and plans there are
        self,
        model: BehaviorModel,
        space: RunSpace,
        predicted: Sequence[str],
        dead: Diagram | None = None,
        choices: Mapping[str, Diagram] | None = None,
        beyond: Diagram | None = None,
    ) -> None:
        """Prepare the moves. Raises `TooManyValuesError`.

        Args:
            model: the model.
            space: the variables of its situations.
            predicted: the variables of the world on which plans depend.
            dead: predicted states from which no plan leads to the goal; by default none.
            choices: for each operation the predicted states in which a plan goes on with it; by default plans are any.
            beyond: situations that are left out after each move; by default none.
        """
        self.space = space
        self.alive = space.manager.true if dead is None else ~dead
        self._model = model
        self._choices = choices
        self._within = None if beyond is None else ~beyond
        self._predicted = tuple(predicted_name(name) for name in predicted)
        self._pairs = tuple((name, predicted_name(name)) for name in predicted)
        self._world = SpaceReader(space, model)
        self._planned = SpaceReader(space, model, prefix=predicted_name(""))
        self._requests = tuple(request_name(resource.name) for resource in model.resources)
        kept = [name for name in space.variables if name in model.running_space]
        self._first = {name: space.variables[name].values[0] for name in space.variables}
        self._kept = tuple(kept)
        self._automatic = [self._automatic_cases(each) for each in model.automatic_transitions]
        self._prepare_order()

    def _prepare_order(self) -> None:
        """Find where each kind of micro-step is tried: where none of those before it applies."""
        space, has = self.space, self.space.has
        taken = [space.any_of(case.where for case in cases) for cases in self._automatic]
        self._automatic_where = taken
        no_automatic = ~space.any_of(taken)
        self._resting = space.has_one_of(PHASE, (SetPhase.REST, SetPhase.OVER)) & no_automatic
        running = space.has_one_of(PHASE, PURSUING) & no_automatic
        aborted = has(PLAN_STATE, PlanState.ABORTED.value)
        self._aborting, self._requesting = running & aborted, running & ~aborted
        ready = space.any_of(map(self._is_ready, self._model.resources))
        self._cancelling = self._requesting & ~ready
        stale = space.any_of(map(self._is_stale, self._model.resources))
        ending = self._cancelling & ~stale
        self._reaching = ending & has(CURRENT_STATE, OperationState.INITIAL.value) & self.goal_holds(self._world)
        self._going_on = ending & ~self._reaching
        self._following = self._going_on & has(CURRENT_NAME, NO_OPERATION)

    def goal_holds(self, reader: SpaceReader) -> Diagram:
        """Return where the goal that is pursued holds."""
        goals = self._model.goals
        return self.space.any_of(self._pursues(name) & reader.holds(goal) for name, goal in goals)

    def predicted_goal(self) -> Diagram:
        """Return where the goal that is pursued holds in the predicted state."""
        return self.goal_holds(self._planned)

    def _pursues(self, goal: str) -> Diagram:
        return self.space.has(GOAL, goal)

    def where(self, predicate: Predicate) -> Diagram:
        """Return where a predicate holds in situations of runs."""
        return self._world.holds(predicate) & ~self.space.has(PHASE, SetPhase.PLANNED)

    def can_hold(self, predicate: Predicate, situations: Diagram) -> bool:
        """Return whether a predicate holds in some of these situations of runs."""
        return situations & self.where(predicate) != self.space.manager.false

    # sets

    def start(self) -> Diagram:
        """Return the situations in which the runner starts."""
        space, model = self.space, self._model
        found = space.manager.false
        reader = SpaceReader(space, model)
        for beginning in InitialStates(model).beginnings(is_open=True):
            kept = [space.has_one_of(name, values) for name, values in beginning.items() if name in space.variables]
            found |= space.all_of(reversed(kept))
        runner = [v for v in model.running_space if v.role.is_runner and v.name in space.variables]
        found &= space.all_of(space.has(v.name, v.initial) for v in runner)
        others = [n for n in space.variables if n not in self._kept]
        found &= space.all_of(space.has(name, self._first[name]) for name in others)
        return found & reader.holds(model.initial_states)

    def image(self, move: RunMove, situations: Diagram) -> Diagram:
        """Return the situations to which a move leads from some."""
        manager = self.space.manager
        found = situations & move.where
        for stage in move.stages:
            before, found = found, manager.false
            if before == found:
                return before
            for each in stage:
                left = before & each.where
                if each.names and left != manager.false:
                    left = manager.exist(self.space.bits_of(each.names), left)
                    left = left if each.then is None else left & each.then
                found |= left
        return found if self._within is None else found & self._within

    def cancelled(self, situations: Diagram) -> Diagram:
        """Return the situations in which any requests in flight of some are cancelled, as while a run ends.

        They count as in flight still, so that what ends the run finds them.
        """
        stages = []
        for resource in self._model.resources:
            cleared: dict[str, Value] = {resource.trigger: False, resource.request_state: RequestState.INITIAL.value}
            flies = self.space.has(request_name(resource.name), True)
            stages.append((Alternative(self.space.manager.true), self._change(cleared, flies)))
        return self.image(RunMove(situations, tuple(stages)), situations)

    def before(self, move: RunMove, situations: Diagram) -> Diagram:
        """Return the situations from which a move can lead to some."""
        manager, found = self.space.manager, situations
        for stage in reversed(move.stages):
            after, found = found, manager.false
            for each in stage:
                left = after if each.then is None else after & each.then
                left = manager.exist(self.space.bits_of(each.names), left) if each.names else left
                found |= left & each.where
        return found & move.where

    # changes

    def _change(self, given: Given, where: Diagram | None = None) -> Alternative:
        """Return the change that gives variables values."""
        space = self.space
        kept = {name: value for name, value in given.items() if name in space.variables}
        then = space.all_of(space.has(name, value) for name, value in reversed(kept.items()))
        return Alternative(space.manager.true if where is None else where, tuple(kept), then)

    def _changes(self, cases: Iterable[AssignedValues], more: Given) -> tuple[Alternative, ...]:
        return tuple(self._change({**dict(case.values), **more}, case.where) for case in cases)

    def _no_plan(self) -> dict[str, Value]:
        """Return the values of a run without a plan."""
        return {PHASE: SetPhase.NO_PLAN, **{name: self._first[name] for name in self._predicted}}

    def _at_rest(self) -> dict[str, Value]:
        return {CURRENT_NAME: NO_OPERATION, CURRENT_STATE: OperationState.INITIAL.value}

    def _end(self, where: Diagram, plan_state: PlanState) -> RunMove:
        """Return the end of a run: its requests are cleared, and no operation is current."""
        space = self.space
        stages = []
        for resource in self._model.resources:
            flies, state = space.has(request_name(resource.name), True), resource.request_state
            occupied = space.has(state, RequestState.EXECUTING.value) & ~flies
            idle: dict[str, Value] = {resource.trigger: False}
            cleared = {**idle, state: RequestState.INITIAL.value}
            stages.append((self._change(idle, occupied), self._change(cleared, ~occupied)))
        phase = SetPhase.REST if self._model.runs.goals is GoalOrder.SEQUENCE else SetPhase.OVER
        given: dict[str, Value] = {**self._no_plan(), **self._at_rest(), PLAN_STATE: plan_state.value, PHASE: phase}
        given |= {GOAL: self._first[GOAL], **dict.fromkeys(self._requests, False)}
        return RunMove(where, (*stages, (self._change(given),)), ends_run=True)

    # moves

    def moves(self) -> Iterator[RunMove]:
        """Yield all moves, those that follow each other in most runs one after the other."""
        yield from self._beginnings()
        yield from self._plans()
        for operation in self._model.operations:
            yield from self._operation_moves(operation)
        yield from self._replies()
        yield from self._sendings()
        yield from self._automatic_moves()
        yield from self._outside()
        yield from self._ends()

    def _beginnings(self) -> Iterator[RunMove]:
        where = self._resting & self.space.has(PHASE, SetPhase.REST)
        for name, _ in self._model.goals:
            given = {PHASE: SetPhase.NO_PLAN, GOAL: name, PLAN_STATE: PlanState.PLANNING.value}
            yield RunMove(where, ((self._change(given),),))

    def _plans(self) -> Iterator[RunMove]:
        """Yield the moves of a run without a current operation, but those that make one current."""
        space, has = self.space, self.space.has
        predicted = self._predicts_present()
        given = self._change({PHASE: SetPhase.ASKING, PLAN_STATE: PlanState.PLANNING.value})
        then = predicted if given.then is None else given.then & predicted
        asks = Alternative(given.where, (*given.names, *self._predicted), then)
        without = self._following & space.has_one_of(PHASE, (SetPhase.NO_PLAN, SetPhase.ASKING))
        yield RunMove(without, ((asks,),))
        answered = self._following & has(PHASE, SetPhase.ASKING) & self.alive
        answer = self._change({PHASE: SetPhase.PLAN, PLAN_STATE: PlanState.EXECUTING.value})
        yield RunMove(answered, ((answer,),))
        looked_at = {PHASE: SetPhase.PLANNED, **{name: self._first[name] for name in (*self._kept, *self._requests)}}
        yield RunMove(answered, ((self._change(looked_at),),))
        done = self._following & has(PHASE, SetPhase.PLAN) & self.goal_holds(self._planned)
        yield RunMove(done, ((self._change(self._no_plan()),),))

    def _predicts_present(self) -> Diagram:
        """Return where the predicted state is the present one."""
        return self.space.all_of(self.space.equal(name, other) for name, other in reversed(self._pairs))

    def following(self, operation: Operation, where: Diagram, given: Given, aspect: Aspect | None) -> RunMove:
        """Return the move by which an operation is next in a plan, as the planner predicts."""
        stages = [
            self._changes(self._planned.cases(half.a), {}) if half.a else (Alternative(self.space.manager.true),)
            for half in (operation.pre, operation.post)
        ]
        guard = (Alternative(self._planned.holds(operation.post.g)),)
        then = self._change(given)
        last = Alternative(self.alive, then.names, then.then) if given else Alternative(self.alive)
        visits = () if aspect is None else ((operation.name, aspect),)
        return RunMove(where & self._planned.holds(operation.pre.g), (stages[0], guard, stages[1], (last,)), visits)

    def _operation_moves(self, operation: Operation) -> Iterator[RunMove]:
        has, name = self.space.has, operation.name
        planned = has(PHASE, SetPhase.PLANNED) & has(CURRENT_NAME, self._first[CURRENT_NAME])
        chosen = self.space.manager.true if self._choices is None else self._choices[name]
        next_one = self._following & has(PHASE, SetPhase.PLAN) & chosen
        yield self.following(operation, next_one, {CURRENT_NAME: name}, None)
        yield self.following(operation, planned & chosen, {}, Aspect.QUEUED)
        for source in dict.fromkeys(rule.source for rule in LIFECYCLE):
            left = self._going_on & has(CURRENT_NAME, name) & has(CURRENT_STATE, source.value)
            timed = self._passes(operation, source)
            rules = [rule for rule in LIFECYCLE if rule.source is source]
            for rule in sorted(rules, key=lambda each: each.needs_timer):
                part = guard_and_actions(operation, rule.part)
                if part is None or (rule.needs_timer and not timed):
                    continue
                cases = self._enabled(*part)
                yield self._lifecycle_move(operation, rule, left, cases)
                left &= ~self.space.any_of(case.where for case in cases)

    @staticmethod
    def _passes(operation: Operation, state: OperationState) -> bool:
        """Return whether an operation may be in a state for a limited time only."""
        if state is OperationState.DISABLED:
            return operation.disabled_deadline_ns is not None
        return state is OperationState.EXECUTING and operation.deadline_ns is not None

    def _enabled(self, guard: Predicate, actions: Sequence[Action]) -> list[AssignedValues]:
        holds = self._world.holds(guard)
        return [AssignedValues(case.where & holds, case.values) for case in self._world.cases(actions)]

    def _lifecycle_move(
        self, operation: Operation, rule: LifecycleRule, where: Diagram, cases: Sequence[AssignedValues]
    ) -> RunMove:
        if rule.plan is PlanEffect.MODEL_ERROR:
            return self._end(where, PlanState.ABORTED)
        given: dict[str, Value] = {CURRENT_STATE: rule.target.value}
        if rule.target is OperationState.INITIAL:
            given = self._at_rest() | (self._no_plan() if rule.plan is PlanEffect.REPLAN else {})
            return RunMove(where, (self._changes(cases, given),))
        return RunMove(where, (self._changes(cases, given),), ((operation.name, Aspect(rule.target.value)),))

    def _settled(self) -> Diagram:
        """Return where a run waits for an event."""
        space, waiting = self.space, self.space.manager.false
        for operation in self._model.operations:
            for source, parts in _TRIED.items():
                here = space.has(CURRENT_NAME, operation.name) & space.has(CURRENT_STATE, source.value)
                for part in parts:
                    found = guard_and_actions(operation, part)
                    if found is not None:
                        here &= ~space.any_of(case.where for case in self._enabled(*found))
                waiting |= here
        return self._going_on & waiting | self._following & space.has(PHASE, SetPhase.ASKING)

    # requests

    def _is_ready(self, resource: Resource) -> Diagram:
        has = self.space.has
        return has(resource.trigger, True) & has(resource.request_state, RequestState.INITIAL.value)

    def _is_stale(self, resource: Resource) -> Diagram:
        return self.space.has(request_name(resource.name), True) & self.space.has(resource.trigger, False)

    def _sendings(self) -> Iterator[RunMove]:
        left = self._requesting
        for resource in self._model.resources:
            state, flies = resource.request_state, request_name(resource.name)
            sent = self._change({state: RequestState.EXECUTING.value, flies: True})
            yield RunMove(left & self._is_ready(resource), ((sent,),))
            left &= ~self._is_ready(resource)
            cancelled = self._change({state: RequestState.INITIAL.value, flies: False})
            yield RunMove(self._cancelling & self._is_stale(resource), ((cancelled,),))

    def _replies(self) -> Iterator[RunMove]:
        settled = self._settled()
        for resource in self._model.resources:
            flies = request_name(resource.name)
            measured = [(name, resource.sends(self._model.space[name])) for name in resource.measures]
            stages = tuple(self._may_become(name, values) for name, values in measured if name in self.space.variables)
            replies = [
                self._change({resource.request_state: state.value, flies: False})
                for state in (RequestState.SUCCEEDED, RequestState.FAILED)
            ]
            yield RunMove(settled & self.space.has(flies, True), (*stages, tuple(replies)))

    def _may_become(self, name: str, values: Iterable[Value]) -> tuple[Alternative, ...]:
        """Return the stage in which a variable keeps its value or gets one of some values."""
        everywhere = self.space.manager.true
        return Alternative(everywhere), Alternative(everywhere, (name,), self.space.has_one_of(name, values))

    # automatic transitions

    def _automatic_cases(self, transition: Transition) -> list[AssignedValues]:
        """Return the cases in which an automatic transition is taken if none before it is: it changes something."""
        space, running = self.space, self._model.running_space
        roles = (Role.OPERATION_STATE, Role.CURRENT_STATE)
        fails = [action for action in transition.running_actions if running[action.target].role in roles]
        others = [action for action in transition.running_actions if action not in fails]
        holds = space.has_one_of(PHASE, (SetPhase.REST, SetPhase.OVER, *PURSUING)) & self._world.holds(
            transition.running_guard
        )
        for action in fails:
            holds &= self._executes(action.target)
        found = []
        for case in self._world.cases(others):
            where = case.where & holds
            if not fails:
                where &= ~space.all_of(space.has(name, value) for name, value in case.values)
            failed = ((CURRENT_STATE, OperationState.FAILED.value),) if fails else ()
            found.append(AssignedValues(where, (*case.values, *failed)))
        return found

    def _executes(self, name: str) -> Diagram:
        """Return where an operation executes, by the name of its state; for `current.state` any operation."""
        space = self.space
        executes = space.has(CURRENT_STATE, OperationState.EXECUTING.value)
        for operation in self._model.operations:
            if name == operation_state_name(operation.name):
                return executes & space.has(CURRENT_NAME, operation.name)
        return executes

    def _automatic_moves(self) -> Iterator[RunMove]:
        space = self.space
        left = space.manager.true
        operations = [operation.name for operation in self._model.operations]
        transitions = zip(self._model.automatic_transitions, self._automatic, self._automatic_where, strict=True)
        for transition, cases, where in transitions:
            taken = (transition.name, Aspect.TAKEN)
            fails = any((CURRENT_STATE, OperationState.FAILED.value) in case.values for case in cases)
            changes = self._changes(cases, {})
            if not fails:
                yield RunMove(left, (changes,), (taken,))
            for name in operations if fails else ():
                is_current = left & space.has(CURRENT_NAME, name)
                yield RunMove(is_current, (changes,), (taken, (name, Aspect.FAILED)))
            left &= ~where

    # changes from outside, ends

    def _outside(self) -> Iterator[RunMove]:
        settled = self._settled() | self._resting
        for group in free_groups(self._model):
            known = [(name, values) for name, values in group.values if name in self.space.variables]
            if known:
                yield RunMove(settled, tuple(self._may_become(name, values) for name, values in known))
        for transition in self._model.environment:
            cases = self._enabled(transition.guard, transition.actions)
            if any(case.values for case in cases):
                yield RunMove(settled, (self._changes(cases, {}),))
        for resource in self._model.resources:
            if resource.shared:
                free, used = RequestState.INITIAL.value, RequestState.EXECUTING.value
                alone = settled & self.space.has(request_name(resource.name), False)
                for before, after in ((free, used), (used, free)):
                    where = self.space.has(resource.request_state, before)
                    yield RunMove(alone & where, ((self._change({resource.request_state: after}),),))

    def _ends(self) -> Iterator[RunMove]:
        """Yield the ends of runs: reached, aborted, unsolvable, by a limit or a livelock."""
        running = self.space.has_one_of(PHASE, PURSUING)
        livelocked = running & self.space.any_of(self._automatic_where)
        asking = self._following & self.space.has(PHASE, SetPhase.ASKING)
        limited = self._settled() | self._following & self.space.has(PHASE, SetPhase.NO_PLAN)
        yield self._end(self._reaching, PlanState.COMPLETED)
        yield self._end(self._aborting | limited, PlanState.ABORTED)
        nothing_flies = self.space.all_of(self.space.has(name, False) for name in self._requests)
        yield self._end(asking & ~self.alive & nothing_flies & self._predicts_present(), PlanState.UNSOLVABLE)
        yield replace(self._end(livelocked, PlanState.ABORTED), is_loose=True)
        yield replace(self._end(asking, PlanState.UNSOLVABLE), is_loose=True)


_TRIED = {
    source: tuple(rule.part for rule in LIFECYCLE if rule.source is source and not rule.needs_timer)
    for source in dict.fromkeys(rule.source for rule in LIFECYCLE)
}
"""The parts that are tried in each state of an operation without a timer."""
