"""The figures of a coverage, and the table of what was missed, for the terminal; reports share them.

Words that reports share.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import STATE_ASPECTS, Aspect, Obligation

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases.coverage import Coverage, Figure
    from scbm.model import BehaviorModel


def counted(count: int, singular: str, plural: str | None = None) -> str:
    """`1 error`, `2 errors`."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


_BAR_WIDTH = 50
COLUMNS = (Aspect.QUEUED, *STATE_ASPECTS)
"""The aspects of operations, in the order of the table."""


def headline(figure: Figure) -> Text:
    """The paper's figure, with a bar."""
    line = Text("  SCBM-IAS: ").append(str(figure), style="bold")
    return line if figure.percent is None else line.append("  ").append_text(_bar(figure, _BAR_WIDTH))


def _bar(figure: Figure, width: int) -> Text:
    """Never full before all is visited, never empty when something is."""
    if not figure.of:
        return Text()
    filled = round(width * figure.visited / figure.of)
    if 0 < figure.visited < figure.of:
        filled = min(max(filled, 1), width - 1)
    return Text("█" * filled, style="green").append("░" * (width - filled), style="red")


def figures(coverage: Coverage) -> Iterator[Text]:
    """How much of each aspect was visited, a line each."""
    for aspect in STATE_ASPECTS:
        yield _row(f"Visited {aspect} state", coverage.figure_of(aspect))
    yield _row("Automatic transitions taken", coverage.figure_of(Aspect.TAKEN))
    yield _row("Queued in a plan", coverage.figure_of(Aspect.QUEUED)).append("  (beside the figure)", style="dim")


def _row(label: str, figure: Figure) -> Text:
    line = Text(f"  {label + ':':<29}{figure.visited:>4} / {figure.of:<4}")
    line.append_text(_bar(figure, min(figure.of, _BAR_WIDTH)))
    line.rstrip()
    return line


def missed_table(model: BehaviorModel, coverage: Coverage) -> Iterator[Text]:
    """A row for each operation that misses something, and the automatic transitions that were not taken."""
    missed = frozenset((*coverage.missed(), *coverage.missed(Aspect.QUEUED)))
    if not missed:
        return
    rows = [o.name for o in model.operations if any(Obligation(o.name, a) in missed for a in COLUMNS)]
    transitions = [t for t in model.automatic_transitions if Obligation(t.name, Aspect.TAKEN) in missed]
    width = max(len(name) for name in (*rows, *(transition.name for transition in transitions)))
    yield Text()
    heads = "".join(f"{aspect.value:^10}" for aspect in COLUMNS).rstrip() if rows else ""
    yield Text(f"{'Missed (○)':<{width + 6}}", style="bold").append(heads)
    for name in rows:
        yield _marks(name, width, missed)
    for transition in transitions:
        line = Text(f"  at: {transition.name:<{width}}").append("    ○     ", style="red")
        yield line.append(f"waits for {transition.running_guard}")


def _marks(name: str, width: int, missed: frozenset[Obligation]) -> Text:
    row = Text(f"  op: {name:<{width}}")
    for aspect in COLUMNS:
        is_missed = Obligation(name, aspect) in missed
        row.append(f"{'○' if is_missed else '●':^10}", style="red" if is_missed else "dim green")
    row.rstrip()
    return row
