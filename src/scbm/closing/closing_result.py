"""What a command that closes a model came to: the closing, the cases before it, the written files, and commands.

All reports about it are made from this record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.closing.decisions import consequences_of_force, failed_cases, found_faults
from scbm.model.visible_text import shell_word, shown_path
from scbm.testing import Campaign, CampaignResult, Tester, find_causes
from scbm.testing.batches.batch_summary import SummaryBuilder, merge
from scbm.testing.batches.campaign_work import FollowedBy

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from scbm.closing.closing_files import ClosingFiles
    from scbm.closing.decisions import Closing, Consequence, FailedCase, FoundFault
    from scbm.testing.suite import Suite


class ClosingResult(Struct, frozen=True):
    """The result of `scbm close`.

    Attributes:
        closing: the decisions about all obligations.
        suite: the cases of the command line.
        campaign: their results, before new cases.
        options: the options that repeat this closing, in addition to those of the suite, each with a leading blank.
        waivers: the waivers file; `None` without one.
        output: the written cases and certificates; `None` if nothing was written.
        written: the goals that were written into the model before it was closed, each with its predicate.
        already: the goals that were to be written, but are in the model already.
    """

    closing: Closing
    suite: Suite
    campaign: Campaign
    options: str = ""
    waivers: Path | None = None
    output: ClosingFiles | None = None
    written: Mapping[str, str] = field(default_factory=dict)
    already: Mapping[str, str] = field(default_factory=dict)

    @property
    def failed(self) -> tuple[FailedCase, ...]:
        """The cases that failed, each with the command that reproduces it."""
        return failed_cases(self.campaign, self.closing, self._again)

    @property
    def found(self) -> tuple[FoundFault, ...]:
        """The faults that new cases found, each with the command that reproduces it."""
        return found_faults(self.closing, self._new)

    @property
    def consequences(self) -> tuple[Consequence, ...]:
        """The failures that occur in forced states of new cases, each with the command that reproduces it."""
        return consequences_of_force(self.closing, self._again)

    @property
    def with_new_cases(self) -> CampaignResult:
        """The result of the cases of the suite and of the new cases that follow them."""
        campaign = self._whole_campaign
        findings = find_causes(Tester(campaign.model), campaign, 0)
        commands = (self._again(finding.names[0]) for finding in findings)
        return CampaignResult(campaign, self.suite, findings, tuple(commands))

    @property
    def _whole_campaign(self) -> Campaign:
        suite = self.campaign
        made_cases = (*self.closing.cases, *self.closing.counterexamples)
        new = Campaign.of(suite.model, [replace(made.execution.result, verdict=made.verdict) for made in made_cases])
        if not suite.count:
            return new
        shifted = SummaryBuilder(len(suite.coverage.obligations.all), suite.summary.written, suite.count + 1)
        for position, result in enumerate(new.results, start=suite.count + 1):
            shifted.add(result.outcome(position))
        source = FollowedBy(suite.source, suite.count, new.source)
        return Campaign(suite.model, source, merge(suite.summary, shifted.summary()))

    @property
    def close_command(self) -> str:
        """The command that closes the model again, without what it writes."""
        return f"scbm close {shown_path(str(self.suite.file))}{self.suite.close_options}{self.options}{self.waived}"

    @property
    def waived(self) -> str:
        """The option for the waivers file, with a leading blank; empty without one."""
        return "" if self.waivers is None else f" --waivers {shell_word(str(self.waivers))}"

    def _again(self, name: str) -> str:
        """Return the command that reproduces the run of a case."""
        return self.suite.again(name) or self._new(name)

    def _new(self, name: str) -> str:
        if self.output is not None:
            return f"scbm replay {shown_path(str(self.output.cases[name]))}"
        return f"{self.close_command} --out closed; scbm replay {shown_path(f'closed/cases/{name}.yaml')}"
