"""Each step of a case has an address, and a failed case opens at the step that failed."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from msgspec.structs import replace

from scbm.files import write_case
from scbm.store import SmallestCase
from scbm.testing import RandomCases, Tester
from scbm.testing.shrinking.shrinker import Shrinker
from support.histories import history_of
from support.wording import Wording

pytest.importorskip("playwright.sync_api", reason="there is no Playwright")
from playwright.sync_api import expect

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from browser.conftest import Visit

pytestmark = pytest.mark.browser

MODELS = Path(__file__).parents[1] / "models"
CASE = "#/case/seed-1-case-2"


def _selected(page: Page) -> int:
    """Return the number of the step that the timeline shows."""
    expect(page.locator(".tl-lanes .tl-base").first).to_be_attached()
    return int(page.locator(".tl-count").inner_text().split(" ")[0])


def test_a_failed_case_opens_at_the_step_that_failed_with_its_lane_in_view(visit: Visit, failing: Path) -> None:
    for size in ({"width": 1440, "height": 900}, {"width": 390, "height": 800}):
        page = visit.open(failing, CASE, viewport=size)
        assert _selected(page) == 7
        expect(page.locator(".tl-now [data-requirement=open_while_pumping]")).to_be_visible()
        expect(page.locator(".tl-lane.requirements .tl-mark")).to_be_in_viewport()


def test_the_address_follows_the_steps_and_opens_them(visit: Visit, failing: Path) -> None:
    page = visit.open(failing, CASE)
    assert _selected(page) == 7
    page.keyboard.press("ArrowRight")
    expect(page).to_have_url(re.compile(f"{CASE}/step/8$"))
    page.reload()
    assert _selected(page) == 8
    page.keyboard.press("Home")
    page.evaluate(f"location.hash = '{CASE}/step/3'")
    expect(page.locator(".tl-count")).to_have_text(re.compile("^3 of 10"))
    assert _selected(visit.open(failing, f"{CASE}/step/10")) == 10


def test_a_case_that_passed_opens_at_its_first_step(visit: Visit, before: Path) -> None:
    assert _selected(visit.open(before, "#/case/seed-1-case-6")) == 1


def test_sentences_about_a_failure_lead_to_its_step(visit: Visit, failing: Path) -> None:
    page = visit.open(failing, f"{CASE}/step/1")
    assert _selected(page) == 1
    page.locator(".failures a").click()
    expect(page.locator(".tl-count")).to_have_text(re.compile("^7 of 10"))


@pytest.mark.parametrize("step", ["0", "99"])
def test_a_step_that_the_case_does_not_have_is_reported(visit: Visit, failing: Path, step: str) -> None:
    page = visit.open(failing, f"{CASE}/step/{step}")
    assert _selected(page) == 7
    expect(page.locator("[data-notice=no-step]")).to_be_visible()


@pytest.mark.parametrize("end", ["/step/", "/step/x", "/step/1/2", "/records"])
def test_other_words_behind_a_case_are_no_page(visit: Visit, failing: Path, end: str) -> None:
    expect(visit.open(failing, CASE + end).locator(".page.shown")).to_have_id("/nothing")


def test_a_failure_without_a_violation_opens_at_the_end_of_its_run(
    visit: Visit, write_report: Callable[..., Path]
) -> None:
    page = visit.open(write_report(history_of(MODELS / "fails_at_run/time_limit.yaml", 1)), "#/case/seed-1-case-1")
    selected = _selected(page)
    assert page.locator(".tl-count").inner_text().startswith(f"{selected} of {selected}")


def test_the_first_page_leads_to_the_failing_step_by_keyboard_alone(visit: Visit, failing: Path) -> None:
    page = visit.open(failing, viewport={"width": 1440, "height": 900})
    page.keyboard.press("f")
    expect(page.locator(".page.shown")).to_have_id("/findings")
    for _ in range(20):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.hash?.startsWith('#/case/')"):
            break
    page.keyboard.press("Enter")
    assert _selected(page) > 1
    expect(page.locator(".tl-lanes")).to_be_in_viewport()


def test_two_clicks_lead_from_the_first_page_to_the_failing_step(visit: Visit, failing: Path) -> None:
    page = visit.open(failing)
    page.locator("[data-notice=failed] a[href='#/findings']").click()
    page.locator(".page.shown .message a").first.click()
    assert _selected(page) > 1


@pytest.fixture(scope="session")
def shrunk(write_report: Callable[..., Path]) -> Path:
    """Return the report of cases that fail for one cause, the second of which has the smallest case."""
    history = history_of(MODELS / "fails_at_run/requirement.yaml", 3)
    tester = Tester(history.model)
    execution = tester.execute(RandomCases(history.model).case(1, 1))
    (failure,) = execution.verdict.failures
    small = Shrinker(tester).shrink(execution, failure).execution.case
    text = write_case(small, history.model, None)
    kept = SmallestCase(failure.kind, failure.subject, text, "small/one.yaml", 1, 0, 4, 12, ("a choice",))
    first, second, third = history.cases
    return write_report(replace(history, cases=(first, replace(second, smallest=(kept,)), third)))


def test_the_smallest_case_comes_first_with_what_matters_and_its_command(visit: Visit, shrunk: Path) -> None:
    page = visit.open(shrunk, "#/case/seed-1-case-1")
    assert _selected(page) > 1
    expect(page.locator(".form-names [aria-current]")).to_have_attribute("href", "#/case/seed-1-case-1/smallest")
    expect(page.locator("[data-smallest] code")).to_have_text("scbm replay small/one.yaml")
    expect(page.locator(".matters li")).to_have_count(1)
    page.keyboard.press("ArrowLeft")
    expect(page).to_have_url(re.compile(r"#/case/seed-1-case-1/smallest/step/\d+$"))


def test_the_case_as_it_was_found_is_one_click_away(visit: Visit, shrunk: Path) -> None:
    page = visit.open(shrunk, "#/case/seed-1-case-1")
    page.locator(".form-names a").last.click()
    expect(page.locator(".again code")).to_contain_text("--seed 1 --case 1")
    expect(page.locator("[data-smallest]")).to_have_count(0)
    assert _selected(page) > 1
    assert _selected(visit.open(shrunk, "#/case/seed-1-case-1/step/2")) == 2


def test_without_a_smallest_case_a_sentence_gives_the_reason(
    visit: Visit, write_report: Callable[..., Path], wording: Wording
) -> None:
    history = history_of(MODELS / "fails_at_run/requirement.yaml", 1)
    command = f"{history.runs[0].command} --no-shrink"
    without = replace(history, runs=(replace(history.runs[0], command=command),))
    for each in (without, history):
        notice = visit.open(write_report(each), "#/case/seed-1-case-1").locator("[data-notice=no-smallest]")
        wording(notice.inner_text())
