"""The plan to a goal as a chain of operations, in lanes by the resources that carry them out."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct

from scbm.cases.coverage import Aspect, Obligation
from scbm.drawing.automaton_svg import arrow_line
from scbm.drawing.drawn_automata import ArrowStyle
from scbm.drawing.edge_statuses import NO_PAINT, PAINTS
from scbm.drawing.layered_layout import Point
from scbm.drawing.model_svg import begin, finish
from scbm.drawing.picture_parts import LINE_HEIGHT, NODE_SIZE, TextLine, arrow, box, text, text_lines
from scbm.model import Assign, Constant, format_value
from scbm.model.operations import apply
from scbm.model.predicates import conjuncts
from scbm.model.variables import State
from scbm.model.visible_text import counted
from scbm.reports.html.diagrams import colour

if TYPE_CHECKING:
    from collections.abc import Sequence
    from xml.etree.ElementTree import Element

    from scbm.drawing.picture_parts import PictureLinks
    from scbm.model import BehaviorModel, Operation

_ROW_WIDTH = 1_240
_GAP, _LANE_GAP, _LANE_NAME = 24, 10, 20


class PlannedOperation(Struct, frozen=True):
    """An operation of a plan.

    Attributes:
        number: its place, from 1.
        operation: its name.
        lane: the resources that it sends requests to.
        needs: the clauses of its precondition that are not about requests.
        sets: the variables that it changes in the plan, each with its new value.
    """

    number: int
    operation: str
    lane: str
    needs: tuple[str, ...]
    sets: tuple[str, ...]


def plan_steps(model: BehaviorModel, plan: Sequence[str], carried: Sequence[str]) -> tuple[PlannedOperation, ...]:
    """Return the steps of a plan from the nominal state; `carried` are variables that only requests need."""
    shown = [variable.name for variable in model.variables if variable.name not in carried]
    now, found = State.nominal(model.running_space), []
    for number, name in enumerate(plan, start=1):
        operation = model.operation(name)
        between = apply(operation.pre.a, now)
        after = None if between is None else apply(operation.post.a, between)
        assert after is not None  # noqa: S101 - the planner has replayed its plan
        needs = [each for each in conjuncts(operation.pre.g) if any(read in shown for read in each.reads())]
        changed = [each for each in shown if now[each] != after[each]]
        sets = tuple(f"{each} <- {format_value(after[each])}" for each in changed)
        found.append(PlannedOperation(number, name, _lane(model, operation), tuple(map(str, needs)), sets))
        now = after
    return tuple(found)


def _lane(model: BehaviorModel, operation: Operation) -> str:
    """Return the resources whose requests an operation triggers."""
    actions = [action for action in operation.pre.running_actions if isinstance(action, Assign)]
    triggered = [action.target for action in actions if action.source == Constant(True)]
    return ", ".join(resource.name for resource in model.resources if resource.trigger in triggered) or "no resource"


class _StepBox(NamedTuple):
    """A step as it is drawn: its lines, and its size."""

    lane: str
    lines: tuple[TextLine, ...]
    width: float
    height: float


def plan_svg(goal: str, steps: Sequence[PlannedOperation], links: PictureLinks, *, is_alone: bool = False) -> str:
    """Return the plan to a goal as `<svg>`: rows of operations from left to right, each row with its lanes."""
    title = f"{counted(len(steps), 'operation')} to {goal}"
    root = begin(title, "A chain of operations in lanes by resource", "plan", is_alone=is_alone)
    text(root, TextLine(title, is_whole=True), Point(_GAP, 20), NODE_SIZE + 1, text_anchor="start")
    rows: list[list[_StepBox]] = [[]]
    for each in (_step_box(step, links) for step in steps):
        if rows[-1] and _width([*rows[-1], each]) > _ROW_WIDTH:
            rows.append([])
        rows[-1].append(each)
    y = 36.0
    for number, row in enumerate(rows):
        y = _draw_row(root, row, y, is_first=number == 0)
    return finish(root, Point(max(*map(_width, rows), 400), y + _GAP))


def _step_box(step: PlannedOperation, links: PictureLinks) -> _StepBox:
    done = Obligation(step.operation, Aspect.COMPLETED)
    paint, known = links.statuses.paint([done]), links.statuses.words(done)
    tooltip = f"{step.operation}, completed: {known}" if known else step.operation
    name = f"{step.number} {step.operation}"
    head = TextLine(name, PAINTS.get(paint, NO_PAINT).mark, paint, tooltip, links.target(done))
    words = [*(f"needs {clause}" for clause in step.needs), *(f"sets {change}" for change in step.sets)]
    lines = (head, *map(TextLine, words))
    return _StepBox(step.lane, lines, max(line.width for line in lines) * 1.1 + 20, LINE_HEIGHT * len(lines) + 12)


def _width(row: Sequence[_StepBox]) -> float:
    return sum(each.width + _GAP for each in row) + _GAP


def _draw_row(root: Element, row: Sequence[_StepBox], top: float, *, is_first: bool) -> float:
    """Add a row of operations, an arrow before each but the first of all; return where the next row begins."""
    middles: dict[str, float] = {}
    for lane in dict.fromkeys(each.lane for each in row):
        height = max(each.height for each in row if each.lane == lane) + _LANE_NAME + _LANE_GAP
        middle, width = Point(_width(row) / 2, top + height / 2 - 2), _width(row) - _GAP
        box(root, middle, width, height - 4, rx=6, fill=colour("bg"), stroke=colour("line"))
        text(root, TextLine(lane), Point(_GAP, top + 11), text_anchor="start")
        middles[lane] = top + _LANE_NAME + (height - _LANE_NAME - _LANE_GAP) / 2
        top += height
    x, before = float(_GAP), None if is_first else Point(_GAP / 2, middles[row[0].lane])
    for each in row:
        middle = Point(x + each.width / 2, middles[each.lane])
        if before is not None:
            arrow(root, (before, Point(x, middle.y)), *arrow_line(ArrowStyle.OPERATION, ""))
        box(root, middle, each.width, each.height, stroke=colour("muted"))
        text_lines(root, each.lines, Point(middle.x, middle.y - each.height / 2 + 6))
        before, x = Point(x + each.width, middle.y), x + each.width + _GAP
    return top + 6
