"""A chart of the coverage figure over the cases of a store."""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import quote

from scbm.cases.coverage import growth
from scbm.reports.html.svg import add, colour, picture, written

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from scbm.cases.coverage import Figure, GrowthStep
    from scbm.store import History

_HEIGHT = 300
_TOP, _PLOT_HEIGHT = 24, 230
_LEFT, _RIGHT = 12.0, 97.0
"""Left and right edge of the plot, in percent of the width, so that the size of texts does not depend on the width."""

_MAX_NAMES = 12
"""Maximum number of obligations in the tooltip of a step; the page of the case lists all."""

_MAX_RUNS = 12
"""Maximum number of runs whose marks have names."""


def growth_svg(history: History) -> str:
    """Return a chart of the figure after each case as `<svg>`, with a point for each case that changed it.

    The chart takes the width of its container. Widths are percentages, and only the curve is stretched, so that texts
    keep their size.
    """
    total = len(history.cases)
    figure = history.coverage.figure
    steps = tuple(growth(history.coverage))
    description = f"After {total} cases the figure is {figure}; {len(steps)} of them increased it."
    root = picture(
        "How the figure grew with the cases", description, "growth", role="img", class_="growth", width="100%"
    )
    root.set("height", str(_HEIGHT))
    root.set("font-family", "system-ui, sans-serif")
    root.set("font-size", "12")
    if not total or figure.percent is None:
        words = "no cases yet" if figure.percent is not None else "there is nothing to visit"
        add(root, "text", words, x="50%", y=_HEIGHT / 2, text_anchor="middle", fill=colour("muted"))
        return written(root)
    _percents(root)
    _numbers(root, total)
    _runs(root, history)
    _curve(root, steps, total)
    _points(root, steps, total)
    _final(root, figure)
    return written(root)


def _x(position: float, total: int) -> str:
    """Return the horizontal position after `position` cases."""
    return f"{_LEFT + (_RIGHT - _LEFT) * position / total:.3f}%"


def _y(figure: Figure) -> float:
    return _TOP + _PLOT_HEIGHT * (1 - figure.visited / figure.of)


def _percents(root: Element) -> None:
    for percent in (0, 25, 50, 75, 100):
        y = _TOP + _PLOT_HEIGHT * (1 - percent / 100)
        add(root, "line", x1=f"{_LEFT}%", x2=f"{_RIGHT}%", y1=y, y2=y, stroke=colour("line"))
        add(root, "text", f"{percent} %", x=f"{_LEFT - 1}%", y=y + 4, text_anchor="end", fill=colour("muted"))


def _numbers(root: Element, total: int) -> None:
    """Add about four numbers of cases below the chart; all but the last are round."""
    y = _TOP + _PLOT_HEIGHT + 18
    width = 10 ** (len(str(total)) - 1)
    width = next(size for size in (width // 2, width, 2 * width) if size and total / size <= 5)  # noqa: PLR2004
    for position in (*(p for p in range(0, total, width) if p <= total - width / 2), total):
        anchor = "end" if position == total else "middle"
        add(root, "text", f"{position:,}", x=_x(position, total), y=y, text_anchor=anchor, fill=colour("muted"))
    add(root, "text", "cases", x=f"{(_LEFT + _RIGHT) / 2}%", y=y + 20, text_anchor="middle", fill=colour("muted"))


def _runs(root: Element, history: History) -> None:
    """Add a dashed line where the cases of each run but the first begin."""
    runs = [case.run for case in history.cases]
    begins = [(i, run) for i, run in enumerate(runs) if i and runs[i - 1] != run]
    for index, run in begins:
        x = _x(index, len(runs))
        group = add(root, "g", class_="run")
        begun = history.runs[run]
        add(group, "title", f"run {run + 1}, {begun.started[:10]}: {begun.command}")
        y2 = _TOP + _PLOT_HEIGHT
        line = add(group, "line", x1=x, x2=x, y1=_TOP - 6, y2=y2, stroke=colour("muted"), stroke_dasharray="3 4")
        line.set("pointer-events", "stroke")
        if len(begins) < _MAX_RUNS:
            add(group, "text", f"run {run + 1}", x=x, y=_TOP - 10, text_anchor="middle", fill=colour("muted"))


def _curve(root: Element, steps: tuple[GrowthStep, ...], total: int) -> None:
    """Add the figure as a step curve, in a nested picture that is stretched to the width of the plot."""
    box = {"viewBox": f"0 0 {total} 1", "preserveAspectRatio": "none", "overflow": "visible"}
    plot = add(root, "svg", x=f"{_LEFT}%", y=_TOP, width=f"{_RIGHT - _LEFT}%", height=_PLOT_HEIGHT, **box)
    parts = ["M0 1"]
    parts += [f"H{step.number} V{1 - step.figure.visited / step.figure.of:.5f}" for step in steps]
    way = " ".join((*parts, f"H{total}"))
    add(plot, "path", d=f"{way} V1 H0 z", fill=colour("visited"), fill_opacity="0.12")
    line = add(plot, "path", d=way, fill="none", stroke=colour("visited"), stroke_width="2")
    line.set("vector-effect", "non-scaling-stroke")


def _points(root: Element, steps: tuple[GrowthStep, ...], total: int) -> None:
    for step in steps:
        # not focusable: the list of cases has the same links for keyboard users
        link = add(root, "a", href=f"#/case/{quote(step.case, safe='')}", tabindex="-1")
        point = add(link, "circle", cx=_x(step.number, total), cy=_y(step.figure), r="3.5", fill=colour("visited"))
        add(point, "title", _tooltip(step))


def _tooltip(step: GrowthStep) -> str:
    names = [str(obligation) for obligation in step.added[:_MAX_NAMES]]
    more = len(step.added) - len(names)
    names += [f"and {more} more"] if more else []
    return "\n".join((f"{step.case}, case {step.number}: {step.figure}, {len(step.added)} more", *names))


def _final(root: Element, figure: Figure) -> None:
    """Add the final figure at the end of the curve; below the curve if there is no space above it."""
    y = _y(figure)
    y += 20 if y < _TOP + 20 else -8
    text = add(root, "text", str(figure), x=f"{_RIGHT}%", y=y, text_anchor="end", fill=colour("fg"))
    text.set("font-weight", "600")
    text.set("font-size", "15")
