"""The page of a model with parameters: the instances of an entry are folded below it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from scbm.reports.html import html_report
from support.histories import EXAMPLE, history_of

TEXT = """behavior_model: doors
types: {door: [d1, d2, d3]}
variables:
  open[door]: {domain: bool, initial: false}
operations:
  open_it[d in door]: {pre: {g: open.d == false}, post: {g: true, a: [open.d <- true]}}
  rest: {pre: {g: true}, post: {g: true}}
automatic_transitions:
  shut[d in door]: {g: open.d == true, a: [open.d <- false]}
goals:
  entered: open.d1 == true
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the page of one case that opens the first door."""
    file = tmp_path_factory.mktemp("doors") / "doors.yaml"
    file.write_text(TEXT)
    return html_report(history_of(Path(file), 1), lambda _: None)


def _section(page: str, name: str) -> str:
    found = re.search(rf'<section class="page" id="/{name}".*?</section>', page, re.DOTALL)
    assert found is not None
    return found[0]


def test_missing_instances_are_folded_below_their_entry(page: str) -> None:
    missing = _section(page, "missing")
    entries = re.findall(r'<details class="entry" data-entry="([^"]*)">(.*?)</details>', missing, re.DOTALL)
    names = [name for name, _ in entries]
    assert dict.fromkeys(names) == dict.fromkeys(("open_it", "automatic/shut"))
    groups = re.findall(r'<details class="group".*?(?=<details class="group"|</section>)', missing, re.DOTALL)
    assert len(groups) < len(names) + 2, "entries stand inside the groups"
    assert all("3 instances" in text for _, text in entries)
    assert not any("rest/" in row for _, text in entries for row in re.findall(r'data-obligation="([^"]*)"', text))
    assert 'data-obligation="rest/' in missing


def test_the_lifted_figure_stands_beside_the_ground_one(page: str) -> None:
    assert re.search(r'data-lifted="\d+\.\d\d %"', _section(page, "missing"))


def test_the_row_of_an_entry_counts_the_instances_that_are_visited(page: str) -> None:
    operations = _section(page, "operations")
    assert 'title="open_it, executing: 1 of 3 instances visited"' in operations
    assert 'title="shut, taken: ' in operations
    assert operations.count('href="#/operation/open_it.d2"') == 1


def test_pages_of_models_without_parameters_have_no_entries() -> None:
    plain = html_report(history_of(EXAMPLE / "before.yaml", 5), lambda _: None)
    assert 'class="entry"' not in _section(plain, "missing") + _section(plain, "operations")
    assert "data-lifted" not in plain
