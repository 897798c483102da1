"""What the last run of a store changed since an earlier one, case by case."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.store import (
    Recipe,
    RunComparison,
    VerdictChange,
    Written,
    combine_stores,
    compare_runs,
    earlier_runs,
    read_history,
    write_store,
)
from scbm.testing import CaseResult, Failure, FailureKind, Verdict
from support.stores import a_run, cell, results, store

FAILURE = Failure(FailureKind.REQUIREMENT, "safe", "safe is violated")
Pairs = Sequence[tuple[Recipe, CaseResult]]


def failing(pairs: Pairs, *numbers: int) -> Pairs:
    """Return results of which those at some places, from 0, failed."""
    failed = Verdict(End.REACHED, (FAILURE,))
    return [(r, replace(each, verdict=failed) if i in numbers else each) for i, (r, each) in enumerate(pairs)]


def compared(path: Path, place: int = -1) -> RunComparison:
    """Compare the last run with an earlier one, by its place among those."""
    history = read_history(path)
    return compare_runs(path, history, earlier_runs(history)[place])


def test_obligations_are_gained_and_lost_with_the_cases_that_had_them(tmp_path: Path) -> None:
    pairs = results(1, 3)
    first, second, third = (result.case.name for _, result in pairs)
    then, now = (
        [(recipe, replace(each, visited=bits)) for (recipe, each), bits in zip(pairs, visits, strict=True)]
        for visits in ((0b0011, 0b0001, 0b1000), (0b0010, 0b1110, 0b0100))
    )
    path = store(store(tmp_path / "c.db", 1, then), 2, now)
    names = [str(obligation) for obligation in read_history(path).obligations]
    assert [(str(each.obligation), each.is_gained, each.cases) for each in compared(path).obligations] == [
        (names[2], True, (second, third)),
        (names[0], False, (first, second)),
    ]


def test_verdicts_that_changed(tmp_path: Path) -> None:
    pairs = results(1, 4)
    names = [result.case.name for _, result in pairs]
    store(store(tmp_path / "c.db", 1, failing(pairs[:3], 1, 2)), 2, failing([pairs[0], pairs[1], pairs[3]], 0, 2))
    assert compared(tmp_path / "c.db").verdicts == (
        VerdictChange(names[0], False, True, str(FAILURE)),
        VerdictChange(names[1], True, False),
        VerdictChange(names[3], None, True, str(FAILURE)),
        VerdictChange(names[2], True, None),
    )


def test_a_case_that_was_edited_is_compared_by_its_name(tmp_path: Path) -> None:
    ((_, result),) = results(1, 1)
    old, new = ([(Written(text, "cases/one.yaml"), result)] for text in ("case: one\n", "case: one  # mended\n"))
    store(store(tmp_path / "c.db", 1, failing(old, 0)), 2, new)
    assert compared(tmp_path / "c.db").verdicts == (VerdictChange(result.case.name, True, False),)


def test_only_earlier_runs_that_were_finished_can_be_compared(tmp_path: Path) -> None:
    path = store(tmp_path / "c.db", 1, results(1, 2))
    assert earlier_runs(read_history(path)) == ()
    with suppress(KeyboardInterrupt), write_store(path, cell(), a_run(2, cell())) as writer:
        writer.add(1, *results(1, 1)[0])
        raise KeyboardInterrupt
    store(path, 3, results(1, 1))
    assert [run.id for run in earlier_runs(read_history(path))] == [a_run(1, cell()).id]
    assert compare_runs(path, read_history(path), None) == RunComparison(read_history(path).runs[-1])


def test_united_stores_keep_what_each_run_had(tmp_path: Path) -> None:
    pairs = results(1, 2)
    one = store(tmp_path / "1.db", 1, failing(pairs, 0))
    two = store(tmp_path / "2.db", 2, failing(pairs, 1))
    for stores in ([one, two], [two, one, one], [tmp_path / "all.db", one]):
        combine_stores(stores, tmp_path / "all.db")
        assert [each.failed_now for each in compared(tmp_path / "all.db").verdicts] == [False, True]


def test_runs_of_an_earlier_model_are_compared_where_its_obligations_are_kept(tmp_path: Path) -> None:
    edited = cell(("gr: light != red", "gr: light == green"))
    one = store(tmp_path / "1.db", 1, failing(results(1, 2), 0))
    two = store(tmp_path / "2.db", 2, results(1, 2), edited)
    combine_stores([one, two], tmp_path / "all.db", across_edits=True)
    found = compared(tmp_path / "all.db")
    assert [(each.failed_then, each.failed_now) for each in found.verdicts] == [(True, False)]
    assert {each.obligation.subject for each in found.obligations if each.is_gained} == {"scan_box"}
    assert not any(each.obligation.subject != "scan_box" for each in found.obligations)
