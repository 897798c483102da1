"""Parts of pictures in SVG: boxes, arrows, labels and frames. Colours follow the theme of the page or of the viewer."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING, NamedTuple

from scbm.drawing.label_widths import label_of, label_width
from scbm.drawing.layered_layout import LayoutNode, Point
from scbm.model.visible_text import in_one_line
from scbm.reports.html.diagrams import add, colour

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from xml.etree.ElementTree import Element

    from scbm.cases.coverage import Obligation
    from scbm.drawing.edge_statuses import EdgeStatuses

NODE_SIZE, LINE_SIZE, TITLE_SIZE = 12, 11, 13
"""Font sizes of values, of the names of makers, and of titles, in pixels."""

LINE_HEIGHT = 14
_HEAD = 7.0
"""Length of an arrow head in pixels."""


class TextLine(NamedTuple):
    """A line of a label.

    Attributes:
        text: the text.
        mark: the mark of its status; may be empty.
        paint: the name of the colour of the mark; may be empty.
        tooltip: the whole text, and what is known about it.
        link: the target of a click; may be empty.
        is_whole: whether it is shown whole, however long it is.
    """

    text: str
    mark: str = ""
    paint: str = ""
    tooltip: str = ""
    link: str = ""
    is_whole: bool = False

    @property
    def label(self) -> str:
        """The text without the mark, as the picture has it."""
        return in_one_line(self.text) if self.is_whole else label_of(self.text)

    @property
    def shown(self) -> str:
        """The mark and the text as the picture has them."""
        return f"{self.mark} {self.label}" if self.mark else self.label

    @property
    def width(self) -> float:
        """Its width in pixels, in the font of names."""
        return label_width(self.shown, LINE_SIZE)


class PictureLinks(NamedTuple):
    """What a picture knows beside the model: statuses, and where a click on an obligation leads."""

    statuses: EdgeStatuses
    target: Callable[[Obligation], str]


def text(parent: Element, line: TextLine, middle: Point, size: int = LINE_SIZE, **attributes: str) -> None:
    """Add a line of text around a point, within a link if it has one; the picture has the usual attributes of texts."""
    holder = add(parent, "a", href=line.link) if line.link else parent
    known = {"font_size": str(size), **attributes} if size != LINE_SIZE else attributes
    shown = add(holder, "text", x=round(middle.x, 1), y=round(middle.y + size * 0.36, 1), **known)
    tooltip = "\n".join(map(in_one_line, (line.tooltip or line.text).split("\n")))
    parts = [add(shown, "title", tooltip)] if tooltip != line.label else []
    if line.mark:
        parts.append(add(shown, "tspan", line.mark, fill=colour(line.paint)))
    if parts:
        parts[-1].tail = f" {line.label}" if line.mark else line.label
    else:
        shown.text = line.label


def text_lines(parent: Element, lines: Sequence[TextLine], top: Point) -> None:
    """Add lines of text below each other, the first one below a point."""
    for index, line in enumerate(lines):
        text(parent, line, Point(top.x, top.y + (index + 0.5) * LINE_HEIGHT))


def box_width(label: str) -> float:
    """Return the width of a box with a value."""
    return label_width(label_of(label), NODE_SIZE) + 18  # 9 pixels on each side


def box(parent: Element, middle: Point, width: float, height: float, **attributes: str | float) -> None:
    """Add a rounded rectangle around a point."""
    known = {"rx": "5", "fill": colour("surface"), **attributes}
    place = {"x": middle.x - width / 2, "y": middle.y - height / 2, "width": width, "height": height}
    add(parent, "rect", "", **{name: round(value, 1) for name, value in place.items()}, **known)


def value_box(parent: Element, middle: Point, size: LayoutNode, *, is_nominal: bool, is_allowed: bool) -> None:
    """Add the box of a value: thick if it is the nominal one, double if runs may begin with it."""
    stroke = colour("fg") if is_nominal or is_allowed else colour("muted")
    box(parent, middle, *size, stroke=stroke, **({"stroke_width": 2.5} if is_nominal else {}))
    if is_allowed:
        box(parent, middle, size.width - 7, size.height - 7, fill="none", stroke=stroke, rx=3)


def arrow(parent: Element, points: Sequence[Point], paint: str, width: float, dashes: str) -> None:
    """Add a smooth curve through points (a Catmull-Rom spline) with a head at its end."""
    way, control = f"M{_pair(points[0])}", points[0]
    if len({point.x for point in points}) == 1 or len({point.y for point in points}) == 1:
        points = (points[0], points[-1])  # all are on one line
    around = (points[0], *points, points[-1])
    for before, here, after, next_one in zip(around, around[1:], around[2:], around[3:], strict=False):
        leave = _between(Point(here.x + (after.x - before.x) / 6, here.y + (after.y - before.y) / 6), here, after)
        control = _between(Point(after.x - (next_one.x - here.x) / 6, after.y - (next_one.y - here.y) / 6), here, after)
        way += f"C{_pair(leave)} {_pair(control)} {_pair(after)}"
    line = add(parent, "path", d=way, fill="none", stroke=colour(paint), stroke_width=width)
    if dashes:
        line.set("stroke-dasharray", dashes)
    if dashes.startswith("1.5"):
        line.set("stroke-linecap", "round")
    _head(parent, control, points[-1], paint)


def _between(point: Point, here: Point, after: Point) -> Point:
    """Return the nearest point in the rectangle between two others, so that a curve does not leave it."""
    x, y = sorted((here.x, after.x)), sorted((here.y, after.y))
    return Point(min(max(point.x, x[0]), x[1]), min(max(point.y, y[0]), y[1]))


def _head(parent: Element, before: Point, end: Point, paint: str) -> None:
    length = hypot(end.x - before.x, end.y - before.y) or 1.0
    x, y = (end.x - before.x) / length * _HEAD, (end.y - before.y) / length * _HEAD
    corners = [end, Point(end.x - x - y / 2, end.y - y + x / 2), Point(end.x - x + y / 2, end.y - y - x / 2)]
    add(parent, "polygon", points=" ".join(map(_pair, corners)), fill=colour(paint))


def _pair(point: Point) -> str:
    return " ".join(f"{value:.1f}".removesuffix(".0") for value in point)
