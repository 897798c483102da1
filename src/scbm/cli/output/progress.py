"""The progress of a campaign: a bar on a terminal, lines elsewhere if it takes long."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rich.progress import Progress, TaskID

    from scbm.cases.coverage import Obligations
    from scbm.testing import CaseResult
    from scbm.testing.batches.batch_summary import BatchSummary

_SLOW_S = 10.0
"""After this time a campaign over nodes prints a line for each further case."""

_MINUTE_S = 60.0
"""The time between two lines about a simulated campaign."""


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


class MinuteLines:
    """Prints a line each minute, or over nodes one for each case once ten seconds have passed."""

    def __init__(
        self,
        count: int,
        obligations: Obligations,
        show: Callable[[str], None],
        now_s: Callable[[], float] = monotonic,
        *,
        each_case: bool = False,
    ) -> None:
        """Start the clock of the lines.

        Args:
            count: the number of cases.
            obligations: those of the model.
            show: prints a line.
            now_s: a clock.
            each_case: whether each case gets a line.
        """
        self._count = count
        self._obligations = obligations
        self._show = show
        self._now_s = now_s
        self._each_case = each_case
        self._begun_s = now_s()
        self._due_s = self._begun_s + _MINUTE_S

    def begin(self, name: str) -> None:
        """Do nothing: a line is about cases that have finished."""

    def advance(self, total: BatchSummary, last: CaseResult | None) -> None:
        """Print a line if it is time for one."""
        now_s = self._now_s()
        if self._each_case and last is not None:
            if now_s - self._begun_s >= _SLOW_S:
                self._show(f"{total.count} of {self._count}: {last.case.name} {_ended(last)}")
        elif now_s >= self._due_s:
            figure = self._obligations.figure(total.visited)
            self._show(f"{total.count} of {self._count} cases, {total.failed} failed, {figure}")
            self._due_s += _MINUTE_S * (1 + (now_s - self._due_s) // _MINUTE_S)


def _ended(result: CaseResult) -> str:
    verdict = result.verdict
    return str(verdict.end) if verdict.passed else f"{verdict.end}, failed: {verdict.failures[0].message}"
