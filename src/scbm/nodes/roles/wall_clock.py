"""Drives one runner in wall time (decision 26).

It gets each event with the time at which the event arrived. A deadline passes at its own time, before all later
events. The runner itself is the one of simulations, and knows nothing of clocks.

The time of a run: wall time since it began, some times faster (decision 26).
"""

from __future__ import annotations

import asyncio
from fractions import Fraction
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct, structs

from scbm.cases.trace import MessageDisturbed, ResourceChanged
from scbm.running import AskPlan, CancelRequest, RunFinished, SendRequest, TimePassed, records_of

if TYPE_CHECKING:
    from scbm.cases.trace import Record
    from scbm.running import Event
    from scbm.running.simulation.case_runner import CaseRunner
    from scbm.testing.event_logs.event_records import Note


class Surroundings(Protocol):
    """Carries out the effects of a runner."""

    def send(self, request: SendRequest) -> None:
        """Send a request to its resource."""
        ...

    def cancel(self, request: CancelRequest) -> None:
        """Cancel a request at its resource."""
        ...

    def plan(self, asked: AskPlan) -> None:
        """Start planning; the answer goes to the driver as an event."""
        ...

    def stepped(self, at_ns: int, event: Event | Note, records: tuple[Record, ...]) -> None:
        """Handle an event or a note at a time of the run, with the records that it led to."""
        ...

    def finished(self, end: RunFinished) -> None:
        """Handle the end of the run."""
        ...


class Driver:
    """Gives events and the changes of the case to one runner, and arms one timer for the deadline that it answers."""

    def __init__(self, runner: CaseRunner, clock: Clock, surroundings: Surroundings) -> None:
        """Start, on the running event loop. The runner is new, and its time is that of `clock`."""
        self._runner = runner
        self._clock = clock
        self._surroundings = surroundings
        self._loop = asyncio.get_running_loop()
        self._timer: asyncio.Handle | None = None
        self._now_ns = 0
        self._is_over = False

    def give(self, event: Event | Note, stamp_ns: int) -> None:
        """Handle an event at a reading of `time.monotonic_ns`; ignore it once the run is over."""
        at_ns = self._clock.of_run_ns(stamp_ns)
        self._pass_deadlines(at_ns)
        if not self._is_over:
            self._step(event, max(at_ns, self._now_ns))
            self._arm()

    def close(self) -> None:
        """Stop."""
        self._is_over = True
        self._disarm()

    def wall_ns_after(self, duration_ns: int) -> int:
        """Return the reading of the clock at a duration after the last event, in time of the run."""
        return self._clock.wall_ns(self._now_ns + duration_ns)

    def _pass_deadlines(self, at_ns: int) -> None:
        """Let the deadlines before a time pass, each at its own time."""
        while not self._is_over:
            deadline_ns = self._runner.deadline_ns
            if deadline_ns is None or deadline_ns >= at_ns:
                return
            now_ns = max(deadline_ns, self._now_ns)
            self._step(self._runner.next_change(now_ns) or TimePassed(), now_ns)

    def _step(self, event: Event | Note, at_ns: int) -> None:
        """Handle an event or a note, and the changes of the case that are possible after it."""
        self._handle(event, at_ns)
        while not self._is_over and (change := self._runner.next_change(at_ns)) is not None:
            self._handle(change, at_ns)

    def _handle(self, event: Event | Note, at_ns: int) -> None:
        self._now_ns = at_ns
        if isinstance(event, MessageDisturbed | ResourceChanged):
            noted = structs.replace(event, at_ns=at_ns)
            self._surroundings.stepped(at_ns, noted, (noted,))
            return
        effects = self._runner.handle(event, at_ns)
        records = records_of(effects)
        self._surroundings.stepped(at_ns, event, records)
        finished: RunFinished | None = None
        for effect in effects:
            match effect:
                case SendRequest():
                    self._surroundings.send(effect)
                case CancelRequest():
                    self._surroundings.cancel(effect)
                case AskPlan():
                    self._surroundings.plan(effect)
                case RunFinished():
                    finished = effect
                case _:
                    pass  # records; and the conditions of simulated resources, which are the tester's
        if finished is not None and self._runner.is_over:  # last of all: what follows the end belongs to the run
            self.close()
            self._surroundings.finished(finished)

    # the timer

    def _arm(self) -> None:
        self._disarm()
        deadline_ns = self._runner.deadline_ns
        if deadline_ns is not None and not self._is_over:
            when = self._clock.wall_ns(deadline_ns) / 1e9  # the loop's own time is that of the same clock
            self._timer = self._loop.call_at(when, self._let_others_first, deadline_ns)

    def _disarm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _let_others_first(self, deadline_ns: int) -> None:
        """Handle the timer after events that came before the deadline and wait in the queue of the loop."""
        self._timer = self._loop.call_soon(self._pass, deadline_ns)

    def _pass(self, deadline_ns: int) -> None:
        self._timer = None
        self._pass_deadlines(deadline_ns + 1)
        self._arm()


class Clock(Struct, frozen=True):
    """Turns readings of `time.monotonic_ns` into time of a run, and back.

    Attributes:
        start_ns: the reading at which the run began.
        scale: how many seconds of the run pass in one of the wall; greater than 0.
    """

    start_ns: int
    scale: Fraction = Fraction(1)

    def of_run_ns(self, stamp_ns: int) -> int:
        """Return the time of the run at a reading; never negative."""
        return max(0, int((stamp_ns - self.start_ns) * self.scale))

    def wall_ns(self, at_ns: int) -> int:
        """Return the first reading at which a time of the run has come."""
        return self.start_ns - int(-at_ns / self.scale // 1)

    def lasts_ns(self, duration_ns: int) -> int:
        """Return the wall time of a duration of the run."""
        return -int(-duration_ns / self.scale // 1)
