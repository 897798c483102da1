"""The figures of a coverage and the table of missed obligations, for the terminal; reports share them."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import (
    STATE_ASPECTS,
    Aspect,
    Decision,
    InstanceFolds,
    LiftedStatuses,
    Obligation,
    Statuses,
    first_missed,
)
from scbm.model.visible_text import counted

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from scbm.cases.coverage import Coverage, Figure, LiftedStatus, ObligationStatus
    from scbm.model import BehaviorModel
    from scbm.running.simulation.device_hazards import Hazard
    from scbm.testing import Excuse
    from scbm.testing.decided_requirements import CheckedRequirement

DEFAULT_COLUMNS = 80
"""The width of a report where nothing says another one."""

COLUMNS = (Aspect.QUEUED, *STATE_ASPECTS)
"""The aspects of operations, in the order of the table."""

_LONGEST_BAR = 50
_FIGURE_WIDTH = 42
"""The columns of a line of figures that stand before its bar."""

_SHORT_HEADS = ("queued", "disab.", "exec.", "failed", "timed.", "compl.")
_INITIAL_HEADS = ("que", "dis", "exe", "fai", "tim", "com")
_HEADS = (
    (10, tuple(aspect.value for aspect in COLUMNS)),
    (7, _SHORT_HEADS),
    (4, _INITIAL_HEADS),
)
"""Forms of the table, the widest first: the width of a column, and the head of each."""

STATUS_MARKS = {
    Decision.COVERED: "●",
    Decision.UNCOVERABLE: "\u00d7",
    Decision.EXCLUDED: "⊘",
    Decision.WAIVED: "~",
    Decision.UNDECIDED: "○",
}
"""One character for each status: reports do not rely on colours alone."""

FORCED_MARK = "▲"
"""The mark beside that of the status, for an obligation that only forced states visit."""

_STATUS_STYLES = {Decision.COVERED: "dim green", Decision.UNDECIDED: "red"}
"""The colours of marks; the others are dim."""

_NAME_INDENT = len("  op: ")
_GUARD_INDENT = 8


def short_of_goal_in_words(cases: int, excuses: Mapping[Excuse, int]) -> str:
    """Return how many cases passed although they missed a goal, and why they were allowed to; empty for none.

    Args:
        cases: the number of these cases.
        excuses: how many of their missed goals were excused, by the reason.
    """
    if list(excuses.values()) == [cases]:  # one reason for all
        reasons = ", ".join(f"by {excuse.words}" for excuse in excuses)
    else:
        reasons = ", ".join(f"{number} by {excuse.words}" for excuse, number in excuses.items())
    missed = sum(excuses.values())
    goals = f" with {missed} missed goals" if missed != cases else ""  # a case can have several
    return f"{counted(cases, 'case')}{goals}, {reasons}" if cases else ""


def verdict_lines(cases: int, failed: int) -> Iterator[Text]:
    """Yield how many cases passed and failed; nothing if none failed."""
    if failed:
        yield Text(f"  Verdicts: {cases - failed} passed, {failed} failed")


_LONGEST_NAME = 40
"""Number of characters beyond which what is known of a requirement does not stand beside its name."""


def requirement_lines(found: Sequence[CheckedRequirement], columns: int) -> Iterator[Text]:
    """Yield a line for each requirement: how many cases check it, and what closing says; one for open built-in ones."""
    rows, alike = [], dict[str, list[str]]()
    for each in found:
        if each.is_built_in and not each.is_notable and each.decision is None:
            alike.setdefault(each.words, []).append(each.name)
        else:
            rows.append((each.name, each.words))
    rows += [("built-in", f"{', '.join(names)}: {words}") for words, names in alike.items()]
    if rows:
        yield Text("  Requirements:")
    width = max((len(name) for name, _ in rows if len(name) <= _LONGEST_NAME), default=0)
    for name, words in rows:
        if len(name) > _LONGEST_NAME:  # a sentence of the command line
            yield from map(Text, wrapped(name, columns, "    ", 6))
            yield from map(Text, wrapped(words, columns, "      ", 6))
            continue
        for number, line in enumerate(wrapped(words, max(20, columns - width - 6), "", 0)):
            yield Text(f"    {'' if number else name:<{width}}  {line}")


def hazard_lines(hazards: Sequence[tuple[str, Hazard]], count: int, columns: int) -> Iterator[Text]:
    """Yield the number of hazards at devices, and a line for each of the first ones, behind the name of its case."""
    if not count:
        return
    yield Text()
    yield Text(f"Hazards at devices: {count}", style="bold red")
    for name, hazard in hazards:
        yield from map(Text, wrapped(f"{name}: {hazard}", columns, "  ", 4))
    if count > len(hazards):
        yield Text(f"  and {count - len(hazards)} more", style="dim")


def wrapped(words: str, columns: int, first: str, following: int) -> Iterator[str]:
    """Break words into lines. A name in them is never broken.

    Args:
        words: what is broken.
        columns: the width of a line.
        first: what the first line begins with.
        following: by how much the others are indented.
    """
    yield from wrap(
        words,
        max(columns, following + 20),
        initial_indent=first,
        subsequent_indent=" " * following,
        break_long_words=False,
        break_on_hyphens=False,
    )


def command_text(before: str, command: str, what: str = "") -> Text:
    """Return a line with a command, which is never broken: people copy it.

    Args:
        before: what stands before the command.
        command: for a shell.
        what: what the command does, behind it.
    """
    line = Text(before, no_wrap=True).append(command, style="cyan")
    return line.append(f"   {what}", style="dim") if what else line


def headline(figure: Figure, columns: int = DEFAULT_COLUMNS) -> Text:
    """Return the figure of the paper, with a bar."""
    line = Text("  SCBM-IAS: ").append(str(figure), style="bold")
    if figure.percent is None:
        return line
    line.append("  ")
    return line.append_text(bar_of(figure, max(10, min(_LONGEST_BAR, columns - len(line)))))


def bar_of(figure: Figure, width: int) -> Text:
    """Return a bar that is never full before all is visited, and never empty when something is."""
    if not figure.of:
        return Text()
    filled = round(width * figure.visited / figure.of)
    if 0 < figure.visited < figure.of:
        filled = min(max(filled, 1), width - 1)
    return Text("█" * filled, style="green").append("░" * (width - filled), style="red")


def figures(coverage: Coverage, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield a line for each aspect: how much of it was visited."""
    for aspect in STATE_ASPECTS:
        yield _row(f"Visited {aspect} state", coverage.figure_of(aspect), columns)
    yield _row("Automatic transitions taken", coverage.figure_of(Aspect.TAKEN), columns)
    yield _row("Queued (not in SCBM-IAS)", coverage.figure_of(Aspect.QUEUED), columns)


def _row(label: str, figure: Figure, columns: int) -> Text:
    line = Text(f"  {label + ':':<29}{figure.visited:>4} / {figure.of:<4}")
    line.append_text(bar_of(figure, min(figure.of, _LONGEST_BAR, max(10, columns - _FIGURE_WIDTH))))
    line.rstrip()
    return line


def missed_table(model: BehaviorModel, statuses: Statuses, columns: int = DEFAULT_COLUMNS) -> Iterator[Text]:
    """Yield a row for each operation that misses something, and for each automatic transition that was not taken."""
    lifted = LiftedStatuses.of(model, statuses)
    if lifted is not None:
        yield from _folded_table(model, lifted, statuses, columns)
        return
    known = statuses.by_obligation
    missed = {o: status for o, status in known.items() if status.marked is not Decision.COVERED}
    if not missed:
        return
    rows = [o.name for o in model.operations if any(Obligation(o.name, a) in missed for a in COLUMNS)]
    transitions = [t for t in model.automatic_transitions if Obligation(t.name, Aspect.TAKEN) in missed]
    names = [*rows, *(transition.name for transition in transitions)]
    width, cell, heads = _form(rows or names, names, columns)
    shown = [status for o, status in known.items() if o.subject in names]
    decisions = dict.fromkeys(each.decision for each in shown)
    yield Text()
    title = Text(f"{_title(decisions):<{width + _NAME_INDENT}}", style="bold")
    yield title.append("".join(f"{head:^{cell}}" for head in heads).rstrip() if rows else "")
    for name in rows:
        yield from _marks(name, width, cell, known)
    lines = [
        Text(f"  at: {obligation.subject:<{width}}", no_wrap=True).append_text(_mark(missed[obligation], cell))
        for obligation in (Obligation(transition.name, Aspect.TAKEN) for transition in transitions)
    ]
    guards = [f"waits for {transition.running_guard}" for transition in transitions]
    is_wide = all(len(line) + len(guard) <= columns for line, guard in zip(lines, guards, strict=True))
    for line, guard in zip(lines, guards, strict=True):
        if is_wide:
            yield line.append(guard)
        else:
            line.rstrip()
            yield line
            yield from map(Text, wrapped(guard, columns, " " * _GUARD_INDENT, _GUARD_INDENT + 2))
    yield from _legend(decisions, any(each.is_forced for each in shown))


def _title(found: Collection[Decision]) -> str:
    """Return the title of the table, with the mark of undecided obligations if it occurs."""
    return f"Missed ({STATUS_MARKS[Decision.UNDECIDED]})" if Decision.UNDECIDED in found else "Missed"


def _legend(found: Collection[Decision], is_forced: bool) -> Iterator[Text]:  # noqa: FBT001 - whether the mark occurs
    """Yield the meaning of the marks in the table."""
    plain = (Decision.COVERED, Decision.UNDECIDED)
    marks = [f"{STATUS_MARKS[status]} {status.words}" for status in Decision if status in found and status not in plain]
    marks += [f"{FORCED_MARK} visited in forced states only"] if is_forced else []
    if marks:
        yield Text(f"  {'   '.join(marks)}", style="dim")


def _folded_table(model: BehaviorModel, lifted: LiftedStatuses, statuses: Statuses, columns: int) -> Iterator[Text]:
    """Yield a row for each entry with parameters, and for each other one, that misses something.

    A cell has the mark of the first status that any instance has, and the number of instances with this status.
    """
    rows: dict[tuple[str, bool], dict[Aspect, LiftedStatus]] = {}
    for entry in lifted.entries:
        head = "at" if entry.obligation.aspect is Aspect.TAKEN else "op"
        name = f"{entry.obligation.subject} ({len(entry.decisions)})" if entry.is_lifted else entry.obligation.subject
        rows.setdefault((f"{head}: {name}", entry.is_lifted), {})[entry.obligation.aspect] = entry
    shown = {name: cells for (name, _), cells in rows.items() if any(map(_is_missing, cells.values()))}
    if not shown:
        return
    names = [name.removeprefix("op: ").removeprefix("at: ") for name in shown]
    width, cell, heads = _form(names, names, columns)
    entries = [entry for cells in shown.values() for entry in cells.values()]
    found = dict.fromkeys(first_missed(entry.decisions) for entry in entries)
    yield Text()
    title = Text(f"{_title(found):<{width + _NAME_INDENT}}", style="bold")
    yield title.append("".join(f"{head:^{cell}}" for head in heads).rstrip())
    operations = {name: cells for name, cells in shown.items() if Aspect.TAKEN not in cells}
    transitions = {name: cells[Aspect.TAKEN] for name, cells in shown.items() if Aspect.TAKEN in cells}
    for name, cells in operations.items():
        yield from _folded_row(name, width, cell, [cells[aspect] for aspect in COLUMNS])
    missed = {each.obligation for each in statuses.entries if each.decision is not Decision.COVERED}
    guards = _folded_guards(model, missed)
    for name, entry in transitions.items():
        yield from _folded_row(name, width, cell, [entry])
        guard = guards[entry.obligation.subject, entry.is_lifted]
        yield from map(Text, wrapped(f"waits for {guard}", columns, " " * _GUARD_INDENT, _GUARD_INDENT + 2))
    yield Text("  (n): n instances; ○n: n of them", style="dim")
    yield from _legend(found, any(_is_forced_entry(entry) for entry in entries))


def _is_forced_entry(entry: LiftedStatus) -> bool:
    """Return whether only forced states visit instances."""
    return entry.is_visited and entry.decision is not Decision.COVERED


def _folded_guards(model: BehaviorModel, missed: Collection[Obligation]) -> dict[tuple[str, bool], str]:
    """Return the guards that missed automatic transitions wait for, by their entries and whether these have parameters.

    Guards of instances that are equal with the names of entries are shown once. Otherwise the first one stands there,
    with the number of the others.
    """
    folds = InstanceFolds.of(model)
    guards: dict[tuple[str, bool], dict[str, str]] = {}
    for transition in model.automatic_transitions:
        obligation, guard = Obligation(transition.name, Aspect.TAKEN), str(transition.running_guard)
        if obligation in missed:
            entry = folds.entry_of(obligation)
            key = (transition.name, False) if entry is None else (entry, True)
            guards.setdefault(key, {}).setdefault(guard if entry is None else folds.in_entries(guard), guard)
    return {
        key: next(iter(found)) if len(found) == 1 else f"{next(iter(found.values()))} (and {len(found) - 1} more)"
        for key, found in guards.items()
    }


def _is_missing(entry: LiftedStatus) -> bool:
    return any(decision is not Decision.COVERED for decision in entry.decisions)


def _folded_row(name: str, width: int, cell: int, entries: Iterable[LiftedStatus]) -> Iterator[Text]:
    row = Text(f"  {name:<{width + _NAME_INDENT - 2}}", no_wrap=True)
    if len(row) > width + _NAME_INDENT:
        yield row
        row = Text(" " * (width + _NAME_INDENT), no_wrap=True)
    for entry in entries:
        decision = first_missed(entry.decisions)
        count = str(entry.decisions.count(decision)) if entry.is_lifted and decision is not Decision.COVERED else ""
        count += FORCED_MARK if _is_forced_entry(entry) else ""
        row.append(f"{STATUS_MARKS[decision] + count:^{cell}}", style=_STATUS_STYLES.get(decision, "dim"))
    row.rstrip()
    yield row


def _form(rows: list[str], names: list[str], columns: int) -> tuple[int, int, tuple[str, ...]]:
    """Return the width of the names, the width of a column and the heads of the widest form that fits."""
    for widest in (names, rows):
        width = max(map(len, widest))
        for cell, heads in _HEADS[:2] if widest is names else _HEADS:
            if _NAME_INDENT + width + cell * len(COLUMNS) <= columns:
                return width, cell, heads
    cell, heads = _HEADS[-1]
    return max(columns - _NAME_INDENT - cell * len(COLUMNS), 0), cell, heads


def _mark(status: ObligationStatus, cell: int) -> Text:
    """Return the mark of a status in its cell of the table."""
    decision = status.marked
    mark = STATUS_MARKS[decision] + (FORCED_MARK if status.is_forced else "")
    return Text(f"{mark:^{cell}}", style=_STATUS_STYLES.get(decision, "dim"))


def _marks(name: str, width: int, cell: int, known: Mapping[Obligation, ObligationStatus]) -> Iterator[Text]:
    """Yield the row of an operation; a name that is too long for the table has a line of its own."""
    row = Text(f"  op: {name:<{width}}", no_wrap=True)
    if len(name) > width:
        yield row
        row = Text(" " * (width + _NAME_INDENT), no_wrap=True)
    for aspect in COLUMNS:
        row.append_text(_mark(known[Obligation(name, aspect)], cell))
    row.rstrip()
    yield row
