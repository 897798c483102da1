"""Lines of pictures as Chromium draws them, without their colours: each status can be told from the others."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element, tostring

import pytest

from scbm.drawing.automaton_svg import arrow_line
from scbm.drawing.drawn_automata import ArrowStyle
from scbm.drawing.layered_layout import Point
from scbm.drawing.picture_parts import arrow

pytest.importorskip("playwright.sync_api", reason="there is no Playwright")

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.browser

LENGTH = 120
"""The length of the lines: that of most arrows, without their labels."""

PAINTS = ("visited", "missed", "forced", "uncoverable")
"""The statuses whose lines differ; what is proved or waived shares one line."""

INK = """async svgs => {
  const drawn = [];
  for (const svg of svgs) {
    const image = new Image();
    image.src = `data:image/svg+xml,${encodeURIComponent(svg)}`;
    await image.decode();
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 4, image.width, 1);
    drawn.push(Array.from({ length: image.width }, (_, x) => data[4 * x + 3] / 255));
  }
  return drawn;
}"""


def line_svg(style: ArrowStyle, paint: str) -> str:
    """Return a line in black as an SVG file."""
    root = Element("svg", xmlns="http://www.w3.org/2000/svg", width=str(LENGTH), height="9")
    arrow(root, (Point(0, 4.5), Point(LENGTH + 9, 4.5)), *arrow_line(style, paint))
    for line in root.iter():
        line.set("style", "stroke: #000")
    return tostring(root, "unicode")


def difference(one: list[float], other: list[float]) -> float:
    """Return the mean difference of the ink of two lines, where they are shifted to be as alike as possible."""
    shifted = (zip(one, other[by:], strict=False) for by in range(LENGTH // 2))
    return min(sum(abs(a - b) for a, b in pairs) / (LENGTH - by) for by, pairs in enumerate(shifted))


def test_each_two_lines_differ_without_colours(browser: Browser) -> None:
    lines = {
        (style, paint): line_svg(style, paint)
        for style in (ArrowStyle.OPERATION, ArrowStyle.AUTOMATIC)
        for paint in PAINTS
    }
    lines[ArrowStyle.OUTSIDE, ""] = line_svg(ArrowStyle.OUTSIDE, "")
    page: Any = browser.new_page()
    ink = dict(zip(lines, page.evaluate(INK, list(lines.values())), strict=True))
    page.close()
    assert all(any(each) for each in ink.values())
    differences = {(one, other): difference(ink[one], ink[other]) for one, other in combinations(ink, 2)}
    assert {pair: share for pair, share in differences.items() if share < 0.15} == {}
