"""Whether a run that waits could reach its goal if something outside changed (semantics 7.12).

A model that waits for a person who acknowledges a fault cannot recover where no person acts, and that is not its fault.
A lamp that nothing in the model depends on excuses nothing. So the run is followed from the state in which it waits:
once without changes from outside, and once with all of them. Further requests succeed; those in flight get no reply.
"""

from __future__ import annotations

from enum import Enum
from functools import cached_property
from itertools import islice, product
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, assert_never

from scbm.cases.trace import End
from scbm.model import PlanState
from scbm.model.sources import outside_groups
from scbm.planning import PlanCache, Planner, Solved, Unsolvable
from scbm.planning.engines.transition_system import influencing, may_leave
from scbm.running import Program
from scbm.running.lifecycle import OperationMove, PlanEffect
from scbm.running.micro_steps import (
    AutomaticMove,
    PlanStep,
    RequestCancelling,
    RequestSending,
    RunTurn,
    next_in_plan,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.running.micro_steps import MicroStep, MicroSteps
    from scbm.running.program import RequestLine

WAITING_ENDS = (End.TIME_LIMIT, End.REPLAN_LIMIT, End.UNSOLVABLE)
"""The ends of runs that wait, or repeat without end. A run that ends otherwise has not waited for a change."""

_MOST_SITUATIONS = 5_000
"""Maximum number of situations of one search: a fraction of a second. What a longer search finds is unknown."""

_MOST_VALUES = 256
"""Maximum number of combinations of values of one message that are tried, beside each value alone."""


class OutsideHelp(Enum):
    """Whether changes from outside lead a waiting run to its goal."""

    LEADS_TO_GOAL = "with changes from outside the run can reach its goal, and without them it cannot"
    NONE = "changes from outside make no difference"
    UNKNOWN = "the search was too long"


class _SearchEnd(Enum):
    """How one search for the goal ended."""

    YES = "the goal can be reached"
    NO = "the goal cannot be reached"
    UNKNOWN = "the search was too long"


class _ExcusedRun(NamedTuple):
    """A situation of a run.

    Attributes:
        state: the packed state.
        in_flight: the resources with a request in flight, by number.
        missing: those of them that never reply.
        queue: the operations that are still to come.
    """

    state: int
    in_flight: tuple[int, ...] = ()
    missing: tuple[int, ...] = ()
    queue: tuple[str, ...] = ()

    def without(self, number: int, state: int) -> _ExcusedRun:
        """Return the situation after a request has ended."""
        left = tuple(each for each in self.in_flight if each != number)
        return self._replace(state=state, in_flight=left, missing=tuple(n for n in self.missing if n != number))


_Choice: TypeAlias = "tuple[int, int]"
"""`(keep, bits)` of values that change together."""


class WithheldChanges:
    """Answers whether changes from outside can lead waiting runs of one model to their goals. Memoizes answers."""

    def __init__(self, model: BehaviorModel) -> None:
        """Prepare nothing yet: most runs do not wait."""
        self._model = model
        self._known: dict[tuple[int, tuple[int, ...], Predicate], OutsideHelp] = {}

    def help_for(self, state: Mapping[str, Value], in_flight: Sequence[str], goal: Predicate) -> OutsideHelp:
        """Return whether changes from outside lead a run to its goal, and nothing else does.

        Args:
            state: the values of all variables as the run ended, the runner's own included. Those of an operation that a
                mutant lacks have their initial values.
            in_flight: the resources with a request in flight, which get no reply.
            goal: the goal of the run.
        """
        if not outside_groups(self._model):
            return OutsideHelp.NONE
        names = dict.fromkeys(in_flight)
        numbers = tuple(line.number for line in self._program.requests if line.resource.name in names)
        keep, bits = self._program.plan_states[PlanState.EXECUTING]  # as the run waits, whatever it ended with
        values = {each.name: state.get(each.name, each.initial) for each in self._model.running_space}
        packed = self._program.packing.pack(values) & self._relevant(goal) & keep | bits
        key = (packed, numbers, goal)
        if key not in self._known:
            self._known[key] = self._searched(_ExcusedRun(packed, numbers, numbers), goal)
        return self._known[key]

    def _searched(self, start: _ExcusedRun, goal: Predicate) -> OutsideHelp:
        for changes in (False, True):
            match self._search(start, goal, changes=changes):
                case _SearchEnd.UNKNOWN:
                    return OutsideHelp.UNKNOWN
                case _SearchEnd.YES:
                    return OutsideHelp.LEADS_TO_GOAL if changes else OutsideHelp.NONE
                case _SearchEnd.NO:
                    pass
        return OutsideHelp.NONE

    def _search(self, start: _ExcusedRun, goal: Predicate, *, changes: bool) -> _SearchEnd:
        """Return whether the goal can be reached, with or without changes from outside.

        The newest situation comes first: one run to the goal is enough, and this order finds it among fewer situations
        than breadth first, so fewer searches meet the limit.
        """
        steps, mask = self._program.micro_steps(goal), self._relevant(goal)
        seen, pending = {start: None}, [start]
        while pending:
            situation = pending.pop()
            lines = tuple(self._program.requests[number] for number in situation.in_flight)
            step = steps.first(situation.state, lines, timer_passed=False)
            if step is RunTurn.REACH_GOAL:
                return _SearchEnd.YES
            may_change = changes or len(situation.in_flight) > len(situation.missing)
            following = self._following(situation, step, goal, may_change=may_change)
            if following is None:
                return _SearchEnd.UNKNOWN
            waits = not following
            if waits and step in (None, RunTurn.FOLLOW_PLAN):
                following = [*(self._changed(situation) if changes else ()), *self._waited(situation, lines, steps)]
            for each in following:
                after = each._replace(state=each.state & mask)
                if after not in seen:
                    seen[after] = None
                    pending.append(after)
            if len(seen) > _MOST_SITUATIONS:
                return _SearchEnd.UNKNOWN
        return _SearchEnd.NO

    def _following(
        self, situation: _ExcusedRun, step: MicroStep | None, goal: Predicate, *, may_change: bool
    ) -> list[_ExcusedRun] | None:
        """Return the successors without waiting, one situation or none; `None` if the limits of planning hide it."""
        match step:
            case AutomaticMove():
                return [situation._replace(state=step.after)]
            case RequestSending():
                sent = situation.without(step.line.number, step.after)
                return [sent._replace(in_flight=(*sent.in_flight, step.line.number))]
            case RequestCancelling():
                return [situation.without(step.line.number, step.after)]
            case OperationMove():
                return self._moved(situation, step)
            case RunTurn.FOLLOW_PLAN:
                return self._follow_plan(situation, goal, may_change=may_change)
            case RunTurn.ABORT | RunTurn.REACH_GOAL | None:
                return []
            case _:
                assert_never(step)

    @staticmethod
    def _moved(situation: _ExcusedRun, move: OperationMove) -> list[_ExcusedRun]:
        if move.rule.plan is PlanEffect.MODEL_ERROR:
            return []
        queue = () if move.rule.plan is PlanEffect.REPLAN else situation.queue
        return [situation._replace(state=move.after, queue=queue)]

    def _follow_plan(self, situation: _ExcusedRun, goal: Predicate, *, may_change: bool) -> list[_ExcusedRun] | None:
        """Return the situation after the next operation of the plan became current; none if there is no plan.

        A plan is answered at once. `None` if the limits of planning hide the answer.
        """
        queue, is_unsolvable = situation.queue, False
        while True:
            following = next_in_plan(
                is_queued=bool(queue), is_asking=False, is_unsolvable=is_unsolvable, may_change=may_change
            )
            match following:
                case PlanStep.TAKE_NEXT:
                    keep, bits = self._program.operations[queue[0]].take_current
                    return [situation._replace(state=situation.state & keep | bits, queue=queue[1:])]
                case PlanStep.REQUEST_PLAN:
                    answer = self._plans.plan(self._program.packing.values(situation.state), goal)
                    if not isinstance(answer, Solved | Unsolvable):
                        return None
                    queue = answer.plan if isinstance(answer, Solved) else ()
                    is_unsolvable = not queue
                case PlanStep.AWAIT_ANSWER | PlanStep.AWAIT_CHANGE | PlanStep.END_UNSOLVABLE:
                    return []
                case _:
                    assert_never(following)

    def _waited(self, situation: _ExcusedRun, lines: Sequence[RequestLine], steps: MicroSteps) -> Iterator[_ExcusedRun]:
        """Yield what time brings: the deadline of the current operation, or a successful reply."""
        state = situation.state
        current = self._program.current(state)
        if current is not None and current.has_timer:
            late = steps.first(state, lines, timer_passed=True)
            if isinstance(late, OperationMove):
                yield from self._moved(situation, late)
        for line in lines:
            if line.number not in situation.missing:
                keep, bits = line.succeeded
                for kept, values in self._measured[line.number]:
                    yield situation.without(line.number, (state & kept | values) & keep | bits)

    def _changed(self, situation: _ExcusedRun) -> Iterator[_ExcusedRun]:
        """Yield what one change from outside leads to."""
        state = situation.state
        for keep, bits in self._free:
            yield situation._replace(state=state & keep | bits)
        for step in self._program.environment:
            after = step.update(state) if step.test(state) else None
            if after is not None:
                yield situation._replace(state=after)
        for line in self._program.shared:
            if line.number not in situation.in_flight:
                for after in line.used_by_others(state):
                    yield situation._replace(state=after)

    # the model, compiled once for all searches

    @cached_property
    def _program(self) -> Program:
        return Program(self._model)

    @cached_property
    def _plans(self) -> PlanCache:
        return PlanCache(Planner(self._model))

    def _relevant(self, goal: Predicate) -> int:
        """Return the bits of the variables that can influence a run to a goal."""
        packing = self._program.packing
        return self._read | sum(packing[name].mask for name in goal.reads() if not packing[name].mask & self._read)

    @cached_property
    def _read(self) -> int:
        """The bits of the variables that decide about steps: read by guards or goals, or about to leave their domain.

        And the bits of the variables that actions on these read.
        """
        model, packing = self._model, self._program.packing
        names = dict.fromkeys(v.name for v in model.running_space if v.role.is_runner)
        for resource in model.resources:
            names |= dict.fromkeys((resource.trigger, resource.request_state))
        for transition in model.transitions:
            names |= dict.fromkeys(transition.running_guard.reads())
        for _, goal in model.goals:
            names |= dict.fromkeys(goal.reads())
        changes = [(tuple(action.target for action in each.actions), each.guard.reads()) for each in model.environment]
        actions = [*model.actions, *(action for each in model.environment for action in each.actions)]
        names |= dict.fromkeys(action.target for action in actions if may_leave(action, model.running_space))
        names = influencing(names, [*changes, *(((action.target,), action.reads()) for action in actions)])
        return sum(packing[name].mask for name in names)

    @cached_property
    def _free(self) -> tuple[_Choice, ...]:
        """The values that messages and inputs from outside can carry."""
        packing = self._program.packing
        found: dict[_Choice, None] = {}
        for group in self._program.free_groups:
            values = [(name, known) for name, known in group.values if packing[name].mask & self._read]
            found |= dict.fromkeys(self._choices(values))
        return tuple(found)

    @cached_property
    def _measured(self) -> tuple[tuple[_Choice, ...], ...]:
        """For each resource the values that its replies can carry."""
        packing = self._program.packing
        found = []
        for known in self._program.measured:
            values = [(name, domain.values) for name, domain in known.items() if packing[name].mask & self._read]
            found.append((packing.assignment({}), *self._choices(values)))
        return tuple(found)

    def _choices(self, values: Sequence[tuple[str, tuple[Value, ...]]]) -> Iterator[_Choice]:
        """Yield each choice of values of some variables; a few of all together, and each value alone."""
        packing = self._program.packing
        for name, known in values:
            yield from (packing.assignment({name: value}) for value in known)
        together = product(*([(name, value) for value in known] for name, known in values))
        yield from (packing.assignment(dict(chosen)) for chosen in islice(together, _MOST_VALUES) if chosen)
