"""The badge: an image that says the figure, legibly, and fetches nothing."""

from __future__ import annotations

import re

import pytest
from lxml import etree

from scbm.cases.coverage import Figure
from scbm.reports.ci.badge import badge, badge_svg
from support.histories import EXAMPLE, history_of

SVG = "{http://www.w3.org/2000/svg}"
FIGURES = [Figure(v, 1000) for v in (0, 1, 240, 250, 499, 500, 740, 750, 890, 900, 999, 1000)] + [Figure(0, 0)]


def luminance(colour: str) -> float:
    """The relative luminance of a colour, as WCAG 2 has it."""
    digits = colour.removeprefix("#")
    whole = digits if len(digits) == 6 else "".join(2 * digit for digit in digits)
    parts = [int(whole[index : index + 2], 16) / 255 for index in (0, 2, 4)]
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


@pytest.mark.parametrize("figure", FIGURES, ids=str)
def test_it_says_the_figure_to_everyone(figure: Figure) -> None:
    root = etree.fromstring(badge_svg(figure))
    assert root.get("height") == "20"
    assert root.get("role") == "img"
    assert root.get("aria-label") == root.findtext(f"{SVG}title") == f"SCBM-IAS: {figure}"
    assert [text.text for text in root.iter(f"{SVG}text")] == ["SCBM-IAS", str(figure)]


@pytest.mark.parametrize("figure", FIGURES, ids=str)
def test_white_can_be_read_on_both_parts(figure: Figure) -> None:
    colours = [str(path.get("fill")) for path in etree.fromstring(badge_svg(figure)).iter(f"{SVG}path")]
    assert len(colours) == 2
    assert all(1.05 / (luminance(colour) + 0.05) >= 4.5 for colour in colours)


def test_the_colour_goes_with_the_figure() -> None:
    colours = [etree.fromstring(badge_svg(figure))[2].get("fill") for figure in FIGURES]
    assert len(set(colours)) == 7
    assert colours[0] == colours[1] == colours[2] != colours[3]
    assert colours[-3] != colours[-2]


@pytest.mark.parametrize("label", ["SCBM-IAS", "", "coverage of <b>größe</b> & 模型 \x1b", "W" * 60])
def test_texts_fit_into_their_parts(label: str) -> None:
    text = badge_svg(Figure(1, 3), label)
    root = etree.fromstring(text)
    left, right = [(float(str(each.get("x"))), int(str(each.get("textLength")))) for each in root.iter(f"{SVG}text")]
    edge = float(re.findall(r'd="M([0-9.]+) 0h', text)[1])
    assert left[0] + left[1] / 2 < edge < right[0] - right[1] / 2
    assert right[0] + right[1] / 2 < float(str(root.get("width")))


def test_nothing_is_fetched_and_nothing_is_named() -> None:
    text = badge_svg(Figure(1, 3))
    assert re.findall(r"https?://[^\"]*", text) == ["http://www.w3.org/2000/svg"]
    assert not re.search(r"\b(href|src|id|url)\b", text)


def test_a_store_has_the_badge_of_its_figure() -> None:
    assert badge(history_of(EXAMPLE / "before.yaml", 20)) == badge_svg(Figure(40, 86))
