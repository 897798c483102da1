"""Forecasts: what ten times as many cases visit is within the error of the forecast, as often as it says."""

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce
from pathlib import Path

import pytest

from scbm.cases import Network
from scbm.cases.coverage import Obligations
from scbm.cases.trace import End
from scbm.files import load_model
from scbm.testing import Verdict
from scbm.testing.batches.batch_summary import BatchSummary, CaseOutcome, SummaryBuilder, merge
from scbm.testing.batches.campaign_runs import run_steps
from scbm.testing.batches.campaign_work import CampaignWork
from scbm.testing.batches.forecast import Forecast, forecast
from support.random_models import random_model

EXAMPLES = Path(__file__).parents[4] / "examples/robot_in_the_air"
EXAMPLE = load_model(EXAMPLES / "after.yaml")
OBLIGATIONS = Obligations.of(EXAMPLE)


def summary(visits: list[int]) -> BatchSummary:
    builder = SummaryBuilder(len(OBLIGATIONS.all))
    for position, visited in enumerate(visits, start=1):
        builder.add(CaseOutcome(position, Verdict(End.REACHED), 1, 1, visited, ()))
    return builder.summary()


def test_few_cases_give_no_forecast() -> None:
    assert forecast(summary([1] * 99), OBLIGATIONS) is None
    assert forecast(BatchSummary(), OBLIGATIONS) is None


def test_cases_from_files_give_no_forecast() -> None:
    builder = SummaryBuilder(len(OBLIGATIONS.all), written=1)
    for position in range(1, 200):
        builder.add(CaseOutcome(position, Verdict(End.REACHED), 1, 1, 1, ()))
    assert forecast(builder.summary(), OBLIGATIONS) is None


def test_where_all_cases_visit_the_same_nothing_more_is_expected() -> None:
    found = forecast(summary([0b111] * 100), OBLIGATIONS)
    assert found is not None
    assert found.visited == 3.0
    assert 0 < found.error < 2


def test_a_forecast_never_exceeds_what_there_is() -> None:
    every = OBLIGATIONS.counted
    assert forecast(summary([every] * 100), OBLIGATIONS) == Forecast(1000, 86.0, 0.0)
    visits = [1 << (number % 80) if number < 80 else 0 for number in range(100)]
    found = forecast(summary(visits), OBLIGATIONS)
    assert found is not None
    assert (found.visited, found.error) == (86.0, 6.0)


def pairs(count: int) -> Iterator[tuple[Forecast, int]]:
    """Yield forecasts for models, and how many obligations ten times as many cases do visit."""
    models = [load_model(EXAMPLES / f"{name}.yaml") for name in ("before", "after")]
    for model in (*models, *map(random_model, range(1, count))):
        for network in (Network(), None):
            work = CampaignWork(model, numbers=range(1, 1001), seed=11, network=network)
            steps = [step.batch for step in run_steps(work)]
            obligations = Obligations.of(model)
            first = BatchSummary()
            for step in steps:
                first = merge(first, step) if first.count < 100 else first
            found = forecast(first, obligations)
            assert found is not None
            whole = reduce(merge, steps)
            yield found, obligations.figure(whole.visited).visited


@pytest.mark.slow
def test_ten_times_as_many_cases_visit_what_was_forecast() -> None:
    forecasts = list(pairs(12))
    within = sum(abs(found.visited - visited) <= 2 * found.error + 0.5 for found, visited in forecasts)
    assert within >= 0.85 * len(forecasts)
