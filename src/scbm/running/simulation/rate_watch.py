"""Whether the environment transitions of a run act at times that their rates allow (semantics 7.2).

Rates bound nothing: what may happen may happen at any time. But a run within the rates is what a simulation draws.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from scbm.model import LatencyShape, RateKind, format_duration

if TYPE_CHECKING:
    from scbm.model import Latency, Rate
    from scbm.running.outside_changes import TransitionMaker
    from scbm.running.program import Program


class RateWatch:
    """Follows one run, settled moment by settled moment.

    Attributes:
        left: a sentence for each change that came at another time than its rate allows.
    """

    def __init__(self, program: Program) -> None:
        pairs = zip(program.model.environment, program.outside.transitions, strict=True)
        self._clocks = {each.name: _WatchedClock(each.rate, maker) for each, maker in pairs if each.rate is not None}
        self.left: list[str] = []

    def observe(self, state: int, now_ns: int) -> None:
        """Follow the guards in the packed state in which the runner is settled."""
        for clock in self._clocks.values():
            clock.observe(state, now_ns)

    def act(self, name: str, now_ns: int) -> None:
        """Note that a transition acts; a change without a transition has no rate."""
        clock = self._clocks.get(name)
        reason = None if clock is None else clock.act(now_ns)
        if reason is not None:
            self.left.append(f"{name} acts {reason}")

    def first_ns(self, name: str, at_ns: int) -> int | None:
        """Return the first time from `at_ns` on at which a transition may act; `None` if it has no rate, or may never.

        That is the case unless its guard becomes false before.
        """
        clock = self._clocks.get(name)
        return None if clock is None else clock.first_ns(at_ns)


class _WatchedClock:
    """The clock of one transition, as `DrawnMoves` would start and stop it."""

    def __init__(self, rate: Rate, maker: TransitionMaker) -> None:
        self._rate = rate
        self._maker = maker
        self._holds = False
        self._since_ns: int | None = 0 if rate.kind is RateKind.EVERY else None

    def observe(self, state: int, now_ns: int) -> None:
        if self._rate.kind is RateKind.AFTER:
            held, self._holds = self._holds, self._maker.holds(state)
            if self._holds != held:
                self._since_ns = now_ns if self._holds else None

    def act(self, now_ns: int) -> str | None:
        """Return the time since the clock started, with the rate; `None` if the clock may pass then."""
        since_ns = self._since_ns
        self._since_ns = now_ns if self._rate.kind is RateKind.EVERY else None
        if self._rate.kind is RateKind.EVERY:
            passed_ns = now_ns - (since_ns or 0)
            if _may_take(self._rate.time, passed_ns, is_repeated=True):
                return None
            since = "it acted last, or the run began"
            return f"{format_duration(passed_ns)} after {since}, and its rate is {words(self._rate)}"
        if since_ns is None:
            return f"once more while its guard holds, and its rate is {words(self._rate)}"
        if _may_take(self._rate.time, now_ns - since_ns, is_repeated=False):
            return None
        return f"{format_duration(now_ns - since_ns)} after its guard held, and its rate is {words(self._rate)}"

    def first_ns(self, at_ns: int) -> int | None:
        """Return the first time from `at_ns` on at which the clock may pass; `None` if it does not run."""
        if self._since_ns is None:
            return None
        time, passed_ns = self._rate.time, max(1, at_ns - self._since_ns)
        if time.shape is LatencyShape.EXPONENTIAL:
            return self._since_ns + passed_ns
        least_ns, most_ns = max(1, time.points_ns[0]), max(1, time.points_ns[-1])
        count = -(-passed_ns // most_ns) if self._rate.kind is RateKind.EVERY else 1
        first_ns = max(passed_ns, count * least_ns)
        return self._since_ns + first_ns if first_ns <= count * most_ns else None


def _may_take(time: Latency, passed_ns: int, *, is_repeated: bool) -> bool:
    """Return whether a drawn time, or the sum of several, can be so long."""
    least_ns, most_ns = max(1, time.points_ns[0]), time.points_ns[-1]
    if time.shape is LatencyShape.EXPONENTIAL:
        return passed_ns > 0
    count = -(-passed_ns // max(1, most_ns)) if is_repeated else 1
    return passed_ns > 0 and count * least_ns <= passed_ns <= count * max(1, most_ns)


def words(rate: Rate) -> str:
    """Return a rate as a model file writes it, on one line."""
    times = [format_duration(point) for point in rate.time.points_ns]
    match rate.time.shape:
        case LatencyShape.FIXED:
            return f"`{rate.kind.value}: {times[0]}`"
        case LatencyShape.EXPONENTIAL:
            return f"`{rate.kind.value}: {{{rate.time.shape.value}: {times[0]}}}`"
        case LatencyShape.UNIFORM | LatencyShape.TRIANGULAR:
            return f"`{rate.kind.value}: {{{rate.time.shape.value}: [{', '.join(times)}]}}`"
        case _:
            assert_never(rate.time.shape)
