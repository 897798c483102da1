"""The report of a flat model with 314 operations: its first page fits one screen or two, and its pages open quickly.

One test is no slow one, so that one worker alone makes the report for a change.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

pytest.importorskip("playwright.sync_api", reason="there is no Playwright")
from playwright.sync_api import expect

from browser.conftest import OPERATIONS
from browser.test_access import AXE, violations

if TYPE_CHECKING:
    from browser.conftest import Visit

pytestmark = pytest.mark.browser

NODES = """(() => {
  const walker = document.createTreeWalker(document, NodeFilter.SHOW_ALL);
  let count = 0;
  while (walker.nextNode()) count += 1;
  return count;
})()"""


def test_its_file_is_small_and_its_first_page_short(visit: Visit, factory: Path) -> None:
    assert factory.stat().st_size <= 3_000_000
    for width in (1440, 390):
        page = visit.open(factory, viewport={"width": width, "height": 900})
        expect(page.locator(".page.shown details.group")).not_to_have_count(0)
        assert page.evaluate(NODES) <= 25_000
        assert page.evaluate("document.documentElement.scrollHeight") <= 3_000
        assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.slow
def test_a_group_opens_to_its_command_and_its_operations(visit: Visit, factory: Path) -> None:
    page = visit.open(factory)
    groups = page.locator(".page.shown details.group")
    assert groups.count() <= 8
    group = groups.first
    group.locator("summary").click()
    expect(group.locator(".command")).to_have_count(1)
    names = group.locator("tbody th a")
    assert names.count() > 250
    names.last.click()
    expect(page.locator(".page.shown h1")).to_have_text("line_7_station_01_clamp")


@pytest.mark.slow
def test_the_picture_names_the_cell_below_the_pointer_and_opens_it(visit: Visit, factory: Path) -> None:
    page = visit.open(factory)
    box = page.locator(".strip-cells").bounding_box()
    assert box is not None
    middle_of_last = (box["x"] + box["width"] * (OPERATIONS - 0.5) / OPERATIONS, box["y"] + box["height"] * 1.5 / 6)
    page.mouse.move(*middle_of_last)
    expect(page.locator(".strip-name")).to_contain_text("line_7_station_01_clamp/disabled")
    page.mouse.click(*middle_of_last)
    expect(page.locator(".page.shown h1")).to_have_text("line_7_station_01_clamp")


@pytest.mark.slow
def test_pages_of_operations_leave_the_document_when_they_are_left(visit: Visit, factory: Path) -> None:
    page = visit.open(factory)
    for name in ("line_1_station_01_load", "line_2_station_03_clamp", "line_1_station_01_load"):
        page.evaluate(f"location.hash = '#/operation/{name}'")
        expect(page.locator(".page.shown h1")).to_have_text(name)
        expect(page.locator(".page.operation")).to_have_count(1)
        expect(page.locator(".page.operation .line")).to_have_count(1)
        expect(page.locator(".page.operation .of-lines")).to_have_count(1)


@pytest.mark.slow
def test_axe_finds_no_violation_on_pages_of_a_large_model(visit: Visit, factory: Path) -> None:
    page = visit.open(factory)
    assert violations(page, "operation/line_1_station_01_load") == {}
    page.evaluate("location.hash = '#/missing'")
    assert page.evaluate(AXE) == []
