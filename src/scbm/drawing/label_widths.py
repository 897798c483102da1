"""The width of labels, without a font: the advance widths of DejaVu Sans, which is wider than most sans-serif fonts."""

from __future__ import annotations

from importlib.resources import files
from unicodedata import combining, east_asian_width

from scbm.model.visible_text import in_one_line

_ADVANCES = tuple(map(int, files(__package__).joinpath("vendored/dejavu_sans_widths.txt").read_text("ascii").split()))
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
