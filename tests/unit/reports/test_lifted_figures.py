"""The lifted figure in the reports of a model with parameters; models without parameters have none."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.cases.coverage import Coverage, Obligations, Statuses
from scbm.files import read_model
from scbm.model import BehaviorModel
from scbm.reports.ci.badge import badge
from scbm.reports.ci.cobertura import cobertura_xml
from scbm.reports.ci.junit import junit_xml
from scbm.reports.ci.markdown import markdown
from scbm.reports.terminal.closing_report import ClosingSetting, closing_report
from scbm.reports.terminal.coverage_report import missing_lines
from scbm.store import History
from support.closings import closing_of
from support.histories import EXAMPLE, history_of

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


def test_formats_have_the_lifted_figure(history: History) -> None:
    assert history.lifted is not None
    assert history.lifted.figure.of == 5
    lifted = history.lifted.figure
    assert lifted.visited == 2
    assert history.coverage.figure.of == 15
    assert f"<title>SCBM-IAS: {history.coverage.figure}, 40.00 % lifted</title>" in badge(history)
    assert "**40.00 % lifted** (2 of 5): an operation with parameters counts once" in markdown(history)
    assert '<property name="lifted" value="40.00 %"/>' in junit_xml(history).replace(" />", "/>")
    assert "<!-- Lifted: 40.00 %, 2 of 5 -->" in cobertura_xml(history)


def test_models_without_parameters_have_no_lifted_figure() -> None:
    plain = history_of(EXAMPLE / "before.yaml", 5)
    for text in (badge(plain), markdown(plain), junit_xml(plain), cobertura_xml(plain)):
        assert "lifted" not in text.lower()


def _missing(model: BehaviorModel, visited: list[str]) -> list[str]:
    obligations = Obligations.of(model)
    bits = sum(obligations.bit(each) for each in obligations if str(each) in visited)
    coverage = Coverage(obligations, (("case", bits),))
    return [line.plain for line in missing_lines(model, coverage, "m.yaml", 100, Statuses.of(coverage))]


def test_missing_obligations_of_all_instances_with_one_reason_have_one_line() -> None:
    lines = _missing(MODEL, [])
    head = lines.index("  op: open_it (3)")
    assert lines[head + 1].split(",")[0].strip() == "○ disabled"
    assert lines[head + 2] == ""
    assert not any("open_it.d2" in line for line in lines)


def test_missing_obligations_of_some_instances_name_them() -> None:
    lines = _missing(MODEL, ["open_it.d1/queued", "open_it.d1/executing"])
    assert lines.count("          open_it.d2, open_it.d3") == 1
    assert "          open_it.d1" in lines
    assert sum("op: open_it" in line for line in lines) == 1


def test_the_closing_report_folds_instances_and_has_the_lifted_figure() -> None:
    lines = [line.plain for line in closing_report(closing_of(MODEL), ClosingSetting("doors.yaml"))]
    assert "  Lifted: 0.00 %, 0 of 5: an operation with parameters counts once" in lines
    assert "  open_it (3): every state, queued" in lines
    assert not any("open_it.d2" in line for line in lines)
