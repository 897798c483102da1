"""Results of mutants in stores: they come back, count for their cases alone, and stores with them combine."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Aspect, Assertion, MutantStatus
from scbm.model import InputError, Slug
from scbm.store import (
    VERDICTS,
    History,
    MutatedSuite,
    StoredMutant,
    basis_of,
    combine_stores,
    read_history,
    write_mutants,
)
from support.stores import cell, results, store
from support.wording import Wording

MODEL = cell()
OPERATION = MODEL.operations[0].name
STARTED = "2026-11-21T12:00:00.000000Z"


def suite_of(history: History, numbers: Iterable[int], mutants: int = 2) -> MutatedSuite:
    """A suite with some cases of a store."""
    keys = tuple(sorted(history.cases[number].key for number in numbers))
    return MutatedSuite(basis_of(MODEL), VERDICTS, keys, mutants, STARTED)


def killed(name: str, history: History, *, notices: bool = True) -> StoredMutant:
    """A killed mutant of the precondition of an operation that the cases execute."""
    bit = history.obligations.bit_of(OPERATION, Aspect.EXECUTING)
    assert history.coverage.visited & bit
    return StoredMutant(name, MutantStatus.KILLED, "late", "why", 1, 0, bit, bit * notices)


def add(path: Path, suite: MutatedSuite, *mutants: StoredMutant) -> None:
    with write_mutants(path, MODEL, suite) as writer:
        for mutant in mutants:
            writer.add(mutant)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return store(tmp_path / "cov.db", 1, results(1, 3))


def test_results_come_back(path: Path) -> None:
    history = read_history(path)
    first = killed("first", history)
    second = replace(first, name="second", status=MutantStatus.SURVIVED, noticed=0, limits="{}", witness="case: w\n")
    add(path, suite_of(history, range(3)), second, first)
    (found,) = read_history(path).mutations
    assert (found.results, found.is_whole) == ((first, second), True)
    assert found.suite == suite_of(history, range(3))


def test_a_result_is_in_the_store_before_the_next_one_is_known(path: Path) -> None:
    history = read_history(path)
    with write_mutants(path, MODEL, suite_of(history, range(3))) as writer:
        writer.add(killed("first", history))
        assert [result.name for result in read_history(path).mutations[0].results] == ["first"]


def test_who_writes_again_finds_what_is_there(path: Path) -> None:
    history = read_history(path)
    suite, first = suite_of(history, range(3)), killed("first", history)
    open_one = replace(first, name="second", status=MutantStatus.EQUIVALENT, noticed=0, limits="{}")
    add(path, suite, first, open_one)
    with write_mutants(path, MODEL, suite) as writer:
        assert list(writer.known) == ["first", "second"]
    with write_mutants(path, MODEL, suite_of(history, [0])) as writer:
        assert (writer.known, writer.decisions) == ({}, {"second": {"{}": open_one}})


@pytest.mark.parametrize("limits", ["not JSON", "[]", '{"situations": "many"}', '{"a": 1, "a": 2}', "[" * 100_000])
def test_damaged_limits_are_an_error_of_the_store(limits: str, path: Path) -> None:
    history = read_history(path)
    suite = suite_of(history, range(3))
    add(path, suite, replace(killed("first", history), status=MutantStatus.SURVIVED, noticed=0, limits="{}"))
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE mutant SET limits = ?", (limits,))
    for opened in (lambda: read_history(path).mutations, lambda: add(path, suite)):
        with pytest.raises(InputError) as refused:
            opened()
        assert [each.slug for each in refused.value.diagnostics] == [Slug.STORE_DAMAGED]


def test_a_decision_stays_when_a_later_command_has_none(path: Path) -> None:
    history = read_history(path)
    decided = replace(killed("first", history), status=MutantStatus.EQUIVALENT, noticed=0, limits="{}")
    add(path, suite_of(history, range(3)), decided)
    add(path, suite_of(history, range(3)), replace(decided, status=MutantStatus.UNDECIDED, limits=None))
    assert read_history(path).mutations[0].results == (decided,)


STATUSES = (MutantStatus.UNDECIDED, MutantStatus.SURVIVED, MutantStatus.EQUIVALENT, MutantStatus.KILLED)
"""From the weakest to the strongest."""


@pytest.mark.parametrize(("weak", "strong"), [*pairwise(STATUSES)])
def test_of_two_results_of_one_suite_the_stronger_status_stays(
    weak: MutantStatus, strong: MutantStatus, path: Path
) -> None:
    history = read_history(path)
    first, second = (replace(killed("first", history), status=each, limits="{}") for each in (weak, strong))
    for results_in_order in ((first, second), (second, first)):
        add(path, suite_of(history, range(3)), *results_in_order)
        assert read_history(path).mutations[0].results == (second,)


@pytest.mark.parametrize(("weak", "strong"), [*pairwise(STATUSES)])
def test_of_the_results_of_several_suites_the_stronger_status_counts(
    weak: MutantStatus, strong: MutantStatus, path: Path
) -> None:
    history = read_history(path)
    for number, status in enumerate((weak, strong, weak)):
        result = replace(killed("first", history, notices=False), status=status)
        add(path, suite_of(history, [number], mutants=1), result)
    found = read_history(path).evidence.found
    assert found is not None
    (entry,) = (each for each in found.entries if str(each.obligation) == f"{OPERATION}/executing")
    is_equivalent = strong is MutantStatus.EQUIVALENT
    assert (entry.unnoticed, entry.equivalent, entry.undecided) == (not is_equivalent, is_equivalent, 0)


def test_the_cases_of_a_result_are_those_of_the_store(path: Path, wording: Wording) -> None:
    history = read_history(path)
    wording(history.evidence.why_none)
    two = [killed("first", history, notices=False), killed("second", history, notices=False)]
    add(path, suite_of(history, [0, 1]), *two)
    wording(read_history(path).evidence.why_none)
    add(path, suite_of(history, [2]), two[0])
    wording(read_history(path).evidence.why_none)
    add(path, suite_of(history, [2]), replace(two[1], noticed=two[1].belongs))
    found = read_history(path).evidence.found
    assert found is not None
    assert [str(entry.obligation) for entry in found.with_answer(Assertion.ASSERTED)] == [f"{OPERATION}/executing"]


def test_results_about_other_cases_or_versions_do_not_count(path: Path, wording: Wording) -> None:
    history = read_history(path)
    suite = suite_of(history, range(3), mutants=1)
    add(path, replace(suite, oracle="recorded"), killed("first", history))
    assert "--oracle recorded" in read_history(path).evidence.why_none
    other = store(path.with_name("other.db"), 1, results(1, 3))
    add(other, replace(suite, made_by="scbm 0.1, operators 0"), killed("first", history))
    wording(read_history(other).evidence.why_none)
    store(path, 2, results(2, 1))
    add(path, suite, killed("first", history))
    wording(read_history(path).evidence.why_none)


def test_stores_combine_in_any_order(path: Path, tmp_path: Path) -> None:
    history = read_history(path)
    suite, first = suite_of(history, range(3)), killed("first", history)
    second = replace(first, name="second", status=MutantStatus.UNDECIDED, noticed=0)
    other = store(tmp_path / "other.db", 2, results(1, 3))
    add(path, suite, first, second)
    add(other, replace(suite, started="2026-11-22T12:00:00.000000Z"), replace(second, limits="{}", reason="because"))
    united = [combine_stores(order, tmp_path / "all.db").history for order in ((path, other), (other, path, other))]
    assert united[0] == united[1]
    (mutation,) = united[0].mutations
    assert mutation.suite.started.startswith("2026-11-22")
    assert [(result.name, result.limits) for result in mutation.results] == [("first", None), ("second", "{}")]


def test_results_of_an_earlier_model_do_not_go_over(path: Path, tmp_path: Path) -> None:
    history = read_history(path)
    add(path, suite_of(history, range(3), mutants=1), killed("first", history))
    later = cell(("deadline: 10 s", "deadline: 11 s"))
    newer = store(tmp_path / "newer.db", 2, results(1, 1), later)
    assert combine_stores([path, newer], tmp_path / "all.db", across_edits=True).history.mutations == ()


def test_a_store_of_another_model_is_refused(path: Path) -> None:
    suite = suite_of(read_history(path), range(3))
    with pytest.raises(InputError) as caught, write_mutants(path, cell(("deadline: 10 s", "deadline: 11 s")), suite):
        pass
    assert caught.value.diagnostics[0].slug is Slug.STORE_OTHER_MODEL


def test_a_store_without_cases_is_empty_for_reports(path: Path, tmp_path: Path) -> None:
    history = read_history(path)
    alone = tmp_path / "alone.db"
    add(alone, suite_of(history, range(3)), killed("first", history))
    with pytest.raises(InputError) as caught:
        read_history(alone)
    assert caught.value.diagnostics[0].slug is Slug.STORE_EMPTY
    assert len(read_history(store(alone, 1, results(1, 3))).mutations) == 1


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE mutant SET status = 'dead'",
        "UPDATE mutant SET runs = 'many'",
        "UPDATE mutant SET noticed = 'all'",
        "UPDATE mutation SET cases = x'00'",
        "UPDATE mutation SET basis = 'x'",
    ],
)
def test_foreign_rows_are_damage(path: Path, change: str) -> None:
    history = read_history(path)
    add(path, suite_of(history, range(3)), killed("first", history))
    with sqlite3.connect(path) as connection:
        connection.execute(change)
    connection.close()
    with pytest.raises(InputError) as caught:
        read_history(path)
    assert caught.value.diagnostics[0].slug is Slug.STORE_DAMAGED
