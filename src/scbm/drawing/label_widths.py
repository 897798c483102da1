"""The width of labels, without a font: the advance widths of DejaVu Sans, which is wider than most sans-serif fonts."""

from __future__ import annotations

from unicodedata import combining, east_asian_width

from scbm.model.visible_text import in_one_line

# fmt: off
_ADVANCES = (
    318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337, 636, 636, 636, 636, 636, 636, 636,
    636, 636, 636, 337, 337, 838, 838, 838, 531, 1000, 684, 686, 698, 770, 632, 575, 775, 752, 295, 295, 656, 557,
    863, 748, 787, 603, 787, 695, 635, 611, 732, 684, 989, 685, 611, 685, 390, 337, 390, 838, 500, 500, 613, 635, 550,
    635, 615, 352, 635, 634, 278, 278, 579, 278, 974, 634, 612, 635, 635, 411, 521, 392, 634, 592, 818, 592, 592, 525,
    636, 337, 636, 838,
)
# fmt: on
"""The advance widths of the characters from the blank to the tilde, in thousandths of the font size."""

_OTHER = 684
"""The width of any other character, in the same unit; wide characters, such as Chinese ones, take two of it."""

MAX_LABEL = 40
"""Maximum number of characters of a label; the tooltip has the whole text."""


def label_width(text: str, size: float) -> float:
    """Return about how wide a text is in a font of a size, both in pixels."""
    return sum(map(_advance, text)) * size / 1000


def _advance(character: str) -> int:
    if " " <= character <= "~":
        return _ADVANCES[ord(character) - ord(" ")]
    if combining(character):
        return 0
    return 2 * _OTHER if east_asian_width(character) in "WF" else _OTHER


def label_of(text: str) -> str:
    """Return a text as one line of at most 40 characters."""
    shown = in_one_line(text)
    return shown if len(shown) <= MAX_LABEL else f"{shown[: MAX_LABEL - 1]}…"
