"""What is missing, on the terminal: a listing if it is short, else the reasons, each with a few names."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import Aspect, Decision, InstanceFolds
from scbm.model.visible_text import counted
from scbm.reports.cover_advice import in_few
from scbm.reports.figure_table import STATUS_MARKS, wrapped
from scbm.reports.missed_groups import reason_groups

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.reports.missed_reasons import Missed

MAX_LISTED = 70
"""Maximum number of lines of a listing; of a longer one only the reasons are shown, unless all of it is asked for."""

_MAX_REASONS = 12

_INDENT = 4


def is_too_long(listing: Sequence[Text], *, shows_all: bool) -> bool:
    """Return whether the reasons alone are shown instead of a listing."""
    return len(listing) > MAX_LISTED and not shows_all


def reason_lines(model: BehaviorModel, missed: Iterable[Missed], columns: int) -> Iterator[Text]:
    """Yield the reasons why obligations are missing, each with its first operations; there is at least one."""
    groups = reason_groups(missed)
    folds = InstanceFolds.of(model)
    yield Text()
    yield Text(f"Missing, for {counted(len(groups), 'reason')}", style="bold")
    for group in islice(groups, _MAX_REASONS):
        style = "red" if group.status is Decision.UNDECIDED else "dim"
        first, *others = wrapped(group.sentence, columns, f"  {STATUS_MARKS[group.status]} ", _INDENT)
        yield Text(first[:_INDENT], style=style).append(first[_INDENT:], style="not red")
        yield from map(Text, others)
        is_automatic = group.missed[0].obligation.aspect is Aspect.TAKEN
        names = in_few(folds.folded(group.subjects, is_automatic=is_automatic))
        yield from (Text(line, style="dim") for line in wrapped(f"{group.aspects}: {names}", columns, "    ", _INDENT))
    if len(groups) > _MAX_REASONS:
        yield Text(f"  and {counted(len(groups) - _MAX_REASONS, 'more reason')}", style="dim")
    yield Text("  --all lists each of them", style="dim")
