"""Campaigns: what is kept of each case, and that a case alone decides its run."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.trace import write_trace
from scbm.files import load_model
from scbm.reports import coverage_report, failure_lines, timeline
from scbm.reports.run.mcap_trace import write_mcap
from scbm.reports.run.perfetto import write_perfetto
from scbm.testing import (
    Campaign,
    CampaignResult,
    FailureKind,
    RandomCases,
    Shrinker,
    Tester,
    campaign_json,
    find_causes,
)
from support.campaigns import drawn_campaign, suite_of
from support.wording import Wording

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["before", "after"])
def test_a_case_replays_to_the_same_trace_byte_for_byte(name: str) -> None:
    model = load_model(EXAMPLE / f"{name}.yaml")
    for case in RandomCases(model).first(15, seed=2):
        first = Tester(model).execute(case)
        assert first.reactions
        again = Tester(model).execute(replace(first.closed_case, origin=None))
        assert write_trace(again.trace) == write_trace(first.trace)
        assert (again.reactions, again.verdict, again.visited) == (first.reactions, first.verdict, first.visited)
        assert first.recorded_case.recorded == again.recorded


@pytest.mark.longer
def test_results_do_not_depend_on_the_order_of_the_cases() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    cases = list(RandomCases(model).first(12, seed=7))
    forwards, backwards = list(Tester(model).results(cases)), list(Tester(model).results(cases[::-1]))
    assert forwards == backwards[::-1]


def test_two_halves_add_up_to_the_whole() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    results = list(Tester(model).results(RandomCases(model).first(20, seed=1)))
    whole = Campaign.of(model, results)
    halves = Campaign.of(model, results[:10]).coverage + Campaign.of(model, results[10:]).coverage
    assert halves == whole.coverage
    assert campaign_json(CampaignResult(whole, suite_of(model)))["coverage"]["visited"] == halves.figure.visited


def test_cases_that_were_lost_count_as_failed_and_are_one_finding() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    tester = Tester(model)
    one, two, three, four = RandomCases(model).first(4, seed=1)
    done = [
        tester.execute(one),
        tester.lost(two, "the controller was lost"),
        tester.lost(three, "no node of resources is there"),
        tester.execute(four),
    ]
    campaign = Campaign.of(model, [execution.result for execution in done])
    without = Campaign.of(model, [done[0].result, done[3].result])
    assert [result.case for result in campaign.failed] == [two, three]
    assert campaign.coverage.visited == without.coverage.visited
    (finding,) = find_causes(tester, campaign)
    assert (finding.names, finding.count) == ((two.name, three.name), 2)
    assert (finding.failure.kind, finding.shrunk) == (FailureKind.LOST, None)


def test_a_lost_case_is_shown_by_every_report_of_a_campaign(wording: Wording) -> None:
    model = load_model(EXAMPLE / "before.yaml")
    tester = Tester(model)
    one, two = RandomCases(model).first(2, seed=1)
    ran = [tester.execute(one).result, tester.lost(two, "the controller was lost").result]
    campaign = drawn_campaign(model, ran, 2)
    findings = find_causes(tester, campaign)
    result = CampaignResult(campaign, suite_of(model, random=2), findings=findings, commands=("scbm test …",))
    document = campaign_json(result)
    assert document["passed"] is False
    lost = document["cases"][1]
    assert (lost["verdict"], lost["passed"], lost["requests"], lost["visited"]) == ("lost", False, 0, [])
    (failure,) = lost["failures"]
    assert failure == str(findings[0].failure)
    (finding,) = document["findings"]
    assert (finding["kind"], finding["again"], finding["smallest"]) == ("lost", "scbm test …", None)
    report = [str(line) for line in coverage_report(result)]
    place = report.index("    again: scbm test …")
    wording([report[2], *report[place - 1 : place + 1]])
    assert not any("smallest" in line for line in report)


def test_a_lost_case_cannot_be_shrunk(wording: Wording) -> None:
    model = load_model(EXAMPLE / "before.yaml")
    lost = Tester(model).lost(RandomCases(model).case(1, 1), "the controller was lost")
    with wording.raises(ValueError):
        Shrinker(Tester(model)).shrink(lost, lost.verdict.failures[0])


def test_a_lost_case_is_drawn_as_a_run_in_which_nothing_happened(wording: Wording) -> None:
    model = load_model(EXAMPLE / "before.yaml")
    lost = Tester(model).lost(RandomCases(model).case(1, 1), "the controller was lost")
    (failure,) = lost.verdict.failures
    wording(str(line) for line in timeline(model, lost, every=False))
    assert [str(line) for line in failure_lines(model, lost)] == [str(failure)]
    for write in (write_perfetto, write_mcap):
        stream = BytesIO()
        write(model, lost, stream)
        assert str(failure).encode() in stream.getvalue()
