"""The result of a campaign, from which all reports about it are made."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import LiftedStatuses, Statuses
from scbm.testing.batches.campaign_runs import StopRule

if TYPE_CHECKING:
    from scbm.cases.coverage import AssertionEvidence
    from scbm.testing.campaign import Campaign
    from scbm.testing.findings import Finding
    from scbm.testing.real_drivers import Answers, ExcludedVariable


class CampaignResult(Struct, frozen=True):
    """What a campaign showed, and what else is known of its obligations.

    Attributes:
        campaign: the cases that ran, with their coverage.
        seed: the seed of the random cases.
        random: the number of random cases that ran; they come last.
        findings: the causes of failures.
        commands: for each finding the command that reproduces it.
        proved: the statuses of the obligations with proofs and waivers; `None` if visits alone decide them.
        evidence: what a store says about asserted obligations; `None` without a store.
        answers: over nodes the replies of each real resource, counted.
        excluded: over nodes the variables of which drivers sent values that the model excludes.
        dry: after how many random cases in a row that visit nothing new the campaign ends; `None` for never.
        ended_early: the number of finished cases in words, if the campaign ended early; else empty.
    """

    campaign: Campaign
    seed: int = 0
    random: int = 0
    findings: tuple[Finding, ...] = ()
    commands: tuple[str, ...] = ()
    proved: Statuses | None = None
    evidence: AssertionEvidence | None = None
    answers: tuple[Answers, ...] = ()
    excluded: tuple[ExcludedVariable, ...] = ()
    dry: int | None = None
    ended_early: str = ""

    @property
    def statuses(self) -> Statuses:
        """The statuses of the obligations."""
        return self.proved or Statuses.of(self.campaign.coverage, forced=self.campaign.forced)

    @property
    def lifted(self) -> LiftedStatuses | None:
        """The statuses of the lifted obligations; `None` if the model has none."""
        return LiftedStatuses.of(self.campaign.model, self.statuses)

    @property
    def random_reached(self) -> int:
        """The number of random cases that reached their goal."""
        return self.campaign.reached_from(self.campaign.count - self.random + 1)

    @property
    def is_dry(self) -> bool:
        """Whether the last random cases visited nothing new."""
        return self.dry is not None and StopRule(dry=self.dry).end(self.campaign.summary) is not None
