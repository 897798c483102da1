"""Diagrams of the HTML page as SVG: the lifecycle of an operation, and coverage as it grew over the cases of a store.

States and transitions of the lifecycle are those of the table in `running/lifecycle.py` (semantics 5.5). Coverage
counts the visits of states and not of transitions, so only states are marked as visited or missed.
"""

from __future__ import annotations

from math import log1p
from typing import TYPE_CHECKING
from urllib.parse import quote
from xml.etree.ElementTree import Element, SubElement, tostring

from msgspec import Struct

from scbm.cases.coverage import STATE_ASPECTS, Aspect, Decision, Obligation, growth
from scbm.model import format_duration
from scbm.model.variables import CURRENT_STATE, operation_state_name
from scbm.model.visible_text import counted
from scbm.reports.figure_table import STATUS_MARKS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.cases.coverage import Figure, GrowthStep
    from scbm.model import BehaviorModel, Operation
    from scbm.store import History


def colour(name: str) -> str:
    """Return a colour of the page by the name of its CSS property."""
    return f"var(--{name})"


def picture(title: str, description: str, identifier: str, **attributes: str | float) -> Element:
    """Return an `<svg>` element with a title and a description for screen readers.

    Args:
        title: the title of the picture.
        description: its content in words.
        identifier: an identifier that is unique in the page.
        attributes: attributes of the `svg` element; `role` is `img` only if the picture has no links.
    """
    names = f"{identifier}-title {identifier}-text"
    root = Element("svg", {"xmlns": "http://www.w3.org/2000/svg", "aria-labelledby": names})
    _set(root, attributes)
    add(root, "title", title, id=f"{identifier}-title")
    add(root, "desc", description, id=f"{identifier}-text")
    return root


def add(parent: Element, tag: str, text: str = "", **attributes: str | float) -> Element:
    """Append a child and return it; `stroke_width=2` becomes `stroke-width="2"`, `class_` becomes `class`."""
    child = SubElement(parent, tag)
    child.text = text or None
    _set(child, attributes)
    return child


def _set(element: Element, attributes: Mapping[str, str | float]) -> None:
    for name, value in attributes.items():
        written = f"{value:.6g}" if isinstance(value, float) else str(value)
        element.set(name.rstrip("_").replace("_", "-"), written)


def written(root: Element) -> str:
    """Return the picture as text."""
    return tostring(root, encoding="unicode")


_WIDTH, _HEIGHT = 500, 356

_LEFT, _MIDDLE, _RIGHT = 86, 242, 422
_PLACES = {
    Aspect.EXECUTING: (_MIDDLE, 68),
    Aspect.COMPLETED: (_RIGHT, 68),
    Aspect.FAILED: (_RIGHT, 170),
    Aspect.TIMEDOUT: (_RIGHT, 272),
    Aspect.DISABLED: (_LEFT, 224),
}
"""Where the name of each state stands; its box is around it."""


_COMMON_WAYS = (
    "M142 71 H184",
    "M298 71 H364",
    "M50 96 V200",
    "M142 227 H194 Q202 227 202 219 V98",
    "M422 46 V28 Q422 20 414 20 H94 Q86 20 86 28 V44",
    "M478 275 H492 M478 173 H484 Q492 173 492 181 V322 Q492 330 484 330 H20 Q12 330 12 322 V79 Q12 71 20 71 H28",
)
"""The paths of the arrows that each lifecycle has."""

_MARKS = {Decision.COVERED: ("visited", "✓ "), Decision.UNDECIDED: ("missed", "✗ ")}
"""The colour and the character of the usual statuses; others have those of their own."""


ARROW_HEAD = "arrow-head"
"""The identifier of the marker at the ends of arrows, which the page defines once for all pictures."""

_PARTS = "lifecycle-parts"
"""The identifier of what all lifecycles have in common."""


def lifecycle_svg(history: History, operation_name: str) -> str:
    """Return the lifecycle of an operation as `<svg>`. Each state links to the cases that visit it.

    Raises `KeyError` if the model has no operation of that name.
    """
    operation = history.model.operation(operation_name)
    states = _states(history, operation_name)
    number = history.model.operations.index(operation)
    title = f"Lifecycle of {operation_name}"
    root = picture(title, "A link for each state", f"lifecycle-{number}", role="group", class_="lifecycle")
    root.set("viewBox", f"0 0 {_WIDTH} {_HEIGHT}")
    add(root, "use", href=f"#{_PARTS}")
    _arrows(_Arrows.within(root), operation, _ways_to_fail(history.model, operation))
    for each in states:
        link = add(root, "a", href=f"#/cases?visits={quote(f'{operation_name}/{each.aspect}', safe='')}")
        add(link, "title", each.words)
        add(link, "use", href=f"#{each.identifier}")
    return written(root)


def lifecycle_parts(history: History) -> str:
    """Return what lifecycles have in common, which the page defines once: hundreds of them are to stay small."""
    root = Element("defs")
    for operation in history.model.operations:
        for state in _states(history, operation.name):
            if root.find(f"g[@id='{state.identifier}']") is None:
                state.draw(root)
    parts = add(root, "g", id=_PARTS)
    arrow = _Arrows.within(parts)
    for way in _COMMON_WAYS:
        arrow.draw(way)
    arrow.label((55, 142), "otherwise", anchor="start")
    arrow.label((172, 220), "pre")
    arrow.label((254, 14), "the next operation")
    arrow.label((254, 346), "a new plan")
    initial = _box(parts, "muted", (_LEFT, 68))
    add(initial, "text", "initial", y=8)
    return written(root)


class _ShownState(Struct, frozen=True):
    """A state of an operation, with the number of cases that visited it, and its status."""

    aspect: Aspect
    count: int
    status: Decision

    @property
    def identifier(self) -> str:
        """The identifier of its box, which states of other operations share."""
        return f"{self.aspect}-{self.count}-{self.status.value}"

    @property
    def words(self) -> str:
        """What it shows, in words."""
        return f"{self.aspect}: {_cases(self.count)}{'' if self.status in _MARKS else f', {self.status.words}'}"

    def draw(self, parent: Element) -> None:
        """Add its box: solid if visited, else dashed, in the colour of its status."""
        paint, mark = _MARKS.get(self.status, (self.status.value, f"{STATUS_MARKS[self.status]} "))
        box = _box(parent, paint, _PLACES[self.aspect], **({} if self.count else {"stroke-dasharray": "6 4"}))
        box.set("id", self.identifier)
        name = add(box, "text")
        add(name, "tspan", mark).tail = self.aspect
        add(box, "text", _cases(self.count), y=18)


def _states(history: History, operation: str) -> tuple[_ShownState, ...]:
    obligations = (Obligation(operation, aspect) for aspect in STATE_ASPECTS)
    known = history.statuses.by_obligation
    return tuple(_ShownState(each.aspect, history.visits[each], known[each].marked) for each in obligations)


def _box(parent: Element, paint: str, place: tuple[int, int], **attributes: str) -> Element:
    """Add a group in a colour around a point, with its frame."""
    group = add(parent, "g", class_=f"state {paint}", transform=f"translate({place[0]} {place[1]})")
    frame = add(group, "rect", x=-56, y=-22, width=112, height=50, rx=8)
    frame.attrib.update(attributes)
    return group


def _cases(count: int) -> str:
    return counted(count, "case") if count else "no case"


def _ways_to_fail(model: BehaviorModel, operation: Operation) -> tuple[str, ...]:
    """Return the names of transitions that can fail an operation: its own, and automatic ones that assign its state."""
    states = (CURRENT_STATE, operation_state_name(operation.name))
    own = () if operation.failed is None else (operation.failed.name,)
    automatic = (t.name for t in model.automatic_transitions if any(a.target in states for a in t.running_actions))
    return (*own, *automatic)


def _arrows(arrow: _Arrows, operation: Operation, failing: tuple[str, ...]) -> None:
    """Add the transitions of an operation as arrows with labels; dotted if the model can never take them."""
    arrow.label((163, 64), "pre", tooltip=str(operation.pre))
    arrow.label((331, 64), "post", tooltip=str(operation.post))
    if operation.disabled_deadline_ns is not None:
        after = format_duration(operation.disabled_deadline_ns)
        tooltip = "the disabled deadline has passed: the runner asks for a new plan"
        arrow.draw("M126 202 V98")
        arrow.label((131, 168), "after", after, anchor="start", tooltip=tooltip)
    arrow.draw("M262 96 V165 Q262 173 270 173 H364", dotted=not failing)
    if failing:
        words = [] if operation.failed is None else ["failed"]
        words += ["automatic"] if len(failing) > len(words) else []
        arrow.label((314, 166), *words, tooltip=", ".join(failing))
    else:
        arrow.label((314, 166), "injections", "only", tooltip="no transition of the model fails it")
    arrow.draw("M226 96 V267 Q226 275 234 275 H364", dotted=operation.deadline_ns is None)
    if operation.deadline_ns is not None:
        arrow.label((298, 268), f"deadline {format_duration(operation.deadline_ns)}")
    else:
        arrow.label((298, 268), "no deadline", tooltip="it never times out")


class _Arrows(Struct, frozen=True):
    """The two groups of a picture that have all arrows and all labels, which inherit colours from them."""

    arrows: Element
    labels: Element

    @staticmethod
    def within(parent: Element) -> _Arrows:
        """Return the two groups, added to an element."""
        return _Arrows(add(parent, "g", class_="arrows"), add(parent, "g", class_="labels"))

    def draw(self, way: str, *, dotted: bool = False) -> None:
        """Add an arrow along a path."""
        line = add(self.arrows, "path", d=way)
        if dotted:
            line.set("stroke-dasharray", "2 4")

    def label(self, place: tuple[int, int], *lines: str, anchor: str = "middle", tooltip: str = "") -> None:
        """Add lines of text below each other from `place` on."""
        x, y = place
        first, *others = lines
        label = add(self.labels, "text", first, x=x, y=y)
        if anchor != "middle":
            label.set("text-anchor", anchor)
        for index, words in enumerate(others, start=1):
            add(label, "tspan", words, x=x, y=y + index * 20)
        if tooltip:
            add(label, "title", tooltip)


_CHART_HEIGHT = 300
_TOP, _PLOT_HEIGHT = 24, 230
_PLOT_X, _PLOT_END = 12.0, 97.0
"""Left and right edge of the plot, in percent of the width, so that the size of texts does not depend on the width."""

_MAX_NAMES = 12
"""Maximum number of obligations in the tooltip of a step; the page of the case lists all."""

_MANY_CASES = 1_000
"""Minimum number of cases for a logarithmic axis: the first ones add most."""

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
        "How the figure grew with the cases", description, "growth", role="group", class_="growth", width="100%"
    )
    root.set("height", str(_CHART_HEIGHT))
    root.set("font-family", "system-ui, sans-serif")
    root.set("font-size", "12")
    if not total or figure.percent is None:
        words = "no cases yet" if figure.percent is not None else "there is nothing to visit"
        add(root, "text", words, x="50%", y=_CHART_HEIGHT / 2, text_anchor="middle", fill=colour("muted"))
        return written(root)
    _percents(root)
    _numbers(root, total)
    _runs(root, history)
    _curve(root, steps, total)
    _points(root, steps, total)
    _final(root, figure)
    return written(root)


def _share(position: float, total: int) -> float:
    """Return the part of the axis before `position` cases; of many cases the axis is logarithmic."""
    return log1p(position) / log1p(total) if total >= _MANY_CASES else position / total


def _x(position: float, total: int) -> str:
    """Return the horizontal position after `position` cases."""
    return f"{_PLOT_X + (_PLOT_END - _PLOT_X) * _share(position, total):.3f}%"


def _y(figure: Figure) -> float:
    return _TOP + _PLOT_HEIGHT * (1 - figure.visited / figure.of)


def _percents(root: Element) -> None:
    for percent in (0, 25, 50, 75, 100):
        y = _TOP + _PLOT_HEIGHT * (1 - percent / 100)
        add(root, "line", x1=f"{_PLOT_X}%", x2=f"{_PLOT_END}%", y1=y, y2=y, stroke=colour("line"))
        add(root, "text", f"{percent} %", x=f"{_PLOT_X - 1}%", y=y + 4, text_anchor="end", fill=colour("muted"))


def _numbers(root: Element, total: int) -> None:
    """Add about four numbers of cases below the chart; all but the last are round."""
    y = _TOP + _PLOT_HEIGHT + 18
    for position in _round_numbers(total):
        anchor = "end" if position == total else "middle"
        add(root, "text", f"{position:,}", x=_x(position, total), y=y, text_anchor=anchor, fill=colour("muted"))
    add(root, "text", "cases", x=f"{(_PLOT_X + _PLOT_END) / 2}%", y=y + 20, text_anchor="middle", fill=colour("muted"))


def _round_numbers(total: int) -> Iterator[int]:
    """Yield about four round numbers of cases, powers of ten on a logarithmic axis, then the number of all cases."""
    if total >= _MANY_CASES:
        yield from (position for power in range(12) if (position := 10**power) <= total / 2)
        yield total
        return
    width = 10 ** (len(str(total)) - 1)
    width = next(size for size in (width // 2, width, 2 * width) if size and total / size <= 5)  # noqa: PLR2004
    yield from (position for position in range(0, total, width) if position <= total - width / 2)
    yield total


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
    box = {"viewBox": "0 0 1 1", "preserveAspectRatio": "none", "overflow": "visible"}
    plot = add(root, "svg", x=f"{_PLOT_X}%", y=_TOP, width=f"{_PLOT_END - _PLOT_X}%", height=_PLOT_HEIGHT, **box)
    parts = ["M0 1"]
    parts += [f"H{_share(step.number, total):.5f} V{1 - step.figure.visited / step.figure.of:.5f}" for step in steps]
    way = " ".join((*parts, "H1"))
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
    text = add(root, "text", str(figure), x=f"{_PLOT_END}%", y=y, text_anchor="end", fill=colour("fg"))
    text.set("font-weight", "600")
    text.set("font-size", "15")
