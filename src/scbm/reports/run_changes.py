"""What the last run of a store changed since an earlier one: rows of a table with one column for each run."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases.coverage import Obligation
    from scbm.store import RunComparison, StoredRun, VerdictChange

NO_EARLIER_RUN = "This store has no earlier finished run to compare with."

NEWLY_FAILING, LOST, GAINED, MENDED, NOT_RUN = CHANGES = (
    "newly failing",
    "lost",
    "gained",
    "mended",
    "failed then, did not run now",
)
"""The kinds of changes, in the order in which reports show them."""


class ChangeRow(Struct, frozen=True):
    """A change of an obligation, or of the verdict of a case.

    Attributes:
        change: one of `CHANGES`.
        subject: the obligation, or the name of the case.
        then: the cases that visited the obligation in the earlier run, or how the case ended there.
        now: the same for the last run.
    """

    change: str
    subject: Obligation | str
    then: tuple[str, ...]
    now: tuple[str, ...]

    @property
    def is_case(self) -> bool:
        """Whether a verdict changed."""
        return isinstance(self.subject, str)


def change_groups(since: RunComparison) -> tuple[tuple[str, tuple[ChangeRow, ...]], ...]:
    """Return the changes of each kind, the most important kind first."""
    rows = sorted(_rows(since), key=lambda row: CHANGES.index(row.change))
    return tuple((change, tuple(group)) for change, group in groupby(rows, lambda row: row.change))


def _rows(since: RunComparison) -> Iterator[ChangeRow]:
    for each in since.obligations:
        if each.is_gained:
            yield ChangeRow(GAINED, each.obligation, (), each.cases)
        else:
            yield ChangeRow(LOST, each.obligation, each.cases, ())
    for verdict in since.verdicts:
        now = verdict.message or _words(verdict.failed_now)
        yield ChangeRow(_change(verdict), verdict.case, (_words(verdict.failed_then),), (now,))


def _change(verdict: VerdictChange) -> str:
    if verdict.failed_now:
        return NEWLY_FAILING
    return NOT_RUN if verdict.failed_now is None else MENDED


def _words(failed: bool | None) -> str:  # noqa: FBT001 - a value of three
    return "did not run" if failed is None else "failed" if failed else "passed"


def run_in_words(run: StoredRun) -> str:
    """Return the first digits of the id of a run, and when it began."""
    return f"{run.id[:8]} of {run.started[:16].replace('T', ' ')}"
