"""The status of each obligation, and the figure of what can be covered (semantics 8.5 and 9.4)."""

from __future__ import annotations

from collections import Counter
from enum import StrEnum
from typing import TYPE_CHECKING, assert_never

from scbm.cases.coverage.obligations import Figure

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


class Decision(StrEnum):
    """The status of an obligation: the first of these that holds, in this order (semantics 9.4)."""

    COVERED = "covered"
    UNCOVERABLE = "uncoverable"
    EXCLUDED = "excluded"
    WAIVED = "waived"
    FORCED = "forced"
    UNDECIDED = "undecided"

    __hash__ = str.__hash__  # of equal value, and without a call of Python for each lookup

    @property
    def words(self) -> str:
        """The status in words, as reports write it."""
        match self:
            case Decision.EXCLUDED:
                return "excluded by the planner"
            case Decision.FORCED:
                return "covered by a forced state"
            case Decision.COVERED | Decision.UNCOVERABLE | Decision.WAIVED | Decision.UNDECIDED:
                return self.value
        assert_never(self)

    @property
    def can_be_covered(self) -> bool:
        """Whether the figure of what can be covered counts obligations of this status."""
        match self:
            case Decision.UNCOVERABLE | Decision.EXCLUDED | Decision.WAIVED:
                return False
            case Decision.COVERED | Decision.FORCED | Decision.UNDECIDED:
                return True
        assert_never(self)

    @property
    def is_always_counted(self) -> bool:
        """Whether reports give the number of obligations of this status even if it is 0."""
        return self in (Decision.COVERED, Decision.UNCOVERABLE, Decision.UNDECIDED)


def count_statuses(statuses: Iterable[Decision]) -> dict[Decision, int]:
    """Return the number of obligations of each status; each status has an entry, in the order of `Decision`."""
    counts = Counter(statuses)
    return {status: counts[status] for status in Decision}


def coverable_figure(counts: Mapping[Decision, int]) -> Figure:
    """Return the figure of what can be covered: covered of all that are not uncoverable, excluded or waived.

    Args:
        counts: the number of obligations of each status.
    """
    return Figure(counts[Decision.COVERED], sum(count for status, count in counts.items() if status.can_be_covered))


def status_counts_in_words(counts: Mapping[Decision, int]) -> str:
    """Return `76 covered, 10 uncoverable, 0 undecided of 86`; the other statuses are named if there are any."""
    shown = [f"{count} {status.words}" for status, count in counts.items() if count or status.is_always_counted]
    return f"{', '.join(shown)} of {sum(counts.values())}"
