"""Why one run failed, for people: each reason, and the part of the run that shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from scbm.reports.run.event_lines import event_lines
from scbm.reports.terminal.timeline import TIME_WIDTH, draw_line
from scbm.testing import FailureKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.reports.run.event_lines import EventLine
    from scbm.testing import Execution, Failure

_FEWEST_LINES = 12
"""So many lines are shown if there are so many, for what led to it."""

_MAX_LINES = 40
"""So many at most; of a longer stretch the last ones."""


def told_failures(model: BehaviorModel, execution: Execution) -> Iterator[Text]:
    """The reasons why a run failed; beneath them the parts of the run that show them."""
    failures = execution.verdict.failures
    for failure in failures:
        yield Text(str(failure), style="red")
    yield from lines_that_show(model, execution, failures)


def lines_that_show(model: BehaviorModel, execution: Execution, failures: Sequence[Failure]) -> Iterator[Text]:
    """Yield the parts of a run's log that show some of its failures, and a few lines before each part."""
    lines = list(event_lines(model, execution))
    windows = sorted(_window(lines, _extent(execution, failure)) for failure in failures)
    shown = 0
    for first, end in windows:
        if first > shown:
            yield Text("…".rjust(TIME_WIDTH + 3), style="dim")
        begin = max(first, shown)
        for number in range(begin, end):
            yield draw_line(lines[number], with_time=number == begin > shown)
        shown = max(shown, end)


def _window(lines: Sequence[EventLine], extent: tuple[int, int]) -> tuple[int, int]:
    """Return the first line of the log that shows the records of an extent, or some lines before it, and the end."""
    begin, end = extent
    count = sum(line.index < end for line in lines)
    own = sum(begin <= line.index < end for line in lines)
    return max(0, count - min(max(_FEWEST_LINES, own), _MAX_LINES)), count


def _extent(execution: Execution, failure: Failure) -> tuple[int, int]:
    """The records that show a failure: the stretch of a violation, else the end of the run."""
    if failure.kind is FailureKind.REQUIREMENT:
        for violation in execution.violations:
            if violation.requirement == failure.subject:
                return violation.begins, violation.record + 1
    return len(execution.trace.records), len(execution.trace.records)
