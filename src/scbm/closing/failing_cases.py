"""The cases that show a fault: failed cases, and new cases that end as no run of a correct model does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cases.trace import End, run_end
from scbm.running import describe_cycle

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.closing.decisions import Closing
    from scbm.testing import Campaign, Execution


@dataclass(frozen=True, slots=True)
class FailedCase:
    """A case that failed.

    Attributes:
        name: the name of the case.
        failures: one sentence for each reason.
        again: the command that reproduces the failure.
    """

    name: str
    failures: tuple[str, ...]
    again: str


def failed_cases(suite: Campaign, closing: Closing, again: Callable[[str], str]) -> tuple[FailedCase, ...]:
    """Return the failed cases, those of the suite first; `again` returns the command that runs a case, by its name."""
    verdicts = [(result.case.name, result.verdict) for result in suite.results]
    verdicts += [(made.case.name, made.execution.verdict) for made in closing.cases]
    return tuple(
        FailedCase(name, tuple(str(failure) for failure in verdict.failures), again(name))
        for name, verdict in verdicts
        if not verdict.passed
    )


@dataclass(frozen=True, slots=True)
class FoundFault:
    """A new case that passes, because it expects its end, but ends as no run of a correct model does.

    Attributes:
        name: the name of the case.
        end: the end of its run.
        message: the fault, as what the case does.
        again: the command that reproduces it.
    """

    name: str
    end: End
    message: str
    again: str


def found_faults(closing: Closing, again: Callable[[str], str]) -> tuple[FoundFault, ...]:
    """Return the faults that new cases found; `again` as in `failed_cases`."""
    ends = [(made.case.name, made.execution.verdict.end, made.execution) for made in closing.cases]
    return tuple(
        FoundFault(name, end, _end_sentence(end, execution), again(name))
        for name, end, execution in ends
        if end in (End.LIVELOCK, End.MODEL_ERROR, End.TIME_LIMIT)
    )


def _end_sentence(end: End, execution: Execution) -> str:
    if end is End.TIME_LIMIT:
        return "ends at the time limit: neither is the goal reached nor is the run given up before"
    last = run_end(execution.trace.records)
    detail = () if last is None else last.detail
    if end is End.LIVELOCK:
        return f"ends in a livelock: {describe_cycle(detail)}"
    return f"ends in an error of the model: {', '.join(detail)}"
