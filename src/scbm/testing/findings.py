"""What failed in a campaign: cases that fail for one reason are one finding, shown by its smallest case."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.testing.shrinking import Shrinker

if TYPE_CHECKING:
    from scbm.testing.campaign import Campaign, CaseResult
    from scbm.testing.shrinking import Shrunk
    from scbm.testing.tester import Tester
    from scbm.testing.verdicts import Failure

MOST_SHRUNK = 5
"""So many findings are made small; a model with more has first of all these."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One reason to fail, and the cases that fail for it.

    Attributes:
        failure: the reason, as the first case has it.
        results: the cases, in the order of the campaign.
        shrunk: a small case that fails for the same reason, if one was looked for.
    """

    failure: Failure
    results: tuple[CaseResult, ...]
    shrunk: Shrunk | None = None


def find_causes(tester: Tester, campaign: Campaign, most_shrunk: int = MOST_SHRUNK) -> tuple[Finding, ...]:
    """The findings of a campaign, those first that came first; at most `most_shrunk` of them with a small case."""
    groups: list[tuple[Failure, list[CaseResult]]] = []
    for result in campaign.failed:
        for failure in result.verdict.failures:
            _group(groups, failure).append(result)
    shrinker = Shrinker(tester)
    shrunk = 0
    findings = []
    for failure, results in groups:
        small = None
        if Shrinker.can_shrink(failure) and shrunk < most_shrunk:
            shrunk += 1
            name = f"{campaign.model.name}-{failure.subject}-{shrunk}"
            small = shrinker.shrink(tester.execute(results[0].case), failure, name)
        findings.append(Finding(failure, tuple(results), small))
    return tuple(findings)


def _group(groups: list[tuple[Failure, list[CaseResult]]], failure: Failure) -> list[CaseResult]:
    """The cases that fail for the same reason; what a case expects is a reason of its own."""
    if Shrinker.can_shrink(failure):
        for known, results in groups:
            if known.is_like(failure):
                return results
    groups.append((failure, []))
    return groups[-1][1]
