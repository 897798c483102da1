"""The report of a campaign fits its width, whatever the names in the model are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from scbm.cases.coverage import Aspect, Statuses, WaiverReview
from scbm.cli.output.terminal import folded
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, Waiver
from scbm.reports import coverage_report
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.figure_table import missed_table
from scbm.reports.missed_reasons import missed_reasons
from scbm.testing import Campaign, CampaignResult, RandomCases, Tester
from support.campaigns import drawn_campaign, suite_of
from support.wording import Wording

ROOT = Path(__file__).parents[3]
BEFORE = "examples/robot_in_the_air/before.yaml"
SMALL = """
behavior_model: small
variables:
  at: {domain: [home, away], initial: home}
  light: {domain: bool, initial: false, random: any}
operations:
  %s:
    deadline: 5 s
    pre: {g: at == home}
    post: {g: "true", a: [at <- away]}
  back:
    pre: {g: at == away}
    post: {g: "true", a: [at <- home]}
goals:
  leave: at == away
"""


def _report(
    model: BehaviorModel,
    columns: int,
    cases: int = 2,
    drawn: int | None = None,
    file: str = BEFORE,
    **suite: Any,  # noqa: ANN401 - further parts of a suite
) -> list[str]:
    random = cases if drawn is None else drawn
    campaign = drawn_campaign(model, list(Tester(model).results(RandomCases(model).first(cases, 1))), random)
    result = CampaignResult(campaign, suite_of(model, file, random, **suite))
    return [part.plain for line in coverage_report(result, columns) for part in folded(line, columns)]


def test_the_mark_of_undecided_obligations_stands_in_the_title_only_if_it_occurs() -> None:
    model = read_model(SMALL % "go")
    campaign = Campaign.of(model, Tester(model).results(RandomCases(model).first(2, 1)))
    missed = campaign.coverage.missed() + campaign.coverage.missed(Aspect.QUEUED)
    for waived in ((), missed):
        waivers = [Waiver(str(each), "spare", "Ada", "2026-01-01") for each in waived]
        review = WaiverReview.on("2026-01-02", waivers)
        statuses = Statuses.of(campaign.coverage, waivers=review)
        _, title, *rows = [line.plain for line in missed_table(model, statuses)]
        assert title.startswith("Missed (○)") is not bool(waived)
        assert any("○" in row for row in rows) is not bool(waived)


@pytest.mark.parametrize("columns", [80, 60])
def test_a_report_fits_its_width_but_for_commands(columns: int) -> None:
    lines = _report(load_model(ROOT / BEFORE), columns, 20)
    assert [line for line in lines if len(line) > max(columns, 80)] == []
    assert [line for line in lines if len(line) > columns and not line.startswith("  scbm ")] == []
    assert any(line.startswith("Missed (○)") for line in lines)


@pytest.mark.parametrize("length", [5, 40, 70])
@pytest.mark.parametrize("columns", [60, 80, 120])
def test_names_of_any_length_are_shown_whole(columns: int, length: int) -> None:
    name = "n" * length
    lines = _report(read_model(SMALL % name), columns)
    (row,) = [number for number, line in enumerate(lines) if line.startswith(f"  op: {name}")]
    marks = lines[row].removeprefix(f"  op: {name}").strip() or lines[row + 1]
    assert len(marks.split()) == 6
    assert max(len(line) for line in lines if not line.startswith(("  scbm ", "  op: "))) <= columns


@pytest.mark.parametrize(
    ("guard", "advice"),
    [
        ("true", "complete as soon as they start"),
        ("at == away", "complete as soon as they start"),
        ("at == home", "they have no `deadline`"),
    ],
)
def test_operations_without_a_deadline_do_not_time_out_by_chance(guard: str, advice: str) -> None:
    back = f'post: {{g: "{guard}", a: [at <- home]}}'
    model = read_model((SMALL % "go").replace('post: {g: "true", a: [at <- home]}', back))
    lines = _report(model, 80, network=None)
    assert [line.split(maxsplit=2)[:2] for line in lines if " timedout " in line and line.startswith("   ")] == [
        ["1", "timedout"],
        ["1", "timedout"],
    ]
    assert any(advice in line for line in lines)


@pytest.mark.parametrize("cases", [2, 20])
def test_after_few_cases_the_first_advice_is_to_run_more(cases: int, wording: Wording) -> None:
    lines = _report(read_model(SMALL % "go"), 80, cases)
    (advice,) = [line for line in lines if line.strip().startswith("1 queued")]
    wording(advice)


@pytest.mark.parametrize("cases", [1, 19, 20])
def test_the_first_advice_depends_on_the_number_of_all_cases_written_or_random(cases: int) -> None:
    model = read_model(SMALL % "go")

    def advice(drawn: int) -> str:
        return next(line for line in _report(model, 80, cases, drawn) if line.strip().startswith("1 queued"))

    assert advice(0) == advice(cases // 2) == advice(cases)


@pytest.mark.parametrize("cases", [1, 20])
def test_both_reports_ask_for_more_cases_after_the_same_number_of_cases(cases: int) -> None:
    model = read_model(SMALL % "go")
    campaign = Campaign.of(model, Tester(model).results(RandomCases(model).first(cases, 1)))
    reason = missed_reasons(CampaignResult(campaign, suite_of(model)), BEFORE, CampaignKind())[-1].reason
    advice = next(line for line in _report(model, 80, cases, 0) if line.strip().startswith("1 queued"))
    assert ("more cases" in reason) == ("more cases" in advice) == (cases == 1)


def test_a_suggested_command_quotes_the_path_of_the_model() -> None:
    lines = _report(read_model(SMALL % "go"), 80, file="my model.yaml")
    assert any(line.startswith("  scbm test 'my model.yaml' --cases") for line in lines)


def test_a_suggested_command_keeps_the_written_cases() -> None:
    lines = _report(read_model(SMALL % "go"), 80, paths=[Path("cases"), Path("more cases")])
    assert any(line.startswith(f"  scbm test {BEFORE} cases 'more cases' --cases") for line in lines)
