"""The page that compares the last run with an earlier one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from msgspec.structs import replace

from scbm.store import RunComparison
from support.histories import EXAMPLE, history_of

pytest.importorskip("playwright.sync_api", reason="there is no Playwright")
from playwright.sync_api import expect

if TYPE_CHECKING:
    from browser.conftest import Visit

pytestmark = pytest.mark.browser


def test_a_newly_failing_case_leads_to_its_failing_step(visit: Visit, failing: Path) -> None:
    page = visit.open(failing, "#/since")
    expect(page.locator(".page.shown h2").first).to_have_attribute("data-change", "newly failing")
    page.locator(".page.shown [data-subject=seed-1-case-2] a").click()
    expect(page.locator(".tl-now [data-requirement=open_while_pumping]")).to_be_visible()


def test_a_case_without_a_page_is_no_link(visit: Visit, failing: Path) -> None:
    row = visit.open(failing, "#/since").locator("[data-subject=gone]")
    expect(row).to_have_count(1)
    expect(row.locator("a")).to_have_count(0)


def test_a_phone_shows_the_page_without_scrolling_to_the_side(visit: Visit, failing: Path) -> None:
    page = visit.open(failing, "#/since", viewport={"width": 390, "height": 800})
    expect(page.locator(".page.shown h2")).not_to_have_count(0)
    assert page.evaluate("document.documentElement.scrollWidth") == 390


def test_without_an_earlier_run_the_page_has_a_sentence(visit: Visit, write_report: Callable[..., Path]) -> None:
    history = history_of(EXAMPLE / "before.yaml", 1)
    page = visit.open(write_report(replace(history, since=RunComparison(history.runs[0]))), "#/since")
    expect(page.locator(".page.shown [data-notice=no-earlier-run]")).to_be_visible()


def test_without_the_option_there_is_no_such_page(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/since")
    expect(page.locator(".page.shown")).to_have_id("/nothing")
    expect(page.locator("nav a[href='#/since']")).to_have_count(0)
