"""All obligations of a model as one small picture: a column for each operation, a row for each of its states.

The picture has one path for each status, whatever the number of operations is. The script of the page names the cell
below the pointer.
"""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from scbm.cases.coverage import STATE_ASPECTS, Aspect, Decision, Obligation
from scbm.reports.html.diagrams import add, colour, picture, written

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import ObligationStatus
    from scbm.model import BehaviorModel
    from scbm.store import History

_ROW = 10
"""The height of a row in the picture; the width of a column is 10, too."""

_GAP = 1

_FEW_COLUMNS = 80
"""Maximum number of columns with gaps between all cells: those of more would hardly be seen."""

_SHAPES = {
    Decision.COVERED: ("visited", 0, 9),
    Decision.UNDECIDED: ("missed", 6, 3),
    Decision.UNCOVERABLE: ("uncoverable", 4, 1),
    Decision.EXCLUDED: ("excluded", 4, 1),
    Decision.WAIVED: ("waived", 4, 1),
}
"""The colour of a status, and where its bar begins in the row and ends, so that statuses differ without colours."""


def strip_rows(model: BehaviorModel) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return the aspect and the subjects of each row; the last row has the automatic transitions, if there are any."""
    names = tuple(operation.name for operation in model.operations)
    transitions = tuple(transition.name for transition in model.automatic_transitions)
    rows = [(aspect.value, names) for aspect in (Aspect.QUEUED, *STATE_ASPECTS) if names]
    return (*rows, *([(Aspect.TAKEN.value, transitions)] if transitions else []))


def strip_svg(history: History) -> str:
    """Return the picture as `<svg>`: full bars are visited, low ones missed, lines cannot be covered, triangles forced.

    It takes the width of its container, and has as many columns as the longest row has subjects.
    """
    rows = strip_rows(history.model)
    width = max((len(names) for _, names in rows), default=0)
    figure = history.coverage.figure
    description = f"{figure.visited} of {figure.of} obligations are visited. The table of operations has all of them."
    root = picture("All obligations", description, "strip", role="img", preserveAspectRatio="none")
    root.set("viewBox", f"0 0 {max(width, 1) * 10} {max(len(rows), 1) * _ROW}")
    for paint, way in _ways(history, rows):
        add(root, "path", d=way, fill=colour(paint))
    return written(root)


def _ways(history: History, rows: tuple[tuple[str, tuple[str, ...]], ...]) -> Iterator[tuple[str, str]]:
    """Yield the colour and the path of each kind of cell that occurs; equal cells of a long row are drawn as one."""
    known = history.statuses.by_obligation
    found: dict[str, list[str]] = {}
    for row, (aspect, names) in enumerate(rows):
        statuses = [known[Obligation(name, Aspect(aspect))] for name in names]
        column = 0
        for _, group in groupby(_kinds(statuses)):
            count = len(list(group))
            for paint, shape in _shapes(statuses[column], count):
                found.setdefault(paint, []).append(f"M{column * 10} {row * _ROW}{shape}")
            column += count
    yield from ((paint, "".join(parts)) for paint, parts in found.items())


def _kinds(row: Sequence[ObligationStatus]) -> Iterator[tuple[Decision, int]]:
    """Yield what neighbours have in common that are drawn as one: forced ones, and those of short rows, are alone."""
    for column, status in enumerate(row):
        yield status.marked, column if status.is_forced or len(row) <= _FEW_COLUMNS else -1


def _shapes(status: ObligationStatus, count: int) -> Iterator[tuple[str, str]]:
    """Yield the colour and the shape of equal cells, from their corner on; forced visits are a triangle over them."""
    paint, top, height = _SHAPES[status.decision if status.is_forced else status.marked]
    width = 10 * count - _GAP
    yield paint, f"m0 {top}h{width}v{height}h-{width}z"
    if status.is_forced:
        yield "forced", f"m0 9h{width}l-{width / 2}-9z"
