"""The figure as a badge for a README: an SVG without external references and without `id` attributes."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from scbm.model.visible_text import escaped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases.coverage import Figure
    from scbm.store import History

_COLOURS = ((100.0, "#2a7a3b"), (90.0, "#4a7326"), (75.0, "#6f6a00"), (50.0, "#8a5a00"), (25.0, "#a8480f"))
"""The colour from each percentage on; white text on each colour has a contrast of at least 4.5."""

_LOW = "#b3261e"
_NOTHING = "#666666"
_LABEL = "#444444"

_NARROW = "ijlftrI.,:;'|!()[]{}- "
_WIDE = "mwMW%@"
_CAPITALS = "ABCDEFGHJKLNOPQRSTUVXYZ"
_MARGIN = 6
"""Pixels on each side of a text."""


def badge(history: History) -> str:
    """Return the badge for all cases of a store."""
    decided = history.decided
    lifted = None if history.lifted is None else history.lifted.figure
    if decided is None:
        return badge_svg(history.coverage.figure, lifted=lifted)
    return badge_svg(
        history.coverage.figure, coverable=decided.coverable, assumptions=decided.assumptions, lifted=lifted
    )


def badge_svg(
    figure: Figure,
    label: str = "SCBM-IAS",
    coverable: Figure | None = None,
    assumptions: Sequence[str] = (),
    lifted: Figure | None = None,
) -> str:
    """Return a badge, 20 pixels high: a label, and the figure on the colour for its percentage.

    Args:
        figure: the figure to show.
        label: the text before it.
        coverable: the figure of what can be covered, which stands behind it and does not decide the colour.
        assumptions: what the proofs behind that figure assume, one sentence each; viewers show them on hovering.
        lifted: the figure of lifted obligations, of a model with parameters; it does not decide the colour either.
    """
    folded = "" if lifted is None else f", {lifted} lifted"
    value = f"{figure}{folded}" if coverable is None else f"{figure}{folded}, {coverable} of what can be covered"
    left, right = _width(label), _width(value)
    name = escape(escaped(f"{label}: {value}"))
    assumed = f". Proofs assume: {' '.join(assumptions)}" if assumptions else ""
    title = escape(escaped(f"{label}: {value}{assumed}"))
    return f"""\
<svg xmlns="http://www.w3.org/2000/svg" width="{left + right}" height="20" role="img" aria-label="{name}">
  <title>{title}</title>
  <path d="M3 0h{left - 3}v20H3a3 3 0 0 1-3-3V3a3 3 0 0 1 3-3z" fill="{_LABEL}"/>
  <path d="M{left} 0h{right - 3}a3 3 0 0 1 3 3v14a3 3 0 0 1-3 3H{left}z" fill="{_colour(figure)}"/>
  <g fill="#fff" text-anchor="middle" font-family="Verdana,DejaVu Sans,Geneva,sans-serif" font-size="11">
    {_text(label, 0, left)}
    {_text(value, left, right)}
  </g>
</svg>
"""


def _text(text: str, x: int, width: int) -> str:
    """Return a centred text with a fixed `textLength`, so that it fits in every font."""
    length = width - 2 * _MARGIN
    middle = x + width / 2
    return f'<text x="{middle:g}" y="14" textLength="{length}" aria-hidden="true">{escape(escaped(text))}</text>'


def _width(text: str) -> int:
    """Return the approximate width of a text in Verdana in pixels, with a margin on both sides."""
    return round(sum(map(_advance, text))) + 2 * _MARGIN


def _advance(character: str) -> float:
    if character in _NARROW:
        return 4.5
    if character in _WIDE:
        return 10.5
    if character in _CAPITALS:
        return 7.8
    return 6.9 if character.isascii() else 11.0


def _colour(figure: Figure) -> str:
    percent = figure.percent
    if percent is None:
        return _NOTHING
    return next((colour for least, colour in _COLOURS if percent >= least), _LOW)
