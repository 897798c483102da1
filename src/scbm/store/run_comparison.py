"""Compares the last run of a store with an earlier one, case by case."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.store.history import ObligationChange, RunComparison, VerdictChange
from scbm.store.store_file import open_for_reading, understood
from scbm.store.store_tables import Tables

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from scbm.store.history import History, StoredRun
    from scbm.store.store_tables import RunCaseRow


def earlier_runs(history: History) -> tuple[StoredRun, ...]:
    """Return the finished runs before the last run of the model, in the order in which they were added."""
    return tuple(run for run in history.runs[: _last(history)] if run.is_finished)


def _last(history: History) -> int:
    """Return the index of the last run of the model, as it is now."""
    return max(index for index, run in enumerate(history.runs) if not run.is_earlier)


def compare_runs(path: Path, history: History, then: StoredRun | None) -> RunComparison:
    """Return the differences between the last run and an earlier one. Raise `InputError` for a damaged store.

    Args:
        path: the store.
        history: its content.
        then: the earlier run; `None` if there is none.
    """
    now = history.runs[_last(history)]
    if then is None:
        return RunComparison(now)
    labels = {case.key: label for case, label in zip(history.cases, history.labels, strict=True)}
    with open_for_reading(path) as connection, understood(path):
        tables = Tables(connection)
        ids = {row.run.id: row.id for row in tables.runs()}
        compared = ids[then.id], ids[now.id]
        rows = [row for row in tables.run_cases() if row.run in compared]
    order = {key: place for place, key in enumerate(labels)}
    rows.sort(key=lambda row: order.get(row.key, len(order)))
    before, after = ([row for row in rows if row.run == run] for run in compared)
    gained, lost = now.visited & ~then.visited, then.visited & ~now.visited
    obligations = (
        *_changes(history, gained, after, labels, is_gained=True),
        *_changes(history, lost, before, labels, is_gained=False),
    )
    return RunComparison(now, then, obligations, tuple(_verdicts(history, before, after, labels)))


def _changes(
    history: History, bits: int, rows: Sequence[RunCaseRow], labels: Mapping[bytes, str], *, is_gained: bool
) -> Iterator[ObligationChange]:
    for obligation in history.obligations:
        bit = history.obligations.bit(obligation)
        if obligation.counts and bits & bit:
            cases = tuple(labels.get(row.key, row.name) for row in rows if row.visited & bit)
            yield ObligationChange(obligation, is_gained, cases)


def _verdicts(
    history: History, before: Sequence[RunCaseRow], after: Sequence[RunCaseRow], labels: Mapping[bytes, str]
) -> Iterator[VerdictChange]:
    """Yield the cases that failed in one run alone; a case is the same in both by its name, also if it was edited."""
    failed_then, failed_now = _failed_by_name(before), _failed_by_name(after)
    named = {row.name: labels.get(row.key, row.name) for row in (*before, *after)}
    messages = {
        case.name: str(case.verdict.failures[0]) for case in history.failed if case.run == len(history.runs) - 1
    }
    for name in (*failed_now, *(each for each in failed_then if each not in failed_now)):
        then, now = failed_then.get(name), failed_now.get(name)
        if bool(then) is not bool(now):
            yield VerdictChange(named[name], then, now, messages.get(name, "") if now else "")


def _failed_by_name(rows: Sequence[RunCaseRow]) -> dict[str, bool]:
    """Return whether a case failed, by its name; of several with one name, whether one failed."""
    failed: dict[str, bool] = {}
    for row in rows:
        failed[row.name] = failed.get(row.name, False) or row.failed
    return failed
