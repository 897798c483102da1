"""The documentation as a site: every public name is on its page, and a search finds guides above decisions."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser

DOCS = Path(__file__).parents[2] / "docs"
PACKAGES = {
    package: page.stem
    for page in sorted((DOCS / "reference" / "api").glob("*.md"))
    for package in re.findall(r"automodule:: (\S+)", page.read_text(encoding="utf-8"))
}
API = "reference/api/*"
NO_API = ("how-to/*", "tutorial/*", "explanation/*", "decisions/*", "examples/*", "reference/*.md")


def built(into: Path, *excluded: str) -> Path:
    """Build the site without some of its pages, which takes half of the time."""
    pytest.importorskip("sphinx", reason="not installed: sphinx")
    left_out = ",".join(("build", *excluded))
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-q",
        "-b",
        "html",
        "-D",
        f"exclude_patterns={left_out}",
        str(DOCS),
        str(into),
    ]
    subprocess.run(command, capture_output=True, check=True)
    return into


def test_there_are_pages_of_packages() -> None:
    assert {"scbm.files", "scbm.cases", "scbm.planning", "scbm.testing", "scbm.model"} <= set(PACKAGES)


@pytest.mark.slow
def test_every_public_name_is_on_the_page_of_its_package(tmp_path: Path) -> None:
    site = built(tmp_path, *NO_API)
    for package, page in PACKAGES.items():
        found = re.findall(r'id="([^"]+)"', (site / "reference" / "api" / f"{page}.html").read_text(encoding="utf-8"))
        names = getattr(import_module(package), "__all__", [])
        assert [name for name in names if f"{package}.{name}" not in found] == [], package


@pytest.mark.slow
@pytest.mark.browser
def test_a_search_finds_guides_first_and_decisions_last(tmp_path: Path, browser: Browser) -> None:
    site = built(tmp_path, API)
    page = browser.new_page()
    for words in ("mutants", "certificates", "planner", "network faults"):
        page.goto(f"{(site / 'search.html').as_uri()}?q={words.replace(' ', '+')}")
        page.locator("#search-results p.search-summary, #search-results .search-summary").first.wait_for()
        page.wait_for_function("document.querySelector('.search-summary').textContent.includes('found')")
        links = page.locator("#search-results li a").evaluate_all("links => links.map(link => link.href)")
        assert "/how-to/" in links[0] or "/tutorial/" in links[0], words
        kinds = ["decisions/" in link for link in links]
        assert any(kinds), words
        assert not all(kinds), words
        assert kinds == sorted(kinds), words
    page.close()
