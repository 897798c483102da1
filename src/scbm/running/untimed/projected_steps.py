"""Steps of runs, memoized for all states that agree in what the micro-steps have looked at.

Most of what happens in a run reads few variables. So the micro-steps from an event until the plan decides, or the
runner is settled, are taken once for all states with equal values of what they read and assign. A state is then the
difference of its bits away. The masks of what was read are learned: each grows as other micro-steps read more.
"""

from __future__ import annotations

from functools import cache, partial, reduce
from operator import or_
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

from msgspec import Struct, field

from scbm.model import OperationState, PlanState, Role, Truth
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE
from scbm.running.lifecycle import LIFECYCLE, guard_and_actions
from scbm.running.micro_steps import AutomaticMove
from scbm.running.untimed.run_steps import RunEnding, RunSteps, SettlingRun
from scbm.running.untimed.situations import (
    ANSWER,
    TIME_LIMIT,
    Happening,
    HappeningKind,
    Position,
    RunStep,
    WaitsFor,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator

    from scbm.cases.trace import End
    from scbm.model import Action, Predicate
    from scbm.running import Program
    from scbm.running.compiled_steps import CompiledStep, RequestLine
    from scbm.running.micro_steps import MicroStep, MicroSteps
    from scbm.running.untimed.situations import RunNote

Result = TypeVar("Result")

_ANY_PLAN = -1
"""Stands for the queue of any plan."""


# Half of the time that the constructor of a named tuple takes.
_position: Callable[[tuple[int, int, tuple[int, ...], WaitsFor, int]], Position] = partial(tuple.__new__, Position)
_step: Callable[[tuple[object, ...]], RunStep] = partial(tuple.__new__, RunStep)
_ending: Callable[[tuple[object, ...]], RunEnding] = partial(tuple.__new__, RunEnding)


class Projection(Struct, Generic[Result]):
    """Results for packed states, each for all states that agree in the bits that finding it has read.

    Attributes:
        mask: the bits that were read so far.
        known: the results by these bits.
    """

    mask: int = 0
    known: dict[int, Result] = field(default_factory=dict)

    def add(self, state: int, read: int, result: Result) -> None:
        """Memoize the result for a packed state; forget the others if they were read from fewer bits."""
        if read & ~self.mask:
            self.mask |= read
            self.known.clear()
        self.known[state & self.mask] = result


class Turn(NamedTuple):
    """The micro-steps from an event, or after the plan has decided, until the plan decides again or the runner waits.

    Attributes:
        difference: the bits of the packed state that change.
        in_flight: the resources with a pending request afterwards.
        visits: what was visited.
        drops_plan: whether the rest of the plan is given up.
        waits: whether the runner waits for an event. If not, and there is no end, the plan decides.
        end: the end of the run; `None` if it goes on, or automatic transitions repeat without end.
        livelock: the step that ends there.
        passed: the differences of the states in which guards were evaluated, but for the first one.
        notes: what was noted, but for the end of the run.
    """

    difference: int
    in_flight: tuple[int, ...]
    visits: int
    drops_plan: bool
    waits: bool
    end: End | None
    livelock: RunStep | None
    passed: tuple[int, ...]
    notes: tuple[RunNote, ...]


class Idling(NamedTuple):
    """The micro-steps of a runner without a goal until it is settled.

    Attributes:
        difference: the bits of the packed state that change; `None` if it is never settled.
        visits: what was visited.
        passed: the differences of the states in which guards were evaluated.
    """

    difference: int | None
    visits: int
    passed: tuple[int, ...]


class _Nexts(dict[int, Happening]):
    """The choices of the next operation by number, each made once."""

    def __missing__(self, number: int) -> Happening:
        self[number] = Happening(HappeningKind.NEXT, number=number)
        return self[number]


class _Event(NamedTuple):
    """An event in the states of one projection, with the turns that follow it."""

    happening: Happening
    difference: int
    in_flight: tuple[int, ...]
    timer_passed: bool
    turns: Projection[Turn]


class ProjectedSteps(RunSteps):
    """Steps of runs that memoize by what was read. They give the steps of `RunSteps`, in the same order."""

    _most_memoized = 0

    def read_goal(self, goal: Predicate) -> ProjectedSteps:
        """Note which variables the goal reads, and return the steps."""
        self._reads = _ReadVariables(self._program, goal)
        self._steps = _TracedSteps(self._steps, self._reads, is_pursuing=True)  # type: ignore[assignment]
        self._idle_steps = _TracedSteps(self._idle_steps, self._reads, is_pursuing=False)  # type: ignore[assignment]
        changed = (~keep for _, keep, _ in self._changes.values())
        outside = self._reads.of_outside if self._outside else 0
        self._event_mask = reduce(or_, changed, self._reads.control | outside)
        self._turns: dict[tuple[int, tuple[int, ...], bool, int | None], Projection[Turn]] = {}
        self._idlings: dict[tuple[int, tuple[int, ...], PlanState | None, int | None], Projection[Idling]] = {}
        self._known_events: dict[tuple[int, tuple[int, ...]], list[_Event]] = {}
        self._nexts = _Nexts()
        self._turn_end: End | None = None
        self._turn_livelock: RunStep | None = None
        self._is_in_turn = self._is_repeating = False
        return self

    def following(self, position: Position) -> Iterable[tuple[Happening, RunStep]]:
        """Return everything that can happen next, in the order of `happenings`, each with the step that it starts."""
        if position.awaits is WaitsFor.NEXT:
            return self._choices(position)
        return super().following(position) if position.awaits is WaitsFor.CHANGE else self._following(position)

    def _choices(self, position: Position) -> Iterator[tuple[Happening, RunStep]]:
        for number, way in enumerate(self._queues.following(position.queue)):
            run = self._resumed(position)
            self._take_next(run, way)
            yield self._nexts[number], self._settle(run)

    def _following(self, position: Position) -> Iterator[tuple[Happening, RunStep]]:
        state, queue, in_flight, awaits, goal = position
        if awaits is not WaitsFor.NOTHING:
            yield ANSWER, self.after(position, ANSWER)
            queue = 0
        evaluated = self.evaluated
        for happening, difference, left, timer_passed, turns in self._events_in(state, in_flight):
            after = state ^ difference
            turn = turns.known.get(after & turns.mask)
            if turn is None:
                turn = self._new_turn(after, left, turns, timer_passed=timer_passed, settled=state)
            evaluated[after] = None
            for passed in turn.passed:
                evaluated[after ^ passed] = None
            if turn.waits:
                plan = 0 if turn.drops_plan else queue
                target = _position((after ^ turn.difference, plan, turn.in_flight, WaitsFor.NOTHING, goal))
                yield happening, _step((target, turn.visits, 0, (), (), self._notes_of(turn, after)))
            elif turn.end is not None:
                visits, rests, notes = self._ending(after ^ turn.difference, turn.in_flight, turn.end)
                yield happening, _step((None, turn.visits | visits, 0, rests, (), self._notes_of(turn, after) + notes))
            elif awaits is WaitsFor.PLAN and self._outside and turn.livelock is None:
                target = _position((after ^ turn.difference, position.queue, turn.in_flight, awaits, goal))
                yield happening, _step((target, turn.visits, 0, (), (), self._notes_of(turn, after)))
            else:
                run = self._resumed(position)
                run.state = after
                yield happening, self._take(run, turn) or self._follow_plan(run) or self._settle(run)
        ending = self._end(state, in_flight, PlanState.ABORTED)
        if self._is_sequence or ending.visits:
            yield TIME_LIMIT, RunStep(None, ending.visits, rests=ending.rests, notes=ending.notes)

    def at_rest(self, rest: Position) -> Iterator[tuple[Happening, RunStep]]:
        """Yield everything that can happen while no goal is pursued: changes from outside, and what follows them."""
        for change in self._events_in(rest.state, ()):
            after = rest.state ^ change.difference
            key = (after & self._reads.control, (), None, change.difference)
            visits, rests, notes = self._settled(after, key)
            yield change.happening, _step((None, visits, 0, rests, (), notes))

    def _events_in(self, state: int, in_flight: tuple[int, ...]) -> list[_Event]:
        """Return the events that are possible in a state, but for those of the planner and limits."""
        key = (state & self._event_mask, in_flight)
        if key not in self._known_events:
            self._known_events[key] = [
                _Event(happening, state ^ after, left, timer_passed, self._turns_in(after, left, timer_passed, state))
                for happening, after, left, timer_passed in self._events(state, in_flight)
            ]
        return self._known_events[key]

    def _note_evaluated(self, state: int, passed: tuple[int, ...]) -> None:
        """Note that guards were evaluated in a state, and in those that differ from it."""
        self.evaluated[state] = None
        for difference in passed:
            self.evaluated[state ^ difference] = None

    # turns

    def _take_turn(self, run: SettlingRun, *, timer_passed: bool) -> RunStep | None:
        turns = self._turns_in(run.state, run.in_flight, timer_passed, run.settled)
        turn = turns.known.get(run.state & turns.mask)
        if turn is None:
            turn = self._new_turn(run.state, run.in_flight, turns, timer_passed=timer_passed, settled=run.settled)
        self._note_evaluated(run.state, turn.passed)
        return self._take(run, turn)

    def _take(self, run: SettlingRun, turn: Turn) -> RunStep | None:
        """Take a turn; return the step if the run waits or ends."""
        run.notes += self._notes_of(turn, run.state)
        if turn.livelock is not None:
            return run.complete(None, turn.livelock.visits, turn.livelock.rests)
        run.state = run.settled = run.state ^ turn.difference
        run.in_flight = turn.in_flight
        run.visits |= turn.visits
        if turn.drops_plan:
            run.queue = 0
        if turn.end is not None:
            return run.complete(None, *self._ending(run.state, run.in_flight, turn.end))
        return run.waiting(WaitsFor.NOTHING) if turn.waits else None

    def _notes_of(self, turn: Turn, state: int) -> tuple[RunNote, ...]:  # noqa: ARG002 - for watched predicates
        """Return the notes about a turn from a state."""
        return turn.notes

    def _turns_in(
        self,
        state: int,
        in_flight: tuple[int, ...],
        timer_passed: bool,  # noqa: FBT001 - a part of the key
        settled: int | None,
    ) -> Projection[Turn]:
        """Return the known turns from states that agree in the runner's variables, requests, and what has changed.

        Args:
            state: the packed state.
            in_flight: the resources with a pending request.
            timer_passed: whether the timer of the current operation has passed.
            settled: the state before a change, in which no automatic transition acted; `None` if it is not known.
        """
        key = (state & self._reads.control, in_flight, timer_passed, None if settled is None else state ^ settled)
        turns = self._turns.get(key)
        if turns is None:
            turns = self._turns[key] = Projection()
        return turns

    def _new_turn(
        self,
        state: int,
        in_flight: tuple[int, ...],
        turns: Projection[Turn],
        *,
        timer_passed: bool,
        settled: int | None,
    ) -> Turn:
        """Return the turn from a state, and memoize it unless it ends in a livelock."""
        run = SettlingRun(state, _ANY_PLAN, in_flight, goal=self._number)
        self._turn_end = self._turn_livelock = None
        self._is_in_turn = True
        before = self._reads.begin(settled)
        complete = super()._take_turn(run, timer_passed=timer_passed)
        read, passed = self._reads.end(before)
        self._is_in_turn = False
        waits = complete is not None and complete.target is not None
        turn = Turn(
            run.state ^ state,
            run.in_flight,
            run.visits,
            run.queue != _ANY_PLAN,
            waits,
            self._turn_end,
            self._turn_livelock,
            tuple(each ^ state for each in passed[1:]),
            run.notes,
        )
        if turn.livelock is None:
            turns.add(state, read, turn)
        return turn

    def _ended(self, run: SettlingRun, end: End) -> RunStep:
        if not self._is_in_turn:
            return super()._ended(run, end)
        self._turn_end = end  # what follows it is found for each state
        return run.complete(None)

    def _livelock(self, run: SettlingRun, chain: tuple[int, ...]) -> RunStep:
        self._is_repeating = True
        self._turn_livelock = super()._livelock(run, chain)
        self._is_repeating = False
        return self._turn_livelock

    # a runner without a goal

    def _end(self, state: int, in_flight: tuple[int, ...], plan_state: PlanState) -> RunEnding:
        if not self._is_sequence:
            return super()._end(state, in_flight, plan_state)
        settled = None if self._is_repeating else 0
        return self._settled(state, (state & self._reads.control, in_flight, plan_state, settled))

    def _idle(self, state: int) -> RunEnding:
        return self._settled(state, (state & self._reads.control, (), None, None))

    def _settled(self, state: int, key: tuple[int, tuple[int, ...], PlanState | None, int | None]) -> RunEnding:
        """Return what is visited until the runner is settled at rest, and its state then.

        Args:
            state: the packed state.
            key: the values of the runner's variables and of requests; the requests in flight and `plan.state` after the
                end of a run that ends in the state; the difference to the state before, in which no automatic
                transition acted, if it is known.
        """
        idlings = self._idlings.get(key)
        if idlings is None:
            idlings = self._idlings[key] = Projection()
        idling = idlings.known.get(state & idlings.mask)
        if idling is None:
            _, in_flight, plan_state, difference = key
            ended = state if plan_state is None else self._at_end(state, self._requests(in_flight), plan_state)
            before = self._reads.begin(None if difference is None else state ^ difference)
            visits, settled, _ = super()._idle(ended)
            read, passed = self._reads.end(before)
            idling = Idling(settled[0] ^ state if settled else None, visits, tuple(each ^ state for each in passed))
            idlings.add(state, read, idling)
        for difference in idling.passed:
            self.evaluated[state ^ difference] = None
        rests = () if idling.difference is None else (state ^ idling.difference,)
        return _ending((idling.visits, rests, self._notes_while_idle(state, key[1], idling)))

    def _notes_while_idle(
        self,
        state: int,  # noqa: ARG002 - for watched predicates
        in_flight: tuple[int, ...],  # noqa: ARG002 - as above
        idling: Idling,  # noqa: ARG002 - as above
    ) -> tuple[RunNote, ...]:
        """Return the notes about what follows the end of a run in a state, until the runner is settled at rest."""
        return ()


class _Collected(Struct):
    """What was collected while some micro-steps were taken: the bits that were read, and the states."""

    settled: int | None
    read: int = 0
    states: list[int] = field(default_factory=list)


class _ReadVariables:
    """Collects the bits that micro-steps read or assign, beside those of the runner's variables and of requests.

    Attributes:
        control: the bits of the runner's variables and of requests, which tell apart what micro-steps are possible.
        of_outside: the bits that changes from outside read or assign.
    """

    def __init__(self, program: Program, goal: Predicate) -> None:
        """Collect nothing yet.

        Args:
            program: the compiled model.
            goal: the goal of the runs.
        """
        model, packing = program.model, program.packing
        self._program = program
        self._masks = {name: packing[name].mask for name in packing.space.names}
        owned = [v.name for v in packing.space if v.role is not Role.DECLARED]
        self.control = self._of(owned)
        self._current = self._of((CURRENT_NAME, CURRENT_STATE))
        self._goal = self._of(goal.reads())
        acting = [self._of(each.guard.reads()) | self._of_actions(each.actions) for each in model.environment]
        self.of_outside = reduce(or_, (*acting, *(maker.mask for maker in program.outside.free)), 0)
        self._automatic = tuple(
            (mask & self.control, bits & self.control, step, self._of(each.running_guard.reads()), acts)
            for (mask, bits, step), each in zip(program.automatic_cubes, model.automatic_transitions, strict=True)
            for acts in (self._of_actions(each.running_actions),)
        )
        self._parts = cache(self._tried_parts)
        self._collected = _Collected(None)

    def _of(self, names: Iterable[str]) -> int:
        return reduce(or_, map(self._masks.__getitem__, names), 0)

    def _of_actions(self, actions: Iterable[Action]) -> int:
        return reduce(or_, (self._of((each.target, *each.reads())) for each in actions), 0)

    def _tried_parts(self, name: str, state: OperationState) -> list[tuple[bool, CompiledStep, int, int]]:
        """Return the parts of an operation that are tried in a state: with a timer only, and what they read."""
        operation, parts = self._program.model.operation(name), self._program.operations[name].parts
        tried = []
        for rule in (rule for rule in LIFECYCLE if rule.source is state and rule.part in parts):
            guard, actions = guard_and_actions(operation, rule.part) or (Truth(True), operation.timedout)
            tried.append((rule.needs_timer, parts[rule.part], self._of(guard.reads()), self._of_actions(actions)))
        return tried

    def begin(self, settled: int | None) -> _Collected:
        """Begin to collect anew, and return what was collected so far.

        Args:
            settled: a state before a change in which no automatic transition acted, nor the current operation without a
                timer; `None` if it is not known. Guards that no change since has touched need not be read.
        """
        before = self._collected
        self._collected = _Collected(settled)
        return before

    def end(self, before: _Collected) -> tuple[int, list[int]]:
        """Return the bits that were read, and the states in which guards were evaluated; go on with what was before."""
        found, self._collected = self._collected, before
        return found.read & ~self.control, found.states

    def note(self, state: int, step: MicroStep | None, *, timer_passed: bool, is_pursuing: bool) -> None:
        """Note what was read to find the micro-step in a state."""
        collected = self._collected
        collected.states.append(state)
        changed = -1 if collected.settled is None else state ^ collected.settled
        for mask, bits, automatic, read, acts in self._automatic:
            if state & mask != bits or not changed & (read | acts):
                continue  # the runner's variables rule it out, or it did not act before the change
            collected.read |= read | (acts if automatic.test(state) else 0)
            if isinstance(step, AutomaticMove) and step.transition is automatic:
                return
        if not is_pursuing:
            return
        current = self._program.current(state)
        if current is None or current.is_initial:
            collected.read |= self._goal
        if current is None:
            return
        for needs_timer, part, read, acts in self._parts(current.operation.name, current.state):
            if timer_passed if needs_timer else changed & (read | acts | self._current):
                collected.read |= read | (acts if part.test(state) else 0)


class _TracedSteps:
    """The micro-steps of a runner; what each one has read is noted."""

    def __init__(self, steps: MicroSteps, reads: _ReadVariables, *, is_pursuing: bool) -> None:
        self._first = steps.first
        self._reads = reads
        self._is_pursuing = is_pursuing

    def first(self, state: int, in_flight: Collection[RequestLine], *, timer_passed: bool) -> MicroStep | None:
        """Return the first micro-step in a state; `None` if the runner is settled."""
        step = self._first(state, in_flight, timer_passed=timer_passed)
        self._reads.note(state, step, timer_passed=timer_passed, is_pursuing=self._is_pursuing)
        return step
