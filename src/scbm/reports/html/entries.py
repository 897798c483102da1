"""The entries of a model with parameters, as the pages of the HTML report fold their instances (semantics 8.6)."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, TypeVar

from msgspec import Struct

from scbm.cases.coverage import InstanceFolds, first_missed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from scbm.cases.coverage import Decision, Obligation
    from scbm.reports.missed_reasons import Missed

Row = TypeVar("Row")


class EntryCell(Struct, frozen=True):
    """One aspect of all instances of an entry.

    Attributes:
        aspect: the aspect.
        decision: the first status that an instance has that is not covered; covered if all are.
        visited: the number of instances that a case visits, forced states included.
        count: the number of instances.
    """

    aspect: str
    decision: Decision
    visited: int
    count: int

    @staticmethod
    def of(aspect: str, instances: Iterable[tuple[Decision, bool]]) -> EntryCell:
        """Return the cell of an aspect, from the status of each instance and whether a case visits it."""
        found = tuple(instances)
        decision = first_missed(decision for decision, _ in found)
        return EntryCell(aspect, decision, sum(is_visited for _, is_visited in found), len(found))


class MissedGroup(Struct, frozen=True):
    """The missed obligations of an entry, or of the parts between two entries with parameters.

    Attributes:
        entry: the name of the entry; `None` for parts without parameters.
        count: the number of its instances.
        missed: the missed obligations.
        in_words: how many instances miss each aspect, such as `3 failed, 8 timedout`.
    """

    entry: str | None
    count: int
    missed: tuple[Missed, ...]
    in_words: str


def missed_groups(missed: Iterable[Missed], folds: InstanceFolds) -> Iterator[MissedGroup]:
    """Yield the missed obligations of each entry together, in the order of the model."""
    for entry, found in rows_by_entry(missed, lambda each: each.obligation, folds):
        counts: dict[str, int] = {}
        for each in found:
            counts[each.obligation.aspect.value] = counts.get(each.obligation.aspect.value, 0) + 1
        words = ", ".join(f"{count} {aspect}" for aspect, count in counts.items())
        is_automatic = found[0].obligation.aspect.value == "taken"
        count = 0 if entry is None else folds.count(entry, is_automatic=is_automatic)
        name = f"automatic/{entry}" if is_automatic and entry is not None else entry
        yield MissedGroup(name, count, found, words)


def rows_by_entry(
    rows: Iterable[Row], about: Callable[[Row], Obligation], folds: InstanceFolds
) -> Iterator[tuple[str | None, tuple[Row, ...]]]:
    """Yield the rows of each entry with its name, and those of parts without parameters with `None`."""
    found = tuple(rows)
    order: dict[tuple[bool, str], int] = {}
    for row in found:
        order.setdefault(_key(about(row), folds), len(order))
    by_entry = sorted(found, key=lambda row: order[_key(about(row), folds)])
    for entry, group in groupby(by_entry, key=lambda row: (folds.entry_of(about(row)), about(row).aspect == "taken")):
        yield entry[0], tuple(group)


def _key(obligation: Obligation, folds: InstanceFolds) -> tuple[bool, str]:
    return obligation.aspect.value == "taken", folds.entry_of(obligation) or obligation.subject
