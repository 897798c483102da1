"""The findings of a campaign: all cases that fail for one reason, shown by the smallest one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from scbm.testing.shrinking import Shrinker
from scbm.testing.verdicts import FailureKind

if TYPE_CHECKING:
    from scbm.testing.campaign import Campaign, CaseResult
    from scbm.testing.shrinking import Shrunk
    from scbm.testing.tester import Tester
    from scbm.testing.verdicts import Failure

_MAX_OF_A_NAME = 80
"""So much of a name stands in that of a small case, as that is the name of a file too."""

MAX_SHRUNK = 5
"""So many findings are made small; a model with more has first of all these."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One reason for failures with its cases; or all unmet expectations of one case.

    Attributes:
        failures: the reason, as the first case has it; or what the case expected.
        results: the cases, in the order of the campaign.
        shrunk: a small case that fails for the same reason, if one was looked for.
    """

    failures: tuple[Failure, ...]
    results: tuple[CaseResult, ...]
    shrunk: Shrunk | None = None

    @property
    def failure(self) -> Failure:
        """The reason, or the first unmet expectation."""
        return self.failures[0]


def find_causes(tester: Tester, campaign: Campaign, most_shrunk: int = MAX_SHRUNK) -> tuple[Finding, ...]:
    """Return the findings of a campaign in the order of their first cases; at most `most_shrunk` are shrunk."""
    shrinker = Shrinker(tester)
    shrunk = 0
    findings = []
    for finding in _grouped(campaign):
        small = None
        if Shrinker.can_shrink(finding.failure) and shrunk < most_shrunk:
            shrunk += 1
            name = f"{campaign.model.name[:_MAX_OF_A_NAME]}-{finding.failure.subject[:_MAX_OF_A_NAME]}-{shrunk}"
            small = shrinker.shrink(tester.execute(finding.results[0].case), finding.failure, name)
        findings.append(replace(finding, shrunk=small))
    return tuple(findings)


def _grouped(campaign: Campaign) -> list[Finding]:
    """Group failed cases by reason; the expectations of a case are a reason of their own."""
    findings: list[Finding] = []
    for result in campaign.failed:
        expected = []
        for failure in result.verdict.failures:
            if failure.kind is not FailureKind.EXPECTATION:
                _add(findings, failure, result)
            else:
                expected.append(failure)
        if expected:
            findings.append(Finding(tuple(expected), (result,)))
    return findings


def _add(findings: list[Finding], failure: Failure, result: CaseResult) -> None:
    for index, known in enumerate(findings):
        if known.failure.is_like(failure):
            findings[index] = replace(known, results=(*known.results, result))
            return
    findings.append(Finding((failure,), (result,)))
