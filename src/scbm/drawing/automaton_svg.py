"""One automaton as a part of a picture: its frame, its values, and the arrows between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.drawing.automata import ANY_OTHER
from scbm.drawing.drawn_automata import ArrowStyle
from scbm.drawing.edge_statuses import NO_PAINT, PAINTS
from scbm.drawing.label_widths import label_width
from scbm.drawing.layered_layout import LayoutEdge, LayoutNode, Point, lay_out
from scbm.drawing.picture_parts import (
    LINE_HEIGHT,
    NODE_SIZE,
    TITLE_SIZE,
    TextLine,
    arrow,
    box,
    box_width,
    text,
    text_lines,
    value_box,
)
from scbm.reports.html.diagrams import add, colour

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from xml.etree.ElementTree import Element

    from scbm.drawing.drawn_automata import DrawnArrow, DrawnAutomaton, DrawnNode, MakerLine
    from scbm.drawing.picture_parts import PictureLinks

_MAX_LINES = 4
"""Maximum number of makers that the label of an arrow names; its tooltip names all."""

_OUTSIDE = "6 2 1.5 2 1.5 2"
"""The pattern of the lines of the environment, which no status has."""

_HEIGHT, _MARGIN, _TITLE_HEIGHT = 24, 12, 26
OTHER = TextLine("any other", tooltip="any other value")


def arrow_line(style: ArrowStyle, paint: str, *, is_thin: bool = False) -> tuple[str, float, str]:
    """Return the colour, the width and the pattern of the line of an arrow."""
    found = PAINTS.get(paint, NO_PAINT)
    patterns = {ArrowStyle.OPERATION: found.dashes, ArrowStyle.AUTOMATIC: found.dots, ArrowStyle.OUTSIDE: _OUTSIDE}
    return paint or "muted", 0.8 if is_thin else 2.2 if paint == "visited" else 1.6, patterns[style]


class AutomatonPicture:
    """An automaton with its layout.

    Attributes:
        size: the width and the height of its frame.
    """

    def __init__(self, automaton: DrawnAutomaton, links: PictureLinks) -> None:
        self._automaton, self._links = automaton, links
        self._moves = [each for each in automaton.arrows if each.way.source != each.way.target]
        loops = [each for each in automaton.arrows if each.way.source == each.way.target]
        self._labels = [self._label(each) for each in self._moves]
        self._loops = [
            [line for each in loops if each.way.source == number for line in self._label(each)]
            for number in range(len(automaton.nodes))
        ]
        self._sizes = [self._size(node, lines) for node, lines in zip(automaton.nodes, self._loops, strict=True)]
        if any(each.way.source == ANY_OTHER for each in self._moves):
            self._sizes.append(LayoutNode(box_width(OTHER.text), _HEIGHT))
        ends = [(each.way.source % len(self._sizes), each.way.target) for each in self._moves]  # ANY_OTHER is the last
        sizes = [(max(line.width for line in label) + _MARGIN, LINE_HEIGHT * len(label)) for label in self._labels]
        edges = [LayoutEdge(*end, *size) for end, size in zip(ends, sizes, strict=True)]
        self._layout = lay_out(self._sizes, edges)
        count = len(automaton.variables)
        self._title = f"{automaton.title}, {count} alike" if count > 1 else automaton.title
        width = max(self._layout.size.x, label_width(self._title, TITLE_SIZE) * 1.1)
        self.size = Point(width + 2 * _MARGIN, self._layout.size.y + _TITLE_HEIGHT + _MARGIN)

    def draw(self, parent: Element, corner: Point) -> None:
        """Add the picture, with its upper left corner at a point."""
        group = add(parent, "g", class_="automaton", transform=f"translate({corner.x:.6g} {corner.y:.6g})")
        middle = Point(self.size.x / 2, self.size.y / 2)
        box(group, middle, *self.size, rx=8, fill=colour("bg"), stroke=colour("line"))
        title = TextLine(self._title, tooltip="\n".join(self._automaton.variables))
        text(group, title, Point(_MARGIN, _TITLE_HEIGHT / 2), TITLE_SIZE, text_anchor="start", font_weight="600")
        inner = add(group, "g", transform=f"translate({_MARGIN} {_TITLE_HEIGHT})")
        for each, route in zip(self._moves, self._layout.routes, strict=True):
            arrow(inner, route.points, *arrow_line(each.way.style, each.paint, is_thin=each.way.is_meanwhile))
        for label, route in zip(self._labels, self._layout.routes, strict=True):
            width, height = max(line.width for line in label) + 4, LINE_HEIGHT * len(label)
            box(inner, route.label, width, height, fill=colour("bg"))
            text_lines(inner, label, Point(route.label.x, route.label.y - height / 2))
        for number, node in enumerate(self._automaton.nodes):
            self._draw_node(inner, node, number)
        for middle in self._layout.nodes[len(self._automaton.nodes) :]:
            text(inner, OTHER, middle, NODE_SIZE)

    def _size(self, node: DrawnNode, loops: Sequence[TextLine]) -> LayoutNode:
        width = max([box_width(node.label), *(line.width + _MARGIN for line in loops)])
        return LayoutNode(width + (4 if node.is_allowed else 0), _HEIGHT + LINE_HEIGHT * len(loops))

    def _draw_node(self, parent: Element, node: DrawnNode, number: int) -> None:
        (width, height), middle = self._sizes[number], self._layout.nodes[number]
        value_box(parent, middle, LayoutNode(width, height), is_nominal=node.is_nominal, is_allowed=node.is_allowed)
        if node.is_present:
            box(parent, middle, width, height, fill=colour("excluded"), fill_opacity=0.35, stroke="none")
        words = [node.label, *(["nominal value"] if node.is_nominal else [])]
        words += ["allowed initial value"] if node.is_allowed else []
        top = middle.y - height / 2
        text(parent, TextLine(node.label, tooltip="\n".join(words)), Point(middle.x, top + _HEIGHT / 2), NODE_SIZE)
        text_lines(parent, self._loops[number], Point(middle.x, top + _HEIGHT - 4))

    def _label(self, each: DrawnArrow) -> list[TextLine]:
        """Return the lines of the label of an arrow; the last one counts the makers that are not named."""
        lines = [self._line(each, line) for line in each.lines]
        if len(lines) <= _MAX_LINES:
            return lines
        hidden = lines[_MAX_LINES - 1 :]
        more = TextLine(f"+ {len(hidden)} more", tooltip="\n".join(line.tooltip for line in hidden))
        return [*lines[: _MAX_LINES - 1], more]

    def _line(self, each: DrawnArrow, line: MakerLine) -> TextLine:
        link = self._links.target(line.obligations[0]) if len(line.obligations) == 1 else ""
        mark = PAINTS.get(line.paint, NO_PAINT).mark
        return TextLine(line.text, mark, line.paint, "\n".join(self._tooltip(each, line)), link)

    def _tooltip(self, each: DrawnArrow, line: MakerLine) -> Iterator[str]:
        """Yield the makers with their statuses, and what the arrow means."""
        for maker in line.makers:
            status = "" if maker.obligation is None else self._links.statuses.words(maker.obligation)
            yield f"{maker}: {status}" if status else f"{maker}"
        yield line.makers[0].kind.value
        if each.way.is_meanwhile:
            yield "from this value only if something changes the variable during the operation"
        if each.way.is_bound:
            yield "≤: its guard may exclude this value"
