"""The pages for people who use screen readers, keyboards, or see little contrast (WCAG 2.2 AA)."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

pytest.importorskip("playwright.sync_api", reason="there is no Playwright")

if TYPE_CHECKING:
    from collections.abc import Callable

    from playwright.sync_api import Page

    from browser.conftest import Visit
    from conftest import Ran

    Scbm = Callable[..., Ran]

pytestmark = pytest.mark.browser

LAMP = """
behavior_model: lamp
variables: {on: {domain: bool, initial: false}, count: {domain: 0..3, initial: 0}}
operations:
  switch: {pre: {g: on == false && count < 3}, post: {g: true, a: [on <- true, count += 1]}}
goals: {lit: on == true}
"""

ROUTES = (
    "missing",
    "operations",
    "operation/pick_item_a",
    "model",
    "cases",
    "case/seed-1-case-6",
    "growth",
    "findings",
    "source",
)
"""All pages, the one with most elements last: they stay in the document."""

CHECKS = """() => {
  const isShown = (element) =>
    element.checkVisibility({ visibilityProperty: true }) && !element.closest("[aria-hidden=true]");
  const shown = [...document.body.querySelectorAll("*")].filter(isShown);
  const found = (test) => shown.filter(test).map((element) => element.outerHTML.slice(0, 200));
  const hasText = (element) => [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
  const style = (element) => getComputedStyle(element);
  const opacity = (element) => element ? Number(style(element).opacity) * opacity(element.parentElement) : 1;
  const textOf = (node) => node.nodeType === 3 ? node.data
    : node.nodeType !== 1 || !isShown(node) || node.classList.contains("vh") ? ""
    : [...node.childNodes].map(textOf).join(" ");
  const words = (text) => text.toLowerCase().replace(/[^\\p{L}\\p{N}]+/gu, " ").trim();
  const isMislabelled = (element) => element.matches("a[aria-label], button[aria-label]")
    && !words(element.getAttribute("aria-label")).includes(words(textOf(element)));
  const isInside = (element) =>
    element.matches("a, button, input") && element.parentElement.closest("[role=img], a, button");
  const isOnlyColoured = (element) => element.matches("p a") && hasText(element.closest("p"))
    && !style(element).textDecorationLine.includes("underline");
  return {
    "faded text": found((element) => hasText(element) && opacity(element) < 1),
    "label without the words that are seen": found(isMislabelled),
    "control in a picture or in a control": found(isInside),
    "link in a sentence that only its colour shows": found(isOnlyColoured),
  };
}"""


AXE = """async () => {
  const { violations } = await axe.run(document, { resultTypes: ["violations"] });
  return violations.map(({ id, nodes }) => `${id}: ${nodes[0].html.slice(0, 200)}`);
}"""


WINDOWS = [
    (1440, "light"),
    pytest.param(1440, "dark", marks=pytest.mark.slow),
    pytest.param(390, "light", marks=pytest.mark.slow),
    (390, "dark"),
]
"""The width of a window, and its theme."""

SCHEMES = ["light", pytest.param("dark", marks=pytest.mark.slow)]


@pytest.mark.parametrize(("width", "scheme"), WINDOWS)
def test_axe_finds_no_violation_on_any_page(visit: Visit, before: Path, failing: Path, scheme: str, width: int) -> None:
    """Check pages with axe-core, which the package `axe-playwright-python` brings: on a phone first page and cases."""
    failed = ("missing", "findings", "since", "cases?failed", "case/seed-1-case-2", "case/seed-1-case-2/step/3")
    for report, routes in ((before, ("nothing", *ROUTES)), (failing, failed)):
        page = visit.open(report, color_scheme=scheme, viewport={"width": width, "height": 900})
        chosen = [each for each in routes if width > 390 or each == "missing" or each.startswith("case/")]
        assert violations(page, *chosen) == {}


def violations(page: Page, *routes: str) -> dict[str, list[str]]:
    """Return the rules of axe-core that pages of a report break."""
    page.evaluate(files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8"))
    found = {}
    for route in routes:
        page.evaluate(f"location.hash = '#/{route}'")
        page.locator(".page.shown h1").first.wait_for()
        page.evaluate("document.querySelectorAll('.page.shown details').forEach(each => { each.open = true; })")
        found[route] = page.evaluate(AXE)
    return {route: broken for route, broken in found.items() if broken}


@pytest.mark.parametrize("scheme", SCHEMES)
def test_axe_finds_no_violation_among_mutants(visit: Visit, scbm: Scbm, tmp_path: Path, scheme: str) -> None:
    model, page = tmp_path / "lamp.yaml", tmp_path / "mutants.html"
    model.write_text(LAMP, encoding="utf-8")
    assert scbm("mutate", model, "--cases", "2", "--html", page).code == 0
    shown = visit.open(page, color_scheme=scheme)
    shown.evaluate(files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8"))
    shown.evaluate("document.querySelectorAll('details').forEach(each => { each.open = true; })")
    assert shown.evaluate(AXE) == []


def wrong(page: Page) -> dict[str, list[str]]:
    return {what: found for what, found in page.evaluate(CHECKS).items() if found}


@pytest.mark.parametrize("scheme", SCHEMES)
def test_text_is_readable_and_controls_have_the_names_that_are_seen(visit: Visit, before: Path, scheme: str) -> None:
    page = visit.open(before, color_scheme=scheme)
    for route in ROUTES:
        page.evaluate(f"location.hash = '#/{route}'")
        page.locator(".page.shown h1").first.wait_for()
        assert wrong(page) == {}, route


def test_so_they_are_where_cases_failed(visit: Visit, failing: Path) -> None:
    page = visit.open(failing, "#/findings")
    page.locator(".page.shown article").first.wait_for()
    assert wrong(page) == {}
