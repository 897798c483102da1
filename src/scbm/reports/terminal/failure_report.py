"""Why one run failed, for people: each reason, and the part of the run that shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from scbm.reports.terminal.timeline import stretch
from scbm.testing import FailureKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.testing import Execution, Failure

_FEWEST_LINES = 12
"""So many lines are shown if there are so many, for what led to it."""

_MAX_LINES = 40
"""So many at most; of a longer stretch the last ones."""

_TIME_WIDTH = 11
"""The columns of the time in a timeline; they are blank where it is that of the line before."""


def told_failures(model: BehaviorModel, execution: Execution) -> Iterator[Text]:
    """The reasons why a run failed; beneath them the parts of the run that show them."""
    failures = execution.verdict.failures
    for failure in failures:
        yield Text(str(failure), style="red")
    yield from lines_that_show(model, execution, failures)


def lines_that_show(model: BehaviorModel, execution: Execution, failures: Sequence[Failure]) -> Iterator[Text]:
    """The parts of a run that show some of its failures, and a little of what led to them."""
    windows = sorted(_window(model, execution, failure) for failure in failures)
    lines = list(stretch(model, execution, 0, len(execution.trace.records)))
    shown = 0
    for first, end in windows:
        if first > shown:
            yield Text("…".rjust(_TIME_WIDTH + 3), style="dim")
        begin = max(first, shown)
        for number in range(begin, end):
            yield _timed(lines, number) if number == begin > shown else lines[number]
        shown = max(shown, end)


def _window(model: BehaviorModel, execution: Execution, failure: Failure) -> tuple[int, int]:
    """The lines of the timeline that show a failure, and some that led to it."""
    begin, end = _extent(execution, failure)
    count = len(list(stretch(model, execution, 0, end)))
    own = len(list(stretch(model, execution, begin, end)))
    return max(0, count - min(max(_FEWEST_LINES, own), _MAX_LINES)), count


def _extent(execution: Execution, failure: Failure) -> tuple[int, int]:
    """The records that show a failure: the stretch of a violation, else the end of the run."""
    if failure.kind is FailureKind.REQUIREMENT:
        for violation in execution.violations:
            if violation.requirement == failure.subject:
                return violation.begins, violation.record + 1
    return len(execution.trace.records), len(execution.trace.records)


def _timed(lines: list[Text], number: int) -> Text:
    """A line with its time, also where that is the time of a line above."""
    times = [line[:_TIME_WIDTH] for line in lines[: number + 1] if line.plain[:_TIME_WIDTH].strip()]
    return times[-1] + lines[number][_TIME_WIDTH:]
