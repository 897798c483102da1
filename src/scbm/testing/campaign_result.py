"""The result of a campaign, from which all reports about it are made, with its findings.

A finding is one reason for failures with all cases that fail for it, shown by the smallest one.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import LiftedStatuses, Statuses
from scbm.model.visible_text import shown_path
from scbm.testing.batches.campaign_runs import StopRule
from scbm.testing.continuations.unjudged import Unjudged
from scbm.testing.decided_requirements import checked_requirements
from scbm.testing.shrinking.shrinker import Shrinker, UnshrinkableError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from scbm.cases.coverage import AssertionEvidence, Coverage
    from scbm.model import BehaviorModel
    from scbm.testing.campaign import Campaign
    from scbm.testing.decided_requirements import CheckedRequirement, KnownDecision
    from scbm.testing.real_drivers import Answers, ExcludedVariable
    from scbm.testing.shrinking.shrinker import Shrunk
    from scbm.testing.suite import Suite
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


class CampaignResult(Struct, frozen=True):
    """What a campaign showed, and what else is known of its obligations.

    Attributes:
        campaign: the cases that ran, with their coverage.
        suite: the cases of the command line.
        findings: the causes of failures.
        commands: for each finding the command that reproduces it.
        decided: the statuses of the obligations with proofs and waivers; `None` if visits alone decide them.
        evidence: what a store says about asserted obligations; `None` without a store.
        answers: over nodes the replies of each real resource, counted.
        excluded: over nodes the variables of which drivers sent values that the model excludes.
        dry: after how many random cases in a row that visit nothing new the campaign ends; `None` for never.
        ended_early: the number of finished cases in words, if the campaign ended early; else empty.
        where: a description of the nodes that ran the cases; empty for simulation.
        verb: the command without model and options.
        node_options: the options for the same nodes, each with a leading blank; empty for simulation.
        store: the store that the cases were added to; `None` for none.
        groups: the number of cases of each kind in words; if empty, written and random cases are counted.
        decisions: the answers of the last closing about requirements, which the store has.
    """

    campaign: Campaign
    suite: Suite
    findings: tuple[Finding, ...] = ()
    commands: tuple[str, ...] = ()
    decided: Statuses | None = None
    evidence: AssertionEvidence | None = None
    answers: tuple[Answers, ...] = ()
    excluded: tuple[ExcludedVariable, ...] = ()
    dry: int | None = None
    ended_early: str = ""
    where: str = ""
    verb: str = "scbm test"
    node_options: str = ""
    store: Path | None = None
    groups: tuple[str, ...] = ()
    decisions: tuple[KnownDecision, ...] = ()

    @property
    def requirements(self) -> tuple[CheckedRequirement, ...]:
        """What cases and closing say of requirements."""
        unjudged, count = dict(self.campaign.summary.unjudged), self.campaign.count
        of_asked = count, unjudged.get(Unjudged.NO_RUN, 0)
        asked = {str(requirement.sentence): of_asked for requirement in self.suite.requirements}
        return checked_requirements(self.model, self.decisions, count, unjudged, asked)

    @property
    def model(self) -> BehaviorModel:
        """The model under test."""
        return self.campaign.model

    @property
    def coverage(self) -> Coverage:
        """The coverage of the cases."""
        return self.campaign.coverage

    @property
    def statuses(self) -> Statuses:
        """The statuses of the obligations."""
        return self.decided or Statuses.of(self.campaign.coverage, forced=self.campaign.forced)

    @property
    def lifted(self) -> LiftedStatuses | None:
        """The statuses of the lifted obligations; `None` if the model has none."""
        return LiftedStatuses.of(self.campaign.model, self.statuses)

    @property
    def random_reached(self) -> int:
        """The number of random cases that reached their goal."""
        return self.campaign.reached_from(self.campaign.count - self.campaign.drawn + 1)

    @property
    def is_dry(self) -> bool:
        """Whether the last random cases visited nothing new."""
        return self.dry is not None and StopRule(dry=self.dry).end(self.campaign.summary) is not None

    @property
    def mutate_command(self) -> str:
        """The command that finds what the cases assert, and keeps it in the store."""
        store = "" if self.store is None else f" --store {shown_path(str(self.store))}"
        return f"scbm mutate {shown_path(str(self.suite.file))}{self.suite.test_options}{store}"
