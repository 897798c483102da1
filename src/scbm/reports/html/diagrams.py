"""The lifecycle of an operation as a diagram: its states, its transitions, and the number of cases in each state.

States and transitions are those of the table in `running/lifecycle.py` (semantics 5.5). Coverage counts the visits of
states and not of transitions, so only states are marked as visited or missed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import quote

from scbm.cases.coverage import STATE_ASPECTS, Aspect, Obligation
from scbm.model import format_duration
from scbm.model.variables import CURRENT_STATE, operation_state_name
from scbm.reports.figure_table import counted
from scbm.reports.html.svg import add, colour, picture, written

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from scbm.model import BehaviorModel, Operation
    from scbm.store import History

_WIDTH, _HEIGHT = 500, 356
_BOX_WIDTH, _BOX_HEIGHT = 112, 50

_LEFT, _MIDDLE, _RIGHT = 30, 186, 366
_PLACES = {
    "initial": (_LEFT, 46),
    "executing": (_MIDDLE, 46),
    "completed": (_RIGHT, 46),
    "failed": (_RIGHT, 148),
    "timedout": (_RIGHT, 250),
    "disabled": (_LEFT, 202),
}
"""The coordinates of the upper left corner of each state."""


def lifecycle_svg(history: History, operation_name: str) -> str:
    """Return the lifecycle of an operation as `<svg>`. Each state links to the cases that visit it.

    Raises `KeyError` if the model has no operation of that name.
    """
    operation = history.model.operation(operation_name)
    counts = _counts(history, operation_name)
    visits = ", ".join(f"{aspect} {_cases(count)}" for aspect, count in counts.items())
    title = f"Lifecycle of {operation_name}"
    description = f"States and the cases that visited them: {visits}."
    root = picture(title, description, f"lifecycle-{operation_name}", role="group", class_="lifecycle")
    root.set("viewBox", f"0 0 {_WIDTH} {_HEIGHT}")
    root.set("font-family", "system-ui, sans-serif")
    root.set("font-size", "13")
    _arrow_head(root, operation_name)
    _arrows(root, operation, _ways_to_fail(history.model, operation))
    _box(root, "initial", None)
    for aspect, count in counts.items():
        target = f"#/cases?visits={quote(f'{operation_name}/{aspect}', safe='')}"
        link = add(root, "a", href=target, aria_label=f"{aspect}: {_cases(count)}")
        _box(link, aspect, count)
    return written(root)


def _counts(history: History, operation: str) -> dict[Aspect, int]:
    """Return the number of cases that visited each state."""
    return {aspect: history.visits[Obligation(operation, aspect)] for aspect in STATE_ASPECTS}


def _cases(count: int) -> str:
    return counted(count, "case") if count else "no case"


def _ways_to_fail(model: BehaviorModel, operation: Operation) -> tuple[str, ...]:
    """Return the names of transitions that can fail an operation: its own, and automatic ones that assign its state."""
    states = (CURRENT_STATE, operation_state_name(operation.name))
    own = () if operation.failed is None else (operation.failed.name,)
    automatic = (t.name for t in model.automatic_transitions if any(a.target in states for a in t.running_actions))
    return (*own, *automatic)


def _box(parent: Element, state: str, count: int | None) -> None:
    """Add a state: green and solid if visited, red and dashed if missed, and grey if coverage does not count it."""
    x, y = _PLACES[state]
    paint = "muted" if count is None else "visited" if count else "missed"
    mark = "" if count is None else "✓ " if count else "✗ "
    middle = x + _BOX_WIDTH / 2
    group = add(parent, "g", class_=f"state {paint}")
    add(group, "rect", x=x, y=y, width=_BOX_WIDTH, height=_BOX_HEIGHT, rx=8, fill=colour("surface"))
    frame = add(group, "rect", x=x, y=y, width=_BOX_WIDTH, height=_BOX_HEIGHT, rx=8, fill=colour(paint))
    frame.set("fill-opacity", "0" if count is None else "0.12")
    frame.set("stroke", colour(paint))
    frame.set("stroke-width", "2")
    if count == 0:
        frame.set("stroke-dasharray", "6 4")
    single = count is None
    name_y = y + (30 if single else 22)
    name = add(group, "text", x=middle, y=name_y, text_anchor="middle", font_weight="600", fill=colour("fg"))
    add(name, "tspan", mark, fill=colour(paint)).tail = state
    if count is not None:
        add(group, "text", _cases(count), x=middle, y=y + 40, text_anchor="middle", fill=colour("fg"))


def _arrow_head(root: Element, operation: str) -> None:
    box = {"viewBox": "0 0 8 8", "markerWidth": "8", "markerHeight": "8", "refX": "7", "refY": "4", "orient": "auto"}
    marker = add(add(root, "defs"), "marker", id=f"arrow-{operation}", markerUnits="userSpaceOnUse", **box)
    add(marker, "path", d="M0 0 L8 4 L0 8 z", fill=colour("muted"))


def _arrows(root: Element, operation: Operation, failing: tuple[str, ...]) -> None:
    """Add the transitions as arrows with labels; dotted if the model can never take them."""
    arrow = _Arrows(root, f"url(#arrow-{operation.name})")
    arrow.draw("M142 71 H184", (163, 64), "pre", tooltip=str(operation.pre))
    arrow.draw("M298 71 H364", (331, 64), "post", tooltip=str(operation.post))
    arrow.draw("M50 96 V200", (55, 142), "otherwise", anchor="start")
    arrow.draw("M142 227 H194 Q202 227 202 219 V98", (172, 220), "pre", tooltip=str(operation.pre))
    if operation.disabled_deadline_ns is not None:
        after = format_duration(operation.disabled_deadline_ns)
        tooltip = "the disabled deadline has passed: the runner asks for a new plan"
        arrow.draw("M126 202 V98", (131, 168), "after", after, anchor="start", tooltip=tooltip)
    way = "M262 96 V165 Q262 173 270 173 H364"
    if failing:
        words = [] if operation.failed is None else ["failed"]
        words += ["automatic"] if len(failing) > len(words) else []
        arrow.draw(way, (314, 166), *words, tooltip=", ".join(failing))
    else:
        arrow.draw(way, (314, 166), "injections", "only", tooltip="no transition of the model fails it", dotted=True)
    way = "M226 96 V267 Q226 275 234 275 H364"
    if operation.deadline_ns is not None:
        arrow.draw(way, (298, 268), f"deadline {format_duration(operation.deadline_ns)}")
    else:
        arrow.draw(way, (298, 268), "no deadline", tooltip="it never times out", dotted=True)
    arrow.draw("M422 46 V28 Q422 20 414 20 H94 Q86 20 86 28 V44", (254, 14), "the next operation")
    back = "M478 173 H484 Q492 173 492 181 V322 Q492 330 484 330 H20 Q12 330 12 322 V79 Q12 71 20 71 H28"
    arrow.draw(f"M478 275 H492 {back}", (254, 346), "a new plan")


@dataclass(frozen=True, slots=True)
class _Arrows:
    root: Element
    head: str

    def draw(
        self,
        way: str,
        place: tuple[int, int],
        *lines: str,
        anchor: str = "middle",
        tooltip: str = "",
        dotted: bool = False,
    ) -> None:
        """Add an arrow along a path, with lines of text below each other from `place` on."""
        group = add(self.root, "g", class_="arrow")
        if tooltip:
            add(group, "title", tooltip)
        line = add(group, "path", d=way, fill="none", stroke=colour("muted"), stroke_width="1.5")
        line.set("marker-end", self.head)
        if dotted:
            line.set("stroke-dasharray", "2 4")
        x, y = place
        for index, words in enumerate(lines):
            add(group, "text", words, x=x, y=y + index * 20, text_anchor=anchor, font_size="12", fill=colour("muted"))
