"""The contexts of obligations (the cases that visit each), and the smallest suite, for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import Coverage, only_by, visitors_of_each
from scbm.model import format_moment
from scbm.model.visible_text import counted
from scbm.reports.figure_table import command_text
from scbm.reports.stored_cases import again

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import Cover
    from scbm.store import History, StoredCase

_MAX_CASES_NAMED = 3
_MAX_OBLIGATIONS_NAMED = 8


def contexts_report(history: History) -> Iterator[Text]:
    """Yield for each obligation the cases that visit it, then for each case the obligations that it alone visits."""
    yield Text("Contexts: ", style="bold").append(f"{history.model.name}, {counted(len(history.cases), 'case')}")
    yield from _visitors(history)
    yield from _alone(history)


def _visitors(history: History) -> Iterator[Text]:
    visitors = visitors_of_each(history.coverage)
    visited = [(each, by) for each, by in zip(history.statuses.entries, visitors, strict=True) if by]
    width = max((len(str(each.obligation)) for each, _ in visited), default=0)
    if visited:
        yield Text()
        yield Text(f"{'Obligation':<{width + 2}}  cases", style="bold")
    for each, by in visited:
        first = [history.labels[place] for place in by[:_MAX_CASES_NAMED]]
        line = Text(f"  {each.obligation!s:<{width}}  {len(by):>5}  ").append(_some(first, len(by)), style="dim")
        yield line.append(f"; {each.forced_in_words}" if each.forced_in_words else "", style="yellow")
    missed = len(visitors) - len(visited)
    if missed:
        yield Text()
        yield Text(f"  {counted(missed, 'more obligation')}, visited by no case", style="red")


def _alone(history: History) -> Iterator[Text]:
    alone = only_by(history.coverage)
    rows = [place for place, bits in enumerate(alone) if bits]
    yield from _heading("Case", "visits  alone", [history.labels[place] for place in rows])
    width = max((len(history.labels[place]) for place in rows), default=0)
    for place in rows:
        visits, bits = _count(history, history.cases[place].visited), alone[place]
        yield Text(f"  {history.labels[place]:<{width}}  {visits:>6}  {_count(history, bits):>5}")
        yield _names(history, bits)
    rest = len(history.cases) - len(rows)
    if rest:
        more = counted(rest, "more case" if rows else "case")
        yield Text(f"  {more} {'visits' if rest == 1 else 'visit'} only what other cases visit too", style="dim")


def smallest_report(history: History, cover: Cover) -> Iterator[Text]:
    """Yield the cases of the smallest suite, what each adds, and the commands that run them.

    Args:
        history: the history that has the cases.
        cover: the suite, as indices into `history.cases`.
    """
    cases = [history.cases[place] for place in cover.chosen]
    yield Text("Smallest suite: ", style="bold").append(f"{len(cases)} of {counted(len(history.cases), 'case')}")
    yield Text()
    yield Text("  Visits the same: ").append(str(history.coverage.figure), style="bold")
    yield Text(f"  {_proof(cover)}", style="green" if cover.is_smallest else "yellow")
    yield Text(f"  {_cost(cases, history)}")
    yield from _rows(history, cover)
    yield from _commands(history, cases)


def _proof(cover: Cover) -> str:
    """Return whether the suite is proved to be the smallest, and the lower bound otherwise."""
    if cover.is_smallest:
        return "Proved: no smaller suite visits the same"
    return f"At least {cover.at_least} cases are needed to visit the same; whether {cover.at_least} suffice is open"


def _cost(cases: Sequence[StoredCase], history: History) -> str:
    requests = sum(case.requests for case in cases)
    ended_ns = sum(case.ended_ns for case in cases)
    of_requests = counted(sum(case.requests for case in history.cases), "request")
    return f"It takes {requests} of {of_requests}, {format_moment(ended_ns)} of {format_moment(history.ended_ns)}"


def _rows(history: History, cover: Cover) -> Iterator[Text]:
    labels = [history.labels[place] for place in cover.chosen]
    visits = [history.cases[place].visited for place in cover.chosen]
    alone = only_by(Coverage(history.obligations, tuple(zip(labels, visits, strict=True))))
    yield from _heading("Case", "visits   adds  needed for", labels)
    width = max(map(len, labels), default=0)
    before = 0
    for label, visited, only in zip(labels, visits, alone, strict=True):
        adds = _count(history, visited & ~before)
        yield Text(f"  {label:<{width}}  {_count(history, visited):>6}  {adds:>5}  {_count(history, only):>10}")
        yield _names(history, only)
        before |= visited


def _count(history: History, bits: int) -> int:
    """Return the number of obligations of a set that count in SCBM-IAS; queued ones are named, not counted."""
    return history.obligations.figure(bits).visited


def _commands(history: History, cases: Sequence[StoredCase]) -> Iterator[Text]:
    if not cases:
        return
    yield Text()
    yield Text("Repeat these cases", style="bold")
    commands = [again(case, history.source.path, history.runs) for case in cases]
    for command in dict.fromkeys(filter(None, commands)):
        yield command_text("  ", command)
    over_nodes = sum(bool(command) and case.is_over_nodes for case, command in zip(cases, commands, strict=True))
    if over_nodes:
        words = f"{counted(over_nodes, 'case')} ran over nodes: only a whole run can be repeated"
        yield Text(f"  {words}", style="yellow")
    earlier = commands.count("")
    if earlier:
        yield Text(f"  {counted(earlier, 'case')} of an earlier model cannot be repeated", style="yellow")


def _heading(first: str, columns: str, labels: Sequence[str]) -> Iterator[Text]:
    yield Text()
    if labels:
        yield Text(f"{first:<{max(map(len, labels)) + 2}}  {columns}", style="bold")


def _names(history: History, bits: int) -> Text:
    """Return a line with the names of the obligations of a set."""
    names = history.obligations.names(bits)
    return Text(f"      {_some(names[:_MAX_OBLIGATIONS_NAMED], len(names))}", style="dim")


def _some(names: Sequence[str], of: int) -> str:
    more = f" and {of - len(names)} more" if of > len(names) else ""
    return f"{', '.join(names)}{more}"
