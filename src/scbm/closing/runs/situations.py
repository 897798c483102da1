"""Where runs can be between two events, and what follows from an event: the runner's steps without time or records.

A second reading of semantics 5 and 6 beside `running.runner`, made for going through all runs: it shares the compiled
model with the runner, and property tests hold the two together. Time is left out: a deadline may pass whenever its
timer runs, a reply may come whenever its request is in flight. Limits can end a run anywhere; behind every end
automatic transitions have their turn once more.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from itertools import product
from math import prod
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from scbm.cases.coverage import Aspect, Obligations
from scbm.model import OperationState, PlanState
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE
from scbm.planning import LimitReached, Solved
from scbm.proofcheck import Awaits
from scbm.running import RunnerOptions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.cases.trace import Changes
    from scbm.closing.runs.run_relevance import Relevance
    from scbm.model import BehaviorModel, Value
    from scbm.model.packing import Test
    from scbm.planning import Answer
    from scbm.running import Program
    from scbm.running.program import RequestLine, RunnableOperation

    Plan: TypeAlias = Callable[[int], Answer]
    """What the planner answers in a packed state."""


class Position(NamedTuple):
    """Where a run can be when the runner is settled and the run has not ended.

    Attributes:
        state: the packed state; variables that make no difference are 0.
        queue: the number of the queue, see `Queues`; of the plan that will come, if `awaits` is `PLAN`.
        in_flight: the resources that a reply is awaited from, by number, in the order of asking.
        awaits: what the runner waits for beside replies and deadlines.
    """

    state: int
    queue: int
    in_flight: tuple[int, ...]
    awaits: Awaits

    @property
    def is_asking(self) -> bool:
        """Whether the planner was asked and has not answered."""
        return self.awaits in (Awaits.PLAN, Awaits.UNSOLVABLE, Awaits.STALE)


class PlanningTooLargeError(Exception):
    """What follows from an event was not found within the limits of planning."""


class TooManyRepliesError(Exception):
    """A reply can measure values in more ways than can be gone through."""


class HappeningKind(Enum):
    """What can happen to a run."""

    ANSWER = "the planner answers"
    REPLY = "a resource replies"
    DEADLINE = "the deadline of the current operation passes"
    TIME_LIMIT = "the time limit of the run passes"
    INPUT = "the world outside changes an input"


class Happening(NamedTuple):
    """One thing that can happen to a run.

    Attributes:
        kind: what it is.
        resource: which one replies; empty if it is no reply.
        succeeded: what the reply says.
        measured: what it carries; for an input, what it becomes.
    """

    kind: HappeningKind
    resource: str = ""
    succeeded: bool = False
    measured: Changes = ()


ANSWER = Happening(HappeningKind.ANSWER)
DEADLINE = Happening(HappeningKind.DEADLINE)
TIME_LIMIT = Happening(HappeningKind.TIME_LIMIT)


class RunStep(NamedTuple):
    """What follows from an event.

    Attributes:
        target: where the run is then; `None` if it has ended.
        visits: what it visits on the way, as bits of `Visits`.
        cut_off: what it would visit if the limit of plans ended it on the way.
    """

    target: Position | None
    visits: int
    cut_off: int = 0


class Visits:
    """What can be visited, as bits: the obligations of a model, and beyond them *is current* for each operation."""

    def __init__(self, model: BehaviorModel) -> None:
        self.obligations = Obligations.of(model)
        self._beyond = len(self.obligations.all)
        self._operations = {operation.name: index for index, operation in enumerate(model.operations)}

    @property
    def mask(self) -> int:
        """The bits of the obligations."""
        return (1 << self._beyond) - 1

    def current(self, operation: str) -> int:
        """The bit of an operation that comes to the head of the queue."""
        return 1 << (self._beyond + self._operations[operation])

    def bit(self, subject: str, aspect: Aspect) -> int:
        """The bit of an obligation."""
        return self.obligations.bit_of(subject, aspect)


class Queues:
    """Queues of operations by number, so that to compare and keep them costs no more than a number. 0 is empty."""

    def __init__(self) -> None:
        self._cells: list[tuple[int, int]] = [(-1, 0)]
        self._numbers: dict[tuple[int, int], int] = {}

    def number(self, operations: Iterable[int]) -> int:
        """The number of a queue; operations are numbered by their place in the model."""
        queue = 0
        for operation in reversed(tuple(operations)):
            cell = (operation, queue)
            if cell not in self._numbers:
                self._numbers[cell] = len(self._cells)
                self._cells.append(cell)
            queue = self._numbers[cell]
        return queue

    def pop(self, queue: int) -> tuple[int, int]:
        """The first operation, and the number of the rest."""
        return self._cells[queue]

    def operations(self, queue: int) -> tuple[int, ...]:
        """All operations of a queue."""
        found = []
        while queue:
            operation, queue = self._cells[queue]
            found.append(operation)
        return tuple(found)


@dataclass(frozen=True, slots=True)
class _SteppedOperation:
    """A compiled operation, with the bits of what its steps visit."""

    runnable: RunnableOperation
    visits: dict[OperationState, int]
    current: int


@dataclass(frozen=True, slots=True)
class _ReplyLine:
    """The request line of a resource, and the replies that can come."""

    line: RequestLine
    number: int
    replies: tuple[tuple[Happening, int, int], ...]


_S = OperationState
_MAX_REPLIES = 4_096
_MAX_ANSWERS = 10_000
"""So many plans may follow each other in one step, without any event between them."""
_LONG = 16
"""From so many automatic transitions in a row on, it is looked whether they go round."""


class RunSteps:
    """The steps of runs for one goal.

    Attributes:
        looked_at: every packed state in which guards were looked at so far, micro-steps included.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - what the runs of a model share, and what is the goal's
        self,
        program: Program,
        relevance: Relevance,
        visits: Visits,
        goal: Test,
        plan: Plan,
        queues: Queues,
        inputs: Sequence[tuple[str, Value]] = (),
        bound: int = RunnerOptions().livelock_bound,
    ) -> None:
        """Prepares the steps. Raises `TooManyRepliesError`.

        Args:
            program: the compiled model.
            relevance: which variables make a difference.
            visits: what the bits of visits mean.
            goal: whether the goal holds.
            plan: the planner's answers.
            queues: gives queues their numbers; may be shared among goals.
            inputs: what the world outside may change, and to what; nothing in runs without injections.
            bound: how many automatic transitions one settling may take.
        """
        packing = program.packing
        self.looked_at: dict[int, None] = {}
        self._kept = relevance.mask
        self._goal = goal
        self._plan = plan
        self._queues = queues
        self._bound = bound
        self._aborted = program.aborted
        self._plan_states = program.plan_states
        self._planning = program.plan_states[PlanState.PLANNING]
        self._executing = program.plan_states[PlanState.EXECUTING]
        self._names = {name: index for index, name in enumerate(program.operations)}
        self._operations = tuple(self._operation(each, visits) for each in program.operations.values())
        self._automatic = tuple((*step.cube, step, visits.bit(step.name, Aspect.TAKEN)) for step in program.automatic)
        self._lines = tuple(_line(line, number, relevance) for number, line in enumerate(program.requests))
        self._numbers = {line.line.resource.name: line.number for line in self._lines}
        self._inputs = {
            Happening(HappeningKind.INPUT, measured=(change,)): program.packing.assignment(dict([change]))
            for change in inputs
        }
        self._triggers = sum(line.line.trigger for line in self._lines)
        self._ready = tuple((line.line.watched, line.line.ready, line) for line in self._lines)
        self._current = (packing[CURRENT_NAME].mask, packing[CURRENT_NAME].shift)
        field = packing[CURRENT_STATE]
        self._current_state = (field.mask, {field.bits(state.value): state for state in OperationState})
        self._queued = tuple(visits.bit(name, Aspect.QUEUED) for name in program.operations)
        self._visits_of: dict[int, int] = {}
        self._plans: dict[int, _PlanQuestion] = {}
        self._behind_ends: dict[int, int] = {}

    def _operation(self, runnable: RunnableOperation, visits: Visits) -> _SteppedOperation:
        bits: dict[OperationState, int] = {_S.INITIAL: 0}
        bits |= {s: visits.bit(runnable.name, Aspect(s.value)) for s in OperationState if s is not _S.INITIAL}
        return _SteppedOperation(
            runnable,
            bits,
            visits.current(runnable.name),
        )

    # the door

    def begin(self, state: int) -> RunStep:
        """What follows when the goal is given in a packed state in which the runner is at rest."""
        keep, bits = self._planning
        return self._settle(state & keep | bits, 0, (), None, None, due=False)

    def happenings(self, position: Position) -> Iterable[Happening]:
        """Everything that can happen next, what goes wrong first: so walks have behind them what is in the way."""
        if position.is_asking:
            yield ANSWER
        replies = [reply for number in position.in_flight for reply, _, _ in self._lines[number].replies]
        yield from (reply for reply in replies if not reply.succeeded)
        if self._timer_runs(position.state):
            yield DEADLINE
        yield from (reply for reply in replies if reply.succeeded)
        for change, (keep, bits) in self._inputs.items():
            if position.state & keep | bits != position.state:
                yield change
        if self._end(position.state, position.in_flight, PlanState.ABORTED):
            yield TIME_LIMIT  # it ends the run; of interest only if something is visited behind the end

    def after(self, position: Position, happening: Happening) -> RunStep:
        """What follows from something that can happen."""
        state, queue, in_flight, awaits = position
        if happening.kind is HappeningKind.TIME_LIMIT:
            return RunStep(None, self._end(state, in_flight, PlanState.ABORTED))
        asked = self._asked_in(position)
        if happening.kind is HappeningKind.INPUT:
            keep, bits = self._inputs[happening]
            unsolvable_in = state if awaits is Awaits.CHANGE else None
            queue = 0 if asked is not None else queue
            return self._settle(state & keep | bits, queue, in_flight, asked, unsolvable_in, due=False)
        if happening.kind is HappeningKind.REPLY:
            number = self._numbers[happening.resource]
            keep, bits = next(
                (k, b) for other, k, b in self._lines[number].replies if other is happening or other == happening
            )
            in_flight = tuple(other for other in in_flight if other != number)
            unsolvable_in = state if awaits is Awaits.CHANGE else None
            queue = 0 if asked is not None else queue
            return self._settle(state & keep | bits, queue, in_flight, asked, unsolvable_in, due=False)
        if happening.kind is HappeningKind.DEADLINE:
            return self._settle(state, queue, in_flight, None, None, due=True)
        assert asked is not None  # noqa: S101 - only who asks is answered
        return self._answered(state, in_flight, asked)

    def operations(self, queue: int) -> tuple[int, ...]:
        """The operations of a queue, by their place in the model."""
        return self._queues.operations(queue)

    def _timer_runs(self, state: int) -> bool:
        current = (state & self._current[0]) >> self._current[1]
        if not current:
            return False
        operation = self._operations[current - 1].runnable
        mask, states = self._current_state
        match states[state & mask]:
            case OperationState.EXECUTING:
                return operation.deadline_ns is not None
            case OperationState.DISABLED:
                return operation.disabled_deadline_ns is not None
        return False

    # settling: the micro-steps of semantics 5, in their order

    def _answered(self, state: int, in_flight: tuple[int, ...], asked: _PlanQuestion) -> RunStep:
        """The planner has answered."""
        if asked.gives_up:
            return RunStep(None, self._end(state, in_flight, PlanState.ABORTED))
        if asked.queue is None:
            return self._settle(state, 0, in_flight, None, asked.state, due=False)
        keep, bits = self._executing
        step = self._settle(state & keep | bits, asked.queue, in_flight, None, None, due=False)
        return RunStep(step.target, step.visits | asked.visits, step.cut_off)

    def _settle(  # noqa: C901, PLR0911, PLR0912, PLR0913, PLR0915 - one loop in which all exploring is done
        self,
        state: int,
        queue: int,
        in_flight: tuple[int, ...],
        asked: _PlanQuestion | None,
        unsolvable_in: int | None,
        *,
        due: bool,
    ) -> RunStep:
        visits = cut_off = 0
        taken = 0
        chain: dict[int, None] = {}
        answered: dict[Position, None] = {}
        current_mask, current_shift = self._current
        states_mask, states = self._current_state
        aborted_mask, aborted_bits = self._aborted
        looked_at, kept, triggers = self.looked_at, self._kept, self._triggers
        while True:
            looked_at[state & kept] = None
            for mask, bits, transition, bit in self._automatic:
                if state & mask != bits or not transition.test(state):
                    continue
                after = transition.update(state)
                if after is None or after == state:
                    continue
                if taken == self._bound or state in chain:
                    return RunStep(None, visits, cut_off)
                taken += 1
                if taken > _LONG:
                    chain[state] = None
                visits |= bit
                if transition.fails_operation:
                    failing = self._operations[((state & current_mask) >> current_shift) - 1]
                    keep, put = failing.runnable.become[_S.FAILED]
                    after = after & keep | put
                    visits |= failing.visits[_S.FAILED]
                    due = False
                state = after
                break
            else:
                chain.clear()
                if state & aborted_mask == aborted_bits:
                    return RunStep(None, visits | self._end(state, in_flight, PlanState.ABORTED), cut_off)
                moved = self._request(state, in_flight) if in_flight or state & triggers else None
                if moved is not None:
                    state, in_flight = moved
                    continue
                current_state = states[state & states_mask]
                if current_state is _S.INITIAL and self._goal(state):
                    return RunStep(None, visits | self._end(state, in_flight, PlanState.COMPLETED), cut_off)
                current = (state & current_mask) >> current_shift
                if current:
                    operation = self._operations[current - 1]
                    lived = self._live(operation, current_state, state, due=due)
                    if lived is None:
                        position = Position(state & self._kept, queue, in_flight, Awaits.NOTHING)
                        return RunStep(position, visits, cut_off)
                    if isinstance(lived, OperationState):
                        return RunStep(None, visits | self._end(state, in_flight, PlanState.ABORTED), cut_off)
                    state, target = lived
                    visits |= operation.visits[target]
                    due = False  # behind a deadline that has passed comes a new plan
                    if target is _S.INITIAL and current_state is not _S.COMPLETED:
                        queue = 0
                elif queue:
                    number, queue = self._queues.pop(queue)
                    operation = self._operations[number]
                    keep, put = operation.runnable.take_current
                    state = state & keep | put
                    visits |= operation.current
                elif asked is not None:
                    position = asked.position(state & self._kept, in_flight, self._kept)
                    if in_flight:
                        return RunStep(position, visits, cut_off)
                    if position in answered:  # without end, until the limit of plans
                        return RunStep(None, visits, cut_off)
                    # Nothing else can come: the answer is the next event.
                    if len(answered) == _MAX_ANSWERS:
                        raise PlanningTooLargeError
                    answered[position] = None
                    cut_off |= self._end(state, in_flight, PlanState.ABORTED)  # a limit can end the run here, too
                    taken, due = 0, False
                    if asked.gives_up:
                        return RunStep(None, visits | self._end(state, in_flight, PlanState.ABORTED), cut_off)
                    if asked.queue is None:
                        unsolvable_in, asked = asked.state, None
                    else:
                        keep, put = self._executing
                        state, queue = state & keep | put, asked.queue
                        visits |= asked.visits
                        asked = None
                elif unsolvable_in is not None and unsolvable_in & self._kept == state & self._kept:
                    if in_flight:
                        return RunStep(Position(state & self._kept, 0, in_flight, Awaits.CHANGE), visits, cut_off)
                    return RunStep(None, visits | self._end(state, in_flight, PlanState.UNSOLVABLE), cut_off)
                else:
                    cut_off |= self._end(state, in_flight, PlanState.ABORTED)
                    keep, put = self._planning
                    state = state & keep | put
                    asked = self._ask(state)

    def _end(self, state: int, in_flight: tuple[int, ...], plan_state: PlanState) -> int:
        """What is visited behind the end of a run: requests are given up, then come automatic transitions."""
        if not self._automatic:
            return 0
        for number in in_flight:
            keep, bits = self._lines[number].line.cleared
            state = state & keep | bits
        keep, bits = self._plan_states[plan_state]
        state = state & keep | bits
        for line in self._lines:
            state = line.line.given_up(state)
        current = (state & self._current[0]) >> self._current[1]
        if current:
            keep, bits = self._operations[current - 1].runnable.become[_S.INITIAL]
            state = state & keep | bits
        key = state & self._kept
        if key not in self._behind_ends:
            self._behind_ends[key] = self._idle(state)
        return self._behind_ends[key]

    def _idle(self, state: int) -> int:
        """What automatic transitions visit while no goal is pursued, and requests are sent and cancelled."""
        visits = 0
        in_flight: tuple[int, ...] = ()
        seen: dict[int, None] = {}
        while True:
            self.looked_at[state & self._kept] = None
            for mask, bits, transition, bit in self._automatic:
                if state & mask == bits and transition.test(state):
                    after = transition.update(state)
                    if after is not None and after != state:
                        state = after
                        visits |= bit
                        break
            else:
                moved = self._request(state, in_flight)
                if moved is None:
                    return visits
                state, in_flight = moved
            if state in seen or len(seen) > self._bound:
                return visits
            seen[state] = None

    def _request(self, state: int, in_flight: tuple[int, ...]) -> tuple[int, tuple[int, ...]] | None:
        """One request is sent or cancelled; `None` if there is none to send or to cancel."""
        for watched, ready, line in self._ready:
            if state & watched == ready:
                keep, bits = line.line.executing
                others = tuple(number for number in in_flight if number != line.number)
                return state & keep | bits, (*others, line.number)
        for number in in_flight:
            request = self._lines[number].line
            if not state & request.trigger:
                keep, bits = request.idle
                return state & keep | bits, tuple(other for other in in_flight if other != number)
        return None

    def _live(
        self, operation: _SteppedOperation, now: OperationState, state: int, *, due: bool
    ) -> tuple[int, OperationState] | OperationState | None:
        """One step of the life of the current operation; an operation state alone if the run ends in a model error."""
        runnable = operation.runnable
        after: int | None
        if now is _S.INITIAL:
            after = runnable.pre.take(state)
            target = _S.DISABLED if after is None else _S.EXECUTING
            after = state if after is None else after
        elif now is _S.DISABLED:
            after, target = runnable.pre.take(state), _S.EXECUTING
            if after is None and due:
                after, target = state, _S.INITIAL
        elif now is _S.EXECUTING:
            after, target = runnable.post.take(state), _S.COMPLETED
            if after is None and runnable.failed is not None:
                after, target = runnable.failed.take(state), _S.FAILED
            if after is None and due:
                after, target = runnable.timedout(state), _S.TIMEDOUT
                if after is None:
                    return _S.TIMEDOUT
        else:
            after, target = state, _S.INITIAL
        if after is None:
            return None
        keep, bits = runnable.become[target]
        return after & keep | bits, target

    def _ask(self, state: int) -> _PlanQuestion:
        """The question for a plan, with the answer that it will have."""
        key = state & self._kept
        if key not in self._plans:
            self._plans[key] = self._answer(state)
        return self._plans[key]._replace(state=state)

    def _answer(self, state: int) -> _PlanQuestion:
        answer = self._plan(state)
        if isinstance(answer, Solved):
            return self._question(state, self._queues.number(self._names[name] for name in answer.plan))
        return _PlanQuestion(state, None, 0, gives_up=isinstance(answer, LimitReached))

    def _asked_in(self, position: Position) -> _PlanQuestion | None:
        """The question that is open in a position."""
        match position.awaits:
            case Awaits.PLAN:
                return self._question(None, position.queue)
            case Awaits.UNSOLVABLE:
                return self._question(position.state, None)
            case Awaits.STALE:
                return self._question(None, None)
        return None

    def _question(self, state: int | None, queue: int | None) -> _PlanQuestion:
        if queue is None:
            return _PlanQuestion(state, None, 0)
        if queue not in self._visits_of:
            named = dict.fromkeys(self._queues.operations(queue))
            self._visits_of[queue] = sum(self._queued[number] for number in named)
        return _PlanQuestion(state, queue, self._visits_of[queue])


class _PlanQuestion(NamedTuple):
    """A question that the planner has not answered yet.

    Attributes:
        state: in which it was asked; `None` if that is another one than now.
        queue: the plan that will come; `None` for no plan.
        visits: what the answer visits.
        gives_up: whether the planner meets a limit, which ends the run.
    """

    state: int | None
    queue: int | None
    visits: int
    gives_up: bool = False

    def position(self, state: int, in_flight: tuple[int, ...], kept: int) -> Position:
        """Where the run is while the question is open.

        A planner that will give up counts as one that will find no plan: the run would end, and here it may go on.
        """
        if self.queue is not None:
            return Position(state, self.queue, in_flight, Awaits.PLAN)
        is_here = self.state is not None and self.state & kept == state
        return Position(state, 0, in_flight, Awaits.UNSOLVABLE if is_here else Awaits.STALE)


def _line(line: RequestLine, number: int, relevance: Relevance) -> _ReplyLine:
    """A resource with all replies that make a difference: a failing one, and one for each choice of measured values."""
    measured = [name for name in line.resource.measures if name in relevance.names]
    packing = relevance.packing
    if prod(len(packing.space[name].domain) + 1 for name in measured) > _MAX_REPLIES:
        raise TooManyRepliesError
    choices = product(*((None, *packing.space[name].domain.values) for name in measured))
    replies = []
    for values in choices:
        changes = tuple((name, value) for name, value in zip(measured, values, strict=True) if value is not None)
        keep, bits = packing.assignment(dict(changes))
        reply = Happening(HappeningKind.REPLY, line.resource.name, succeeded=True, measured=changes)
        replies.append((reply, keep & line.succeeded[0], bits & line.succeeded[0] | line.succeeded[1]))
    replies.append((Happening(HappeningKind.REPLY, line.resource.name), *line.failed))
    return _ReplyLine(line, number, tuple(replies))


def world_bits(program: Program, values: Mapping[str, Value]) -> int:
    """A state of the world as the runner packs it at rest."""
    space = program.packing.space
    return program.packing.pack({v.name: v.initial if v.role.is_runner else values[v.name] for v in space})
