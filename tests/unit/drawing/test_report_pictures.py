"""Pictures of models in reports: in the HTML page, and as diagrams in the summary in Markdown."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from msgspec.structs import replace

from scbm.drawing import layered_layout
from scbm.drawing.report_pictures import automata_pictures, missing_diagrams
from scbm.files import read_model
from scbm.reports.ci.markdown import MAX_CHARACTERS, markdown
from scbm.reports.html import html_report
from scbm.reports.pictures import ReportPictures
from support.flat_factory import flat_factory
from support.histories import EXAMPLE, history_of

if TYPE_CHECKING:
    from support.wording import Wording

pytest.importorskip("quickjs", reason="the extra `draw` is not installed")

BEFORE = EXAMPLE / "before.yaml"
TITLE = re.compile(r"<details><summary>What changes (.*?)</summary>")


@pytest.fixture
def flat(tmp_path: Path) -> Path:
    path = tmp_path / "flat.yaml"
    path.write_text(flat_factory(120), encoding="utf-8")
    return path


def test_each_operation_that_changes_something_has_its_picture() -> None:
    history = history_of(BEFORE, 5)
    made = automata_pictures(history)
    assert list(made.operations) == [operation.name for operation in history.model.operations]
    assert made.operations["pick_item_a"].count('class="automaton"') == 2
    assert made.model.count('class="automaton"') == 7
    identifiers = re.findall(r' id="([^"]+)"', "".join((made.model, *made.operations.values())))
    assert len(identifiers) == len(dict.fromkeys(identifiers))


def test_the_page_has_the_picture_and_equal_histories_the_same_page() -> None:
    history = history_of(BEFORE, 5)
    page = html_report(history, lambda _: None)
    made = automata_pictures(history)
    assert made.model in page
    assert made.operations["pick_item_a"] in page
    assert page == html_report(history, lambda _: None)


def test_a_click_leads_to_the_cases_or_to_the_operation() -> None:
    model = automata_pictures(history_of(BEFORE, 5)).model
    assert 'href="#/cases?visits=scanner_scan_item_a%2Fcompleted"' in model
    assert 'href="#/operation/robot_move_to_home"' in model


def test_without_the_extra_the_page_names_it(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setitem(sys.modules, "quickjs", None)
    made = automata_pictures(history_of(BEFORE, 5))
    assert (made.model, made.operations) == ("", {})
    wording(made.note)
    assert 'data-notice="picture"' in html_report(history_of(BEFORE, 5), lambda _: None)


def test_a_report_whose_picture_is_too_large_has_all_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scbm.drawing.layered_layout._MAX_MEMORY", 100_000)
    layered_layout._context.cache_clear()
    try:
        page = html_report(history_of(BEFORE, 5), lambda _: None)
        note = automata_pictures(history_of(BEFORE, 5)).note
    finally:
        layered_layout._context.cache_clear()
    assert 'data-notice="picture"' in page
    assert note.startswith("No pictures: the layout of an automaton with ")


def test_a_model_in_which_nothing_changes_has_no_picture() -> None:
    model = read_model("behavior_model: m\nvariables: {}\noperations: {}\n")
    assert automata_pictures(replace(history_of(BEFORE, 1), model=model, cases=())) == ReportPictures()


def test_the_summary_has_diagrams_of_variables_with_missing_edges() -> None:
    history = history_of(BEFORE, 20)
    blocks = missing_diagrams(history)
    titles = [title for block in blocks for title in TITLE.findall(block)]
    assert "scan_timeouts" in titles
    assert "item_a_at" not in titles
    assert markdown(history).endswith("\n".join(blocks))


def test_the_diagrams_of_a_summary_are_few_and_small(flat: Path) -> None:
    history = history_of(flat, 1)
    blocks = missing_diagrams(history)
    assert sum("```mermaid" in block for block in blocks) == 20
    assert blocks[-1].startswith("8 more ") or blocks[-1].startswith("9 more ") or blocks[-1].startswith("10 more ")
    assert sum(len(block.encode()) for block in blocks) <= 60_100
    assert len(markdown(history)) <= MAX_CHARACTERS
