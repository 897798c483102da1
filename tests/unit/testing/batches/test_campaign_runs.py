"""Campaigns run in batches: the same sums for every size of batch, and early ends at the same case."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Coverage
from scbm.files import load_model, read_model
from scbm.model import InputError, Slug
from scbm.testing import Campaign, CampaignResult, Tester, campaign_json
from scbm.testing.batches.batch_summary import BatchSummary
from scbm.testing.batches.campaign_runs import BatchPlan, BatchResult, InProcess, StopRule, run_batch, run_steps
from scbm.testing.batches.campaign_work import CampaignWork
from support.campaigns import suite_of
from support.models import scan_cell
from support.profiles import share, slow_beyond

ROOT = Path(__file__).parents[4]
EXAMPLE = load_model(ROOT / "examples/robot_in_the_air/after.yaml")
FAILS = load_model(ROOT / "tests/models/fails_at_run/livelock.yaml")


class OfSize:
    """Runs batches of one size, and counts the cases."""

    def __init__(self, size: int) -> None:
        self._size = size
        self.cases = 0

    def results(self, plan: BatchPlan) -> Generator[BatchResult, None, None]:
        tester = Tester(plan.work.model)
        first = 1
        while first <= plan.work.count:
            request = plan.request(first, self._size)
            result = run_batch(plan.work, tester, request)
            self.cases += result.summary.count
            yield result
            first = request.last + 1


def total(work: CampaignWork, size: int | None, rule: StopRule | None = None) -> BatchSummary:
    executor = InProcess() if size is None else OfSize(size)
    return [step.total for step in run_steps(work, executor, rule or StopRule())][-1]


@pytest.mark.longer
@pytest.mark.parametrize("size", slow_beyond(1, [7, 1, 100]))
def test_the_size_of_batches_does_not_matter(size: int) -> None:
    work = CampaignWork(EXAMPLE, numbers=range(1, 31), seed=3, network=None)
    expected = Campaign.of(EXAMPLE, Tester(EXAMPLE).results(work.cases()))
    campaign = Campaign(EXAMPLE, work, total(work, size))
    expected = replace(expected, summary=replace(expected.summary, written=0))
    made, whole = (CampaignResult(each, suite_of(EXAMPLE, random=30)) for each in (campaign, expected))
    assert campaign_json(made) == campaign_json(whole)
    assert campaign.coverage == expected.coverage
    assert campaign.summary == total(work, None)


def test_the_coverage_of_a_campaign_counts_the_cases_that_it_does_not_list() -> None:
    model = scan_cell()
    work = CampaignWork(model, numbers=range(1, 31))
    coverage = Campaign(model, work, total(work, 7).notable()).coverage
    assert len(coverage.cases) < coverage.count == 30
    each = Coverage(coverage.obligations, tuple((r.case.name, r.visited) for r in Tester(model).results(work.cases())))
    assert (coverage.visits(), coverage.visited, each.count) == (each.visits(), each.visited, 30)


@pytest.mark.parametrize("size", [1, 7, 100])
def test_a_campaign_ends_at_its_first_failure_whatever_the_size_of_batches(size: int) -> None:
    work = CampaignWork(FAILS, numbers=range(1, 41))
    first = total(work, size, StopRule(at_failure=True))
    assert (first.count, first.failed_positions) == (1, (1,))


@pytest.mark.longer
@pytest.mark.parametrize("size", slow_beyond(1, [7, 1, 100]))
def test_a_campaign_is_dry_after_cases_in_a_row_that_visited_nothing_new(size: int) -> None:
    work = CampaignWork(EXAMPLE, numbers=range(1, share(1_000, usual=80) + 1), seed=1)
    all_cases = total(work, 100)
    news = [position for position, _ in all_cases.news]
    ends = total(work, size, StopRule(dry=15))
    expected = next(new + 15 for new, following in zip(news, [*news[1:], 10_000], strict=True) if following - new > 15)
    assert ends.last == expected
    assert ends == total(work, 1, StopRule(dry=15))
    assert total(work, size, StopRule(dry=1_000)) == all_cases


@pytest.mark.slow
def test_case_files_do_not_count_as_dry() -> None:
    drawn = CampaignWork(EXAMPLE, numbers=range(1, 201), seed=1)
    written = tuple(drawn.case(1) for _ in range(50))
    work = CampaignWork(EXAMPLE, written, range(1, 201), 1)
    assert total(work, 100, StopRule(dry=20)).count > 50


def test_an_error_in_drawing_comes_after_the_cases_before_it() -> None:
    text = (ROOT / "examples/robot_in_the_air/after.yaml").read_text(encoding="utf-8")
    without_goals = read_model(text[: text.index("\ngoals:")] + "\n")
    case = CampaignWork(EXAMPLE, numbers=[1]).case(1)
    work = CampaignWork(without_goals, (case,), range(1, 3))
    steps = run_steps(work, OfSize(10))
    assert next(steps).total.count == 1
    with pytest.raises(InputError) as raised:
        next(steps)
    assert [error.slug for error in raised.value.diagnostics] == [Slug.NO_GOALS]
