"""Each report that counts cases names the hazards at devices (semantics 7.14)."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import pytest
from msgspec.structs import replace

from scbm.reports.ci.history_json import history_json
from scbm.reports.ci.junit import junit_xml
from scbm.reports.ci.markdown import markdown
from scbm.reports.ci.sarif import sarif_log
from scbm.reports.html import html_report
from scbm.reports.terminal.store_report import stored_report
from scbm.running.simulation.device_hazards import Hazard, HazardKind
from scbm.store import History, read_history
from support.histories import EXAMPLE, history_of
from support.models import DRIVE
from support.wording import Wording

S = 1_000_000_000
NAME = "one_request_at_a_time"
UNAWAITED = Hazard(HazardKind.UNAWAITED, "gantry", 1, 5 * S, 20 * S)
OVERLAP = Hazard(HazardKind.OVERLAP, "gantry", 2, 7 * S, None, 1)


class Ran(Protocol):
    code: int
    out: str


Scbm = Callable[..., Ran]


def history_with(*hazards: Hazard) -> History:
    """Return a history of three cases, of which the second has hazards."""
    found = history_of(EXAMPLE / "after.yaml", 3)
    first, second, third = found.cases
    return replace(found, cases=(first, replace(second, hazards=hazards), third))


def lines_of(text: str, *hazards: Hazard) -> list[str]:
    return [line for line in text.splitlines() if "azards at devices" in line or any(str(h) in line for h in hazards)]


def test_the_terminal_has_a_line_for_each_of_the_first_ten(wording: Wording) -> None:
    wording(
        lines_of(
            "\n".join(map(str, stored_report(history_with(UNAWAITED, OVERLAP), "cov.db", 200))), UNAWAITED, OVERLAP
        )
    )
    lines = list(map(str, stored_report(history_with(*(UNAWAITED,) * 12), "cov.db", 200)))
    assert sum(str(UNAWAITED) in line for line in lines) == 10
    assert "  and 2 more" in lines


@pytest.mark.longer
def test_markdown_and_the_page_have_a_line_for_each(wording: Wording) -> None:
    history = history_with(UNAWAITED, OVERLAP)
    wording(lines_of(markdown(history), UNAWAITED, OVERLAP))
    wording(lines_of(html_report(history, lambda _: None), UNAWAITED, OVERLAP))
    assert "and 2 more" in markdown(history_with(*(UNAWAITED,) * 12))


def test_reports_without_hazards_do_not_mention_them() -> None:
    history = history_with()
    texts = (
        markdown(history),
        junit_xml(history),
        sarif_log(history),
        "\n".join(map(str, stored_report(history, "cov.db"))),
    )
    assert not [text for text in texts if "azard" in text]


def test_junit_has_the_count_and_the_lines_of_the_case(wording: Wording) -> None:
    wording([line.strip() for line in junit_xml(history_with(UNAWAITED, OVERLAP)).splitlines() if "hazard" in line])


def test_sarif_has_one_result_for_each_kind_at_a_device(wording: Wording) -> None:
    (run,) = json.loads(sarif_log(history_with(UNAWAITED, OVERLAP, OVERLAP)))["runs"]
    assert [each["level"] for each in run["results"]] == ["warning", "warning"]
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert [rules[each["ruleIndex"]] for each in run["results"]] == ["hazard", "hazard"]
    wording([each["message"]["text"] for each in run["results"]])


def test_json_has_the_count_and_the_records(wording: Wording) -> None:
    data = history_json(history_with(UNAWAITED, OVERLAP))
    assert data["hazards"] == 2
    assert [len(case["hazards"]) for case in data["cases"]] == [0, 2, 0]
    wording(json.dumps(data["cases"][1]["hazards"]))


STOPPED = """
case: stopped
model: drive.yaml
goals: [{goal: arrived, may_end: [aborted]}, {goal: arrived, when: cancel == none}]
environment: [{at: 5 s, set: {cancel: wanted}}, {at: 7 s, set: {cancel: none}}]
outcomes: {controller: [{cancel: lost}, succeed]}
"""


def test_commands_and_stores_keep_them(tmp_path: Path, scbm: Scbm, wording: Wording) -> None:
    (tmp_path / "drive.yaml").write_text(DRIVE)
    (tmp_path / "stopped.yaml").write_text(STOPPED)
    model, case, store = (str(tmp_path / name) for name in ("drive.yaml", "stopped.yaml", "cov.db"))
    data = json.loads(scbm("test", model, case, "--store", store, "--json").out)
    assert (data["passed"], data["hazards"], len(data["cases"][0]["hazards"])) == (True, 2, 2)
    assert json.loads(scbm("replay", case, "--json").out)["hazards"] == data["cases"][0]["hazards"]
    assert history_json(read_history(tmp_path / "cov.db"))["cases"][0]["hazards"] == data["cases"][0]["hazards"]
    texts = (scbm("test", model, case).out, scbm("report", store).out, scbm("replay", case).out)
    wording(
        [line for text in texts for line in text.splitlines() if "azards at" in line or "controller carries" in line]
    )


def test_closing_says_that_only_cases_judge_the_requirement(tmp_path: Path, scbm: Scbm, wording: Wording) -> None:
    (tmp_path / "drive.yaml").write_text(f"{DRIVE}requirements_on: [one_request_at_a_time]\n")
    (tmp_path / "stopped.yaml").write_text(STOPPED)
    close = ("close", str(tmp_path / "drive.yaml"), "--requirements", "--out", str(tmp_path / "closed"), "--json")
    (judged,) = [each for each in json.loads(scbm(*close).out)["requirements"]["decided"] if each["name"] == NAME]
    assert judged["status"] == "cases_only"
    wording(judged["reason"])
    found = json.loads(scbm(*close, "--suite", str(tmp_path / "stopped.yaml")).out)["requirements"]["decided"]
    assert [each["status"] for each in found if each["name"] == NAME] == ["violated"]
