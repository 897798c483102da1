"""The environment in a simulation: changes from outside, drawn at the rates of the model or recorded in a case.

Each change is a recorded choice: its time, and the values that it gave (semantics 9.4, decision 44). At one moment
changes of the environment come after all other events, and before deadlines. So a recorded change acts in the same
state again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

from msgspec import Struct

from scbm.cases import EnvironmentChange
from scbm.cases.injections import MAX_CHANGES
from scbm.model import Diagnostic, InputError, Latency, LatencyShape, Place, Rate, RateKind, Slug
from scbm.running.events import Measured
from scbm.running.outside_changes import TransitionMaker
from scbm.running.simulation.default_reactions import draw_time_ns

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from random import Random

    from scbm.cases.trace import Changes
    from scbm.model import Value
    from scbm.running.program import Program
    from scbm.running.runner import Runner

DRAWN_INPUT_MEAN_NS = 10_000_000_000
"""The mean time between two changes of an input that the model gives no rate: some changes in a typical run."""


class ClockTick(NamedTuple):
    """The end of the time of a clock, if the clock has not been stopped or started again by then.

    Attributes:
        at_ns: when it is.
        clock: the number of the clock, or of the recorded change.
        start: how many times the clock had been started.
        precedes: whether it comes before all other events of its moment, and not after them.
    """

    at_ns: int
    clock: int
    start: int = 0
    precedes: bool = False


class EnvironmentMoves(Protocol):
    """Decides what the environment changes in one run."""

    def is_pending(self, state: int) -> bool:
        """Return whether something will change if nothing but time passes from a settled packed state on."""
        ...

    def begin(self) -> Sequence[ClockTick]:
        """Return what is scheduled at the beginning of the run."""
        ...

    def observe(self, state: int, now_ns: int) -> Sequence[ClockTick]:
        """Return what is scheduled in addition, as the runner is settled in a packed state."""
        ...

    def tick(
        self, tick: ClockTick, state: int, *, is_waiting: bool
    ) -> tuple[EnvironmentChange | None, ClockTick | None]:
        """Return the change that happens now, if there is one, and what is scheduled next.

        Args:
            tick: what was scheduled for now.
            state: the packed state, in which the runner is settled.
            is_waiting: whether the run waits for a change, as no plan exists.
        """
        ...

    def taken(self, *, is_waiting: bool) -> tuple[EnvironmentChange, ...]:
        """Return all changes of a case that has ended; `is_waiting`: a run waited until its limit for another one."""
        ...

    def missing(self) -> tuple[EnvironmentChange, ...]:
        """Return the changes of the case whose moments have not come."""
        ...


def parts_of(change: EnvironmentChange, runner: Runner) -> list[Changes]:
    """Return the changes that an entry of a case stands for now, in order.

    That is one change if something outside the model makes all of it at once, else one for each source of variables.
    """
    outside, state = runner.program.outside, runner.packed_state
    if change.assign is None:
        made = (after for each in outside.transitions if each.name == change.by for after in each.following(state, ()))
        return [runner.program.packing.changes(state, next(made, state))]
    if change.by or runner.can_be_changed(change.assign):
        return [change.assign]
    return outside.parts(change.assign)


def event_of(values: Changes, by: str, runner: Runner) -> Measured | None:
    """Return the event of a change if something outside the model can make it now; `by` as in `EnvironmentChange`."""
    if not runner.can_be_changed(values, by):
        return None
    maker = runner.maker_of(values, by)
    return Measured(values, maker.name if isinstance(maker, TransitionMaker) else "")


class RecordedMoves:
    """Repeats the changes of a case."""

    def __init__(self, program: Program, changes: Sequence[EnvironmentChange]) -> None:
        self._changes = tuple(changes)
        self._when = [None if change.when is None else program.test(change.when) for change in self._changes]
        self._tried = [0] if self._is_tried(0) else []
        self._scheduled = 0
        self._come: list[int] = []

    def _is_tried(self, number: int) -> bool:
        """Return whether a change waits for its `when`, once the change before it has acted."""
        return number < len(self._when) and self._when[number] is not None

    def _holds(self, number: int, state: int) -> bool:
        test = self._when[number]
        return test is not None and test(state)

    def is_pending(self, state: int) -> bool:
        """Return whether the time of a change runs, or its predicate holds."""
        return self._scheduled > 0 or self.begins_in(state)

    def begins_in(self, state: int) -> bool:
        """Return whether the time of a change begins in a settled packed state, as its predicate holds."""
        return any(self._holds(number, state) for number in self._tried)

    def begin(self) -> Sequence[ClockTick]:
        """Return a tick for each change with a time of its own."""
        ticks = [ClockTick(c.at_ns, number) for number, c in enumerate(self._changes) if c.at_ns is not None]
        self._scheduled += len(ticks)
        return ticks

    def observe(self, state: int, now_ns: int) -> Sequence[ClockTick]:
        """Return a tick for each change whose predicate holds first now."""
        found = [number for number in self._tried if self._holds(number, state)]
        if not found:
            return ()
        self._tried = [number for number in self._tried if number not in found]
        self._scheduled += len(found)
        after = ((self._changes[number].after_ns, number) for number in found)
        return [ClockTick(now_ns + after_ns, number, precedes=not after_ns) for after_ns, number in after]

    def tick(
        self,
        tick: ClockTick,
        state: int,  # noqa: ARG002 - as the protocol says
        *,
        is_waiting: bool,  # noqa: ARG002
    ) -> tuple[EnvironmentChange | None, ClockTick | None]:
        """Return the change of the case."""
        self._scheduled -= 1
        self._come.append(tick.clock)
        if self._is_tried(tick.clock + 1):
            self._tried.append(tick.clock + 1)
        return self._changes[tick.clock], None

    def taken(self, *, is_waiting: bool) -> tuple[EnvironmentChange, ...]:  # noqa: ARG002 - as the protocol says
        """Return the changes of the case."""
        return self._changes

    def missing(self) -> tuple[EnvironmentChange, ...]:
        """Return those whose moments have not come."""
        return tuple(change for number, change in enumerate(self._changes) if number not in self._come)


class _TransitionClock(Struct):
    """The clock of an environment transition, or of variables that change freely.

    Attributes:
        rate: when it starts, and how long it runs.
        maker: the transition; `None` for variables that change freely.
        values: the variables that change freely, each with its values.
        starts: how many times it was started.
        due_ns: when it passes; `None` while it does not run.
        held: whether the guard was true at the last settled moment.
    """

    rate: Rate
    maker: TransitionMaker | None
    values: tuple[tuple[str, tuple[Value, ...]], ...] = ()
    starts: int = 0
    due_ns: int | None = None
    held: bool = False

    @property
    def name(self) -> str:
        """The name of the transition; empty without one."""
        return "" if self.maker is None else self.maker.name

    def holds(self, state: int) -> bool:
        """Return whether the guard of its transition holds in a packed state."""
        return self.maker is not None and self.maker.holds(state)


class DrawnMoves:
    """Draws when environment transitions fire, and the values of variables that change freely.

    Only `Random.random` is used: of all methods it alone promises the same numbers in every version of Python.
    """

    def __init__(self, program: Program, random: Random, *, moves_inputs: bool) -> None:
        """Prepare one run.

        Args:
            program: the compiled model.
            random: the source of random numbers.
            moves_inputs: whether variables that change freely are moved as well.
        """
        self._program = program
        self._random = random
        rates = zip(program.model.environment, program.outside.transitions, strict=True)
        self._clocks = [_TransitionClock(each.rate, maker) for each, maker in rates if each.rate is not None]
        if moves_inputs:
            rate = Rate(RateKind.EVERY, Latency(LatencyShape.EXPONENTIAL, (DRAWN_INPUT_MEAN_NS,)))
            self._clocks += [_TransitionClock(rate, None, maker.values) for maker in program.outside.free]
        self._guarded = [(n, c) for n, c in enumerate(self._clocks) if c.rate.kind is RateKind.AFTER]
        self._taken: list[EnvironmentChange] = []

    @property
    def is_idle(self) -> bool:
        """Whether nothing will ever change."""
        return not self._clocks

    def is_pending(self, state: int) -> bool:
        """Return whether a clock runs in this state, or starts in it, as its guard has become true."""
        return any(
            (not clock.held or clock.due_ns is not None) and clock.holds(state)
            if clock.rate.kind is RateKind.AFTER
            else clock.due_ns is not None
            for clock in self._clocks
        )

    def begin(self) -> Sequence[ClockTick]:
        """Start the clocks that need no guard."""
        clocks = enumerate(self._clocks)
        return [self._start(number, 0) for number, clock in clocks if clock.rate.kind is RateKind.EVERY]

    def observe(self, state: int, now_ns: int) -> Sequence[ClockTick]:
        """Start the clocks whose guards have become true, and stop those whose guards have become false."""
        return [self._start(number, now_ns) for number, clock in self._guarded if self._has_become_true(clock, state)]

    def _has_become_true(self, clock: _TransitionClock, state: int) -> bool:
        held, clock.held = clock.held, clock.holds(state)
        if not clock.held:
            clock.due_ns = None
        return clock.held and not held

    def _start(self, number: int, now_ns: int) -> ClockTick:
        clock = self._clocks[number]
        clock.starts += 1
        # At least 1 ns, so that a change never precedes in a replay what had happened before it at its moment.
        clock.due_ns = now_ns + max(1, draw_time_ns(clock.rate.time, self._random))
        return ClockTick(clock.due_ns, number, clock.starts)

    def tick(
        self, tick: ClockTick, state: int, *, is_waiting: bool
    ) -> tuple[EnvironmentChange | None, ClockTick | None]:
        """Return the change that a clock leads to, and its next tick; nothing if the clock was stopped.

        A clock that passes without an effect is no change. But a run that waits may end there if no other time follows:
        then it is one.
        """
        clock = self._clocks[tick.clock]
        if clock.due_ns is None or tick.start != clock.starts:
            return None, None
        clock.due_ns = None
        following = self._start(tick.clock, tick.at_ns) if clock.rate.kind is RateKind.EVERY else None
        changes = self._changes(clock, state)
        if not changes and (following is not None or not is_waiting):
            return None, following
        if len(self._taken) == MAX_CHANGES:
            raise InputError([self._too_many(clock)])
        self._taken.append(EnvironmentChange(tick.at_ns, changes, clock.name if changes else ""))
        return self._taken[-1], following

    def _too_many(self, clock: _TransitionClock) -> Diagnostic:
        last = f", the last of them by `{clock.name}`" if clock.name else ""
        message = f"the environment made {MAX_CHANGES:,} changes in one run{last}"
        shorter = "limit the time of the run with `--time-limit`"
        remedy = f"make its rates slower, or {shorter}" if clock.name else shorter
        return Diagnostic(Slug.BAD_LATENCY, message, clock.rate.place or Place(self._program.model.name), remedy)

    def _changes(self, clock: _TransitionClock, state: int) -> Changes:
        if clock.maker is None:
            return self._drawn(clock, state)
        after = next(clock.maker.following(state, ()), state)
        return self._program.packing.changes(state, after)

    def _drawn(self, clock: _TransitionClock, state: int) -> Changes:
        """Draw another value of one of the variables that change freely."""
        name, values = clock.values[self._below(len(clock.values))]
        others = [value for value in values if value != self._program.packing.value(state, name)]
        return ((name, others[self._below(len(others))]),) if others else ()

    def _below(self, count: int) -> int:
        return int(self._random.random() * count)

    def taken(self, *, is_waiting: bool) -> tuple[EnvironmentChange, ...]:
        """Return the changes; for a run that waited until its limit also the next one, for which it waited."""
        return (*self._taken, *(self._next() if is_waiting else ()))

    def missing(self) -> tuple[EnvironmentChange, ...]:
        """Return none: what is drawn comes."""
        return ()

    def _next(self) -> Iterator[EnvironmentChange]:
        running = [clock for clock in self._clocks if clock.due_ns is not None]
        if running:
            first = min(running, key=lambda clock: clock.due_ns or 0)
            yield EnvironmentChange(first.due_ns or 0, ())
