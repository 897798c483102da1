"""Results of campaigns, made by hand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.model import BehaviorModel
from scbm.testing import Campaign, CampaignResult, CaseResult, RandomCases, Tester
from scbm.testing.suite import Suite


def suite_of(model: BehaviorModel, file: str = "cell.yaml", random: int = 0, **options: Any) -> Suite:  # noqa: ANN401
    return Suite(model, Path(file), random=random, seed=1, numbers=range(1, random + 1), **options)


def drawn_campaign(model: BehaviorModel, results: Sequence[CaseResult], drawn: int) -> Campaign:
    """The last cases of the campaign count as drawn."""
    campaign = Campaign.of(model, results)
    return replace(campaign, summary=replace(campaign.summary, written=len(results) - drawn))


def visiting(model: BehaviorModel, visited: Iterable[str], file: str = "cell.yaml") -> CampaignResult:
    """The result of one case that visits these obligations."""
    obligations, names = Obligations.of(model), list(visited)
    bits = sum(bit for each in obligations if str(each) in names and (bit := obligations.bit(each)))
    run = Tester(model).execute(RandomCases(model).case(1, 1)).result
    return CampaignResult(Campaign.of(model, [replace(run, visited=bits)]), suite_of(model, file))
