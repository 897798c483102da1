"""The picture of a model as SVG: its automata in rows, and a legend of what occurs."""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.drawing.automaton_svg import AutomatonPicture, arrow_line
from scbm.drawing.drawn_automata import ArrowStyle
from scbm.drawing.edge_statuses import PAINTS
from scbm.drawing.layered_layout import LayoutNode, Point
from scbm.drawing.picture_parts import LINE_HEIGHT, TextLine, arrow, text, value_box
from scbm.model.visible_text import counted, escaped
from scbm.reports.html.diagrams import add, colour, picture, written

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from xml.etree.ElementTree import Element

    from scbm.drawing.drawn_automata import DrawnAutomaton
    from scbm.drawing.picture_parts import PictureLinks

    _Sample: TypeAlias = Callable[[Element, Point], None]

_ROW_WIDTH = 1_190
"""Maximum width of a row in pixels: that of the page of a report. A wider automaton has a row of its own."""

_GAP = 12


class PictureFrame(Struct, frozen=True):
    """What is around a picture.

    Attributes:
        title: its title for screen readers.
        caption: sentences below the legend; `None` for a picture without a legend.
        identifier: an identifier that is unique in the page.
    """

    title: str
    caption: tuple[str, ...] | None = ()
    identifier: str = "model"


def model_svg(
    automata: Sequence[DrawnAutomaton], around: PictureFrame, links: PictureLinks, *, is_alone: bool = False
) -> str:
    """Return the picture of automata as `<svg>`; one that is alone is a file of its own, with its own colours."""
    frames = [AutomatonPicture(each, links) for each in automata]
    places, size = _rows([frame.size for frame in frames])
    changes = sum(len(line.makers) for each in automata for arrow in each.arrows for line in arrow.lines)
    description = f"{counted(len(automata), 'automaton', 'automata')} with {counted(changes, 'change')}"
    root = begin(around.title, description, around.identifier, is_alone=is_alone)
    for frame, corner in zip(frames, places, strict=True):
        frame.draw(root, corner)
    if around.caption is not None:
        size = _legend(root, automata, around.caption, size)
    return finish(root, size)


def begin(title: str, description: str, identifier: str, *, is_alone: bool) -> Element:
    """Return an empty picture; one that stands alone has its own colours and a background."""
    root = picture(title, description, identifier, role="group", class_="model")
    if is_alone:
        add(root, "style", files(__package__).joinpath("picture.css").read_text("utf-8"))
        add(root, "rect", width="100%", height="100%", fill=colour("bg"))
    return root


def finish(root: Element, size: Point) -> str:
    """Return a picture of a size as text."""
    width, height = round(size.x), round(size.y)
    root.set("viewBox", f"0 0 {width} {height}")
    root.set("width", str(width))
    root.set("height", str(height))
    return escaped(written(root))


def _rows(sizes: Sequence[Point]) -> tuple[list[Point], Point]:
    """Return the corners of frames that stand in rows, and the size of all."""
    places, x, y, height, right = [], 0.0, 0.0, 0.0, 0.0
    for size in sizes:
        if x and x + size.x > _ROW_WIDTH:
            x, y, height = 0.0, y + height + _GAP, 0.0
        places.append(Point(x + _GAP, y + _GAP))
        x, height = x + size.x + _GAP, max(height, size.y)
        right = max(right, x)
    return places, Point(right + _GAP, y + height + 2 * _GAP)


def _legend(root: Element, automata: Sequence[DrawnAutomaton], caption: Sequence[str], size: Point) -> Point:
    """Add what the lines and marks of a picture mean, and a caption; return the new size."""
    x, y, limit = float(_GAP), size.y + LINE_HEIGHT / 2, max(size.x, _ROW_WIDTH / 2)
    for sample, line in _meanings(automata):
        if x > _GAP and x + line.width + 68 > limit:
            x, y = float(_GAP), y + LINE_HEIGHT + 4
        sample(root, Point(x, y))
        text(root, line, Point(x + 44, y), text_anchor="start")
        x += line.width + 68
    for sentence in caption:
        y += LINE_HEIGHT + 4
        text(root, TextLine(sentence, is_whole=True), Point(_GAP, y), text_anchor="start")
    return Point(max(size.x, limit), y + LINE_HEIGHT + _GAP)


def _meanings(automata: Sequence[DrawnAutomaton]) -> Iterator[tuple[_Sample, TextLine]]:
    """Yield what occurs in automata: each kind of value and of line, with its words."""
    nodes = [each for automaton in automata for each in automaton.nodes]
    arrows = [each for automaton in automata for each in automaton.arrows]
    if any(node.is_nominal for node in nodes):
        yield _value(is_nominal=True), TextLine("nominal value")
    if any(node.is_allowed for node in nodes):
        yield _value(is_nominal=False), TextLine("allowed initial value")
    for style in ArrowStyle:
        if any(each.way.style is style for each in arrows):
            yield _line(style), TextLine(style.value, is_whole=True)
    if any(each.way.is_meanwhile for each in arrows):
        words = "end of an operation, from a value that something else sets meanwhile"
        yield _line(is_thin=True), TextLine(words, is_whole=True)
    for name, paint in reversed(PAINTS.items()):
        if any(each.paint == name for each in arrows):
            yield _line(paint=name), TextLine(paint.words, paint.mark, name, is_whole=True)


def _value(*, is_nominal: bool) -> _Sample:
    kind = {"is_nominal": is_nominal, "is_allowed": not is_nominal}
    return lambda root, here: value_box(root, Point(here.x + 18, here.y), LayoutNode(34, 13), **kind)


def _line(style: ArrowStyle = ArrowStyle.OPERATION, paint: str = "", *, is_thin: bool = False) -> _Sample:
    line = arrow_line(style, paint, is_thin=is_thin)
    return lambda root, here: arrow(root, (here, Point(here.x + 36, here.y)), *line)
