"""The cases that failed: of the suite that was closed, and of those that closing made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.closing.decisions import Closing
    from scbm.testing import Campaign


@dataclass(frozen=True, slots=True)
class FailedCase:
    """A case that failed.

    Attributes:
        name: of the case.
        failures: why, a sentence each.
        again: the command that shows it again.
    """

    name: str
    failures: tuple[str, ...]
    again: str


def failed_cases(suite: Campaign, closing: Closing, again: Callable[[str], str]) -> tuple[FailedCase, ...]:
    """The failed cases, those of the suite first; `again` says for a name the command that shows that case again."""
    verdicts = [(result.case.name, result.verdict) for result in suite.results]
    verdicts += [(made.case.name, made.execution.verdict) for made in closing.cases]
    return tuple(
        FailedCase(name, tuple(str(failure) for failure in verdict.failures), again(name))
        for name, verdict in verdicts
        if not verdict.passed
    )
