"""The progress of a campaign: a bar on a terminal, lines elsewhere if it takes long."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING, Protocol

from scbm.closing.counted_activity import CountedActivity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rich.progress import Progress, TaskID

    from scbm.cases.coverage import Obligations
    from scbm.testing import CaseResult
    from scbm.testing.batches.batch_summary import BatchSummary

_INTERVAL_S = 10.0
"""The time between two lines about work where no terminal shows it: CI systems end jobs that are silent for minutes."""

_MINUTE_S, _MINUTES_FROM_S = 60.0, 120.0
"""A minute, and the time from which lines name minutes."""


class CampaignProgress(Protocol):
    """Shows how far a campaign is."""

    def begin(self, name: str) -> None:
        """Show the name of the case that runs now."""
        ...

    def advance(self, total: BatchSummary, last: CaseResult | None) -> None:
        """Show the sum of all cases so far; `last` is the last of them where cases run one by one."""
        ...


class _Bar:
    """A bar on a terminal with the number of failures and the figure."""

    def __init__(self, progress: Progress, task: TaskID, obligations: Obligations) -> None:
        self._progress = progress
        self._task = task
        self._obligations = obligations

    def begin(self, name: str) -> None:
        """Show the name of the case that runs now."""
        self._progress.update(self._task, description=name)

    def advance(self, total: BatchSummary, last: CaseResult | None) -> None:
        """Show the sum of all cases so far."""
        del last
        state = f"{total.failed} failed, {self._obligations.figure(total.visited)}"
        self._progress.update(self._task, completed=total.count, state=state)


@contextmanager
def bar(count: int, obligations: Obligations) -> Iterator[CampaignProgress]:
    """Show a bar while a campaign of `count` cases runs."""
    from rich.console import Console  # noqa: PLC0415 - only where there is something to show
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn  # noqa: PLC0415

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[state]}", markup=False),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(file=sys.stderr), transient=True) as progress:
        yield _Bar(progress, progress.add_task("cases", total=count, state=""), obligations)


def time_in_words(seconds: float) -> str:
    """Return a duration, such as `30 s` or `3 min`."""
    return f"{seconds:.0f} s" if seconds < _MINUTES_FROM_S else f"{seconds / _MINUTE_S:.0f} min"


class LineClock:
    """Says when a line about work is due: first after ten seconds, then at most every ten seconds."""

    def __init__(self, now_s: Callable[[], float] = monotonic) -> None:
        """Start the clock."""
        self._now_s = now_s
        self._begun_s = now_s()
        self._due_s = _INTERVAL_S

    def is_slow(self) -> bool:
        """Return whether the work takes ten seconds already."""
        return self._now_s() - self._begun_s >= _INTERVAL_S

    def due(self) -> str:
        """Return the time so far, such as `30 s`, if a line is due; empty if not."""
        elapsed_s = self._now_s() - self._begun_s
        if elapsed_s < self._due_s:
            return ""
        self._due_s = elapsed_s + _INTERVAL_S
        return time_in_words(elapsed_s)


class RemainingTime:
    """Estimates how long an activity takes at most: what is left of it at its rate so far."""

    def __init__(self, now_s: Callable[[], float] = monotonic) -> None:
        """Take the time from a clock."""
        self._now_s = now_s
        self._name = ""
        self._begun_s = 0.0
        self._begun_at = 0

    def of(self, text: str) -> str:
        """Return `at most 30 s more for this`; empty for an activity without a limit, and at its beginning."""
        if not isinstance(text, CountedActivity):
            return ""
        now_s = self._now_s()
        if text.name != self._name or text.done < self._begun_at:
            self._name, self._begun_s, self._begun_at = text.name, now_s, text.done
        done, elapsed_s = text.done - self._begun_at, now_s - self._begun_s
        if not done or not elapsed_s:
            return ""
        return f"at most {time_in_words(elapsed_s * (text.most - text.done) / done)} more for this"


class CampaignLines:
    """Prints a line every ten seconds, or over nodes one for each case once ten seconds have passed."""

    def __init__(
        self,
        count: int,
        obligations: Obligations,
        show: Callable[[str, str], None],
        now_s: Callable[[], float] = monotonic,
        *,
        each_case: bool = False,
    ) -> None:
        """Start the clock of the lines.

        Args:
            count: the number of cases.
            obligations: those of the model.
            show: prints a line, and the time so far unless it is empty.
            now_s: a clock.
            each_case: whether each case gets a line.
        """
        self._count = count
        self._obligations = obligations
        self._show = show
        self._clock = LineClock(now_s)
        self._each_case = each_case

    def begin(self, name: str) -> None:
        """Do nothing: a line is about cases that have finished."""

    def advance(self, total: BatchSummary, last: CaseResult | None) -> None:
        """Print a line if it is time for one."""
        if self._each_case and last is not None:
            if self._clock.is_slow():
                self._show(f"{total.count} of {self._count}: {last.case.name} {_ended(last)}", "")
        elif elapsed := self._clock.due():
            figure = self._obligations.figure(total.visited)
            self._show(f"{total.count} of {self._count} cases, {total.failed} failed, {figure}", elapsed)


def _ended(result: CaseResult) -> str:
    verdict = result.verdict
    return str(verdict.end) if verdict.passed else f"{verdict.end}, failed: {verdict.failures[0].message}"
