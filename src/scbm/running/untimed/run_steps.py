"""The successors of a situation by one event: the runner's micro-steps without time and records.

The order of micro-steps is that of `running.micro_steps`, the life of operations that of `running.lifecycle`. Here they
are walked on packed states that keep only the variables that can influence a run. Time is left out: a deadline may pass
whenever its timer runs, a reply may arrive whenever its request is in flight. A limit can end a run anywhere, and
automatic transitions follow every end. Where goals follow each other, a runner at rest is a position, too. Property
tests compare these steps with those of the runner.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, NamedTuple, TypeAlias, assert_never

from msgspec import Struct, field

from scbm.cases.coverage import Aspect
from scbm.cases.trace import End
from scbm.model import OperationState, PlanState
from scbm.planning import Solved, Unsolvable
from scbm.running import RunnerOptions
from scbm.running.lifecycle import OperationMove, PlanEffect
from scbm.running.micro_steps import (
    AutomaticMove,
    MicroSteps,
    PlanStep,
    RequestCancelling,
    RequestSending,
    RunTurn,
    next_in_plan,
)
from scbm.running.outside_changes import OutsideChanges
from scbm.running.untimed.relevance import choices, relevant_changes
from scbm.running.untimed.rest_visits import RestVisits
from scbm.running.untimed.situations import (
    ANSWER,
    DEADLINE,
    GIVE_UP,
    MAX_ANSWERS,
    NO_GOAL,
    TIME_LIMIT,
    Happening,
    HappeningKind,
    NoteKind,
    PlanningTooLargeError,
    Position,
    RunStep,
    WaitsFor,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.model import Predicate
    from scbm.planning import Answer
    from scbm.running import Program
    from scbm.running.compiled_steps import RequestLine
    from scbm.running.outside_changes import Maker
    from scbm.running.untimed.plan_queues import FollowingOperation, PlanQueues
    from scbm.running.untimed.relevance import Relevance
    from scbm.running.untimed.situations import RunNote, Visits

    Plan: TypeAlias = Callable[[int], Answer]
    """The planner's answer in a packed state."""

_LONG = 16
"""After so many automatic transitions in a row their states are compared, to find a cycle."""


# Each access to a member of an enumeration takes as long as a call.
_FOLLOW_PLAN = RunTurn.FOLLOW_PLAN
_TAKE_NEXT, _AWAIT_ANSWER, _REQUEST_PLAN = PlanStep.TAKE_NEXT, PlanStep.AWAIT_ANSWER, PlanStep.REQUEST_PLAN


class _PlanQuestion(NamedTuple):
    """A question that the planner has not answered yet.

    Attributes:
        state: the packed state in which it was asked; `None` if the state has changed since.
        queue: the number of the plan that will be the answer; `None` if no plan exists.
        visits: what the answer visits.
        gives_up: whether the planner reaches a limit, which ends the run.
    """

    state: int | None
    queue: int | None
    visits: int
    gives_up: bool = False

    def awaited(self, state: int, planner_reads: int) -> tuple[WaitsFor, int]:
        """Return what a run in `state` awaits while the question is open, and the queue of its position.

        The planner finds none in a state that is the same to it as the one in which it was asked.

        A planner that will reach a limit counts as one that will find no plan: the run would end, and here it may go
        on.
        """
        if self.queue is not None:
            return WaitsFor.PLAN, self.queue
        is_fresh = self.state is not None and not (self.state ^ state) & planner_reads
        return WaitsFor.UNSOLVABLE if is_fresh else WaitsFor.STALE, 0


class SettlingRun(Struct):
    """A run between an event and the next position.

    Attributes:
        state: the packed state; variables that cannot influence a run are 0.
        queue: the number of the queue.
        in_flight: the resources with a pending request, by number, in the order of their requests.
        asked: the question that the planner has not answered.
        unsolvable_in: the state from which the planner has answered that no plan exists.
        visits: what was visited so far.
        cut_off: what the run would have visited if the limit of plans had ended it on the way.
        answered: the positions in which the planner answered at once.
        goal: the number of the goal.
        cut_off_rests: the states of the runner at rest if the limit of plans had ended the run on the way.
        settled: the last state in which no automatic transition acted; `None` if it is not known.
        notes: what was noted so far, where notes are kept.
    """

    state: int
    queue: int
    in_flight: tuple[int, ...]
    asked: _PlanQuestion | None = None
    unsolvable_in: int | None = None
    visits: int = 0
    cut_off: int = 0
    answered: dict[Position, None] = field(default_factory=dict)
    goal: int = 0
    cut_off_rests: tuple[int, ...] = ()
    settled: int | None = None
    notes: tuple[RunNote, ...] = ()

    def position(self, awaits: WaitsFor, queue: int) -> Position:
        """Return where the run is if it is settled."""
        return Position(self.state, queue, self.in_flight, awaits, self.goal)

    def waiting(self, awaits: WaitsFor) -> RunStep:
        """Return the step that is complete here, as the run waits for an event."""
        return self.complete(self.position(awaits, self.queue))

    def complete(
        self, target: Position | None, visits: int = 0, rests: tuple[int, ...] = (), notes: tuple[RunNote, ...] = ()
    ) -> RunStep:
        """Return the step that is complete here, with what it visits and what is noted in the end."""
        return RunStep(target, self.visits | visits, self.cut_off, rests, self.cut_off_rests, self.notes + notes)


class RunEnding(NamedTuple):
    """The end of a run.

    Attributes:
        visits: what follows it, until the runner is settled; where each run has one goal, what ever follows it.
        rests: the states of the runner at rest, where goals follow each other.
        notes: what is noted until then, where notes are kept.
    """

    visits: int
    rests: tuple[int, ...] = ()
    notes: tuple[RunNote, ...] = ()


_NOTHING_FOLLOWS = RunEnding(0)


class RunSteps:
    """The steps of runs for one goal.

    Attributes:
        evaluated: every packed state in which guards were evaluated so far, those between micro-steps included.
    """

    _most_memoized: ClassVar[int] = 2_000_000
    """Maximum number of packed states whose micro-step is memoized: more than a graph of runs has."""

    def __init__(  # noqa: PLR0913, PLR0917 - what the runs of a model share, and what is the goal's
        self,
        program: Program,
        relevance: Relevance,
        visits: Visits,
        goal: Predicate,
        plan: Plan,
        queues: PlanQueues,
        bound: int = RunnerOptions().livelock_bound,
        number: int = 0,
        *,
        is_open: bool = False,
        is_sequence: bool = False,
    ) -> None:
        """Prepare the steps. Raises `TooManyRepliesError`.

        Args:
            program: the compiled model.
            relevance: the variables that can influence a run.
            visits: the meaning of the bits of visits.
            goal: the goal.
            plan: the planner's answers.
            queues: what is left of plans; goals may share canonical ones.
            bound: maximum number of automatic transitions that count together.
            number: the number of the goal.
            is_open: whether something outside the model changes variables at settled moments.
            is_sequence: whether goals follow each other; then ends of runs lead to a runner at rest.
        """
        self.evaluated: dict[int, None] = {}
        self._program = program
        self._kept = relevance.mask
        self._plan = plan
        self._queues = queues
        self._bound = bound
        self._number = number
        self._is_sequence = is_sequence
        self._planner_reads = program.planner_reads(goal)
        self._steps = MicroSteps(program, program.test(goal), program.memoized_steps, self._most_memoized)
        self._idle_steps = program.micro_steps(None)
        self._planning = program.plan_states[PlanState.PLANNING]
        self._executing = program.plan_states[PlanState.EXECUTING]
        self._operations = tuple(program.operations.values())
        self._numbers = {name: number for number, name in enumerate(program.operations)}
        replies = [_replies(line, relevance) for line in program.requests]
        self._replies = tuple(map(tuple, replies))
        self._changes = {
            reply: (number, *changes) for number, each in enumerate(replies) for reply, changes in each.items()
        }
        self._outside = relevant_changes(program, relevance) if is_open else OutsideChanges(())
        self._changed: dict[Happening, tuple[int, int]] = {}
        self._taken = {transition.name: visits.bit(transition.name, Aspect.TAKEN) for transition in program.automatic}
        self._entered = {name: _entered(name, visits) for name in program.operations}
        self._current = tuple(map(visits.current, program.operations))
        self._queued = tuple(visits.bit(name, Aspect.QUEUED) for name in program.operations)
        self._queued_in: dict[int, int] = {}
        self._questions: dict[int, _PlanQuestion] = {}
        self._answered_steps: dict[int | tuple[int, ...], RunStep] = {}
        self._known_changes: dict[Happening, Happening] = {}
        self._requests_of: dict[tuple[int, ...], tuple[RequestLine, ...]] = {(): ()}
        self._rest_visits = RestVisits(self._outside, lambda state: self._idle(state)[:2])
        self._after_ends: dict[int, RunEnding] = {}
        self._ends: dict[PlanState, dict[int | tuple[int, ...], RunEnding]] = {state: {} for state in PlanState}

    @property
    def asked(self) -> Sequence[int]:
        """The packed states in which a plan was asked for so far."""
        return tuple(self._questions)

    def begin(self, state: int) -> RunStep:
        """Return the step in which the goal is given to a runner at rest in a packed state."""
        keep, bits = self._planning
        return self._settle(SettlingRun((state & keep | bits) & self._kept, 0, (), goal=self._number, settled=state))

    def resume(self, state: int, in_flight: Iterable[int]) -> RunStep:
        """Return the step of a run without a plan from a packed state on, with these requests in flight."""
        return self._settle(SettlingRun(state & self._kept, 0, tuple(in_flight), goal=self._number))

    def rest(self, state: int, goal: int = NO_GOAL) -> Position:
        """Return the position of a runner at rest in a packed state, in which it is settled."""
        return Position(state & self._kept, 0, (), WaitsFor.NOTHING, goal)

    def start(self, state: int) -> RunStep:
        """Return the step in which the runner starts in a packed state: it settles without a goal."""
        visits, rests, notes = self._idle(state & self._kept)
        return RunStep(None, visits, rests=rests, notes=notes)

    def at_rest(self, rest: Position) -> Iterator[tuple[Happening, RunStep]]:
        """Yield everything that can happen while no goal is pursued: changes from outside, and what follows them."""
        for change, after in self._changes_from_outside(rest.state, ()):
            visits, rests, notes = self._idle(after)
            yield change, RunStep(None, visits, rests=rests, notes=notes)

    def _changes_from_outside(self, state: int, in_flight: Sequence[int]) -> Iterator[tuple[Happening, int]]:
        """Yield the changes from outside that are possible, each once, with the packed states after them."""
        seen = dict[int, None]()
        for maker, after in self._outside.following(state, in_flight):
            if after not in seen:
                seen[after] = None
                yield self._change(maker, state, after), after

    def _change(self, maker: Maker, state: int, after: int) -> Happening:
        """Return the change that a maker makes; equal ones are identical."""
        changes = self._program.packing.changes(state, after)
        change = Happening(HappeningKind.OUTSIDE, maker.name, measured=changes, by=type(maker))
        return self._known_changes.setdefault(change, change)

    def happenings(self, position: Position) -> Iterable[Happening]:
        """Yield everything that can happen next, failures first: so walks have obstacles behind them."""
        if position.awaits is WaitsFor.NEXT:
            count = len(self._queues.following(position.queue))
            yield from (Happening(HappeningKind.NEXT, number=number) for number in range(count))
            return
        if position.is_asking:
            yield ANSWER
        yield from (event[0] for event in self._events(position.state, position.in_flight))
        if self._outside and position.awaits is WaitsFor.CHANGE and not position.in_flight:
            yield GIVE_UP
        if self._is_sequence or self._end(position.state, position.in_flight, PlanState.ABORTED).visits:
            yield TIME_LIMIT  # it ends the run; of interest only if something follows the end

    def following(self, position: Position) -> Iterable[tuple[Happening, RunStep]]:
        """Yield everything that can happen next, in the order of `happenings`, each with the step that it starts."""
        if position.awaits is not WaitsFor.NOTHING:
            for happening in self.happenings(position):
                yield happening, self.after(position, happening)
            return
        for happening, state, in_flight, timer_passed in self._events(position.state, position.in_flight):
            yield happening, self._after_event(position, state, in_flight, timer_passed=timer_passed)
        if self._is_sequence or self._end(position.state, position.in_flight, PlanState.ABORTED).visits:
            yield TIME_LIMIT, self.after(position, TIME_LIMIT)

    def _after_event(
        self, position: Position, state: int, in_flight: tuple[int, ...], *, timer_passed: bool
    ) -> RunStep:
        """Return the step of an event that leads to a state, with these requests in flight."""
        run = self._resumed(position)
        run.state, run.in_flight = state, in_flight
        return self._settle(run, timer_passed=timer_passed)

    def _events(self, state: int, in_flight: tuple[int, ...]) -> Iterator[tuple[Happening, int, tuple[int, ...], bool]]:
        """Yield replies, deadlines and changes from outside, each with the state and the requests in flight after it.

        The last part says whether a timer has passed.
        """
        replies = [reply for number in in_flight for reply in self._replies[number]]
        for is_success in (False, True):
            for reply in replies:
                if reply.succeeded is is_success:
                    number, keep, bits = self._changes[reply]
                    yield reply, state & keep | bits, tuple([each for each in in_flight if each != number]), False
            current = None if is_success else self._program.current(state)
            if current is not None and current.has_timer:
                yield DEADLINE, state, in_flight, True
        for change, after in self._changes_from_outside(state, in_flight):
            yield change, after, in_flight, False

    def after(self, position: Position, happening: Happening) -> RunStep:
        """Return the step that an event starts in a position."""
        run = self._resumed(position)
        match happening.kind:
            case HappeningKind.TIME_LIMIT | HappeningKind.GIVE_UP:
                is_limit = happening.kind is HappeningKind.TIME_LIMIT
                return self._ended(run, End.TIME_LIMIT if is_limit else End.UNSOLVABLE)
            case HappeningKind.NEXT:
                self._take_next(run, self._queues.following(run.queue)[happening.number])
                return self._settle(run)
            case HappeningKind.ANSWER:
                return self._answer(run) or self._settle(run)
            case HappeningKind.DEADLINE:
                return self._settle(run, timer_passed=True)
            case HappeningKind.REPLY:
                number, keep, bits = self._changes[happening]
                run.in_flight = tuple(other for other in run.in_flight if other != number)
                run.state = run.state & keep | bits
            case HappeningKind.OUTSIDE:
                if happening not in self._changed:
                    self._changed[happening] = self._program.packing.assignment(dict(happening.measured))
                keep, bits = self._changed[happening]
                run.state = run.state & keep | bits
            case HappeningKind.GOAL | HappeningKind.PLAN_LIMIT:
                raise ValueError(f"while a goal is pursued it is no event that {happening.kind.value}")
            case _:
                assert_never(happening.kind)
        return self._settle(run)

    def _resumed(self, position: Position) -> SettlingRun:
        """Return the run that was settled in a position."""
        asked = self._question_in(position)
        queue = 0 if asked is not None else position.queue
        unsolvable_in = position.state if position.awaits is WaitsFor.CHANGE else None
        run = SettlingRun(position.state, queue, position.in_flight, asked, unsolvable_in, goal=self._number)
        run.settled = position.state
        return run

    # micro-steps

    def _settle(self, run: SettlingRun, *, timer_passed: bool = False) -> RunStep:
        """Take micro-steps until the run waits or ends."""
        while True:
            complete = self._take_turn(run, timer_passed=timer_passed) or self._follow_plan(run)
            if complete is not None:
                return complete
            timer_passed = False  # after a timer that has passed a new plan is requested

    def _take_turn(self, run: SettlingRun, *, timer_passed: bool) -> RunStep | None:
        """Take the micro-steps that no plan decides; return the step if the run waits or ends."""
        first, evaluated = self._steps.first, self.evaluated
        chain: dict[int, None] = {}
        automatic = 0  # since the last answer of the planner, request for a plan, or operation that became current
        while True:
            state = run.state
            evaluated[state] = None
            step = first(state, self._requests(run.in_flight), timer_passed=timer_passed)
            if isinstance(step, AutomaticMove):
                if automatic == self._bound or state in chain:
                    return self._livelock(run, tuple(chain))
                if automatic >= _LONG:
                    chain[state] = None
                automatic += 1
                timer_passed = timer_passed and step.failed is None
                self._take_automatic(run, step)
                continue
            if chain:
                chain.clear()
            if step is _FOLLOW_PLAN:
                return None
            if isinstance(step, OperationMove):
                timer_passed = False  # after a timer that has passed a new plan is requested
                complete = self._move_operation(run, step)
            else:
                complete = self._follow(run, step)
            if complete is not None:
                return complete

    def _requests(self, in_flight: tuple[int, ...]) -> tuple[RequestLine, ...]:
        """Return the request variables of resources."""
        if in_flight not in self._requests_of:
            self._requests_of[in_flight] = tuple(self._program.requests[number] for number in in_flight)
        return self._requests_of[in_flight]

    def _follow(self, run: SettlingRun, step: RequestSending | RequestCancelling | RunTurn | None) -> RunStep | None:
        """Take a micro-step of the run as a whole; return the step if it is complete."""
        match step:
            case RequestSending(line, after):
                run.in_flight = (*(other for other in run.in_flight if other != line.number), line.number)
            case RequestCancelling(line, after):
                run.in_flight = tuple(other for other in run.in_flight if other != line.number)
            case RunTurn.REACH_GOAL:
                return self._ended(run, End.REACHED)
            case RunTurn.ABORT:
                return self._ended(run, End.ABORTED)
            case _:
                return run.waiting(WaitsFor.NOTHING)
        run.state = after & self._kept
        return None

    def _take_automatic(self, run: SettlingRun, move: AutomaticMove) -> None:
        transition, failed, after = move
        run.visits |= self._taken[transition.name]
        if failed is not None:
            run.visits |= self._entered[failed.name][OperationState.FAILED]
        run.state = after & self._kept

    def _move_operation(self, run: SettlingRun, move: OperationMove) -> RunStep | None:
        operation, rule, _, after, _ = move
        if rule.plan is PlanEffect.MODEL_ERROR:
            return self._ended(run, End.MODEL_ERROR)
        if rule.plan is PlanEffect.REPLAN:
            run.queue = 0
        run.visits |= self._entered[operation.name][rule.target]
        run.state = after & self._kept
        return None

    def _follow_plan(self, run: SettlingRun) -> RunStep | None:
        """Do what the plan says; return the step if the run waits or ends."""
        following = next_in_plan(
            is_queued=run.queue != 0,
            is_asking=run.asked is not None,
            is_unsolvable=run.unsolvable_in is not None and not (run.unsolvable_in ^ run.state) & self._planner_reads,
            may_change=bool(run.in_flight or self._outside),
        )
        if following is _TAKE_NEXT:
            ways = self._queues.following(run.queue)
            if len(ways) > 1:
                return run.waiting(WaitsFor.NEXT)
            self._take_next(run, ways[0])
            return None
        if following is _AWAIT_ANSWER:
            return self._await_answer(run)
        if following is _REQUEST_PLAN:
            self._request_plan(run)
            return self._answered_at_once(run)
        if following is PlanStep.AWAIT_CHANGE:
            return run.waiting(WaitsFor.CHANGE)
        return self._ended(run, End.UNSOLVABLE)

    def _request_plan(self, run: SettlingRun) -> None:
        """Ask for a plan; a limit can end the run instead."""
        self._cut_off(run)
        keep, bits = self._planning
        run.state = run.state & keep | bits
        run.asked = self._question_from(run.state)

    def _answered_at_once(self, run: SettlingRun) -> RunStep | None:
        """Return the step that a request for a plan leads to, with the answer if nothing else can be first; memoized.

        Many runs request a plan in the same state. `None` if the micro-steps have to be taken one by one.
        """
        if run.answered or run.unsolvable_in is not None:
            return None
        key = (run.state, *run.in_flight) if run.in_flight else run.state
        known = self._answered_steps.get(key)
        if known is None:
            asking = SettlingRun(run.state, 0, run.in_flight, run.asked, goal=self._number, settled=run.settled)
            known = self._answered_steps[key] = self._settle(asking)
        target, visits, cut_off, rests, cut_off_rests, notes = known
        visits, cut_off = run.visits | visits, run.cut_off | cut_off
        return RunStep(target, visits, cut_off, rests, run.cut_off_rests + cut_off_rests, run.notes + notes)

    def _take_next(self, run: SettlingRun, way: FollowingOperation) -> None:
        """Let the next operation of the plan become current, or the plan end."""
        number, run.queue = way
        if number < 0:
            return
        keep, bits = self._operations[number].take_current
        run.state = run.state & keep | bits
        run.visits |= self._current[number]

    # the planner

    def _await_answer(self, run: SettlingRun) -> RunStep | None:
        """Wait for the planner if something else may come first. Else its answer is next, in the same step."""
        assert run.asked is not None  # noqa: S101 - that is why the run waits
        position = run.position(*run.asked.awaited(run.state, self._planner_reads))
        if run.in_flight or self._outside:
            return run.complete(position)
        if position in run.answered:
            return self._goes_round(run)
        if len(run.answered) == MAX_ANSWERS:
            raise PlanningTooLargeError
        run.answered[position] = None
        self._cut_off(run)  # a limit can end the run here, too
        return self._answer(run)

    def _goes_round(self, run: SettlingRun) -> RunStep:
        """Return the step of a run that asks for plans without end in one instant: at the limit of plans a livelock.

        What follows the limit is in `cut_off`: it can end the run at each of these questions.
        """
        return run.complete(None)

    def _answer(self, run: SettlingRun) -> RunStep | None:
        """Give the run the planner's answer; return the step if that ends the run."""
        asked, run.asked = run.asked, None
        assert asked is not None  # noqa: S101 - only questions are answered
        if asked.gives_up:
            return self._ended(run, End.PLANNER_LIMIT)
        if asked.queue is None:
            run.unsolvable_in = asked.state
            return None
        keep, bits = self._executing
        run.state, run.queue = run.state & keep | bits, asked.queue
        run.visits |= asked.visits
        return None

    def _question_from(self, state: int) -> _PlanQuestion:
        """Return the request for a plan from a packed state, with the answer that it will have."""
        if state not in self._questions:
            answer = self._plan(state)
            if isinstance(answer, Solved):
                queue = self._queues.of_answer(state, [self._numbers[name] for name in answer.plan])
                self._questions[state] = self._question(state, queue)
            else:
                gives_up = not isinstance(answer, Unsolvable)
                self._questions[state] = _PlanQuestion(state, None, 0, gives_up)
        return self._questions[state]

    def _question_in(self, position: Position) -> _PlanQuestion | None:
        """Return the question that is open in a position."""
        match position.awaits:
            case WaitsFor.PLAN:
                return self._question(None, position.queue)
            case WaitsFor.UNSOLVABLE:
                return _PlanQuestion(position.state, None, 0)
            case WaitsFor.STALE:
                return _PlanQuestion(None, None, 0)
            case WaitsFor.NOTHING | WaitsFor.CHANGE | WaitsFor.NEXT:
                return None
            case _:
                assert_never(position.awaits)

    def _question(self, state: int | None, queue: int) -> _PlanQuestion:
        if queue not in self._queued_in:
            self._queued_in[queue] = sum(self._queued[number] for number in dict.fromkeys(self._queues.planned(queue)))
        return _PlanQuestion(state, queue, self._queued_in[queue])

    # the end

    def _ended(self, run: SettlingRun, end: End) -> RunStep:
        """Return the step with which a run ends."""
        return run.complete(None, *self._ending(run.state, run.in_flight, end))

    def _ending(self, state: int, in_flight: tuple[int, ...], end: End) -> RunEnding:
        """Return what follows this end of a run, with what is noted about it."""
        return self._end(state, in_flight, end.plan_state)

    def _note_possible_end(self, run: SettlingRun, kind: NoteKind, ending: RunEnding) -> None:
        """Note that a run can end here, too, where notes are kept."""

    def _cut_off(self, run: SettlingRun) -> None:
        """Note what follows if a limit ends the run here."""
        end = self._end(run.state, run.in_flight, PlanState.ABORTED)
        self._note_possible_end(run, NoteKind.MAY_BE_CUT_OFF, end)
        run.cut_off |= end.visits
        run.cut_off_rests += end.rests

    def _livelock(self, run: SettlingRun, chain: tuple[int, ...]) -> RunStep:
        """Return the step that ends in a livelock: in the last state, or in any one of the cycle."""
        visits = 0
        rests: tuple[int, ...] = ()
        for state in dict.fromkeys((run.state, *chain)):
            end = self._end(state, run.in_flight, PlanState.ABORTED)
            self._note_possible_end(run, NoteKind.MAY_END, end)
            visits |= end.visits
            rests += end.rests
        return run.complete(None, visits, tuple(dict.fromkeys(rests)))

    def _end(self, state: int, in_flight: tuple[int, ...], plan_state: PlanState) -> RunEnding:
        """Return what follows the end of a run: its requests are given up, automatic transitions follow."""
        if not self._program.automatic and not self._is_sequence:
            return _NOTHING_FOLLOWS
        ends = self._ends[plan_state]
        key = (state, *in_flight) if in_flight else state
        if key not in ends:
            ends[key] = self._after_end(self._at_end(state, self._requests(in_flight), plan_state))
        return ends[key]

    def _after_end(self, state: int) -> RunEnding:
        if state not in self._after_ends:
            self._after_ends[state] = self._idle(state) if self._is_sequence else RunEnding(self._rest(state))
        return self._after_ends[state]

    def _at_end(self, state: int, in_flight: tuple[RequestLine, ...], plan_state: PlanState) -> int:
        """Return the state at the end of a run, before automatic transitions."""
        for line in in_flight:
            keep, bits = line.cleared
            state = state & keep | bits
        return self._program.end(state, plan_state)

    def _rest(self, state: int) -> int:
        """Return what a runner without a goal visits from a packed state on, whatever changes from outside."""
        visits, settled, _ = self._idle(state)
        return visits | (self._rest_visits.of(*settled) if settled and self._outside else 0)

    def _idle(self, state: int) -> RunEnding:
        """Return what a runner without a goal visits from a packed state until it is settled, and the state then.

        There is no such state if automatic transitions repeat without end.
        """
        visits = 0
        seen: dict[int, None] = {}
        while True:
            self.evaluated[state] = None
            step = self._idle_steps.first(state, (), timer_passed=False)
            if not isinstance(step, AutomaticMove):
                return RunEnding(visits, (state & self._kept,))
            visits |= self._taken[step.transition.name]
            state = step.after & self._kept
            if state in seen or len(seen) > self._bound:
                return RunEnding(visits)
            seen[state] = None


def _entered(name: str, visits: Visits) -> dict[OperationState, int]:
    """Return what an operation visits when it enters each of its states."""
    initial = OperationState.INITIAL
    return {initial: 0} | {s: visits.bit(name, Aspect(s.value)) for s in OperationState if s is not initial}


def _replies(line: RequestLine, relevance: Relevance) -> dict[Happening, tuple[int, int]]:
    """Return all replies of a resource that differ in their effect, each with `(keep, bits)`.

    These are a successful and a failing one for each choice of measured values. Raises `TooManyRepliesError`.
    """
    resource, space = line.resource, relevance.packing.space
    measured = [(name, resource.sends(space[name])) for name in resource.measures if name in relevance.names]
    replies = {}
    for changes in choices(measured):
        keep, bits = relevance.packing.assignment(dict(changes))
        reply = Happening(HappeningKind.REPLY, line.resource.name, succeeded=True, measured=changes)
        replies[reply] = (keep & line.succeeded[0], bits & line.succeeded[0] | line.succeeded[1])
        failing = Happening(HappeningKind.REPLY, line.resource.name, measured=changes)
        replies[failing] = (keep & line.failed[0], bits & line.failed[0] | line.failed[1])
    return replies
