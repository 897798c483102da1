"""Why one run failed, for people: each reason, and the part of the run that shows it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.reports.timeline import stretch
from scbm.testing import FailureKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel
    from scbm.testing import Execution, Failure

_FEWEST_LINES = 12
"""So many lines are shown if there are so many, for what led to it."""

_MOST_LINES = 40
"""So many at most; of a longer stretch the last ones."""

_TIME_WIDTH = 11
"""The columns of the time in a timeline; they are blank where it is that of the line before."""


def told_failures(model: BehaviorModel, execution: Execution) -> Iterator[Text]:
    """Each reason of a failure; beneath it what shows it, once for reasons in a row that the same shows."""
    failures = execution.verdict.failures
    extents = [_extent(execution, failure) for failure in failures]
    for failure, (extent, following) in zip(failures, pairwise([*extents, None]), strict=True):
        yield Text(str(failure), style="red")
        if extent is not None and extent != following:
            yield from _shown(model, execution, *extent)


def _extent(execution: Execution, failure: Failure) -> tuple[int, int]:
    """The records that show a failure: the stretch of a violation, else the end of the run."""
    if failure.kind is FailureKind.REQUIREMENT:
        for violation in execution.violations:
            if violation.requirement == failure.subject:
                return violation.begins, violation.record + 1
    return len(execution.trace.records), len(execution.trace.records)


def _shown(model: BehaviorModel, execution: Execution, begin: int, end: int) -> Iterator[Text]:
    """A stretch of a run, and before it some of what led to it."""
    lines = list(stretch(model, execution, 0, end))
    count = min(max(_FEWEST_LINES, len(list(stretch(model, execution, begin, end)))), _MOST_LINES)
    first = max(0, len(lines) - count)
    if first:
        yield Text("…".rjust(_TIME_WIDTH + 3), style="dim")
    times = [line[:_TIME_WIDTH] for line in lines[: first + 1] if line.plain[:_TIME_WIDTH].strip()]
    for index, line in enumerate(lines[first:]):
        yield times[-1] + line[_TIME_WIDTH:] if not index and times else line
