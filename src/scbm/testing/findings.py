"""The findings of a campaign: all cases that fail for one reason, shown by the smallest one."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.testing.shrinking.shrinker import Shrinker, UnshrinkableError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.testing.campaign import Campaign
    from scbm.testing.shrinking.shrinker import Shrunk
    from scbm.testing.tester import Tester
    from scbm.testing.verdicts import Failure

_MAX_OF_A_NAME = 80
"""Maximum number of characters of a cause in the name of a small case, which is a file name too."""

MAX_SHRUNK = 5
"""Maximum number of findings that are shrunk; repair these first."""


class Finding(Struct, frozen=True):
    """One reason for failures with its cases; or all unmet expectations of one case.

    Attributes:
        failures: the reason, as the first case has it; or what the case expected.
        names: the first cases, in the order of the campaign; see `FailureCause.positions`.
        count: how many cases there are.
        shrunk: a small case that fails for the same reason, if one was looked for. Findings whose small cases are equal
            but for their names have the one of the first of them.
    """

    failures: tuple[Failure, ...]
    names: tuple[str, ...]
    count: int
    shrunk: Shrunk | None = None

    @property
    def failure(self) -> Failure:
        """The reason, or the first unmet expectation."""
        return self.failures[0]


def find_causes(tester: Tester, campaign: Campaign, most_shrunk: int = MAX_SHRUNK) -> tuple[Finding, ...]:
    """Return the findings of a campaign in the order of their first cases; at most `most_shrunk` are shrunk."""
    shrinker = Shrinker(tester)
    shrunk = 0
    findings: list[Finding] = []
    for cause in campaign.summary.causes:
        finding = Finding(cause.failures, tuple(map(campaign.source.name, cause.positions)), cause.count)
        small = None
        if Shrinker.can_shrink(finding.failure) and shrunk < most_shrunk:
            shrunk += 1
            name = f"{campaign.model.name[:_MAX_OF_A_NAME]}-{finding.failure.subject[:_MAX_OF_A_NAME]}-{shrunk}"
            first = tester.execute(campaign.source.case(cause.positions[0]))
            with suppress(UnshrinkableError):
                small = _shared(shrinker.shrink(first, finding.failure, name), findings)
        findings.append(replace(finding, shrunk=small))
    return tuple(findings)


def _shared(small: Shrunk, findings: Sequence[Finding]) -> Shrunk:
    """Return the result of shrinking with the run of an earlier finding, if its case is equal but for the name."""
    case = small.execution.case
    runs = (each.shrunk.execution for each in findings if each.shrunk is not None)
    known = next((run for run in runs if replace(run.case, name=case.name) == case), None)
    return small if known is None else replace(small, execution=known)
