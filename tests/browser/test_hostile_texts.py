"""Names and texts that look like HTML, turn the direction of texts around, or are very long do no harm on any page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.files import write_case
from scbm.store import History, SmallestCase, Written
from scbm.testing import Failure, FailureKind, RandomCases, Verdict
from support.histories import EXAMPLE, history_of, since_another_run

pytest.importorskip("playwright.sync_api", reason="there is no Playwright")
from playwright.sync_api import expect

if TYPE_CHECKING:
    from browser.conftest import Visit

pytestmark = pytest.mark.browser

MARKUP = """</script></template><script>window.hacked = 1</script><img src=x onerror="hacked=1">"'\u202e\u2066 """
HOSTILE = MARKUP + "x" * 300
ROUTES = ("missing", "operations", "operation/pick_item_a", "model", "source", "cases", "growth", "since", "findings")


def _hostile() -> History:
    """Return a history whose texts are all hostile; its first case fails, and has a smallest one."""
    history = history_of(EXAMPLE / "before.yaml", 3)
    failure = Failure(FailureKind.REQUIREMENT, HOSTILE, f"message {HOSTILE}")
    text = write_case(RandomCases(history.model).case(1, 1), history.model, None)
    small = SmallestCase(FailureKind.REQUIREMENT, HOSTILE, text, HOSTILE, 1, 2, 3, 4, (HOSTILE,))
    first = replace(
        history.cases[0],
        name=HOSTILE,
        goal=HOSTILE,
        recipe=Written(text, HOSTILE),
        verdict=Verdict(End.ABORTED, (failure,)),
        smallest=(small,),
    )
    source = replace(history.source, path=HOSTILE, text=f"# {HOSTILE}\n{history.source.text}")
    runs = (replace(history.runs[0], command=f"scbm test {HOSTILE}", source=source),)
    return since_another_run(replace(history, runs=runs, cases=(first, *history.cases[1:])))


@pytest.mark.parametrize("width", [pytest.param(1440, marks=pytest.mark.slow), 390])
def test_hostile_texts_are_shown_and_do_nothing(visit: Visit, write_report: Callable[..., Path], width: int) -> None:
    page = visit.open(write_report(_hostile()), viewport={"width": width, "height": 900})
    for route in ROUTES:
        page.evaluate("route => { location.hash = `#/${route}`; }", route)
        expect(page.locator(".page.shown h1")).to_have_count(1)
        page.evaluate("document.querySelectorAll('.page.shown details').forEach(each => { each.open = true; })")
        assert page.evaluate("document.documentElement.scrollWidth") <= width, route
    page.locator(".page.shown .message a").first.click()
    expect(page.locator(".tl-count")).to_be_visible()
    expect(page.locator("[data-smallest] code")).to_contain_text("</script>")
    assert "\u202e" not in page.locator("body").inner_text()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("window.hacked") is None
    expect(page.locator("img")).to_have_count(0)
