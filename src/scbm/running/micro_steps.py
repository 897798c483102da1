"""The order of micro-steps (semantics 5, 6), for the runner and the exploration of all runs; and memoized macro-steps.

After every event the runner takes micro-steps until none applies; it is then settled. `MicroSteps.first` decides which
micro-step is next. It is a pure function of the packed state, the requests in flight, and whether a timer has passed:

| semantics | micro-step | value |
| --- | --- | --- |
| 5.0 | an injection acts, or is put back | only the runner has injections: it tries them first |
| 5.1 | an automatic transition is taken | `AutomaticMove` |
| 5.2 | the run is aborted | `RunTurn.ABORT` |
| 5.3 | a request is sent, or cancelled | `RequestSending`, `RequestCancelling` |
| 5.4 | the run reaches its goal | `RunTurn.REACH_GOAL` |
| 5.5 | the current operation moves | `OperationMove`, by the table in `lifecycle` |
| 5.5 | no operation is current | `RunTurn.FOLLOW_PLAN`, then `next_in_plan` |

The runner turns micro-steps into records and effects. The exploration (`closing.runs`) collects the obligations that
they visit. Neither has a second copy of this order. `find_cycle` finds the cycle in a chain of automatic transitions
that does not end (semantics 5.1).

A campaign repeats a few macro-steps many thousand times. The first time the runner takes the micro-steps one by one and
keeps what they did. Later it writes the same records again, with the new time, and takes over the state.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from msgspec import Struct

from scbm.running.lifecycle import OperationMove

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from scbm.cases.trace import Changes, Record
    from scbm.model.packing import Test
    from scbm.running.compiled_model import CompiledModel
    from scbm.running.compiled_steps import CompiledStep, RequestLine, RunnableOperation


class AutomaticMove(NamedTuple):
    """The micro-step in which an automatic transition is taken.

    Attributes:
        transition: the transition.
        failed: the current operation, if the transition fails it.
        after: the packed state afterwards.
    """

    transition: CompiledStep
    failed: RunnableOperation | None
    after: int


def next_automatic(program: CompiledModel, state: int) -> AutomaticMove | None:
    """Return the first automatic transition in the file whose guard holds and that changes a packed state."""
    for mask, bits, step in program.automatic_cubes:  # most are ruled out without a call
        if state & mask != bits or not step.test(state):
            continue
        after = step.update(state)
        if after is None or after == state:
            continue
        return (
            AutomaticMove(step, *program.fail_current(after))
            if step.fails_operation
            else AutomaticMove(step, None, after)
        )
    return None


def find_cycle(program: CompiledModel, state: int, bound: int) -> tuple[str, ...]:
    """Return `name_cycle` of the chain of automatic transitions from `state`; empty if it ends within `bound`."""
    taken: list[tuple[str, int]] = []
    seen: dict[int, None] = {}
    while len(taken) <= bound:
        following = next_automatic(program, state)
        if following is None:
            return ()
        state = following.after
        taken.append((following.transition.name, state))
        if state in seen:
            break
        seen[state] = None
    return name_cycle(taken)


def name_cycle(taken: Sequence[tuple[str, int]]) -> tuple[str, ...]:
    """Return the names of the transitions of a chain that is too long.

    If the last state occurred before, these are the names of one cycle, with the first name again at the end. Otherwise
    the chain has no cycle, and each name occurs once.

    Args:
        taken: the transitions, each with the packed state after it.
    """
    *before, (_, state) = taken
    for index in range(len(before) - 1, -1, -1):
        if before[index][1] == state:
            return _round([name for name, _ in taken[index + 1 :]], [name for name, _ in taken])
    return tuple(dict.fromkeys(name for name, _ in taken))


def _round(names: list[str], taken: list[str]) -> tuple[str, ...]:
    """Return the names of a cycle from the one that was taken first, with that one again at the end."""
    first = min(range(len(names)), key=lambda index: taken.index(names[index]))
    return (*names[first:], *names[:first], names[first])


NO_TIME_PASSES = "no time passes"
"""Replaces the names of a cycle where requests are sent and answered without end at one moment."""

PLANS_WITHOUT_TIME = "plans without time"
"""Begins the detail of a livelock in which plans are asked for without end at one moment; the last plan follows."""

MIN_PLANS_AT_ONCE = 50
"""So many of the plans that a run has used, asked for in one instant, make its limit of plans a livelock."""


def describe_cycle(names: Sequence[str]) -> str:
    """Return the result of `name_cycle` as a sentence."""
    if tuple(names) == (NO_TIME_PASSES,):
        return "requests are sent and answered without end, and no time passes: give the resources a latency"
    if names and names[0] == PLANS_WITHOUT_TIME:
        last = " -> ".join(names[1:]) or "empty"
        return (
            f"plans are asked for without end, and no time passes: each ends at once without the goal, such as {last}"
        )
    if len(names) > 1 and names[0] == names[-1]:
        return f"automatic transitions repeat without end: {' -> '.join(names)}"
    return f"too many automatic transitions in a row, though no state repeats: {', '.join(names)}"


class RequestSending(NamedTuple):
    """The micro-step in which a request is sent; one in flight to the same resource is cancelled before."""

    line: RequestLine
    after: int


class RequestCancelling(NamedTuple):
    """The micro-step in which a request in flight is cancelled, as its trigger has become false."""

    line: RequestLine
    after: int


class RunTurn(Enum):
    """A micro-step that is about the run as a whole."""

    ABORT = "the run ends, as `plan.state` is `aborted`"
    REACH_GOAL = "the run ends, as its goal holds and no operation has left `initial`"
    FOLLOW_PLAN = "no operation is current: see `next_in_plan`"


MicroStep: TypeAlias = AutomaticMove | RequestSending | RequestCancelling | OperationMove | RunTurn

MemoizedSteps: TypeAlias = dict[int, tuple[MicroStep | None, bool]]
"""For packed states the next micro-step, and whether the run ends instead if its goal holds."""

_MAX_MEMOIZED = 50_000
"""Maximum number of packed states whose micro-step is memoized: some 20 MB. A campaign repeats the same states."""


class MicroSteps:
    """The micro-steps of one program while it pursues one goal, or none.

    Holds no state of any run, so all runs for this goal can share it. Memoizes results. The goal decides few
    micro-steps, so the results are shared with the other goals of the program.

    Attributes:
        macro_steps: the macro-steps that runners have taken so far, by the packed state and the queue before.
    """

    def __init__(
        self, program: CompiledModel, goal: Test | None, memoized: MemoizedSteps, most_memoized: int = _MAX_MEMOIZED
    ) -> None:
        """Prepare the micro-steps.

        Args:
            program: the compiled model.
            goal: whether the goal holds in a packed state; `None` while no goal is pursued.
            memoized: the micro-steps that other goals of the program share.
            most_memoized: maximum number of packed states whose micro-step is memoized.
        """
        self._program = program
        self._is_pursuing = goal is not None
        self._goal = goal or _never
        self._aborted_mask, self._aborted_bits = program.aborted
        self._memoized = {} if goal is None else memoized
        self._most_memoized = most_memoized
        self.macro_steps: dict[tuple[int, PlanQueue], MacroStep] = {}

    def first(self, state: int, in_flight: Collection[RequestLine], *, timer_passed: bool) -> MicroStep | None:
        """Return the next micro-step; `None` if none applies, so that the runner is settled.

        Args:
            state: the packed state.
            in_flight: the resources with a pending request, in the order of their requests.
            timer_passed: whether the timer of the current operation has passed.
        """
        # Without a timer that has passed and a request to cancel, the packed state and the goal alone decide.
        memoizes = not timer_passed and not (in_flight and _is_any_stale(state, in_flight))
        known = self._memoized.get(state) if memoizes else None
        if known is None:
            automatic = next_automatic(self._program, state)
            known = (automatic, False)
            if automatic is None:
                known = self.first_not_automatic(state, in_flight, timer_passed=timer_passed)
            if memoizes and len(self._memoized) < self._most_memoized:
                self._memoized[state] = known
        step, may_end = known
        return RunTurn.REACH_GOAL if may_end and self._goal(state) else step

    def first_not_automatic(
        self, state: int, in_flight: Collection[RequestLine], *, timer_passed: bool
    ) -> tuple[MicroStep | None, bool]:
        """Return the next micro-step but automatic transitions, and whether the run ends instead if its goal holds."""
        if not self._is_pursuing:
            return None, False  # before a run and after its end nothing is sent to a resource
        if state & self._aborted_mask == self._aborted_bits:
            return RunTurn.ABORT, False
        program = self._program
        if in_flight or state & program.triggers:
            request = self._request(state, in_flight)
            if request is not None:
                return request, False
        current = program.current(state)
        if current is None:
            return RunTurn.FOLLOW_PLAN, True
        return current.move(state, timer_passed=timer_passed), current.is_initial

    def _request(self, state: int, in_flight: Collection[RequestLine]) -> RequestSending | RequestCancelling | None:
        for line in self._program.requests:
            if state & line.watched == line.ready:
                keep, bits = line.executing
                return RequestSending(line, state & keep | bits)
        for line in in_flight:
            if not state & line.trigger:
                keep, bits = line.idle
                return RequestCancelling(line, state & keep | bits)
        return None


def _never(_: int) -> bool:
    return False


def _is_any_stale(state: int, in_flight: Collection[RequestLine]) -> bool:
    """Return whether the trigger of a request in flight is false."""
    for line in in_flight:  # noqa: SIM110 - a generator would take longer than all the rest
        if not state & line.trigger:
            return True
    return False


class PlanStep(Enum):
    """The next step of a run while no operation is current and its goal does not hold."""

    TAKE_NEXT = "the next operation of the plan becomes current"
    AWAIT_ANSWER = "the runner waits for the planner's answer"
    REQUEST_PLAN = "a new plan is requested"
    AWAIT_CHANGE = "no plan exists from this state, and the runner waits until the state changes"
    END_UNSOLVABLE = "no plan exists from this state, which cannot change any more: the run ends"


def next_in_plan(*, is_queued: bool, is_asking: bool, is_unsolvable: bool, may_change: bool) -> PlanStep:
    """Return what a run does at `RunTurn.FOLLOW_PLAN` (semantics 5.5 and 5.6).

    Args:
        is_queued: whether the plan has another operation.
        is_asking: whether a planning request is pending.
        is_unsolvable: whether the planner has answered that no plan exists from the present state.
        may_change: whether the run waits for something that could change the state.
    """
    if is_queued:
        return PlanStep.TAKE_NEXT
    if is_asking:
        return PlanStep.AWAIT_ANSWER
    if not is_unsolvable:
        return PlanStep.REQUEST_PLAN
    return PlanStep.AWAIT_CHANGE if may_change else PlanStep.END_UNSOLVABLE


MAX_MACRO_STEPS = 50_000
"""Maximum number of macro-steps that are memoized for one goal: some 50 MB."""

MAX_TAKEN = 50
"""Maximum number of automatic transitions in a macro-step; where they repeat without end, the runner takes over."""


class PlanQueue(Struct, frozen=True, eq=False):
    """The operations of a plan that are still to come, as a linked list. `Program.queue` makes equal ones identical.

    Attributes:
        first: the next operation; `None` if there is none.
        rest: the queue behind it; `None` if there is no next operation.
    """

    first: RunnableOperation | None = None
    rest: PlanQueue | None = None

    def __iter__(self) -> Iterator[RunnableOperation]:
        queue: PlanQueue | None = self
        while queue is not None and queue.first is not None:
            yield queue.first
            queue = queue.rest


_TimelessRecord: TypeAlias = "tuple[Callable[..., Record], tuple[Any, ...]]"
"""A kind of record, and all fields behind its time."""


class TimelessRequest(NamedTuple):
    """A request that was sent, without its number and its time."""

    line: RequestLine
    payload: Changes
    changes: Changes


class MacroStep(NamedTuple):
    """The result of a macro-step.

    Attributes:
        records: its records, without the one of the request.
        request: the request that it ended with; `None` if it sent none.
        after: the packed state afterwards.
        queue: the queue afterwards.
        sets_timer: whether it set or stopped the timer of the current operation.
        timer_ns: the time that the timer has from now on; `None` if it does not run.
        taken: the automatic transitions since an operation became current, each with the packed state after it.
        longest: the maximum number of automatic transitions that are counted together.
        settles: whether no other micro-step follows, unless a goal waits.
    """

    records: tuple[_TimelessRecord, ...]
    request: TimelessRequest | None
    after: int
    queue: PlanQueue
    sets_timer: bool
    timer_ns: int | None
    taken: tuple[tuple[str, int], ...]
    longest: int
    settles: bool


def without_time(records: Sequence[Record]) -> tuple[_TimelessRecord, ...]:
    """Return records without their time, which is the first field of each kind."""
    return tuple(
        (type(record), tuple(getattr(record, name) for name in record.__struct_fields__[1:])) for record in records
    )
