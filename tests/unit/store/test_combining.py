"""Stores united: what comes of it, what is refused, and what an edited model leaves."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.model import InputError, Slug
from scbm.store import Recipe, combine_stores, read_history, store_file, write_store
from scbm.store.history_reader import StoreTotals, totals_in
from scbm.testing import CaseResult, Verdict, coverage_json
from support.stores import a_run, cell, results, store
from support.wording import Wording

EDITED = (("gr: light != red", "gr: light == green"),)


def idle() -> list[tuple[Recipe, CaseResult]]:
    """A case that visited nothing."""
    (recipe, result), *_ = results(9, 1)
    return [(recipe, replace(result, visited=0))]


def _stores(directory: Path, *seeds: int) -> list[Path]:
    return [store(directory / f"{seed}.db", seed, results(seed, 6)) for seed in seeds]


def test_the_union_has_every_case_and_every_run(tmp_path: Path) -> None:
    one, two = _stores(tmp_path, 1, 2)
    combined = combine_stores([one, two], tmp_path / "all.db")
    history = read_history(tmp_path / "all.db")
    assert combined.history == history
    assert combined.dropped == ()
    assert history.runs == (*read_history(one).runs, *read_history(two).runs)
    assert [case.recipe for case in history.cases] == [r for seed in (1, 2) for r, _ in results(seed, 6)]


def test_the_later_result_of_a_case_counts_in_whatever_order_stores_are_combined(tmp_path: Path) -> None:
    """Of two results in one run the one at the later place counts."""
    (recipe, result), *_ = results(1, 1)
    earlier = replace(result, verdict=Verdict(End.ABORTED), ended_ns=7, requests=1)
    later = replace(result, verdict=Verdict(End.REACHED), ended_ns=9, requests=2)
    stores = [store(tmp_path / f"{run}.db", run, [(recipe, each)]) for run, each in ((1, earlier), (2, later))]
    stores.append(store(tmp_path / "both.db", 3, [(recipe, earlier), (recipe, later)]))
    for order in ((0, 1), (1, 0), (2, 0, 1), (0, 1, 2)):
        (case,) = combine_stores([stores[number] for number in order], tmp_path / "all.db").history.cases
        assert (case.verdict.end, case.ended_ns, case.requests) == (End.REACHED, 9, 2)


def test_the_target_may_be_one_of_the_stores_and_then_grows(tmp_path: Path) -> None:
    one, two = _stores(tmp_path, 1, 2)
    combine_stores([one, two], one)
    assert len(read_history(one).cases) == 12
    assert sorted(found.name for found in tmp_path.iterdir()) == ["1.db", "2.db"]


def test_a_store_in_the_place_of_the_target_is_replaced(tmp_path: Path) -> None:
    one, two = _stores(tmp_path, 1, 2)
    combine_stores([one], two)
    assert read_history(two) == read_history(one)


def test_a_file_that_is_no_store_is_not_replaced(tmp_path: Path) -> None:
    (one,) = _stores(tmp_path, 1)
    notes = tmp_path / "notes.txt"
    notes.write_text("keep me", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        combine_stores([one], notes)
    assert caught.value.diagnostics[0].slug is Slug.NOT_A_STORE
    assert notes.read_text(encoding="utf-8") == "keep me"


def test_stores_of_other_models_are_refused(tmp_path: Path, wording: Wording) -> None:
    (one,) = _stores(tmp_path, 1)
    two = store(tmp_path / "2.db", 2, results(2, 2), cell(*EDITED))
    with pytest.raises(InputError) as caught:
        combine_stores([one, two], tmp_path / "all.db")
    found = caught.value.diagnostics[0]
    assert (found.slug, found.place.file) == (Slug.STORE_OTHER_MODEL, str(one))
    wording(found.message)
    assert not (tmp_path / "all.db").exists()


def test_across_edits_what_is_unchanged_goes_over_and_the_rest_is_listed(tmp_path: Path) -> None:
    (one,) = _stores(tmp_path, 1)
    two = store(tmp_path / "2.db", 2, idle(), cell(*EDITED))
    combined = combine_stores([one, two], tmp_path / "all.db", across_edits=True)
    before = read_history(one)
    names = before.obligations.names(before.coverage.visited)
    ((path, dropped),) = combined.dropped
    assert path == one
    assert [str(d.obligation) for d in dropped] == [name for name in names if name.startswith("scan_box/")]
    assert not any(d.is_gone for d in dropped)
    history = read_history(tmp_path / "all.db")
    assert history.model == cell(*EDITED)
    assert history.obligations.names(history.coverage.visited) == tuple(n for n in names if "automatic" in n)
    assert [case.is_earlier for case in history.cases] == [True] * 6 + [False]
    assert "automatic/scan_failed" in names


def test_what_the_edited_model_lacks_is_gone(tmp_path: Path) -> None:
    (one,) = _stores(tmp_path, 1)
    renamed = cell(("  scan_failed:", "  scan_broke:"))
    two = store(tmp_path / "2.db", 2, idle(), renamed)
    combined = combine_stores([one, two], tmp_path / "all.db", across_edits=True)
    (_, dropped), *_ = combined.dropped
    assert [(str(d.obligation), d.is_gone) for d in dropped] == [("automatic/scan_failed", True)]
    history = read_history(tmp_path / "all.db")
    kept = read_history(one).obligations.names(read_history(one).coverage.visited)
    assert history.obligations.names(history.coverage.visited) == tuple(n for n in kept if "automatic" not in n)


def test_the_same_case_before_and_after_an_edit_is_two(tmp_path: Path) -> None:
    (one,) = _stores(tmp_path, 1)
    two = store(tmp_path / "2.db", 2, results(1, 6), cell(*EDITED))
    combine_stores([one, two], tmp_path / "all.db", across_edits=True)
    history = read_history(tmp_path / "all.db")
    assert [case.is_earlier for case in history.cases] == [True] * 6 + [False] * 6
    again = combine_stores([tmp_path / "all.db", two], tmp_path / "all.db").history
    assert again == history


def test_an_edit_of_an_edit_keeps_what_both_left_alone(tmp_path: Path) -> None:
    (one,) = _stores(tmp_path, 1)
    two = store(tmp_path / "2.db", 2, idle(), cell(*EDITED))
    back = store(tmp_path / "3.db", 3, idle())
    first = combine_stores([one, two], tmp_path / "all.db", across_edits=True).history
    second = combine_stores([tmp_path / "all.db", back], tmp_path / "back.db", across_edits=True).history
    kept = first.obligations.names(first.coverage.visited)
    assert kept
    assert second.obligations.names(second.coverage.visited) == kept
    assert second.model == cell()


def test_a_copy_of_a_store_in_the_middle_of_a_run_adds_nothing_to_it(tmp_path: Path) -> None:
    half = store(tmp_path / "half.db", 1, results(1, 3))
    whole = store(tmp_path / "whole.db", 1, results(1, 6))
    expected = read_history(whole)
    for order in ([half, whole], [whole, half]):
        assert combine_stores(order, tmp_path / "all.db").history == expected


def test_runs_are_distinguished_by_their_token_alone(tmp_path: Path) -> None:
    one, two = _stores(tmp_path, 1, 2)
    runs = combine_stores([two, one], tmp_path / "all.db").history.runs
    assert [replace(run, visited=0).command for run in runs] == ["scbm test 1", "scbm test 2"]


def test_the_source_is_that_of_the_model_that_counts_also_if_an_earlier_one_ran_later(tmp_path: Path) -> None:
    old = store(tmp_path / "old.db", 9, results(1, 2))
    new = store(tmp_path / "new.db", 1, idle(), cell(*EDITED))
    history = combine_stores([old, new], tmp_path / "all.db", across_edits=True).history
    assert [run.is_earlier for run in history.runs] == [False, True]
    assert history.source == read_history(new).source


@pytest.mark.parametrize("is_one_of_them", [True, False])
def test_a_store_that_someone_adds_to_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, is_one_of_them: bool
) -> None:
    """A writer knows its rows by their numbers, which would be others then."""
    monkeypatch.setattr(store_file, "_PATIENCE_S", 0)
    one, two = _stores(tmp_path, 1, 2)
    model = cell()
    pairs = results(3, 2)
    with write_store(two, model, a_run(3, model)) as writer:
        writer.add(1, *pairs[0])
        with pytest.raises(InputError) as caught:
            combine_stores([one, two] if is_one_of_them else [one], two)
        assert caught.value.diagnostics[0].slug is Slug.STORE_UNUSABLE
        writer.add(2, *pairs[1])
    history = read_history(two)
    assert [(run.id, run.cases) for run in history.runs][-1] == (a_run(3, model).id, 2)
    assert len(history.cases) == 8


def test_nobody_adds_to_a_store_while_it_is_read_to_be_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_file, "_PATIENCE_S", 0)
    one, two = _stores(tmp_path, 1, 2)

    def added_to_meanwhile(connection: sqlite3.Connection) -> StoreTotals:
        with pytest.raises(InputError):
            store(two, 3, results(3, 1))
        return totals_in(connection)

    monkeypatch.setattr("scbm.store.store_union.totals_in", added_to_meanwhile)
    combine_stores([one, two, two], two)
    assert len(read_history(two).cases) == 12


def test_the_figures_of_the_new_store_are_those_of_all_that_it_holds(tmp_path: Path) -> None:
    one, two = (store(tmp_path / f"{run}.db", run, results(run, 40, "drawn")) for run in (1, 2))
    combined = combine_stores([one, two], tmp_path / "all.db")
    totals, history = combined.totals, combined.history
    assert (totals.cases, totals.runs) == (len(history.cases), len(history.runs))
    assert coverage_json(totals.coverage) == coverage_json(history.coverage)
    assert len(totals.coverage.cases) <= len(history.obligations.all)
    assert totals.coverage.count == history.coverage.count == len(history.cases)
    assert totals.coverage.visits() == history.coverage.visits()
