"""The lifted figure in the reports of a model with parameters; models without parameters have none."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Statuses, WaiverReview
from scbm.closing import Closer
from scbm.files import read_model
from scbm.model import BehaviorModel, Waiver
from scbm.reports.ci.badge import badge
from scbm.reports.ci.cobertura import cobertura_xml
from scbm.reports.ci.junit import junit_xml
from scbm.reports.ci.markdown import markdown
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.terminal.closing_report import closing_report
from scbm.reports.terminal.coverage_report import missing_lines
from scbm.store import History
from support.campaigns import visiting
from support.closings import closing_of, result_of
from support.histories import EXAMPLE, history_of
from support.wording import Wording

TEXT = """behavior_model: doors
types: {door: [d1, d2, d3]}
variables:
  open[door]: {domain: bool, initial: false}
operations:
  open_it[d in door]: {pre: {g: open.d == false}, post: {g: true, a: [open.d <- true]}}
goals:
  entered: open.d1 == true
  all_open: forall d in door. (open.d == true)
"""
MODEL = read_model(TEXT)


@pytest.fixture(scope="module")
def history(tmp_path_factory: pytest.TempPathFactory) -> History:
    """One case that opens some of the doors."""
    file = tmp_path_factory.mktemp("doors") / "doors.yaml"
    file.write_text(TEXT)
    return history_of(Path(file), 1)


def test_formats_have_the_lifted_figure(history: History, wording: Wording) -> None:
    assert history.lifted is not None
    assert history.lifted.figure.of == 5
    lifted = history.lifted.figure
    assert lifted.visited == 2
    assert history.coverage.figure.of == 15
    assert f"<title>SCBM-IAS: {history.coverage.figure}, 40.00 % lifted</title>" in badge(history)
    wording(line for line in markdown(history).splitlines() if "40.00 % lifted" in line)
    assert '<property name="lifted" value="40.00 %"/>' in junit_xml(history).replace(" />", "/>")
    assert "<!-- Lifted: 40.00 %, 2 of 5 -->" in cobertura_xml(history)


def test_models_without_parameters_have_no_lifted_figure() -> None:
    plain = history_of(EXAMPLE / "before.yaml", 5)
    for text in (badge(plain), markdown(plain), junit_xml(plain), cobertura_xml(plain)):
        assert "lifted" not in text.lower()


def _missing(model: BehaviorModel, visited: list[str]) -> list[str]:
    return [line.plain for line in missing_lines(visiting(model, visited), "m.yaml", CampaignKind(), 100)]


def test_missing_obligations_of_all_instances_with_one_reason_have_one_line(wording: Wording) -> None:
    lines = _missing(MODEL, [])
    head = lines.index("  op: open_it (3)")
    wording(lines[head + 1])
    assert lines[head + 2] == ""
    assert not any("open_it.d2" in line for line in lines)


def test_missing_obligations_of_some_instances_name_them() -> None:
    lines = _missing(MODEL, ["open_it.d1/queued", "open_it.d1/executing"])
    assert lines.count("          open_it.d2, open_it.d3") == 1
    assert "          open_it.d1" in lines
    assert sum("op: open_it" in line for line in lines) == 1


def _section(text: str, title: str) -> str:
    """Return the rows of the table below a title of the summary."""
    return text.partition(f"{title}**\n\n")[2].partition("\n\n")[0]


def test_the_summary_folds_instances_with_one_reason(history: History) -> None:
    text = markdown(history)
    assert _section(text, "2 executing").splitlines()[2].startswith("| `open_it.d2`, `open_it.d3` | ")
    assert _section(text, "3 timedout").count("| `open_it") == 2
    waived = [Waiver(f"open_it.d{number}/failed", "no", "Ada", "2026-11-20") for number in (1, 2, 3)]
    statuses = Statuses.of(history.coverage, waivers=WaiverReview(tuple(waived)))
    decided = markdown(replace(history, decided=statuses))
    assert "| `open_it (3)`: failed | " in decided
    statuses = Statuses.of(history.coverage, waivers=WaiverReview(tuple(waived[1:])))
    assert "| `open_it.d2/failed`, `open_it.d3/failed` | " in markdown(replace(history, decided=statuses))


def test_the_summary_counts_instances_of_many(tmp_path: Path) -> None:
    file = tmp_path / "doors.yaml"
    file.write_text(TEXT.replace("[d1, d2, d3]", "[d1, d2, d3, d4, d5, d6, d7]").replace("  all_open", "  # all_open"))
    text = markdown(history_of(file, 1))
    assert _section(text, "6 executing").splitlines()[2].startswith("| `open_it (6 of 7)` | ")
    assert "| `open_it.d1` | executed in 1 case" in _section(text, "7 failed")
    assert "<details><summary><b>" not in text


def test_the_closing_report_folds_instances_and_has_the_lifted_figure(wording: Wording) -> None:
    lines = [line.plain for line in closing_report(result_of(closing_of(MODEL)))]
    wording(line for line in lines if "Lifted: " in line or "open_it" in line)
    assert not any("open_it.d2" in line for line in lines)


ROBOTS = """behavior_model: arms
types: {robot: [r1, r2]}
resources:
  arm[robot]: {}
variables:
  done[robot]: {domain: bool, initial: false}
operations:
  move[r in robot]: {request: arm.r, guard: done.r == false, post: {g: true, a: [done.r <- true]}}
goals:
  all_done: forall r in robot. (done.r == true)
"""


def test_the_closing_report_counts_forced_visits_of_what_is_proved_uncoverable(wording: Wording) -> None:
    closing = Closer(read_model(ROBOTS)).close()
    assert closing.forced == 2
    lines = [line.plain for line in closing_report(result_of(closing))]
    wording(line for line in lines if "Lifted: " in line)
    assert "  move (2): disabled" in lines[lines.index("Proved uncoverable: 4") :]
